"""Designs by users: a factors file becomes a sheet of runs, a filled sheet becomes an analysis."""
