"""A photographed pile read like a simulated one: picture file → silhouette → outline and flank lines.

It complements `solver/observables/scan.py`, which does the same for a scanned pile, and lies below ``doe``, so that
measured data sets and the command line read pictures by the same function. NumPy, SciPy and Pillow; no kernels.
"""

from solver.photograph.checkerboard import Board, board_of
from solver.photograph.drum import PhotographedDrum, read_drum
from solver.photograph.picture import NotAPile, PhotographError, Picture, Reason, Refusal, open_picture
from solver.photograph.read import PhotographedPile, read_photograph
from solver.photograph.reference_bar import reference_pixels

__all__ = [
    "Board",
    "NotAPile",
    "PhotographError",
    "PhotographedDrum",
    "PhotographedPile",
    "Picture",
    "Reason",
    "Refusal",
    "board_of",
    "open_picture",
    "read_drum",
    "read_photograph",
    "reference_pixels",
]
