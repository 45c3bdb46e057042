"""Settings of the numerical method, and when a pour counts as over."""

from __future__ import annotations

from dataclasses import dataclass

from solver.params import param

REST_SPEED = 2e-3
"""Default speed [m/s] below which a body counts as at rest."""
ROLLING_SLOPE = 0.01
"""A lone body on the plate whose path is no steeper than this rolls on for ever; others tumble and come to rest."""


@dataclass(frozen=True)
class Numerics:
    """Time step, neighbour lists, and the criteria by which a run ends."""

    rayleigh_fraction: float = param(0.3, low=0.02, high=0.6, doc="Time step as a fraction of the Rayleigh time.")
    impact_fraction: float = param(
        0.35, low=0.02, high=1.0, doc="Time step times the frequency of an undamped impact at 2 m/s."
    )
    skin: float = param(1.0e-3, unit="m", low=1e-5, high=2e-2, doc="Gap up to which bodies are listed as neighbours.")
    rest_speed: float = param(
        REST_SPEED,
        unit="m/s",
        low=1e-5,
        high=0.1,
        doc="A pile is at rest when every body is slower than this, by √(2 kinetic energy / mass).",
    )
    rest_time: float = param(
        0.1, unit="s", low=0.01, high=5.0, doc="How long every body must stay slower than rest_speed."
    )
    sleep_speed: float = param(
        REST_SPEED,  # nothing in a pile at rest rolls on
        unit="m/s",
        low=0.0,
        high=0.1,
        doc="A body slower than this, by √(2 kinetic energy / mass), is held still until its forces change; 0: never.",
    )
    sleep_time: float = param(
        0.05,
        unit="s",
        low=1e-3,
        high=5.0,
        doc="How long a body must stay slower than sleep_speed before it is held still.",
    )
    hanging_bodies: float = param(
        1.0, low=0.0, high=1e3, doc="Number of bodies that may stay behind in the funnel if they hold up no others."
    )
    max_time: float = param(8.0, unit="s", low=0.1, high=60.0, doc="Simulated time after which a run is stopped.")
    duration: float = param(
        0.0,
        unit="s",
        low=0.0,
        high=60.0,
        doc="Time from the first body's entry to the measurement, at rest or not; 0: measured once at rest.",
    )
    overlap_limit: float = param(
        0.1, low=0.001, high=0.5, doc="Largest overlap allowed, as a fraction of the smaller member sphere's radius."
    )
    sample_interval: float = param(
        0.01, unit="s", low=1e-3, high=0.1, doc="Simulated time between two samples of the curves."
    )
