"""A bin's measured discharge as the emptying of a smaller charge: the table of a measured data set.

A slot's flow does not depend on how high the bin is filled while the flow is steady, so the last ``CHARGE`` kg of the
measured charge are a pour of their own. It begins where the straight line through the steady part leaves so much:

    python reduced_charge.py plastic_spheres.csv 2.344 > spheres.csv
    python reduced_charge.py plastic_cylinders.csv 2.495 residual > cylinders.csv

With ``residual`` only what stays is told: a flow that is not steady leaves open when the last charge begins.
"""

import csv
import sys
from pathlib import Path

import numpy as np

CHARGE = 0.600
"""Of the simulated bin [kg]."""
STEADY = (0.1, 0.7)
"""Discharged fractions between which the flow is steady."""


def measured(path: Path) -> tuple[np.ndarray, np.ndarray]:
    """Times since the gate opened [s] and discharged fractions, (k,) each."""
    lines = (line for line in path.read_text(encoding="utf-8").splitlines() if not line.startswith("#"))
    rows = list(csv.DictReader(lines))
    return np.array([float(row["x"]) for row in rows]), np.array([float(row["value"]) for row in rows])


def reduced(time: np.ndarray, fraction: np.ndarray, mass: float) -> tuple[float, np.ndarray, np.ndarray]:
    """Steady rate [kg/s], and the times [s] and discharged masses [kg] of the last ``CHARGE`` of ``mass`` [kg]."""
    steady = (fraction >= STEADY[0]) & (fraction <= STEADY[1])
    rate, start = np.polyfit(time[steady], mass * fraction[steady], 1)
    begun = (mass - CHARGE - start) / rate
    later = time > begun
    return float(rate), time[later] - begun, mass * fraction[later] - (mass - CHARGE)


def main(path: str, mass: str, only: str = "") -> None:
    """Print the table; ``only`` "residual": without the curve."""
    rate, time, discharged = reduced(*measured(Path(path)), float(mass))
    print(f"# last {CHARGE:g} kg of {mass} kg in {Path(path).name}; steady rate {rate:.3f} kg/s")
    print("replicate,observable,x,value")
    for x, value in zip(time, discharged, strict=True) if only != "residual" else ():
        print(f"1,discharged_mass_kg,{x:.3f},{value:.4f}")
    print(f"1,residual_mass_kg,,{CHARGE - discharged[-1]:.4f}")


if __name__ == "__main__":
    main(*sys.argv[1:])
