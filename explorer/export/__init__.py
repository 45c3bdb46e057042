"""Files for other programs: decks for engines, one file per engine, and what they share; VTK; material tables.

decks.py        deck writers by engine
deck.py         what a deck says, whatever the engine, and the file that holds it
deck_of_scene.py  deck_of(record): the deck that repeats a pour of ours
triangles.py    cone and gate as triangles, STL
liggghts.py     LIGGGHTS-PUBLIC 3.8 (in.liggghts)
yade.py         YADE 2023 (yade_pour.py, copied into the folder, reads deck.json)
bed.py          a bed of equal spheres for both, for timing
impacts.py      single impacts in LIGGGHTS, for the verification
frames.py       what the engines write: spheres of one moment
run.py          run a folder with the installed engine, for a limited time, and time its stepping loop
moments.py      a pour at given moments;  paraview.py them as VTK files
material_table.py   a material as CSV for EDEM, with the convention of every coefficient
"""

# Nothing of the solver is loaded here: the page names the programs, and its process has no Taichi.
PROGRAMS = ("liggghts", "yade", "paraview", "edem")
"""Everything that something can be exported to: decks for engines (`decks.py`), then files for others."""

__all__ = ["PROGRAMS"]
