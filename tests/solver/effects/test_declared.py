"""What every effect declares, once for all of them; no kernel runs here."""

import dataclasses
import inspect
import math
import pickle
import re

import pytest

from solver.assets import asset_path
from solver.effects import EFFECTS, SetUpEffect, Telltale, body_effects, contact_effects, set_up_effects
from solver.effects.columns import COLUMNS, COUPLE, KEPT, MEMORY, effect_table, kernel_effects
from solver.params import UNITS, ParameterError, declared
from solver.scenes.material_file import load_material, scene_from, with_set_up
from solver.scenes.scene import actual, parameters, value, with_values
from solver.toml_file import read_toml
from tests.solver.effects.cases import FELT, felt, scene_with, with_effects

SCENE = load_material("sunflower_extract")
DENSE = '[effect.rolling_resistance]\nrolling_friction = 0.05\n[effect.plate_tilt]\ntilt_x = "2deg"\n'


@pytest.mark.parametrize("name", EFFECTS)
def test_the_text_names_formula_limit_and_where_it_comes_from(name):
    text = inspect.getmodule(EFFECTS[name]).__doc__
    assert "anish" in text, "the limit in which it is not there"
    assert len(text.splitlines()) >= 5
    known = ("Source:", "→", "exact")  # a source, or the derivation of a change of the set-up
    assert any(word in text for word in known)
    if not issubclass(EFFECTS[name], SetUpEffect):
        assert re.search(r"Source: .*\d{4}|Source: LIGGGHTS|Source: as ``", text)


@pytest.mark.parametrize("name", EFFECTS)
def test_class_and_parameters_are_complete(name):
    kind = EFFECTS[name]
    fields = {field.name for field in dataclasses.fields(kind)}
    assert set(FELT[name]) == fields
    assert kind.name == name
    assert set(kind.amplitudes) <= fields
    assert kind.__doc__
    for text in (kind.literature, kind.lever):
        assert len(text) > 10
    assert kind.telltales
    assert set(kind.telltales) <= set(Telltale)
    for path, parameter in declared(kind, name).items():
        assert parameter.unit in UNITS, path
        assert parameter.low < parameter.high < float("inf"), path
        assert parameter.doc.endswith("."), path
        assert parameter.low <= getattr(kind(), path.split(".")[1]) <= parameter.high, path
        # What acts in a kernel can be changed while it runs.
        assert parameter.live == (not issubclass(kind, SetUpEffect)), path
    for amplitude in kind.amplitudes:
        parameter = declared(kind, name)[f"{name}.{amplitude}"]
        assert parameter.low <= 0.0 < kind.strongest <= parameter.high


@pytest.mark.parametrize("name", EFFECTS)
def test_off_it_leaves_no_trace_in_the_scene(name):
    effect = EFFECTS[name]()
    assert not effect.on
    assert felt(name).on
    assert SCENE.with_effect(effect) == SCENE
    assert with_effects(SCENE, felt(name)).without_effect(name) == SCENE
    assert actual(SCENE) is SCENE
    if isinstance(effect, SetUpEffect):
        assert effect.applied(SCENE) == SCENE


@pytest.mark.parametrize("name", EFFECTS)
def test_parameters_go_round_by_their_paths(name):
    scene = SCENE
    for key, number in FELT[name].items():
        path = f"effect.{name}.{key}"
        assert path in parameters(scene)
        scene = with_values(scene, {path: number})
        assert value(scene, path) == number
        beyond = 2.0 * parameters(scene)[path].high
        with pytest.raises(ParameterError, match=rf"{path}: .* is outside"):
            with_values(scene, {path: beyond})
    assert scene == with_effects(SCENE, felt(name))
    assert scene != SCENE
    again = pickle.loads(pickle.dumps(scene))
    assert again == scene
    assert hash(again) == hash(scene)
    back = with_values(scene, {f"effect.{name}.{key}": getattr(EFFECTS[name](), key) for key in FELT[name]})
    assert back == SCENE


