"""The part of the campaign that CI runs: laboratories of two kinds pour on the campaign's own workers.

The whole of it in the small, answers included, is slow (`test_campaign.py`).
"""

from contextlib import closing
from types import SimpleNamespace

import numpy as np
import pytest

import solver
from doe.declared.budget import Budget
from doe.diagnose.result import BODIES_ALONE, RankedExperiment, Suggestion
from doe.errors import MeasurementError
from doe.measurement import load_measurement
from doe.measurement.condition_table import in_rig
from doe.measurement.features import SCALARS, SCAN, features_of_data, offer_of
from doe.store import Store
from doe.validation.campaign import OFFERS, SETS, Answers, CampaignOrder, run_campaign
from doe.validation.laboratory import TREFOILS, Laboratory, LaboratoryPour, read_laboratory, table_of_bodies
from doe.validation.outside import OUTSIDE_EFFECTS, possible_outside
from doe.validation.scanner import Scanner
from doe.validation.sets import SetRow, append_rows
from doe.validation.truth import REPLICATES, Case, Truth
from doe.validation.work_place import WorkPlace
from solver import AssetNotFoundError, PlateTest, actual, value, with_values
from tests.doe.validation.small_model import small_laboratory


class Listener:
    """Keeps what it is told of pours."""

    def __init__(self):
        self.told, self.seen = [], 0

    def pour(self, part, left, ended):
        self.told.append((part, left, ended.outcome, ended.wall_s > 0.0))

    def watched(self, pours):
        def run(queue, room):
            for one in pours(queue, room):
                self.seen += 1
                yield one

        return run


@pytest.mark.slow
def test_laboratories_pour_with_and_without_an_effect_and_nothing_twice(tmp_path):
    laboratory = read_laboratory(small_laboratory(tmp_path / "laboratory"))
    measurement = laboratory.declared
    (condition, *_) = measurement.fit
    theta = tuple(0.5 * (parameter.low + parameter.high) for parameter in measurement.parameters)
    rolling = (("rolling_resistance", (0.3,)),)
    null, effect = Truth(Case(9, 0, "null"), theta), Truth(Case(9, 1, "effect"), theta, rolling)
    listener = Listener()
    with closing(Store(tmp_path / "runs.sqlite")) as store, WorkPlace(store, 2, listener=listener) as place:
        answers = Answers(laboratory, None, place, Budget())  # nothing is judged
        assert answers.measured(Truth(Case(9, 2, "effect"), theta, missing="bounds"), [condition]) is None
        plain, acting = (answers.measured(truth, [condition]) for truth in (null, effect))
        poured = place.poured
        assert poured >= 2 * REPLICATES
        for data in (plain, acting):
            assert len(data[condition.name]) == REPLICATES
            assert all(set(sample.reading) == set(laboratory.readings) for sample in data[condition.name])
        assert [one.reading for one in plain[condition.name]] != [one.reading for one in acting[condition.name]]
        again = answers.measured(null, [condition])
        assert [one.reading for one in again[condition.name]] == [one.reading for one in plain[condition.name]]
        assert place.poured == poured == len(listener.told) == listener.seen
        assert listener.told[-1] == ("laboratory", 0, "measured", True)
    for scanner, offer in ((None, SCALARS), (Scanner.drawn(np.random.default_rng(0)), SCAN)):
        folder = tmp_path / offer
        folder.mkdir()
        laboratory.hand_out(folder, plain, scanner, (9, 0))
        (read,) = load_measurement(folder).fit
        assert offer_of(read) == offer
        assert np.isfinite(features_of_data(read)).all()


def edited(folder, old, new):
    """The file of a laboratory in which ``old`` is ``new``."""
    path = small_laboratory(folder)
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new))
    return path


WRONG = (
    ('reference = "reference_blind.npz"', 'reference = "nobody.npz"', "nobody"),
    ("readings = [", 'wishes = 1\nreadings = ["steepness",', "laboratory.wishes"),
    ("readings = [", 'readings = ["steepness",', "laboratory.readings: 'steepness'"),
    ('role = "holdout"', 'role = "holdout"\ndata = "a.csv"', "condition.data: 'a.csv'"),
    ('rig = "funnel"', 'rig = "hopper"', "hopper"),
    ("[parameters]", '[laboratory.scanner]\nnoise = ["1mm"]\n[parameters]', "laboratory.scanner.noise: ['1mm']"),
    ("[parameters]", '[laboratory.scanner]\ngrid = ["0mm"]\n[parameters]', "laboratory.scanner.grid: [0.0]; allowed"),
)


