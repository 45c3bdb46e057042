"""What a start does not load: libraries that a pour of known bodies never calls."""

import subprocess
import sys

POUR = """
import sys
from solver import load_material, run_pour, with_values
small = {"body.spheres": "coarse", "rig.mass": "1g", "numerics.max_time": 0.1}
scene = with_values(load_material("sunflower_extract"), small)
run_pour(scene, 1)
late = {"trimesh", "scipy.spatial", "scipy.special", "scipy.ndimage", "scipy.optimize", "scipy.stats"}
print(*sorted(late & set(sys.modules)))
"""


def test_a_pour_of_shipped_bodies_loads_no_mesh_library():
    done = subprocess.run([sys.executable, "-c", POUR], capture_output=True, text=True, check=True)
    assert done.stdout.split() == []
