"""Files for other programs: decks for engines, one file per engine, and what they share; VTK; material tables.

deck.py         what a deck says, whatever the engine;  deck_of(record) makes it from a pour of ours
triangles.py    cone and gate as triangles, STL
liggghts.py     LIGGGHTS-PUBLIC 3.8 (in.liggghts)
yade.py         YADE 2023 (yade_pour.py, copied into the folder, reads deck.json)
bed.py          a bed of equal spheres for both, for timing
frames.py       what the engines write: spheres of one moment
run.py          run a folder with the installed engine and time its stepping loop
moments.py      a pour at given moments;  paraview.py them as VTK files
material_table.py   a material as CSV for EDEM, with the convention of every coefficient
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from explorer.export.deck import Deck
from explorer.export.liggghts import write_liggghts
from explorer.export.yade import write_yade

WRITERS: dict[str, Callable[[Path, Deck], None]] = {"liggghts": write_liggghts, "yade": write_yade}
"""Engine → what writes its deck into an existing folder."""

PROGRAMS = (*WRITERS, "paraview", "edem")
"""Everything that something can be exported to."""

__all__ = ["PROGRAMS", "WRITERS", "Deck", "write_liggghts", "write_yade"]
