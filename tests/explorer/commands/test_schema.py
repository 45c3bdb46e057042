"""JSON Schemas of the files: an independent validator takes what is shipped and refuses what the loaders refuse."""

import copy
import json
import tomllib

import jsonschema
import pytest

from explorer.commands.schema import KINDS
from solver import asset_path
from solver.assets import measurement_folder, shipped_assets
from tests.explorer.command_line import explorer, refused


def schema_of(kind):
    result = explorer("schema", kind)
    assert result.exit_code == 0
    return json.loads(result.stdout)


def shipped():
    for folder, kind in (
        ("materials", "material"),
        ("studies", "study"),
        ("presets", "preset"),
        ("designs", "factors"),
    ):
        yield from ((kind, asset_path(folder, name)) for name in shipped_assets(folder))
    for name in ("trefoil_1", "trefoil_2", "granudrum_mcc", "sunflower_extract"):
        folder = measurement_folder(name)
        yield "measurement", folder / "measurement.toml"
        if (folder / "material.toml").is_file():
            yield "material", folder / "material.toml"


SHIPPED = [(kind, path) for kind, path in shipped() if path.suffix == ".toml"]


@pytest.mark.parametrize("kind", KINDS)
def test_every_schema_is_one(kind):
    jsonschema.Draft202012Validator.check_schema(schema_of(kind))


@pytest.mark.parametrize(
    ("kind", "path"), SHIPPED, ids=[f"{kind}-{path.parent.name}-{path.stem}" for kind, path in SHIPPED]
)
def test_shipped_files_are_valid(kind, path):
    jsonschema.validate(tomllib.loads(path.read_text(encoding="utf-8")), schema_of(kind))


@pytest.mark.parametrize(
    ("kind", "folder", "name", "spoil"),
    [
        ("material", "materials", "sunflower_extract", lambda t: t.update(colour=1)),
        ("material", "materials", "sunflower_extract", lambda t: t["body"][0].update(colour=1)),
        ("material", "materials", "sunflower_extract", lambda t: t["materials"]["seed"].update(colour=1)),
        ("material", "materials", "sunflower_extract", lambda t: t.update(rig={"name": "bucket"})),
        ("material", "materials", "sunflower_extract", lambda t: t.update(rig={"outlet_hight": 0.1})),
        ("material", "materials", "sunflower_extract", lambda t: t.pop("pair")),
        ("study", "studies", "sunflower_extract", lambda t: t["factor"][0].pop("low")),
        ("study", "studies", "sunflower_extract", lambda t: t["target"][0].update(n=1)),
        ("study", "studies", "sunflower_extract", lambda t: t["target"][0].update(margin=0.0)),
        ("study", "studies", "sunflower_extract", lambda t: t["profile"]["quick"].update(pilot_runs=1.5)),
        ("study", "studies", "sunflower_extract", lambda t: t.update(screening={"alpha": "near"})),
        ("study", "studies", "sunflower_extract", lambda t: t.update(estimators="angle_of_repose_deg")),
    ],
)
def test_what_a_loader_refuses_is_not_valid(kind, folder, name, spoil):
    table = tomllib.loads(asset_path(folder, name).read_text(encoding="utf-8"))
    schema = schema_of(kind)
    jsonschema.validate(table, schema)
    spoilt = copy.deepcopy(table)
    spoil(spoilt)
    with pytest.raises(jsonschema.ValidationError):
        jsonschema.validate(spoilt, schema)


def test_parameters_come_with_their_meaning_and_unit():
    outlet = schema_of("material")["properties"]["rig"]["properties"]["outlet_height"]
    assert outlet["description"].endswith("[m]")
    assert outlet["type"] == ["number", "string"]


def test_it_is_written_where_asked_and_an_unknown_kind_is_refused(tmp_path):
    assert explorer("schema", "preset", "--out", tmp_path / "preset.json").exit_code == 0
    assert json.loads((tmp_path / "preset.json").read_text()) == schema_of("preset")
    assert "allowed: material, body, study" in refused(explorer("schema", "recipe"))
    lost = tmp_path / "none" / "preset.json"
    assert refused(explorer("schema", "preset", "--out", lost)) == f"--out {lost}: there is no folder {lost.parent}"
