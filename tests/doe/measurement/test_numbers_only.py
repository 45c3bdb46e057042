"""A verdict is a function of declared model, simulated runs and readings: of a folder only its numbers get there."""

import shutil

import numpy as np

from doe.declared.model import declare
from doe.diagnose.compared_features import measured
from doe.measurement import load_measurement
from doe.measurement.summaries import complete_rows
from doe.validation.laboratory import TREFOILS, read_laboratory
from solver import EFFECTS
from solver.assets import measurement_folder
from solver.laws import LinearSpringDashpot
from tests.doe.validation.disguise import disguise


def asked(folder):
    """All that the decision is told of a data set."""
    measurement = load_measurement(folder)
    fitted = [measured(condition) for condition in measurement.fit]
    return (
        declare(measurement, tuple(EFFECTS)),
        [condition.scene for condition in measurement.conditions],
        [np.sort(one.values, axis=0) for one in fitted],
        [one.instrument for one in fitted],
        [one.mean_of for one in fitted],
        [np.sort(complete_rows(condition), axis=0) for condition in measurement.holdout],
    )


def assert_same(one, other):
    assert one[0] == other[0]
    # A scene is called after its file; nothing else of it may differ.
    for a, b in zip(one[1], other[1], strict=True):
        assert {**vars(a), "title": ""} == {**vars(b), "title": ""}
    for k in (2, 3, 5):
        for a, b in zip(one[k], other[k], strict=True):
            np.testing.assert_array_equal(a, b)
    assert one[4] == other[4]


def test_a_folder_s_name_its_texts_comments_and_order_say_nothing(tmp_path):
    rng = np.random.default_rng(1)
    laboratory = read_laboratory(TREFOILS)
    names = laboratory.readings
    data = {
        c.name: [dict(zip(names, rng.normal(size=len(names)).tolist(), strict=True)) for _ in range(6)]
        for c in laboratory.declared.conditions
    }
    folders = [tmp_path / name for name in ("rolling_resistance", "no_missing_effect")]
    for folder in folders:
        folder.mkdir()
        laboratory.write(folder, data)
    disguise(folders[1], rng)
    assert_same(*map(asked, folders))


def test_so_it_is_with_a_shipped_data_set(tmp_path):
    shipped = measurement_folder("trefoil_2")
    shutil.copytree(shipped, tmp_path / "air_drag")
    disguise(tmp_path / "air_drag", np.random.default_rng(2))
    assert_same(asked(shipped), asked(tmp_path / "air_drag"))


def test_effects_that_the_contact_law_does_not_go_with_are_no_candidates(tmp_path):
    """Linear springs refuse what begins with Hertz's force; no amplitude of it could be set up."""
    shutil.copytree(measurement_folder("trefoil_2"), tmp_path / "linear")
    material = tmp_path / "linear" / "material.toml"
    material.write_text(material.read_text().replace("hertz_mindlin", LinearSpringDashpot.name))
    declared = declare(load_measurement(tmp_path / "linear"), tuple(EFFECTS))
    assert [effect.name for effect in declared.effects] == [n for n in EFFECTS if n not in LinearSpringDashpot.refuses]
