"""Beans: ellipsoids 12 mm long, 8 mm wide and 6 mm thick, poured as a layer that is no heap, and as a heap."""

import dataclasses

from solver.scenes.scene import Scene, with_rig, with_values
from solver.shapes.solid import Solid
from tests.solver.golden.cases import TREFOIL

BEAN = dataclasses.replace(
    TREFOIL.bodies[0], name="bean", shape=Solid("ellipsoid", (12e-3, 8e-3, 6e-3)), spheres="coarse"
)
BEANS = with_values(dataclasses.replace(TREFOIL, title="beans", bodies=(BEAN,)), {"numerics.duration": 0.0})


def two_layers() -> Scene:
    """Smooth beans that lie two deep when the cylinder around them has been lifted."""
    lifted = with_rig(BEANS, "lifting_cylinder")
    values = {"rig.diameter": 0.08, "rig.cylinder_height": 0.05, "rig.lift_speed": 0.05, "rig.lift_height": 0.05}
    smooth = {"pair.grain.grain.static_friction": 0.2, "pair.grain.steel.static_friction": 0.2}
    return with_values(lifted, values | smooth | {"rig.mass": 60 * BEAN.mass, "insertion.rate": 0.1})


def heap() -> Scene:
    """Three times as many and rough, in a narrower cylinder: they stay piled up."""
    rough = {"pair.grain.grain.static_friction": 0.9, "pair.grain.steel.static_friction": 0.9}
    values = {"rig.diameter": 0.06, "rig.cylinder_height": 0.1, "rig.lift_speed": 0.05, "rig.lift_height": 0.1}
    lifted = with_rig(BEANS, "lifting_cylinder")
    return with_values(lifted, rough | values | {"rig.mass": 180 * BEAN.mass, "insertion.region_radius": 0.03})
