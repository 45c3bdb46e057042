"""What single bodies say of effects, against closed forms."""

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy import stats

from doe.declared.bodies import TOGETHER, ActingModel, body_evidence, body_rows, wanted_bodies
from doe.declared.model import declare
from doe.measurement import load_measurement
from doe.measurement.bodies import MeasuredBody
from doe.measurement.measurement import MeasuredParameter
from solver import EFFECTS
from tests.doe.measurement.folders import write

MASS = 2500.0 * math.pi / 6.0 * 12e-3**3
NAMES = tuple(EFFECTS)
pytestmark = pytest.mark.usefixtures("plates")


@pytest.fixture
def data(tmp_path):
    return load_measurement(write(tmp_path))


def evidence_of(data, *rows):
    data = replace(data, bodies=rows)
    return body_evidence(data, declare(data, NAMES))


def test_a_weighed_density_is_that_of_a_gaussian(data):
    """Ten per cent heavier, known to one per cent: ln 1.1/0.01 standard errors off, less what the density explains."""
    found = evidence_of(data, MeasuredBody("bead", "mass", 1.1 * MASS, 0.011 * MASS))
    off = math.log(1.1) / 0.01
    assert found.off == pytest.approx([off])
    assert found.log_density("base", np.zeros((1, 0)), 1.15) == pytest.approx([-0.5 * off**2])
    at = np.array([[0.05], [0.1], [0.2]])
    wanted = -0.5 * ((math.log(1.1) - np.log1p(at[:, 0])) / 0.01) ** 2
    # A cell of no width; straight lines between amplitudes are off by less than a thousandth of a shift.
    assert found.log_density("density_error", at, 1.0 + 1e-9) == pytest.approx(wanted, abs=0.05)


def test_a_cell_is_averaged_over(data):
    """Its amplitudes a are spread evenly over ln a: ∫ N(ln(1 + a)) d ln a over the cell."""
    found = evidence_of(data, MeasuredBody("bead", "mass", 1.2 * MASS, 0.012 * MASS))
    fine = 0.2 * 1.15 ** np.linspace(-0.5, 0.5, 2001)
    wanted = math.log(np.exp(-0.5 * ((math.log(1.2) - np.log1p(fine)) / 0.01) ** 2).mean())
    assert found.log_density("density_error", np.array([[0.2]]), 1.15)[0] == pytest.approx(wanted, abs=0.02)


def test_two_effects_add_and_what_changes_no_body_does_not_matter(data):
    rows = (
        MeasuredBody("bead", "mass", 1.1 * MASS, 0.011 * MASS),
        MeasuredBody("bead", "length", 12e-3 * 1.2, 12e-5 * 1.2),
    )
    found = evidence_of(data, *rows)
    cell = 1.0 + 1e-9
    both = found.log_density("density_error+shape_elongation", np.array([[0.1, 0.2]]), cell)
    assert both == pytest.approx([0.0], abs=0.1)
    assert found.log_density("plate_tilt+density_error", np.array([[3.0, 1.0, 0.1]]), cell) == pytest.approx(
        [-0.5 * (math.log(1.2) / 0.01) ** 2], rel=0.01
    )
    assert not found.moved_by("rolling_resistance")
    assert not found.moved_by("funnel_offset")
    assert found.log_density("rolling_resistance", np.array([[0.1]]), cell) == pytest.approx(
        found.log_density("base", np.zeros((1, 0)), cell)
    )


def test_averages_weigh_pairs_too(data):
    """Mass by both of two effects: the mean over both cells, by brute force."""
    found = evidence_of(data, MeasuredBody("bead", "mass", 1.1 * MASS, 0.033 * MASS))
    steps = 1.5 ** np.linspace(-0.5, 0.5, 101)
    heavier, spread = np.log1p(0.08 * steps), 3.0 * np.log1p((0.1 * steps) ** 2)
    density = stats.norm.pdf((math.log(1.1) - heavier[:, None] - spread) / 0.03).mean() / stats.norm.pdf(0.0)
    label, at = "size_dispersion+density_error", np.array([[0.1, 0.08]])
    assert found.log_density(label, at, 1.5)[0] == pytest.approx(math.log(density), abs=0.05)


