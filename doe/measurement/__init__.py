"""Measured data: a folder of conditions, replicates and parameter ranges, and the runs that repeat it.

``README.md`` beside this file describes the format. The same functions read data and simulated runs.
"""

from doe.measurement.load import load_measurement
from doe.measurement.measurement import Condition, CrossCheck, MeasuredParameter, Measurement, Observation
from doe.measurement.observations import readings_of_data, readings_of_record
from doe.measurement.reach import Reach, reach_of
from doe.measurement.summaries import (
    summaries_of_data,
    summaries_of_record,
    summary_names,
    summary_uncertainties,
)

__all__ = [
    "Condition",
    "CrossCheck",
    "MeasuredParameter",
    "Measurement",
    "Observation",
    "Reach",
    "load_measurement",
    "reach_of",
    "readings_of_data",
    "readings_of_record",
    "summaries_of_data",
    "summaries_of_record",
    "summary_names",
    "summary_uncertainties",
]
