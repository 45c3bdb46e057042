"""Speed of the solver on declared cases. Every case runs in a process of its own, on the threads it is given."""

from solver.benchmark.measurement import Measurement
from solver.benchmark.packed_bed import Bed, measure_bed, shuffled, wide_bed
from solver.benchmark.pours import measure_batch, measure_pour

__all__ = ["Bed", "Measurement", "measure_batch", "measure_bed", "measure_pour", "shuffled", "wide_bed"]