def test_what_is_calibrated_is_known_as_well_as_the_parameter(data):
    """ln m of a density known to ± 5 %, even over its range: both errors together, and no further off than that."""
    density = MeasuredParameter("material.glass.density", 2285.0, 2715.0, None, None, "kg/m3")
    data = replace(data, parameters=(*data.parameters, density))
    found = evidence_of(data, MeasuredBody("bead", "mass", 1.1 * MASS, 0.011 * MASS))
    error = 430.0 / math.sqrt(12.0) / 2500.0
    # And by how much the logarithm bends over the deviation.
    bend = math.sqrt(3.0) * 0.5 * math.log1p(-(error**2))
    assert found.off == pytest.approx([math.log(1.1) / math.hypot(0.01, bend, math.atanh(error))], rel=1e-6)
    assert evidence_of(data) is None


@pytest.mark.parametrize("ends", [(2000.0, 2550.0), (2000.0, 2500.0), (2450.0, 3000.0)])
def test_a_range_that_cuts_a_side_off_leaves_the_slope(data, ends):
    """ln m of a density ± 10 % rises by 0.1 per deviation, though the range ends 0.2 or 0 deviations from the mean."""
    density = MeasuredParameter("material.glass.density", *ends, 2500.0, 250.0, "kg/m3")
    found = evidence_of(replace(data, parameters=(density,)), MeasuredBody("bead", "mass", MASS, 0.01 * MASS))
    assert found.slopes == pytest.approx(np.array([[0.1 / 0.01]]), rel=0.06)  # a line alone misses the curvature, 5 %


def test_two_frictions_share_what_is_not_known_of_the_declared_one(data):
    """Both are 20 % too high, ± 5 % each: with a declared friction that is known to 10 %, hardly more than one is."""
    friction = MeasuredParameter("pair.glass.steel.static_friction", 0.2, 0.4, 0.3, 0.03, "1")
    names = ("apparent_static_friction", "apparent_kinetic_friction")
    rows = [MeasuredBody("bead", name, 0.36, 0.018) for name in names]
    sure = evidence_of(data, *rows)
    assert sure.off @ sure.off == pytest.approx(2.0 * (math.log(1.2) / 0.05) ** 2)
    found = evidence_of(replace(data, parameters=(friction,)), *rows)
    # The logarithm bends by ½ ln(1 − 0.1²) over a deviation, and in the mean square by 3 times its square.
    covariance = 0.05**2 * np.eye(2) + math.atanh(0.1) ** 2 + 3.0 * (0.5 * math.log1p(-0.01)) ** 2
    off = np.full(2, math.log(1.2))
    assert found.off @ found.off == pytest.approx(off @ np.linalg.solve(covariance, off))


@pytest.mark.parametrize("second", ["wall_adhesion", "kinetic_friction"])
def test_loads_of_two_adhesions_add_up_and_a_lower_friction_is_a_factor(data, second):
    """The number by both is the likeliest, of a density as wide as 0.05 and ``TOGETHER``; not the sum of logarithms."""
    row = "apparent_static_friction" if second == "wall_adhesion" else "apparent_kinetic_friction"
    at = {"adhesion_jkr": 2.0, "wall_adhesion": 3.0, "kinetic_friction": 0.4}
    load = 3.0 * math.pi * 6e-3 / (MASS * 9.81)
    wanted = 0.3 * ((1.0 + 5.0 * load) if second == "wall_adhesion" else 0.6 * (1.0 + 2.0 * load))
    names = [name for name in NAMES if name in ("adhesion_jkr", second)]
    both, amplitudes = "+".join(names), np.array([[at[name] for name in names]])
    found = evidence_of(data, MeasuredBody("bead", row, wanted, 0.05 * wanted))
    width = math.hypot(0.05, TOGETHER)
    assert found.log_density(both, amplitudes, 1.0 + 1e-9) == pytest.approx([-math.log(width / 0.05)], abs=0.01)
    mean, noise, _ = found.predicted(model(found.slopes.shape[1], *((name, at[name], 0.0) for name in names)))
    assert mean == pytest.approx(found.off, rel=0.01)
    assert noise == pytest.approx(np.array([[(width / 0.05) ** 2]]))


