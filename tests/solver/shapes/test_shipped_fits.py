"""The fits that are shipped are those that would be made."""

import numpy as np
import pytest

from solver.assets import shipped_fits
from solver.shapes.clump import _new_fit, fit_name, read_fit
from tests.solver.shipped_fits import SLACK, fitted


def test_every_shipped_body_has_its_fit_and_nothing_else_is_there():
    assert {path.name for path in shipped_fits().iterdir()} == {fit_name(*one) for one in fitted()}


@pytest.mark.parametrize(("solid", "spheres"), [one for one in fitted() if one[1] != "fine"], ids=str)
def test_a_shipped_fit_is_the_one_that_would_be_made(solid, spheres):
    kept, made = read_fit(shipped_fits() / fit_name(solid, spheres)), _new_fit(solid, spheres)
    for one, other in zip(kept[:2], made[:2], strict=True):
        np.testing.assert_allclose(one, other, rtol=0.0, atol=SLACK)
