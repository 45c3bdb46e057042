"""Reference pours: rounds that add up, and the file that keeps them."""

import dataclasses
from pathlib import Path

import numpy as np
import pytest

from doe.declared.model import CalibratedParameter, CandidateEffect, Declared, DeclaredCondition
from doe.declared.points import Direction
from doe.declared.pours import PointPour
from doe.diagnose.result import Level
from doe.errors import StatisticsError
from doe.validation.reference import (
    PER_ROUND,
    Reference,
    extended,
    load,
    points_of,
    reference_directions,
    save,
)

DECLARED = Declared(
    (CalibratedParameter("friction", 0.1, 0.9, 0.5, 0.05), CalibratedParameter("restitution", 0.2, 0.8)),
    (
        CandidateEffect("push", (0.0,), (2.0,)),
        CandidateEffect("density", (-0.3,), (0.3,)),
        CandidateEffect("tilt", (-5.0, -5.0), (5.0, 5.0)),
    ),
    (DeclaredCondition("low", ("height",)), DeclaredCondition("high", ("height", "width"))),
)
LEVELS = tuple(Level(direction, 0.5, 12.0) for effect in DECLARED.effects for direction in reference_directions(effect))
NOTHING = Reference("made up", 2, 2, (("height", "area"), ("height", "width", "area")), LEVELS)


class Poured:
    """Pours whose numbers follow from their point; every seventh has jammed, every eleventh cannot be read."""

    def __init__(self):
        self.asked = []

    def run(self, what, points):
        self.asked += [(point.sequence, point.number) for point in points]
        return [[self._pour(point, c) for c in range(2)] for point in points]

    @staticmethod
    def _pour(point, condition):
        size = sum(point.theta) + sum(sum(amplitude) for _, amplitude in point.effects)
        summaries = (size, point.number * 1.1)[: condition + 1]
        surface = (np.nan if point.number % 11 == 10 else 0.1 * size,)
        return PointPour(summaries, "jammed" if point.number % 7 == 6 else "measured", surface=surface)


def rounds(number, pours=None):
    found = NOTHING
    for _ in range(number):
        found = extended(found, DECLARED, pours or Poured())
    return found


def test_directions_are_up_and_down_or_along_both_axes():
    assert [one.name for one in reference_directions(DECLARED.effects[1])] == ["density +", "density -"]
    assert [one.full for one in reference_directions(DECLARED.effects[2])] == [(5.0, 0.0), (0.0, 5.0)]


def test_a_round_has_so_many_pours_of_each_kind_and_half_the_amplitude_is_weak():
    points = points_of(DECLARED, LEVELS, 2)
    assert len(points["push strong"]) == 2 * PER_ROUND["strong"]
    assert len(points["density - strong"]) == 2 * PER_ROUND["other"]
    assert "density - weak" not in points
    assert points["push strong"][0].effects == (("push", (1.0,)),)
    assert points["push weak"][0].effects == (("push", (0.5,)),)
    moved = points["friction +"][0].theta[0] - points["friction -"][0].theta[0]
    assert moved == pytest.approx(2 * 1.5 * 0.05)


def test_rounds_ask_for_nothing_twice():
    pours = Poured()
    found = rounds(3, pours)
    assert found.rounds == 3
    assert len(pours.asked) == len(set(pours.asked)) == sum(map(len, points_of(DECLARED, LEVELS, 3).values()))


def test_what_came_to_no_end_or_cannot_be_read_is_left_out():
    found = rounds(2)
    number = 2 * PER_ROUND["strong"]
    counted = sum(k % 7 != 6 and k % 11 != 10 for k in range(number))
    assert [len(block) for block in found.sample.pours["push strong"]] == [counted] * 2
    assert [block.shape[1] for block in found.sample.pours["base"]] == [2, 3]


def test_a_kind_whose_pours_all_jam_has_no_pours(tmp_path):
    class Jammed(Poured):
        def run(self, what, points):
            pours = super().run(what, points)
            jams = [dict(point.effects).get("push") == (1.0,) for point in points]
            return [
                [dataclasses.replace(one, outcome="jammed") for one in row] if jam else row
                for row, jam in zip(pours, jams, strict=True)
            ]

    found = rounds(2, Jammed())
    assert [block.shape for block in found.sample.pours["push strong"]] == [(0, 2), (0, 3)]
    save(found, tmp_path / "reference.npz")
    again = extended(load(tmp_path / "reference.npz"), DECLARED, Poured())
    assert all(len(block) > 0 for block in again.sample.pours["push strong"])


def test_two_processes_that_write_at_once_both_end(tmp_path, monkeypatch):
    path, found, both = tmp_path / "reference.npz", rounds(1), iter((True, False))
    replace = Path.replace

    def meanwhile(part, target):
        if next(both):
            monkeypatch.setattr("os.getpid", lambda: -1)
            save(found, path)
        return replace(part, target)

    monkeypatch.setattr(Path, "replace", meanwhile)
    save(found, path)
    assert load(path).rounds == 1
    assert list(tmp_path.iterdir()) == [path]


def test_a_file_gives_back_what_was_written_and_can_be_gone_on_with(tmp_path):
    path = tmp_path / "reference.npz"
    save(rounds(1), path)
    again = load(path)
    assert dataclasses.replace(again, sample=NOTHING.sample) == dataclasses.replace(rounds(1), sample=NOTHING.sample)
    there, at_once = extended(again, DECLARED, Poured()), rounds(2)
    assert there.sample.pours.keys() == at_once.sample.pours.keys()
    for kind, blocks in at_once.sample.pours.items():
        for one, other in zip(blocks, there.sample.pours[kind], strict=True):
            assert np.array_equal(one, other)
            assert one.dtype == other.dtype == np.float64


def test_another_file_is_refused_in_one_line(tmp_path):
    path = tmp_path / "other.npz"
    for content in (b"", b"no archive"):
        path.write_bytes(content)
        with pytest.raises(StatisticsError, match=r"other\.npz: not a file of reference pours"):
            load(path)
    np.savez(path, head=np.array([1, 2]))
    with pytest.raises(StatisticsError, match="not a file of reference pours"):
        load(path)


def test_a_level_is_a_share_of_its_direction():
    direction = Direction("push", "push", (2.0,))
    assert direction.at(0.25) == (0.5,)
