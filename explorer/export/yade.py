"""The deck for YADE 2023: ``deck.json``, ``law.json`` and a script that reads them.

These settings make it repeat our pour: planes and facets with ``hertzian``, so that R* is the sphere's radius; damping
ratios instead of restitutions, betan = c_n/2 and betas = c_t/2 of our law; members that carry the body's mass, because
YADE damps with the mass of the touching sphere; a clump whose mass and principal moments come from one sphere that
touches nothing.

Differences that remain: tangential springs are not scaled down while a contact unloads, and a sphere on an edge between
two facets is pushed by both. Version 2023.02a is assumed: 2019 and earlier use the mean shear modulus of a pair.
"""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import numpy as np

from explorer.errors import CommandError
from explorer.export.deck import Deck, DeckTarget, write_deck, write_stl
from explorer.export.readme import write_readme
from solver.laws import HertzMindlin
from solver.laws.hertz_mindlin import tangential_damping
from solver.laws.restitution import normal_damping

SCRIPT = "yade_pour.py"
SCRIPTS = Path(__file__).with_name("scripts")
LAW = "law.json"


def write_yade(folder: Path, deck: Deck) -> None:
    """Write the deck into ``folder``; :class:`CommandError` for anything that YADE's law lacks."""
    if deck.rolling_friction > 0.0:
        raise CommandError(f"rolling friction {deck.rolling_friction:g}: not in the deck for YADE; allowed: 0")
    if deck.law != HertzMindlin.name:
        raise CommandError(f"contact law {deck.law!r}: not in the deck for YADE; allowed: {HertzMindlin.name}")
    write_deck(folder, deck)
    write_law(folder, deck.restitution, deck.friction)
    for mesh in deck.meshes:
        write_stl(folder / f"{mesh.name}.stl", mesh.name, mesh.triangles)
    shutil.copyfile(SCRIPTS / SCRIPT, folder / SCRIPT)
    write_readme(folder, "yade", deck)


def write_law(folder: Path, restitution: np.ndarray, friction: np.ndarray) -> None:
    """Write damping ratios and friction angles [rad] of all pairs of classes: ``law.json``."""
    tables = {
        "normal_damping": np.vectorize(normal_damping, otypes=[float])(restitution) / 2.0,
        "tangential_damping": np.vectorize(tangential_damping, otypes=[float])(restitution) / 2.0,
        "friction_angle": np.arctan(friction),
    }
    text = json.dumps({name: table.tolist() for name, table in tables.items()}, indent=1)
    (folder / LAW).write_text(text + "\n", encoding="utf-8")


class Yade(DeckTarget):
    """YADE as a target of an export."""

    name, what = "yade", "a deck that runs as it is"

    def write_deck(self, folder: Path, deck: Deck) -> None:
        """Write a deck into an existing folder."""
        write_yade(folder, deck)


YADE = Yade()
