"""A study: the contents of its file, the chain of its stages, and its results."""