def model(k, *effects):
    """``effects`` with ``k`` parameters of which the piles say nothing."""
    return ActingModel(effects, np.zeros(k), np.eye(k))


def wanted_by(data, *answers):
    declared = declare(data, NAMES)
    return wanted_bodies(data, declared, [model(len(declared.parameters), *one) for one in answers])


def acting(*names, share=0.3):
    return [(name, share * EFFECTS[name].strongest, 0.0) for name in names]


@pytest.mark.parametrize(
    ("answers", "wanted"),
    [
        ([acting("density_error"), []], ["mass"]),
        ([acting("shape_elongation", "rolling_resistance"), []], ["length"]),
        ([acting("size_dispersion"), acting("rolling_resistance")], ["mass", "length_spread"]),
        ([acting("rolling_resistance"), []], []),
        ([acting("plastic_contact"), acting("rolling_resistance")], ["restitution"]),
        ([acting("kinetic_friction"), []], ["apparent_kinetic_friction"]),
        ([acting("adhesion_jkr"), acting("adhesion_sjkr")], ["apparent_static_friction", "apparent_kinetic_friction"]),
        ([acting("density_error"), acting("density_error")], []),
    ],
)
def test_what_tells_two_answers_apart_is_asked_for(data, answers, wanted):
    found = wanted_by(data, *answers)
    assert ([] if found is None else [row.quantity for row in found.rows]) == wanted


def test_what_an_effect_that_fits_weakly_may_do_is_asked_for(data):
    known, loose = ([("density_error", 0.005, deviation)] for deviation in (0.001, 0.01))
    assert wanted_by(data, known, []) is None
    assert [row.quantity for row in wanted_by(data, loose, []).rows] == ["mass"]


def test_what_is_measured_is_not_asked_for_again(data):
    data = replace(data, bodies=(MeasuredBody("bead", "mass", MASS, 0.01 * MASS),))
    assert wanted_by(data, acting("density_error"), []) is None


def test_a_prediction_knows_how_well_its_amplitude_is_known(data):
    found = wanted_by(data, [("density_error", 0.1, 0.05)], [])
    acts = [("density_error", 0.1, 0.05), ("rolling_resistance", 0.1, 0.02)]
    k = found.slopes.shape[1]
    mean, noise, loadings = found.predicted(model(k, *acts))
    assert mean == pytest.approx([math.log(1.1) / 0.01], rel=1e-3)
    assert noise == pytest.approx(np.eye(1))
    assert loadings == pytest.approx(np.array([[0.0] * k + [math.log(1.15 / 1.1) / 0.01, 0.0]]), rel=0.01)
    *_, lighter = found.predicted(model(k, ("density_error", -0.1, 0.05)))
    assert lighter[0, -1] == pytest.approx(math.log(0.85 / 0.9) / 0.01, rel=0.01)
    # At the end of the range, where there is no more, a step back stands for it.
    (end,) = [one.high[0] for one in found.effects if one.name == "density_error"]
    *_, heaviest = found.predicted(model(k, ("density_error", end, 0.05)))
    assert heaviest[0, -1] == pytest.approx(math.log((1.0 + end) / (0.95 + end)) / 0.01, rel=0.01)
    assert found.predicted(model(found.slopes.shape[1]))[0] == pytest.approx([0.0])