@pytest.mark.parametrize(("old", "new", "named"), WRONG)
def test_a_file_that_is_wrong_is_named_in_one_line(tmp_path, old, new, named):
    path = edited(tmp_path / "laboratory", old, new)
    with pytest.raises((MeasurementError, AssetNotFoundError)) as caught:
        assert read_laboratory(path).declared
    (line,) = str(caught.value).splitlines()
    assert line.startswith(str(path))
    assert named in line


def test_scanners_are_drawn_from_the_file_s_ranges(tmp_path):
    ranges = '[laboratory.scanner]\ngrid = ["3mm"]\nnoise = ["0.4mm", "0.5mm"]\n\n[parameters]'
    laboratory = read_laboratory(edited(tmp_path / "laboratory", "[parameters]", ranges))
    drawn = [Scanner.drawn(np.random.default_rng(seed), laboratory.scanner) for seed in range(20)]
    assert {one.grid for one in drawn} == {3e-3}
    assert all(0.4e-3 <= one.noise <= 0.5e-3 for one in drawn)
    assert all(1e-3 <= np.hypot(one.axis_x, one.axis_y) <= 2e-3 for one in drawn)


def test_outside_effects_are_those_that_there_can_be():
    scene = read_laboratory(TREFOILS).declared.scene
    assert possible_outside([scene]) == tuple(OUTSIDE_EFFECTS)
    cylinder = in_rig(scene, "lifting_cylinder")
    assert set(OUTSIDE_EFFECTS) - set(possible_outside([scene, cylinder])) == {
        "sticky_funnel",
        "draught",
        "raised_funnel",
    }


def test_a_set_is_there_once_it_is_judged_by_every_kind_of_data(tmp_path):
    title, said = read_laboratory(TREFOILS).declared.title, []
    order = CampaignOrder(tmp_path, 1, minutes=0.0, cases=(Case(9, 0, "null"),))
    for offer in OFFERS:
        found = SetRow(
            laboratory=title,
            root=9,
            number=0,
            kind="null",
            label="none",
            strength=float("nan"),
            amplitude="",
            offer=offer,
            verdict="no_missing_effect",
        )
        append_rows(tmp_path / SETS, [found])
        run_campaign(order, said.append)
    assert [line.partition(": ")[2] for line in said] == ["0 of 1 data sets are done", "1 of 1 data sets are done"]


def test_its_balance_and_caliper_are_right_within_what_they_state():
    """Over 400 laboratories means of (measured − true)/standard error about 0, their deviation about 1."""
    scene = read_laboratory(TREFOILS).declared.scene
    asked = [("trefoil", name) for name in ("mass", "length", "length_spread")]
    scattered = with_values(scene, {"effect.size_dispersion.spread": 0.12, "effect.density_error.excess": 0.1})
    assert [body.name for body in scene.bodies] == ["trefoil"]
    (body,) = actual(scattered).bodies
    truth = {"mass": body.mean_mass, "length": max(body.extents), "length_spread": 0.12}
    z = {name: [] for name in truth}
    for seed in range(400):
        head, *rows = table_of_bodies(scattered, asked, np.random.default_rng(seed)).splitlines()
        assert head == "body,quantity,unit,mean,standard_error"
        for row in rows:
            _, name, _, mean, error = row.split(",")
            z[name].append((float(mean) - truth[name]) / float(error))
    for name, found in z.items():
        # A mean of few lots is a little off in its standard error: t with four degrees of freedom has 1.4.
        assert abs(np.mean(found)) < 0.25, name
        assert 0.8 < np.std(found) < 1.5, name
    # Bodies that are all alike: whatever spread is found is the caliper's.
    *_, row = table_of_bodies(scene, asked, np.random.default_rng(1)).splitlines()
    mean, error = (float(cell) for cell in row.split(",")[3:])
    assert mean < 2.0 * error < 0.02


