"""The running batch: the arrays of its worlds, the kernels that move them, and ways to keep and restore one."""
