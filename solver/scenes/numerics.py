"""Settings of the numerical method, and when a pour counts as over."""

from __future__ import annotations

from dataclasses import dataclass

from solver.params import param

REST_SPEED = 2e-3
"""Below it [m/s] a body counts as lying still, where nothing else is asked for."""
ROLLING_SLOPE = 0.01
"""A single body on the plate whose path is no steeper than this rolls, for ever; others tumble and come to rest."""


@dataclass(frozen=True)
class Numerics:
    """Time step, neighbour lists, and the criteria by which a run ends."""

    rayleigh_fraction: float = param(0.3, low=0.02, high=0.6, doc="Time step as a fraction of the Rayleigh time.")
    impact_fraction: float = param(
        0.35, low=0.02, high=1.0, doc="Time step times the frequency of an undamped impact at 2 m/s."
    )
    skin: float = param(1.0e-3, unit="m", low=1e-5, high=2e-2, doc="Reach of the contact list beyond touching.")
    rest_speed: float = param(
        REST_SPEED,
        unit="m/s",
        low=1e-5,
        high=0.1,
        doc="A pile whose bodies all move slower, √(2 kinetic energy / mass), is at rest.",
    )
    rest_time: float = param(0.1, unit="s", low=0.01, high=5.0, doc="How long it has to stay that slow.")
    sleep_speed: float = param(
        REST_SPEED,  # nothing in a pile at rest rolls on
        unit="m/s",
        low=0.0,
        high=0.1,
        doc="A body slower than this, √(2 kinetic energy / mass), stands still until the forces on it change; 0: none.",
    )
    sleep_time: float = param(0.05, unit="s", low=1e-3, high=5.0, doc="How long it has to be that slow before.")
    hanging_bodies: float = param(
        1.0, low=0.0, high=1e3, doc="Number of bodies that may be left hanging in the funnel, holding up no other."
    )
    max_time: float = param(8.0, unit="s", low=0.1, high=60.0, doc="Simulated time after which a run is cut off.")
    duration: float = param(
        0.0,
        unit="s",
        low=0.0,
        high=60.0,
        doc="A pour is read this long after its first body entered, at rest or not; 0: when it is at rest.",
    )
    overlap_limit: float = param(
        0.1, low=0.001, high=0.5, doc="Largest overlap allowed, as a fraction of the smaller member sphere's radius."
    )
    sample_interval: float = param(
        0.01, unit="s", low=1e-3, high=0.1, doc="Simulated time between two samples of the curves."
    )
