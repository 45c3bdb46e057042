"""Compression between plates: a sphere of the body's material is squeezed slowly, then sheared at a fixed preload.

    normal    F = 4/3 E* √R δ^1.5 at each of the two contacts, δ half of the approach of the plates  →  E*
    shear     dF_t/du = 8 G* a per contact, a = √(R δ), u half of the shift of the upper plate       →  G*

The specimen is a ball of the body's volume, because a Hertzian contact needs a radius; it is held so that it cannot
roll, and gravity is off, as if the scale were tared. ``single_body/compression.py`` runs the test. Bodies here are
rigid with Hertzian contacts: there is no elastic cube whose stress over strain would be a modulus, and the result of
the paper's Equation (1) depends on how far the ball is compressed.
Source of the test: Processes 2022, 10, 185, §2.3; Hertz 1882; Mindlin 1949.
"""

from __future__ import annotations

from dataclasses import dataclass

from solver.params import param
from solver.rigs.rig import BenchRig
from solver.rigs.surface import FACING_DOWN, Surface, horizontal, turned_plane


@dataclass(frozen=True)
class Compression(BenchRig):
    """How far and how fast the plates press and shear."""

    strain: float = param(4e-3, low=1e-5, high=0.05, doc="Approach of the plates over the thickness of the specimen.")
    speed: float = param(5e-5, unit="m/s", low=1e-6, high=1e-2, doc="Speed of the upper plate (the paper: 0.05 mm/s).")
    shear_load: float = param(0.2, low=0.01, high=0.9, doc="Tangential force reached, as a share of that of sliding.")
    body: str = ""
    wall: str = "rigid_sieve_plate"
    domain_half_width: float = 100.0
    gap: float = 0.01
    """Initial distance of the plates [m]: the test sets it to the thickness of its specimen."""

    name = "compression"
    surface_names = ("lower", "upper")

    def surfaces(self) -> tuple[Surface, ...]:
        """Lower and upper plate."""
        return (horizontal(0.0, self.wall), turned_plane((0.0, 0.0, self.gap), FACING_DOWN, self.wall))
