"""The folder of a result is there at once and complete, wherever a person wants it."""

import os
import tomllib
from contextlib import ExitStack
from pathlib import Path

import pytest

from explorer.errors import CommandError
from explorer.files.run_folder import appearing, parameters_text
from explorer.files.run_result import ParameterValue


def made(folder):
    with appearing(folder) as temporary:
        (temporary / "result.json").write_text("{}")
        (temporary / "more").mkdir()
    return sorted(one.name for one in folder.iterdir())


def test_a_folder_that_is_new_or_empty_becomes_the_result(tmp_path):
    (tmp_path / "empty").mkdir()
    for name in ("new", "empty"):
        assert made(tmp_path / name) == ["more", "result.json"]
    assert sorted(one.name for one in tmp_path.iterdir()) == ["empty", "new"]


@pytest.mark.parametrize("there", [True, False])
def test_a_link_leads_to_the_result(tmp_path, there):
    if there:
        (tmp_path / "elsewhere").mkdir()
    (tmp_path / "out").symlink_to("elsewhere")
    assert made(tmp_path / "out") == ["more", "result.json"]
    assert (tmp_path / "out").is_symlink()


def test_a_mounted_folder_is_filled_where_it_is(tmp_path, monkeypatch):
    """As a volume of a container is: it cannot be taken away to make room for another."""

    def busy(self):
        raise OSError(16, "Device or resource busy", str(self))

    monkeypatch.setattr(Path, "rmdir", busy)
    (tmp_path / "volume").mkdir()
    assert made(tmp_path / "volume") == ["more", "result.json"]
    assert [one.name for one in tmp_path.iterdir()] == ["volume"]


def test_an_empty_folder_is_filled_where_nothing_can_be_made_beside_it(tmp_path, monkeypatch):
    (tmp_path / "mine").mkdir()
    monkeypatch.setattr(os, "access", lambda place, mode: place != tmp_path)
    with appearing(tmp_path / "mine") as temporary:
        assert temporary.parent == tmp_path / "mine"
        (temporary / "result.json").write_text("{}")
    assert [one.name for one in (tmp_path / "mine").iterdir()] == ["result.json"]


def test_what_fails_leaves_nothing_and_what_came_meanwhile_is_kept(tmp_path):
    with ExitStack() as stack:
        temporary = stack.enter_context(appearing(tmp_path / "out"))
        (temporary / "result.json").write_text("{}")
        (tmp_path / "out").mkdir()
        (tmp_path / "out" / "theirs").touch()
        with pytest.raises(CommandError, match="is not empty"):
            stack.close()
    assert [one.name for one in (tmp_path / "out").iterdir()] == ["theirs"]
    assert [one.name for one in tmp_path.iterdir()] == ["out"]


def test_parameters_are_toml_whatever_a_file_is_called():
    """JSON writes a character beyond U+FFFF as two halves, which TOML refuses."""
    name, path = "/tmp/\U0001f600 \x7f.stl", "rig.mesh"
    text = parameters_text({path: ParameterValue(name, "1"), "rig.mass": ParameterValue(0.1, "kg")})
    assert tomllib.loads(text) == {path: name, "rig.mass": 0.1}
