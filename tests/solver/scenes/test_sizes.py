"""Distributions of size: moments, masses and shares of what is poured, and whole pours of unequal bodies."""

import dataclasses
import math

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.stats import norm

from solver.engine.tables import body_tables, outline
from solver.params import ParameterError
from solver.pours.record import Outcome
from solver.pours.run import Job, run_pour, run_pours
from solver.scenes.body import counts
from solver.scenes.insertion import shuffled_components
from solver.scenes.material_file import load_material
from solver.scenes.scene import value, with_values
from solver.scenes.sizes import KINDS, SizeDistribution, drawn_sizes
from solver.scenes.time_step import time_step
from solver.shapes.clump import fit_clump, scaled
from solver.shapes.solid import Solid

SHIPPED = load_material("sunflower_extract")
COARSE = with_values(SHIPPED, {"body.spheres": "coarse", "rig.mass": "4g"})
QUICK = with_values(COARSE, {"insertion.rate": "60g/s", "rig.outlet_diameter": "60mm"})
WIDE = with_values(
    COARSE,
    {
        "rig.inlet_diameter": "700mm",
        "rig.outlet_diameter": "300mm",
        "insertion.region_radius": "300mm",
        "rig.mass": "30g",
    },
)
"""A rig into which bodies four times as long fit."""
COMPONENTS = ("seed", "plate", "petiole")
KINDS_THAT_VARY = [kind for kind in KINDS if kind != "none"]


def varied(scene, kind, spread, components=COMPONENTS):
    values = {f"body.{name}.size_distribution": kind for name in components}
    return with_values(scene, values | {f"body.{name}.size_spread": spread for name in components})


def drawn(scene, seed):
    """Order of the components, and mass and scale of every body, as a pour of ``seed`` has them."""
    order = shuffled_components(counts(scene.bodies, scene.rig.mass), np.random.default_rng(seed))
    scale = drawn_sizes([body.sizes for body in scene.bodies], order, seed)
    return order, body_tables(scene, order, scale).numbers[:, 0], scale


@pytest.mark.parametrize("spread", [0.01, 0.1, 0.3, 0.5])
@pytest.mark.parametrize("kind", KINDS_THAT_VARY)
def test_mean_deviation_and_mean_cube_are_those_of_the_quantiles(kind, spread):
    sizes = SizeDistribution(kind, spread)

    def mean(function):
        return quad(lambda p: function(sizes.quantile(np.array([p]))[0]), 0.0, 1.0, epsabs=1e-11, limit=200)[0]

    # 1e-8: quadrature of a function whose slope grows large at its ends
    assert mean(lambda s: s) == pytest.approx(1.0, abs=1e-8)
    assert mean(lambda s: (s - 1.0) ** 2) == pytest.approx(spread**2, rel=1e-6)
    assert mean(lambda s: s**3) == pytest.approx(sizes.mean_cube, rel=1e-8)


def test_log_normal_is_the_textbook_s_where_the_cut_does_not_matter():
    """Without a cut E[s³] = (1 + σ²)³, ln s has the deviation √ln(1 + σ²) and the mean −ln(1 + σ²)/2."""
    sizes = SizeDistribution("log_normal", 0.1)
    # the cut takes 0.3 % of the bodies: that moves the third moment in the fourth digit
    assert sizes.mean_cube == pytest.approx(1.01**3, rel=1e-3)
    shares = (norm.cdf([-1.0, 0.0, 1.0]) - norm.cdf(-3.0)) / (norm.cdf(3.0) - norm.cdf(-3.0))
    low, middle, high = np.log(sizes.quantile(shares))
    # a cut at 3 deviations lowers the deviation of a normal variable to 0.98658: that is made up for
    assert (high - low) / 2 == pytest.approx(math.sqrt(math.log(1.01)) / 0.98658, rel=1e-3)
    assert middle == pytest.approx(-math.log(1.01) / 2, abs=1e-4)
    assert math.log(sizes.high / sizes.low) == pytest.approx(3.0 * (high - low))


