"""NumPy arrays as small kernels take them."""

from solver.backend import ti

Table = ti.types.ndarray(dtype=ti.f64, ndim=2)
Row = ti.types.ndarray(dtype=ti.f64, ndim=1)
IntTable = ti.types.ndarray(dtype=ti.i32, ndim=2)
IntRow = ti.types.ndarray(dtype=ti.i32, ndim=1)