def test_its_pulls_and_drops_are_right_within_what_they_state(plates):
    """Over 400 laboratories, of bodies that stick; and of bodies that something outside draws to the plate."""
    scene = read_laboratory(TREFOILS).declared.scene
    sticky = with_values(scene, {"effect.adhesion_jkr.work_of_adhesion": 0.01})
    names = ("apparent_static_friction", "apparent_kinetic_friction", "restitution")
    truth = solver.plate_tests([PlateTest(sticky, "trefoil", name) for name in names])
    assert truth[0] > 1.1 * solver.plate_tests([PlateTest(scene, "trefoil", names[0])])[0]
    asked = [("trefoil", name) for name in names]
    z = {name: [] for name in names}
    for seed in range(400):
        for drawn in (0.0, 3.0):
            rng = np.random.default_rng(seed)
            _, *rows = table_of_bodies(sticky, asked, rng, lambda height, drawn=drawn: drawn).splitlines()
            for row, wanted in zip(rows, truth, strict=True):
                _, name, unit, mean, error = row.split(",")
                assert unit == "1"
                wanted *= 1.0 if name == "restitution" else 1.0 + drawn
                z[name].append((float(mean) - wanted) / float(error))
    for name, found in z.items():
        # A mean of ten is a little off in its standard error: t with nine degrees of freedom has 1.13.
        assert abs(np.mean(found)) < 0.25, name
        assert 0.85 < np.std(found) < 1.3, name


def test_what_was_asked_of_bodies_is_handed_out(tmp_path):
    laboratory = read_laboratory(TREFOILS)
    name = laboratory.declared.fit[0].name
    pours = [dict.fromkeys(laboratory.readings, 1.0 + 0.1 * k) for k in range(3)]
    table = table_of_bodies(laboratory.declared.scene, [("trefoil", "mass")], np.random.default_rng(0))
    laboratory.write(tmp_path, {name: pours}, None, table)
    (row,) = load_measurement(tmp_path).bodies
    assert row.mean == pytest.approx(laboratory.declared.scene.bodies[0].mass, rel=0.02)


def test_bodies_are_measured_without_a_pour_where_they_alone_are_asked_for():
    laboratory, case = read_laboratory(TREFOILS), Case(9, 0, "effect", "density_error", 6.0)
    declared = laboratory.declared
    theta = tuple(value(declared.scene, parameter.path) for parameter in declared.parameters)
    truth = Truth(case, theta, (("density_error", (0.2,)),))
    answers = Answers(laboratory, None, SimpleNamespace(store=None, pours=None), Budget())
    asked = Suggestion(
        RankedExperiment(BODIES_ALONE, 0.9, 3.0),
        {},
        declared.fit[0].name,
        ("density_error", "base"),
        (),
        0,
        bodies=(("trefoil", "mass"),),
    )
    found = answers.followed_up(truth, asked, None)
    assert found.conditions == ()
    (row,) = found.bodies
    assert row.mean == pytest.approx(1.2 * declared.scene.bodies[0].mass, rel=0.02)


@pytest.mark.parametrize("turned", [False, True])
def test_a_turned_rig_is_scanned_by_a_scanner_that_was_not_turned(monkeypatch, turned):
    laboratory, used = read_laboratory(TREFOILS), []
    pour = LaboratoryPour(dict.fromkeys(laboratory.readings, 1.0), np.array([[0.0, 0.0, 0.01]]), np.array([0.01]))
    monkeypatch.setattr(Answers, "measured", lambda self, truth, conditions, *_: {conditions[0].name: [pour] * 6})
    handed_out = Laboratory.hand_out

    def hand_out(self, folder, data, scanner, *others):
        used.append(scanner)
        handed_out(self, folder, data, scanner, *others)

    monkeypatch.setattr(Laboratory, "hand_out", hand_out)
    asked = Suggestion(RankedExperiment("turned", 0.9, 3.0), {}, laboratory.declared.fit[0].name, (), (), 6, turned)
    scanner = Scanner.drawn(np.random.default_rng(1))
    answers = Answers(laboratory, None, SimpleNamespace(store=None, pours=None), Budget())
    (found,) = answers.followed_up(Truth(Case(9, 0, "null"), ()), asked, scanner).fit
    assert found.turned == turned
    assert used == [scanner.of_turned_rig() if turned else scanner]