def test_uniform_ends_at_the_root_of_three():
    sizes = SizeDistribution("uniform", 0.2)
    assert (sizes.low, sizes.high) == pytest.approx((1.0 - 0.2 * math.sqrt(3.0), 1.0 + 0.2 * math.sqrt(3.0)))
    assert sizes.mean_cube == pytest.approx(1.12)


@pytest.mark.parametrize("kind", KINDS_THAT_VARY)
def test_every_body_that_is_drawn_follows_the_distribution(kind):
    """Of one place in the order over many seeds: the strata must not make any body an exception."""
    sizes, seeds = SizeDistribution(kind, 0.3), 4000
    order = np.zeros(7, dtype=np.int32)
    first = np.array([drawn_sizes([sizes], order, seed)[0] for seed in range(seeds)])
    assert first.min() >= sizes.low
    assert first.max() <= sizes.high
    # four standard errors of the mean, of the deviation (kurtosis at most 6) and of the mean cube
    assert first.mean() == pytest.approx(1.0, abs=4 * 0.3 / math.sqrt(seeds))
    assert first.std() == pytest.approx(0.3, rel=4 * math.sqrt(5.0 / 4.0 / seeds))
    assert (first**3).mean() == pytest.approx(sizes.mean_cube, abs=4 * (first**3).std() / math.sqrt(seeds))


def test_sizes_come_from_the_seed_and_are_the_same_again():
    order, _, scale = drawn(varied(WIDE, "log_normal", 0.2), 5)
    again_order, _, again = drawn(varied(WIDE, "log_normal", 0.2), 5)
    assert np.array_equal(again, scale)
    assert np.array_equal(again_order, order)
    assert not np.array_equal(drawn(varied(WIDE, "log_normal", 0.2), 6)[2], scale)


@pytest.mark.parametrize("kind", KINDS_THAT_VARY)
def test_the_mass_of_a_pour_is_the_declared_one(kind):
    scene = varied(WIDE, kind, 0.3)
    masses = np.array([drawn(scene, seed)[1].sum() for seed in range(200)])
    numbers = np.array(counts(scene.bodies, scene.rig.mass))
    mean_mass = np.array([body.mean_mass for body in scene.bodies])
    # four standard errors over the seeds, which is 1 g at most
    standard_error = masses.std() / math.sqrt(len(masses))
    assert masses.mean() == pytest.approx(numbers @ mean_mass, abs=4.0 * standard_error)
    assert 4.0 * standard_error < 1e-3
    # whole bodies: each number differs by less than one from the share of the mass that is declared
    declared = np.array([scene.rig.mass * body.mass_fraction for body in scene.bodies])
    assert np.abs(numbers - declared / mean_mass).max() < 1.0


@pytest.mark.parametrize("kind", KINDS_THAT_VARY)
def test_the_mass_of_a_seed_scatters_less_than_that_of_independent_draws(kind):
    sizes, order = SizeDistribution(kind, 0.3), np.zeros(67, dtype=np.int32)
    rng = np.random.default_rng(1)
    strata = [(drawn_sizes([sizes], order, seed) ** 3).mean() for seed in range(400)]
    independent = [(sizes.quantile(rng.uniform(size=67)) ** 3).mean() for _ in range(400)]
    assert np.std(strata) < 0.25 * np.std(independent)


@pytest.mark.parametrize(("kind", "spread"), [("none", 0.0), ("uniform", 0.3), ("log_normal", 0.3)])
def test_three_components_are_mixed_by_mass(kind, spread):
    """Shares of the mass over several seeds, where the pour is so large that whole bodies matter little."""
    scene = varied(with_values(WIDE, {"rig.mass": "600g"}), kind, spread)
    shares = []
    for seed in range(8):
        order, mass, _ = drawn(scene, seed)
        shares.append(np.bincount(order, mass) / mass.sum())
    declared = np.array([body.mass_fraction for body in scene.bodies])
    largest = max(body.mean_mass for body in scene.bodies)
    # one body of rounding, and the scatter of the strata over 8 seeds
    error = largest / 0.6 + 4.0 * np.std(shares, axis=0) / math.sqrt(8)
    assert np.abs(np.mean(shares, axis=0) - declared).max() < error.max()
    assert error.max() < 0.01