def test_between_amplitudes_that_were_set_up_a_friction_is_known_to_a_fiftieth_of_its_shift(data):
    """ln(1 + c w) of JKR adhesion over three decades of w."""
    found = evidence_of(data, MeasuredBody("bead", "apparent_static_friction", 0.3, 0.015))
    works = np.geomspace(0.005, 5.0, 50)
    wanted = np.log1p(3.0 * math.pi * works * 6e-3 / (MASS * 9.81)) / 0.05
    shifts = found.shift("adhesion_jkr", works)[:, 0]
    assert np.abs(shifts - wanted).max() < 0.02 * wanted.max()


def test_rows_stand_beside_both_models(data):
    measured = [MeasuredBody("bead", "mass", 1.1 * MASS, 0.011 * MASS)]
    (row,) = body_rows(data.fit[0].scene, measured, {"density_error": [0.1]})
    assert (row.declared, row.final, row.unit) == (pytest.approx(MASS), pytest.approx(1.1 * MASS), "kg")


def test_two_frictions_say_what_the_parameter_is_and_piles_what_a_third_will_be(data):
    """One parameter with slope K = atanh(0.1)/0.05 in both: a mean of two, by hand; and a prediction from the piles."""
    friction = MeasuredParameter("pair.glass.steel.static_friction", 0.2, 0.4, 0.3, 0.03, "1")
    names = ("apparent_static_friction", "apparent_kinetic_friction")
    data = replace(data, parameters=(friction,))
    found = evidence_of(data, *[MeasuredBody("bead", name, 0.36, 0.018) for name in names])
    slope, off = math.atanh(0.1) / 0.05, math.log(1.2) / 0.05
    bend = 0.5 * math.log1p(-0.01) / 0.05
    # A mean of two numbers of variance 1, with what both miss of the line.
    told = 1.0 / (0.5 + 3.0 * bend**2)
    means, covariance = found.parameters("base", np.zeros((3, 0)))
    assert covariance == pytest.approx(np.array([[1.0 / (1.0 + slope**2 * told)]]))
    assert means == pytest.approx(np.full((3, 1), slope * off * told * covariance[0, 0]))
    # An effect that explains the numbers leaves the parameter where it was.
    work = 0.2 * MASS * 9.81 / (3.0 * math.pi * 6e-3)
    explained, _ = found.parameters("adhesion_jkr", np.array([[work]]))
    assert abs(explained[0, 0]) < 0.05 * means[0, 0]
    other = wanted_by(data, acting("kinetic_friction"), [])
    mean, noise, loadings = other.predicted(ActingModel([], np.array([1.5]), np.array([[0.04]])))
    q = [row.quantity for row in other.rows].index("apparent_kinetic_friction")
    own = other.slopes[q, 0]
    assert (other.factor @ mean)[q] == pytest.approx(1.5 * own)
    assert (other.factor @ noise @ other.factor.T)[q, q] == pytest.approx(other.noise[q, q])
    assert (other.factor @ loadings)[q] == pytest.approx([0.2 * own])


@pytest.mark.parametrize("off", [-1.39, 1.39])
def test_a_parameter_known_by_a_wide_range_alone_is_not_told_too_surely(data, off):
    """The logarithm of a friction between 0.1 and 0.6 is far from a line: the stated error holds what that does."""
    friction = MeasuredParameter("pair.glass.steel.static_friction", 0.1, 0.6, None, None, "1")
    deviation = 0.5 / math.sqrt(12.0)
    there = 0.35 + off * deviation
    row = MeasuredBody("bead", "apparent_static_friction", there, 0.05 * there)
    found = evidence_of(replace(data, parameters=(friction,)), row)
    means, covariance = found.parameters("base", np.zeros((1, 0)))
    assert abs(means[0, 0] - off) < 2.0 * math.sqrt(covariance[0, 0])
