"""Files for other programs: a module per target, and what the targets share.

target.py       the protocol of a target
deck.py         the deck that repeats a pour of ours in any engine: its content, its file, walls as STL
liggghts.py     LIGGGHTS-PUBLIC 3.8 (in.liggghts)
yade.py         YADE 2023 (yade_pour.py, copied into the folder, reads deck.json)
bed.py          a bed of equal spheres for both, for timing
impacts.py      single impacts in LIGGGHTS, for the verification
frames.py       the output of the engines: spheres of one moment
run.py          run a folder with the installed engine, for a limited time, and time its stepping loop
paraview.py     a pour at given moments as VTK files
material_table.py   a material as CSV for EDEM, with the convention of every coefficient
"""

from explorer.export.liggghts import LIGGGHTS
from explorer.export.material_table import EDEM
from explorer.export.paraview import PARAVIEW
from explorer.export.target import ExportTarget
from explorer.export.yade import YADE
from solver.plugins import Registry, instance_of, plugged_in

OWN: tuple[ExportTarget, ...] = (LIGGGHTS, YADE, PARAVIEW, EDEM)
EXPORTS: Registry[ExportTarget] = Registry("export", OWN, instance_of(ExportTarget))
"""All export targets, by name."""


def names() -> tuple[str, ...]:
    """Names of all targets. No plug-in is loaded for this: it may load Taichi, which the page's process never does."""
    return (*(target.name for target in OWN), *plugged_in(EXPORTS.kind))


__all__ = ["EXPORTS", "OWN", "names"]
