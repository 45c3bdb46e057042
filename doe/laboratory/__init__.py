"""From the readings of a bench test to parameters of a material: statistics on tables, no solver and no picture."""

from doe.laboratory.analysis import TESTS, analyse
from doe.laboratory.replicates import ReplicateSummary, summarise
from doe.laboratory.result import CurveFit, Derived, Estimate, LabResult
from doe.laboratory.tables import LaboratoryError, read_table

__all__ = [
    "TESTS",
    "CurveFit",
    "Derived",
    "Estimate",
    "LabResult",
    "LaboratoryError",
    "ReplicateSummary",
    "analyse",
    "read_table",
    "summarise",
]
