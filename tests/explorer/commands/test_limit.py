"""``explorer limit`` on a file of made-up reference pours: no pour is made, the tables follow from the file."""

import json

import numpy as np
import pytest

from doe.declared.points import Direction
from doe.diagnose.result import Level
from doe.measurement.features import feature_set
from doe.store import READINGS
from doe.validation.laboratory import TREFOILS, read_laboratory
from doe.validation.limit import DataKind, LimitStudy, Reached, Strength
from doe.validation.reference import Reference, ReferencePours, save
from explorer.diagnosis.limit import limit_text
from solver import PHYSICS
from tests.explorer.command_line import explorer

ROUNDS, STRONG, WEAK, BASE = 8, 64, 32, 240


@pytest.fixture(scope="module")
def model():
    return read_laboratory(TREFOILS).declared


def made_up(model, physics=PHYSICS):
    """Two effects, of which the second moves only what a scan shows."""
    rng = np.random.default_rng(0)
    names = [feature_set(condition).names for condition in model.fit]
    kinds = {"base": (BASE, -1, 0.0)}
    for name, place in (("rolling_resistance", 0), ("size_dispersion", -6)):
        kinds |= {f"{name} strong": (STRONG, place, 5.0), f"{name} weak": (WEAK, place, 2.5)}
    kinds |= {f"{p.path} {side}": (32, 3, 0.0) for p in model.parameters for side in "-+"}

    def block(number, place, shift, width):
        found = rng.standard_normal((number, width))
        found[:, place] += shift
        found[:, 1] += 0.1 * shift
        return found

    pours = {kind: tuple(block(*what, len(one)) for one in names) for kind, what in kinds.items()}
    levels = tuple(
        Level(Direction(name, name, (0.3,)), 0.5, 12.0) for name in ("rolling_resistance", "size_dispersion")
    )
    sample = ReferencePours(pours, tuple(p.path for p in model.parameters))
    return Reference(model.title, physics, READINGS, tuple(names), levels, ROUNDS, sample)


@pytest.mark.slow
@pytest.mark.slow
def test_tables_and_file_follow_from_the_reference(model, tmp_path):
    save(made_up(model), tmp_path / "reference.npz")
    out = tmp_path / "limit.json"
    result = explorer("limit", "--reference", tmp_path / "reference.npz", "--out", out)
    assert result.exit_code == 0, result.output
    for text in ("rolling_resistance", "size_dispersion", "named, 3.0% wrong", "taught by", "false names"):
        assert text in result.output
    found = json.loads(out.read_text(encoding="utf-8"))
    assert (found["title"], found["rounds"], found["physics"]) == (model.title, ROUNDS, PHYSICS)
    scans = {(row["data"], row["replicates"], row["limit"]["strength"]): row["limit"] for row in found["rows"]}
    # The second effect is nearly unseen in scalars and far off in a scan.
    assert scans["scan", 6, 4.0]["by_effect"]["size_dispersion"] > 0.95
    assert {row["data"] for row in found["cross_validation"]} == {"scalars", "profile", "scan"}


def test_a_reference_of_another_physics_is_refused(model, tmp_path):
    path = tmp_path / "reference.npz"
    save(made_up(model, physics=PHYSICS - 1), path)
    result = explorer("limit", "--reference", path, "--out", tmp_path / "limit.json")
    assert result.exit_code == 2
    assert f"{path}: physics {PHYSICS - 1} is out of date" in " ".join(result.output.split())
    assert not (tmp_path / "limit.json").exists()


def test_data_in_which_no_effect_is_seen_are_named_instead_of_a_limit():
    strength = Strength(0.1, 0.2)
    reached = Reached(DataKind("tilt", "tilt", True), (0.3,), strength, None, {"scalars": strength})
    text = limit_text(LimitStudy({"base": 240}, (reached,), (), ()), ())
    assert "scalars: no effect is told from zero, so that there is no limit" in text