@pytest.mark.slow
def test_a_pour_of_three_components_leaves_the_declared_mixture(taichi):
    """The whole way: material file, counts, shuffled entry, pour, record; over three seeds."""
    scene = with_values(QUICK, {"rig.mass": "15g", "insertion.rate": "150g/s", "numerics.max_time": 0.6})
    declared = np.array([body.mass_fraction for body in scene.bodies])
    single = np.array([body.mass for body in scene.bodies])
    orders = []
    for _, record in run_pours([Job(scene, seed) for seed in range(3)]):
        assert record.trace.entered_mass[-1] == pytest.approx(record.poured_mass)
        shares = np.bincount(record.bodies.component, record.bodies.mass, minlength=3) / record.bodies.mass.sum()
        # whole bodies: none of the three is off by one, and the total by half a body
        assert (np.abs(shares - declared) < (single + single.max() / 2) / record.poured_mass).all()
        orders.append(record.bodies.component.tolist())
    # mixed: another order for another seed, and no component enters in one go
    assert orders[0] != orders[1] != orders[2]
    assert min(np.count_nonzero(np.diff(order)) for order in orders) > 3


def test_fewer_bodies_make_the_mass_when_sizes_scatter():
    none, many = counts(WIDE.bodies, 1.0), counts(varied(WIDE, "uniform", 0.5).bodies, 1.0)
    # E[s³] = 1 + 3/4
    assert np.array(many) == pytest.approx(np.array(none) / 1.75, abs=1.0)


def test_a_body_of_another_size_is_the_solid_of_that_size():
    """Spheres, mass s³ and inertia s⁵ against a clump that is fitted to the larger solid itself."""
    solid = Solid("ellipsoid", (27.92e-3, 11.18e-3, 6.11e-3))
    double = Solid("ellipsoid", tuple(2.0 * d for d in solid.dimensions))
    ours, fitted = scaled(fit_clump(solid, 346.0, "coarse"), 2.0), fit_clump(double, 346.0, "coarse")
    assert ours.mass == pytest.approx(fitted.mass, rel=1e-12)
    assert ours.inertia == pytest.approx(fitted.inertia, rel=1e-12)
    assert ours.radii == pytest.approx(fitted.radii, rel=1e-7)
    assert ours.bounding_radius == pytest.approx(fitted.bounding_radius, rel=1e-7)
    assert ours.fit.surface_rms == pytest.approx(fitted.fit.surface_rms, rel=1e-6)
    tables = body_tables(COARSE, np.zeros(2, dtype=np.int32), np.array([1.0, 2.0]))
    seed = COARSE.bodies[0].clump
    *lengths, sphericity = outline(COARSE.bodies[0])
    dynamics = [8 * seed.mass, *(32 * seed.inertia), 2 * seed.bounding_radius]
    assert tables.numbers[1] == pytest.approx([*dynamics, *(2 * length for length in lengths), sphericity])
    assert tables.spheres[len(seed.radii) :, 3] == pytest.approx(2 * seed.radii)


def test_time_step_is_that_of_the_smallest_body():
    solid = COARSE.bodies[0].shape
    sizes = SizeDistribution("log_normal", 0.3)
    one = dataclasses.replace(COARSE.bodies[0], mass_fraction=1.0, sizes=sizes)
    small = dataclasses.replace(
        one, sizes=SizeDistribution(), shape=Solid("ellipsoid", tuple(sizes.low * d for d in solid.dimensions))
    )
    expected = time_step(dataclasses.replace(COARSE, bodies=(small,)))
    # the fit of the small solid repeats that of the large one to rounding of a least-squares minimum
    assert time_step(dataclasses.replace(COARSE, bodies=(one,))) == pytest.approx(expected, rel=1e-6)


