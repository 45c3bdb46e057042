"""`make preview`: pour what ``explorer serve`` begins with, and keep it to be shown while the solver loads."""

import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np

from explorer.live.preview import FOLDER, Preview, save_preview
from explorer.project.project import study_project
from explorer.recordings.recording_reader import read_recording
from explorer.scene.file import DEFAULT_STUDY

SEED = 1
"""Of the first pour of ``explorer serve``."""


def preview_of(recording, bodies):
    """Frames of all bodies, component by component of the recording; ``bodies``: the components' names in the scene."""
    times = np.asarray(recording.times)
    most = [component.most for component in recording.components]
    n = sum(most)
    inside = np.zeros((len(times), n), dtype=bool)
    position, quaternion = np.zeros((len(times), n, 3)), np.zeros((len(times), n, 4))
    quaternion[..., 0] = 1.0
    scale = np.ones(n)
    for k, time in enumerate(times):
        for first, component in zip(np.cumsum([0, *most[:-1]]), recording.components, strict=True):
            there = component.at(time)
            rows = first + there.place
            inside[k, rows] = True
            position[k, rows], quaternion[k, rows] = there.position, there.quaternion
            scale[rows] = there.scale
    kinds = [bodies.index(one.shape.name) for one in recording.components]
    component = np.repeat(kinds, most)
    return Preview(times - times[0], component, inside, position, quaternion, scale)


def main():
    project = study_project(DEFAULT_STUDY)
    scene = project.source.scene
    for stale in FOLDER.glob("*.npz"):
        stale.unlink()
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "pour.rrd"
        command = [sys.executable, "-m", "explorer", "simulate", str(project.study), "--seed", str(SEED)]
        subprocess.run([*command, "--record", str(file)], check=True)
        print(save_preview(preview_of(read_recording(file), [body.name for body in scene.bodies]), scene, SEED))


if __name__ == "__main__":
    main()
