"""Design of experiments and statistics: which runs are made, and what may be concluded from them."""
