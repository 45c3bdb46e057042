"""Effects in set-up and study files and on the command line."""

import pytest

from explorer.scene.file import load_scene, with_settings
from solver.assets import asset_path
from solver.params import ParameterError
from solver.scenes.scene import value

SET_UP = """format = 1
material = "sunflower_extract"
[effect.capillary_bridge]
surface_tension = "72mN/m"
bridge_volume = 2e-9
[effect.funnel_offset]
dx = "5mm"
"""


def test_a_set_up_file_switches_effects_on(tmp_path):
    path = tmp_path / "moist.toml"
    path.write_text(SET_UP)
    scene = load_scene(str(path))
    assert value(scene, "effect.capillary_bridge.surface_tension") == pytest.approx(0.072)
    assert value(scene, "effect.capillary_bridge.bridge_volume") == 2e-9
    assert value(scene, "effect.funnel_offset.dx") == pytest.approx(5e-3)


def test_a_mistake_names_the_file(tmp_path):
    path = tmp_path / "moist.toml"
    path.write_text(SET_UP.replace("surface_tension", "tension"))
    with pytest.raises(ParameterError, match=r"moist\.toml: effect\.capillary_bridge\.tension: no such parameter"):
        load_scene(str(path))


def test_a_setting_on_the_command_line():
    scene = with_settings(load_scene("funnel"), ["effect.adhesion_jkr.work_of_adhesion=500mJ/m2"])
    assert value(scene, "effect.adhesion_jkr.work_of_adhesion") == pytest.approx(0.5)
    with pytest.raises(ParameterError, match=r"--set: effect\.air_drag\.strength: 21 is outside 0 … 20"):
        with_settings(scene, ["effect.air_drag.strength=21"])


def test_a_study_is_of_a_material_with_its_effects(tmp_path):
    path = tmp_path / "study.toml"
    shipped = asset_path("studies", "sunflower_extract").read_text()
    path.write_text(shipped + "\n[effect.air_drag]\nstrength = 1.0\n")
    assert value(load_scene(str(path)), "effect.air_drag.strength") == 1.0
