"""The laboratory's side: readings become parameters of a material, and the bench is repeated on the solver."""