@pytest.mark.parametrize("kind", set_up_effects())
def test_every_parameter_of_the_set_up_acts_and_is_carried_out_once(kind):
    scene = with_effects(SCENE, felt(kind.name))
    done = actual(scene)
    assert not done.effects
    assert actual(done) is done
    for key, number in FELT[kind.name].items():
        other = actual(with_effects(SCENE, felt(kind.name, **{key: 1.1 * number})))
        assert other != done


def test_the_order_of_effects_does_not_matter():
    there = with_effects(SCENE, *(felt(name) for name in EFFECTS))
    back = with_effects(SCENE, *(felt(name) for name in reversed(tuple(EFFECTS))))
    assert there == back
    assert [effect.name for effect in there.effects] == list(EFFECTS)


def test_tables_of_a_material_file(tmp_path):
    original = asset_path("materials", "sunflower_extract")
    path = tmp_path / "moist.toml"
    path.write_text(original.read_text() + "\n" + DENSE)
    scene = load_material(str(path))
    assert value(scene, "effect.rolling_resistance.rolling_friction") == 0.05
    assert value(scene, "effect.plate_tilt.tilt_x") == 2.0
    assert [effect.name for effect in scene.effects] == ["rolling_resistance", "plate_tilt"]
    assert kernel_effects(scene)


@pytest.mark.parametrize(
    ("table", "message"),
    [
        ({"rolling": {"rolling_friction": 0.1}}, r"effect\.rolling\.rolling_friction: no such parameter"),
        ({"rolling_resistance": {"friction": 0.1}}, r"effect\.rolling_resistance\.friction: no such parameter"),
        ({"rolling_resistance": 0.1}, r"effect\.rolling_resistance: no such parameter"),
        ({"rolling_resistance": {"rolling_friction": -1}}, r"effect\.rolling_resistance\.rolling_friction: -1 is out"),
        ({"adhesion_jkr": {"work_of_adhesion": "2MPa"}}, r"work_of_adhesion: unit 'MPa' is not one of J/m2, mJ/m2"),
        ([1], r"effect: a table is needed"),
    ],
)
def test_a_wrong_table_is_told_in_one_line(table, message):
    with pytest.raises(ParameterError, match=message) as told:
        with_set_up(SCENE, {"effect": table})
    assert "\n" not in str(told.value)


def test_a_table_of_effects_is_known_to_material_files():
    table = read_toml(asset_path("materials", "sunflower_extract")) | {"effect": {"density_error": {"excess": 0.1}}}
    assert scene_from(table, asset_path("materials", "sunflower_extract")).effect("density_error").on


RECKONED = {"capillary_bridge": (0.3 * math.cos(0.3), 1e-9, 1.15)}
"""What a kernel reads where it is not the parameters themselves (θ = 0.3 rad): γ cos θ, V, 1 + θ/2."""


def test_columns_of_kernel_and_tables_agree():
    """Each effect's parameters stand in its own columns, of the pairs of classes on which it acts."""
    for k, kind in enumerate((*contact_effects(), *body_effects())):
        effect = felt(kind.name)
        table = effect_table(scene_with(effect), ("wall",))
        assert table.shape == (2, 2, COLUMNS[-1] + 1)
        mine = table[:, :, COLUMNS[k] : COLUMNS[k + 1]]
        others = table[:, :, : COLUMNS[-1]].copy()
        others[:, :, COLUMNS[k] : COLUMNS[k + 1]] = 0.0
        assert not others.any()
        read = RECKONED.get(kind.name, effect.numbers)
        assert mine[0, 1] == pytest.approx(read)
        among = (0.0,) if kind.name == "wall_adhesion" else read
        assert mine[0, 0] == pytest.approx(among)
        assert (table[0, :, -1] == 0.6).all()
    assert MEMORY[-1] == COUPLE
    assert KEPT == COUPLE + 4
    assert sum(kind.memory for kind in contact_effects()) == COUPLE


def test_contact_effects_stand_in_the_order_of_their_stages():
    stages = [kind.stage for kind in contact_effects()]
    assert stages == sorted(stages)
    assert len(stages) + len(body_effects()) + len(set_up_effects()) == len(EFFECTS)
