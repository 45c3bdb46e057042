"""A diagnosis: from its order to its files."""
