"""What may be concluded from runs: effects, surfaces, optima, t tests, power. Statistics only: no solver, no files."""
