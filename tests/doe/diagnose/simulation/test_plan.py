"""Which pours are asked for: the same ones every time, within the bounds, over the whole box."""

import numpy as np
import pytest

from doe.diagnose.runs import Effect, Parameter
from doe.diagnose.simulation.plan import base_points, effect_points, full, middle, scaling_points

PARAMETERS = (Parameter("friction", 0.4, 0.8, 0.5, 0.05), Parameter("restitution", 0.3, 0.9))
ROLLING = Effect("rolling_resistance", (0.0,), (0.2,))
DENSITY = Effect("density_error", (-0.3,), (0.5,))
TILT = Effect("plate_tilt", (-5.0, -4.0), (5.0, 4.0))


def test_more_points_continue_the_sequence():
    assert base_points(PARAMETERS, 40)[:24] == base_points(PARAMETERS, 24)
    first = effect_points(PARAMETERS, ROLLING, 0, 16)
    assert effect_points(PARAMETERS, ROLLING, 0, 30)[:16] == first
    assert effect_points(PARAMETERS, ROLLING, 0, 30, 16) == effect_points(PARAMETERS, ROLLING, 0, 30)[16:]


def test_a_point_is_named_by_its_sequence_and_the_range():
    wide, narrow = (effect_points(PARAMETERS, Effect("x", (0.0,), (high,)), 0, 2)[0] for high in (0.2, 0.1))
    assert wide.sequence != narrow.sequence
    names = {(p.sequence, p.number) for e in (ROLLING, TILT) for p in effect_points(PARAMETERS, e, 0, 8)}
    assert len(names) == 16


def test_points_fill_the_box():
    theta = np.array([point.theta for point in base_points(PARAMETERS, 64)])
    for column, parameter in zip(theta.T, PARAMETERS, strict=True):
        share = (column - parameter.low) / (parameter.high - parameter.low)
        # A Sobol sequence of 64 puts one point into each 64th.
        assert sorted((share * 64).astype(int)) == list(range(64))


@pytest.mark.parametrize("effect", [ROLLING, DENSITY, TILT], ids=lambda e: e.name)
def test_amplitudes_stay_within_their_bounds_and_reach_them(effect):
    found = np.array([point.effects[0][1] for point in effect_points(PARAMETERS, effect, 0, 64)])
    assert (found >= np.array(effect.low) - 1e-12).all()
    assert (found <= np.array(effect.high) + 1e-12).all()
    assert found.max() == pytest.approx(max(effect.high))
    assert found.any(axis=1).all()
    if min(effect.low) < 0.0:
        assert found.min() == pytest.approx(min(effect.low))


@pytest.mark.parametrize("stream", range(6))
@pytest.mark.parametrize("effect", [ROLLING, DENSITY, TILT], ids=lambda e: e.name)
def test_no_amplitude_goes_with_a_parameter(effect, stream):
    points = effect_points(PARAMETERS, effect, stream, 32)
    size = np.linalg.norm([np.array(p.effects[0][1]) / effect.scale for p in points], axis=1)
    theta = np.array([point.theta for point in points])
    # Levels taken in turn gave 0.87 with the second parameter; independent draws of 32 scatter by 0.18.
    for column in theta.T:
        assert abs(np.corrcoef(size, column)[0, 1]) < 0.3


def test_scaling_stands_in_the_middle():
    assert middle(PARAMETERS) == (0.5, pytest.approx(0.6))
    points = scaling_points(PARAMETERS, TILT, 3)
    assert {point.theta for point in points} == {middle(PARAMETERS)}
    assert {point.effects for point in points} == {(("plate_tilt", full(TILT)),)}
    assert full(TILT) == (5.0, 0.0)
