"""Drag: the coefficient beside other correlations, terminal speed by iterating it, the area that a body shows."""

import numpy as np
import pytest

from solver.backend import ti
from solver.effects.air_drag import AIR_DENSITY, AIR_VISCOSITY, drag_coefficient, shape_factors, shown_area
from solver.engine.state import Vec3
from solver.engine.tables import outline
from solver.scenes.body import Body, Members
from solver.scenes.material import Material
from solver.shapes.solid import Solid
from solver.single_body.free_world import EARTH, RADIUS, FreeWorld, sphere
from tests.solver.effects.cases import felt, scene_with

pytestmark = pytest.mark.usefixtures("taichi")

FOAM = Material("grain", density=30.0, shear_modulus=1e7, poisson_ratio=0.25)


@ti.kernel
def coefficients(inputs: ti.types.ndarray(dtype=ti.f64, ndim=2), out: ti.types.ndarray(dtype=ti.f64, ndim=1)):
    """C_D for rows of Re, φ."""
    for k in range(out.shape[0]):
        out[k] = drag_coefficient(inputs[k, 0], shape_factors(inputs[k, 1]))


@ti.kernel
def areas(inputs: ti.types.ndarray(dtype=ti.f64, ndim=2), out: ti.types.ndarray(dtype=ti.f64, ndim=1)):
    """Shown area for rows of semi-axes (3) and wind (3)."""
    for k in range(out.shape[0]):
        axes = Vec3(inputs[k, 0], inputs[k, 1], inputs[k, 2])
        out[k] = shown_area(axes, Vec3(inputs[k, 3], inputs[k, 4], inputs[k, 5]))


def drag_of(reynolds, phi=1.0):
    """C_D as the kernel has it."""
    reynolds = np.atleast_1d(np.asarray(reynolds, dtype=float))
    out = np.zeros(len(reynolds))
    coefficients(np.column_stack([reynolds, np.full(len(reynolds), phi)]), out)
    return out


def haider_levenspiel(reynolds, phi=1.0):
    """The same written down again, for the closed forms below."""
    a, b = np.exp(2.3288 - 6.4581 * phi + 2.4486 * phi**2), 0.0964 + 0.5565 * phi
    c = np.exp(4.905 - 13.8944 * phi + 18.4222 * phi**2 - 10.2599 * phi**3)
    d = np.exp(1.4681 + 12.2584 * phi - 20.7322 * phi**2 + 15.8855 * phi**3)
    return 24.0 / reynolds * (1.0 + a * reynolds**b) + c / (1.0 + d / reynolds)


def test_of_a_sphere_beside_the_standard_drag_curve():
    """Clift & Gauvin's form of the standard curve (Clift, Grace & Weber 1978, Table 5.1: ± 6 % of the measurements).

    Below Re 1000 its first term is Schiller & Naumann's, 5 % of the measurements. Ours, for any sphericity, was fitted
    to spheres with an rms of 3 %; the two differ by up to 6.4 %, at Re 10.
    """
    reynolds = np.logspace(-1, 5, 61)
    schiller_naumann = 24.0 / reynolds * (1.0 + 0.15 * reynolds**0.687)
    standard = schiller_naumann + 0.42 / (1.0 + 42500.0 * reynolds**-1.16)
    ours = drag_of(reynolds)
    assert ours == pytest.approx(standard, rel=0.08)
    slow = reynolds < 1.0
    assert ours[slow] == pytest.approx(schiller_naumann[slow], rel=0.05)
    assert ours == pytest.approx(haider_levenspiel(reynolds), rel=1e-12)
    assert drag_of(1e-4) == pytest.approx(24.0 / 1e-4, rel=1e-2)  # Stokes


def test_of_other_shapes_beside_pettyjohn_and_christiansen():
    """C_D = 5.31 − 4.88 φ of isometric bodies at 2000 < Re < 2e5 (Chem. Eng. Prog. 44 (1948) 157): tetrahedron, cube,
    octahedron, cube-octahedron. Their data are among those that Haider & Levenspiel fitted, rms 6 %."""
    for phi in (0.67, 0.806, 0.846, 0.906):
        assert drag_of(1e4, phi)[0] == pytest.approx(5.31 - 4.88 * phi, rel=0.12)


