"""The analysis of a design that was run anywhere: which model its runs can bear, and what that model says."""
