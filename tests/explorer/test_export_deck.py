"""What no exported deck can hold is refused in one line."""

import dataclasses

import numpy as np
import pytest

from explorer.errors import CommandError
from explorer.export.deck import deck_of
from solver.sizes import SizeDistribution
from tests.solver.observables.made_up import cone, record_of


def test_bodies_of_unequal_size_are_not_exported():
    record = record_of(cone(20.0, 0.05), np.zeros(1), np.zeros(1), 0.03)
    first = dataclasses.replace(record.scene.bodies[0], sizes=SizeDistribution("uniform", 0.1))
    scene = dataclasses.replace(record.scene, bodies=(first, *record.scene.bodies[1:]))
    with pytest.raises(CommandError, match=r"body\.a\.size_distribution: 'uniform' cannot be exported"):
        deck_of(dataclasses.replace(record, scene=scene))
