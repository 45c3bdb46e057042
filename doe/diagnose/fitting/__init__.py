"""A predicted model against measured data: its best fit, what it cannot undo, and data as it would give them."""
