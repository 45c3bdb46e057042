"""Whether a long run grows: resident memory of `explorer repeat` and of its worker over 10⁴ pours (`make memory`).

    python -m tests.faults.memory --pours 10000

Twelve soft beads fall through the funnel in 0.06 CPU s. Each pour is dispatched, read off, kept in the store and told
as in a study. A straight line is fitted to the means of ``BLOCKS`` blocks of samples, since neighbouring samples are
alike; the first tenth, in which kernels and caches are loaded, is left out. The exit code is 1 if either process grows
by more than ``MOST`` for certain.
"""

import argparse
import json
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy import stats

from explorer.scene.text import material_toml
from solver import with_values
from tests.explorer.beads import bead_scene
from tests.faults.kills import ROOT, workers

VALUES: dict[str, float | str] = {
    "material.glass.shear_modulus": 4e5,
    "pair.bead.bead.static_friction": 0.5,
    "pair.bead.steel.static_friction": 0.5,
    "insertion.rate": 0.5,
    "numerics.duration": 0.6,
    "numerics.sample_interval": 0.02,
    "numerics.overlap_limit": 0.4,
}
"""What makes a pour of beads cheap: soft ones, read after 0.6 s."""
BEADS = 12
SAMPLES, BLOCKS, WARM_UP = 200, 18, 0.1
KIB = 1024.0
MOST = 100.0
"""Bytes per pour: 1 MB over 10⁴."""


@dataclass(frozen=True)
class Growth:
    """Slope of the resident memory of one process, bytes per pour, and half of its 95 % interval."""

    slope: float
    half_width: float
    first: float
    """Fitted memory [bytes] at the first pour after the warm-up, and at the last."""
    last: float

    @staticmethod
    def of(pours: np.ndarray, memory: np.ndarray) -> "Growth":
        """Fitted to ``memory`` [bytes] after so many ``pours``."""
        settled = pours > WARM_UP * pours[-1]
        x, y = (np.array([part.mean() for part in np.array_split(one[settled], BLOCKS)]) for one in (pours, memory))
        line = stats.linregress(x, y)
        # Without any change there is no scatter to tell an error from.
        half_width = float(np.nan_to_num(stats.t.ppf(0.975, len(x) - 2) * line.stderr))
        ends = line.intercept + line.slope * pours[settled][[0, -1]]
        return Growth(float(line.slope), half_width, *map(float, ends))

    @property
    def certain(self) -> bool:
        """Whether all of the interval is above ``MOST``."""
        return self.slope - self.half_width > MOST

    def __str__(self) -> str:
        return (
            f"{self.slope:+.1f} ± {self.half_width:.1f} bytes per pour, "
            f"{self.first / KIB**2:.1f} to {self.last / KIB**2:.1f} MiB"
        )


def resident(process: int) -> float:
    """Resident memory of its own of ``process`` [bytes], without pages of files, which the system may drop."""
    status = Path(f"/proc/{process}/status").read_text()
    return KIB * next(float(line.split()[1]) for line in status.splitlines() if line.startswith("RssAnon:"))


def measured(pours: int, folder: Path) -> np.ndarray:
    """Rows of pours done, memory of the command and of its worker [bytes]."""
    scene, out = folder / "beads.toml", folder / "out"
    scene.write_text(material_toml(with_values(bead_scene(BEADS), VALUES)), encoding="utf-8")
    command = [sys.executable, "-m", "explorer", "repeat", str(scene), "--pours", str(pours), "--threads", "1"]
    command += ["--out", str(out), "--store", str(folder / "pours.sqlite"), "--json"]
    every, found = max(1, pours // SAMPLES), list[tuple[float, float, float]]()
    with (
        (folder / "said.txt").open("w") as said,
        subprocess.Popen(command, cwd=ROOT, stdout=subprocess.PIPE, stderr=said, text=True) as run,
    ):
        assert run.stdout is not None
        for event in map(json.loads, run.stdout):
            if event["event"] == "pour" and event["done"] % every == 0 and (there := workers(run.pid)):
                found.append((event["done"], resident(run.pid), resident(there[0])))
                here, worker = (f"{memory / KIB**2:.2f} MiB" for memory in found[-1][1:])
                print(f"{event['done']} pours, {event['time']:.0f} s: command {here}, worker {worker}", flush=True)
    if run.returncode:
        raise RuntimeError((folder / "said.txt").read_text())
    return np.array(found)


def main() -> int:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--pours", type=int, default=10_000)
    asked = parser.parse_args()
    with tempfile.TemporaryDirectory() as place:
        rows = measured(asked.pours, Path(place))
    command, worker = Growth.of(rows[:, 0], rows[:, 1]), Growth.of(rows[:, 0], rows[:, 2])
    print(f"{asked.pours} pours: command {command}; worker {worker}")
    return 1 if command.certain or worker.certain else 0


if __name__ == "__main__":
    raise SystemExit(main())
