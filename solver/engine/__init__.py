"""The running batch: the arrays of its worlds, the kernels that advance them, and ways to save and restore a world."""