def test_the_largest_body_has_to_fit():
    """A petiole of 57.56 mm is longer than the feeding cylinder of 90 mm if it is 1.8 times as long."""
    with pytest.raises(ParameterError, match=r"insertion\.region_radius.*too narrow for a body of 0\.10"):
        varied(SHIPPED, "log_normal", 0.2, ["petiole"])
    # a plate is 15.02 mm wide: three times that does not pass an outlet of 30 mm
    with pytest.raises(ParameterError, match=r"outlet_diameter.*too narrow for a body"):
        varied(SHIPPED, "log_normal", 0.4, ["plate"])


def test_without_a_spread_not_a_bit_changes(taichi):
    plain = run_pour(with_values(QUICK, {"numerics.max_time": 0.3}), 11)
    for kind, spread in (("log_normal", 0.0), ("uniform", 0.0), ("none", 0.3)):
        again = run_pour(with_values(varied(QUICK, kind, spread), {"numerics.max_time": 0.3}), 11)
        assert (again.steps, again.dt) == (plain.steps, plain.dt)
        assert np.array_equal(again.bodies.position, plain.bodies.position)
        assert np.array_equal(again.bodies.quaternion, plain.bodies.quaternion)
        assert np.array_equal(again.spheres.centre, plain.spheres.centre)
        assert np.array_equal(again.trace.kinetic_energy, plain.trace.kinetic_energy)
        assert (again.bodies.scale == 1.0).all()


@pytest.fixture(scope="module")
def unequal(taichi):
    """A pour of seeds and plates whose sizes scatter by 20 %, with petioles of one size."""
    return run_pour(varied(QUICK, "log_normal", 0.2, ["seed", "plate"]), 3)


def test_a_pour_of_unequal_bodies_comes_to_rest_with_its_mass(unequal):
    assert unequal.ended[0] == Outcome.AT_REST
    assert unequal.trace.discharged_mass[-1] == pytest.approx(unequal.poured_mass)
    assert unequal.trace.max_overlap.max() < 0.1
    lowest = (unequal.pile.spheres.centre[:, 2] - unequal.pile.spheres.radius).min()
    assert -1e-4 < lowest < 1e-4  # an overlap at rest is micrometres


def test_the_record_holds_bodies_at_their_size(unequal):
    bodies, scene = unequal.bodies, unequal.scene
    clumps = [body.clump for body in scene.bodies]
    mass = np.array([clumps[k].mass for k in bodies.component])
    assert bodies.mass == pytest.approx(mass * bodies.scale**3)
    assert (bodies.scale[bodies.component == 2] == 1.0).all()
    assert np.ptp(bodies.scale[bodies.component == 0]) > 0.2
    for b in np.flatnonzero(bodies.inside):
        radii = unequal.spheres.radius[unequal.spheres.body == b]
        assert radii == pytest.approx(clumps[bodies.component[b]].radii * bodies.scale[b])


def test_unequal_bodies_enter_without_overlap(taichi):
    """What `test_pour.test_insertion_never_overlaps` asks for, of bodies that are up to 1.8 times as large."""
    dense = {"insertion.rate": "5000g/s", "numerics.max_time": 0.1, "numerics.sample_interval": 1e-3}
    record = run_pour(with_values(varied(QUICK, "log_normal", 0.2, ["seed", "plate"]), dense), 5)
    assert len(record.bodies.mass) > 4
    # an overlap at entry would be millimetres, a fifth of a radius at least
    assert record.trace.max_overlap.max() < 0.1


def test_paths_of_sizes_read_and_write():
    scene = varied(SHIPPED, "uniform", "12 %", ["seed"])
    assert value(scene, "body.seed.size_distribution") == "uniform"
    assert value(scene, "body.seed.size_spread") == pytest.approx(0.12)
    assert value(scene, "body.plate.size_distribution") == "none"
    with pytest.raises(ParameterError, match=r"body\.seed\.size_spread: 0\.6 is outside 0 … 0\.5"):
        varied(SHIPPED, "uniform", 0.6, ["seed"])
    with pytest.raises(ParameterError, match="none, uniform, log_normal"):
        varied(SHIPPED, "weibull", 0.1, ["seed"])
