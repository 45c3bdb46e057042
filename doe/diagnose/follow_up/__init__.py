"""After a verdict: pours at the best fits, their errors on held-out data, and what to measure next."""
