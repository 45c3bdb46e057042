"""A recorded pour that is shown while the solver loads: of exactly this scene and seed, or none.

``make preview`` pours the shipped study's scene and writes ``explorer/previews/<first digits of its key>.npz``; a test
checks that the file has the key (`solver.pours.pour_key`) of the pour with which ``explorer serve`` begins.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt

from explorer.live.frames import Frame
from solver import Scene, npz_arrays, pour_key

FOLDER = Path(__file__).parents[1] / "previews"
DIGITS = 16
"""Digits of the key in the name of a file."""


@dataclass(frozen=True, eq=False)
class Preview:
    """Frames of a pour; n bodies in order of component, f frames."""

    times: npt.NDArray[np.float64]
    """[s], shape (f,)."""
    component: npt.NDArray[np.int32]
    """Index into ``scene.bodies``, shape (n,)."""
    inside: npt.NDArray[np.bool_]
    """Whether a body is in the scene, shape (f, n)."""
    position: npt.NDArray[np.float32]
    """[m], shape (f, n, 3)."""
    quaternion: npt.NDArray[np.float32]
    """wxyz, shape (f, n, 4)."""
    scale: npt.NDArray[np.float32]
    """Linear size relative to the declared one, shape (n,)."""

    def frame(self, elapsed: float, generation: int) -> Frame:
        """The frame ``elapsed`` [s] after the beginning; after the end, the last one. Frame numbers are negative."""
        k = max(int(np.searchsorted(self.times, elapsed, side="right")) - 1, 0)
        return Frame(
            number=-1 - k,
            generation=generation,
            time=float(self.times[k]),
            position=self.position[k],
            quaternion=self.quaternion[k],
            component=self.component,
            inside=self.inside[k],
            scale=self.scale,
        )


def preview_path(scene: Scene, seed: int, folder: Path = FOLDER) -> Path:
    """Where the recording of ``scene`` poured with ``seed`` is kept, if there is one."""
    return folder / f"{pour_key(scene, seed)[:DIGITS]}.npz"


def load_preview(scene: Scene, seed: int, folder: Path = FOLDER) -> Preview | None:
    """The recording of exactly this pour; None if none is shipped."""
    path = preview_path(scene, seed, folder)
    if not path.is_file():
        return None
    stored = npz_arrays(path)
    return Preview(
        times=stored["times"].astype(np.float64),
        component=stored["component"].astype(np.int32),
        inside=stored["inside"],
        position=stored["position"].astype(np.float32),
        quaternion=stored["quaternion"].astype(np.float32),
        scale=stored["scale"].astype(np.float32),
    )


def save_preview(preview: Preview, scene: Scene, seed: int, folder: Path = FOLDER) -> Path:
    """Write ``preview``; poses in half precision, which is 0.06 mm at 0.1 m."""
    path = preview_path(scene, seed, folder)
    path.parent.mkdir(parents=True, exist_ok=True)
    np.savez_compressed(
        path,
        times=preview.times,
        component=preview.component.astype(np.int8),
        inside=preview.inside,
        position=preview.position.astype(np.float16),
        quaternion=preview.quaternion.astype(np.float16),
        scale=preview.scale,
    )
    return path
