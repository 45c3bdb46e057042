"""Runs of other engines: what LIGGGHTS is told of an impact, and a run that does not end."""

import subprocess

import numpy as np
import pytest

from explorer.errors import CommandError
from explorer.export.impacts import plane_input, target_input
from explorer.export.liggghts import INPUT, unclamped_restitution
from explorer.export.run import PeerTimeout, run_liggghts
from solver.verification.chung_ooi import ALUMINIUM, NYLON
from solver.verification.impacts import STEPS_PER_CONTACT, Impact, StruckSphere, contact_time, struck_time

FAST, SLOW = (Impact(ALUMINIUM, 0.1, v, 0.05, 0.3, 0.5, 0.4) for v in (0.4, 0.2))
OTHER = Impact(NYLON, 0.1, 0.2, 0.0, 0.3, 0.5, 0.4, gap=1e-4)


def words(folder, start):
    """What follows the only line that begins with ``start``."""
    lines = [line for line in (folder / INPUT).read_text().splitlines() if line.startswith(start)]
    assert len(lines) == 1, lines
    return lines[0].removeprefix(start).split()


def spheres(folder):
    """Numbers of the two sections of the data file: places and speeds."""
    text = (folder / "spheres.data").read_text()
    sections = text.split("Atoms\n\n")[1].split("\n\nVelocities\n\n")
    return [np.array([line.split() for line in part.strip().splitlines()], dtype=float) for part in sections]


def test_impacts_on_the_plane_are_told_as_they_are(tmp_path):
    plane_input(tmp_path, [FAST, SLOW, OTHER])
    places, speeds = spheres(tmp_path)
    assert places[:, 1].tolist() == [1, 1, 2]  # two materials, the plane is the third
    assert places[:, 2:4].tolist() == [[0.2, 2700.0], [0.2, 2700.0], [0.2, 1000.0]]
    assert places[:, 6].tolist() == [0.1, 0.1, 0.1001]
    assert speeds[:, 1:4].tolist() == [[0.05, 0.0, -0.4], [0.05, 0.0, -0.2], [0.0, 0.0, -0.2]]
    assert speeds[:, 5] == pytest.approx(-3.0)  # r ω = 0.3 m/s: the contact point runs with the centre
    moduli = [float(word) for word in words(tmp_path, "fix youngs all property/global youngsModulus peratomtype")]
    assert moduli == pytest.approx([7e10, 2.5e9, 1e30])
    table = np.array(words(tmp_path, "fix restitution all property/global coefficientRestitution peratomtypepair 3"))
    assert table.astype(float).reshape(3, 3)[0, 2] == unclamped_restitution(0.5)
    friction = np.array(words(tmp_path, "fix friction all property/global coefficientFriction peratomtypepair 3"))
    assert friction.astype(float).reshape(3, 3)[1, 2] == 0.4
    dt, steps = float(words(tmp_path, "timestep")[0]), int(words(tmp_path, "run")[0])
    assert dt == contact_time(FAST) / STEPS_PER_CONTACT
    assert steps * dt > 3.0 * contact_time(OTHER)  # the softest has long left


def test_an_impact_on_a_target_touches_it_at_the_start(tmp_path):
    target = StruckSphere(ALUMINIUM, 0.5)
    target_input(tmp_path, [SLOW, SLOW], target)
    places, speeds = spheres(tmp_path)
    assert places[:2, 6] - places[2:, 6] == pytest.approx(0.6)
    assert (places[:2, 5] == places[2:, 5]).all()
    assert not speeds[2:, 1:].any()
    assert "plane" not in (tmp_path / INPUT).read_text()
    assert float(words(tmp_path, "timestep")[0]) == struck_time(SLOW, target) / STEPS_PER_CONTACT


@pytest.fixture
def engine(tmp_path, monkeypatch):
    """Puts a shell script in the place of LIGGGHTS."""

    def place(script):
        program = tmp_path / "bin" / "liggghts"
        program.parent.mkdir()
        program.write_text(f"#!/bin/sh\n{script}\n")
        program.chmod(0o755)
        monkeypatch.setenv("PATH", str(program.parent), prepend=":")

    return place


def test_a_run_that_does_not_end_is_stopped(engine, tmp_path):
    engine("sleep 100000")
    with pytest.raises(PeerTimeout, match=r"liggghts: stopped after 0\.01 s"):
        run_liggghts(tmp_path, limit=0.01)


@pytest.mark.parametrize(
    ("stop", "raised"),
    [(subprocess.TimeoutExpired("liggghts", 7.0), PeerTimeout), (KeyboardInterrupt(), KeyboardInterrupt)],
)
def test_what_an_engine_started_dies_with_it(engine, tmp_path, monkeypatch, stop, raised):
    """Its child holds the pipe open: reading it to its end, and so this test, would last as long as the child."""
    engine("sleep 100000 & echo $! > child; wait")
    communicate = subprocess.Popen.communicate

    def interrupted(self, input=None, timeout=None):
        if timeout is None:
            return communicate(self, input)
        while not (tmp_path / "child").exists() or not (tmp_path / "child").read_text().strip():
            assert self.poll() is None
        raise stop

    monkeypatch.setattr(subprocess.Popen, "communicate", interrupted)
    with pytest.raises(raised):
        run_liggghts(tmp_path, limit=7.0)


def test_an_engine_that_fails_says_why(engine, tmp_path):
    engine("echo 'ERROR: no such style'; exit 1")
    with pytest.raises(CommandError, match="ERROR: no such style"):
        run_liggghts(tmp_path)