def test_the_area_that_an_ellipsoid_shows():
    axes = (3e-3, 2e-3, 1e-3)
    along = [(*axes, *wind) for wind in ((1.0, 0, 0), (0, 1.0, 0), (0, 0, 1.0), (0.0, 0.6, 0.8))]
    out = np.zeros(4)
    areas(np.array(along, dtype=float), out)
    assert out[:3] == pytest.approx(np.pi * 1e-6 * np.array([2.0, 3.0, 6.0]))
    # Shadow along a tilted direction, by brute force: the outline of points spread over the surface.
    angles = np.random.default_rng(0).normal(size=(400_000, 3))
    points = angles / np.linalg.norm(angles, axis=1)[:, None] * axes
    wind = np.array([0.0, 0.6, 0.8])
    flat = np.column_stack([points[:, 0], points @ np.cross(wind, [1.0, 0, 0])])
    cells = np.unique(np.floor(flat / 5e-5), axis=0)
    assert len(cells) * 5e-5**2 == pytest.approx(out[3], rel=0.05)  # cells on the rim count whole


def test_terminal_speed_of_a_sphere():
    """v = √(4/3 (ρ/ρ_air) D g/C_D(Re)) by iteration, without buoyancy, which is not in the model."""
    lab = FreeWorld(
        scene_with(felt("air_drag", strength=1.0), bodies=(sphere(material=FOAM),), grain=FOAM, gravity=EARTH),
        1,
        dt=1e-3,
        plate=False,
    )
    lab.put(0, (0.0, 0.0, 0.0))
    lab.run(8000)
    speed, diameter = 1.0, 2.0 * RADIUS
    for _ in range(200):
        c_d = haider_levenspiel(AIR_DENSITY * speed * diameter / AIR_VISCOSITY)
        speed = np.sqrt(4.0 / 3.0 * FOAM.density / AIR_DENSITY * diameter * 9.81 / c_d)
    assert 2.0 < speed < 4.0
    assert lab.state()[0, 9] == pytest.approx(-speed, rel=1e-6)


def test_a_flake_falls_slower_flat_than_on_edge():
    """Forces at the first step: in proportion to the area shown, the same body and speed."""
    axes = np.array([10e-3, 10e-3, 1e-3])
    spheres = Members(
        ((-9e-3, 0.0, 0.0), (9e-3, 0.0, 0.0), (0.0, -9e-3, 0.0), (0.0, 9e-3, 0.0)),
        (1e-3,) * 4,
        1e-4,
        (2e-9, 2e-9, 4e-9),
    )
    flake = Body("grain", "grain", 1.0, spheres, 400.0)
    assert outline(flake)[:3] == pytest.approx(axes * np.sqrt(outline(flake)[4]))
    lab = FreeWorld(scene_with(felt("air_drag", strength=1.0), bodies=(flake,)), 2, dt=1e-3, plate=False)
    half = np.sqrt(0.5)
    lab.put(0, (0.0, 0.0, 0.0), velocity=(0.0, 0.0, -1.0))
    lab.put(1, (0.5, 0.0, 0.0), velocity=(0.0, 0.0, -1.0), quaternion=(half, half, 0.0, 0.0))
    lab.run(1)
    slowed = lab.state()[:, 9] + 1.0
    assert slowed[0] / slowed[1] == pytest.approx(10.0)
    diameter, sphericity = outline(flake)[3:]
    assert diameter == pytest.approx((6.0 * 1e-4 / 400.0 / np.pi) ** (1.0 / 3.0))
    c_d = haider_levenspiel(AIR_DENSITY * diameter / AIR_VISCOSITY, sphericity)
    shown = sphericity * np.pi * 1e-4
    assert slowed[0] == pytest.approx(1e-3 / 1e-4 * 0.5 * AIR_DENSITY * c_d * shown, rel=1e-9)


@pytest.mark.parametrize(
    "solid",
    [Solid("ellipsoid", (12e-3, 8e-3, 3e-3)), Solid("box", (4e-3, 3e-3, 3e-3)), Solid("cylinder", (4e-3, 3e-3))],
)
def test_a_body_shows_on_average_what_the_sphere_of_its_volume_shows(solid):
    """C_D is by ¼ π D². Thomsen gives the surface within 1.1 %, 4000 directions the mean within 1 %."""
    *axes, diameter, _ = outline(Body("grain", "grain", 1.0, solid, 400.0))
    winds = np.random.default_rng(1).normal(size=(4000, 3))
    winds /= np.linalg.norm(winds, axis=1)[:, None]
    out = np.zeros(len(winds))
    areas(np.column_stack([np.tile(axes, (len(winds), 1)), winds]), out)
    assert out.mean() == pytest.approx(0.25 * np.pi * diameter**2, rel=0.02)
