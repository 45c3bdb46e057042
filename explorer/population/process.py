"""The stored pours of a scene, and ``explorer repeat`` in the background, which pours more of them.

A scene reaches the command as a material file; it is refused where that does not give the same pour.
"""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import closing
from dataclasses import replace
from pathlib import Path

from doe.population import Population
from doe.store import Store, default_store, observables_of
from explorer.background.command_output import kept_scene
from explorer.background.command_process import PROGRAM, BackgroundError, CommandProcess, PourPlace
from explorer.background.output_folder import new_folder
from explorer.scene.file import material_scene
from solver import Scene, pour_key

STEM = "pours"


class PopulationProcess:
    """``explorer repeat`` as a child process, one at a time.

    Args:
        folder: output folders and the scenes' files are made in here.
        store: file of the store of runs; None for the default store.
        program: how the command line is called.
        place: where the next set is poured; None for this machine.
    """

    def __init__(
        self,
        folder: Path,
        store: Path | None = None,
        program: Sequence[str] = PROGRAM,
        place: PourPlace | None = None,
    ) -> None:
        self._folder, self._named, self._program = folder, store, program
        self._place = place or PourPlace()
        self._process = CommandProcess("set of pours", {0: "poured"}, program)
        self.status, self.cancel, self.close = self._process.status, self._process.cancel, self._process.close

    @property
    def store(self) -> Path:
        """File of the store, which may not be there yet."""
        return self._named or default_store()

    def stamp(self) -> tuple[int, ...]:
        """Changes when runs are added to the store, by whomever."""
        files = (self.store, Path(f"{self.store}-wal"))
        return tuple(file.stat().st_mtime_ns if file.is_file() else 0 for file in files)

    def read(self, scene: Scene, observable: str) -> Population:
        """The stored pours of ``scene``; takes some ms for each, so it is not for the page's loop."""
        if not self.store.is_file():
            return Population(observable, (), ())
        with closing(Store(self.store, pouring=False)) as store:
            return populations(store, scene, (observable,))[0]

    def start(self, scene: Scene, pours: int) -> None:
        """Pour ``scene`` so many times more. Raises BackgroundError where some are being poured, or it cannot be."""
        self._process.refuse_while_running()
        file = kept_scene(scene, self._folder)
        if pour_key(material_scene(str(file)), 0) != pour_key(scene, 0):
            raise BackgroundError("this scene has settings that no material file holds; it cannot be poured apart")
        out = new_folder(self._folder, STEM)
        store = () if self._named is None else ("--store", str(self._named))
        asked = ("--pours", str(pours), "--out", str(out), *store, *self._place.arguments)
        self._process.start(out, ["repeat", str(file), *asked])


def populations(store: Store, scene: Scene, names: Sequence[str]) -> tuple[Population, ...]:
    """Observables ``names`` over the stored pours of ``scene``, of the present version of the readings."""
    read = (store.read(run, names, observables_of) for run in store.pours_of(scene))
    # Without what takes memory: there may be ten thousand.
    runs = [replace(run, raw=b"", parameters={}) for run in read]
    return tuple(Population.of(runs, name) for name in names)
