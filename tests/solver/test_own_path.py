"""Paths that people name with a tilde."""

from pathlib import Path

import pytest

from solver.assets import AssetNotFoundError, asset_path, own_path


def test_a_tilde_is_the_person_s_folder(monkeypatch, tmp_path):
    monkeypatch.setenv("HOME", str(tmp_path))
    assert own_path("~/a.toml") == tmp_path / "a.toml"
    assert own_path("a~b/c.toml") == Path("a~b/c.toml")


def test_nobody_s_folder_is_no_fault_of_the_program():
    assert own_path("~nobody-of-this-name/a.toml") == Path("~nobody-of-this-name/a.toml")
    with pytest.raises(AssetNotFoundError, match=r"neither a file"):
        asset_path("materials", "~nobody-of-this-name/a.toml")
