"""The laboratory: readings become parameters of a material, and bench tests are repeated on the solver."""
