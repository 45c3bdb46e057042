"""Fits on disk: the same bits as a new fit, and never a reason to fail."""

import numpy as np
import pytest
import trimesh

from solver.shapes.clump import kept_fit
from solver.shapes.clump_error import ClumpFit
from solver.shapes.solid import Solid

SEED = Solid("ellipsoid", (27.5e-3, 11.5e-3, 6.5e-3))
"""Not one of the shipped bodies, whose fits are shipped."""
QUALITY = ClumpFit(2, 0.9, 0.8, 1.1e-4, 3.3e-4, (0.01, -0.02, 1.0 / 3.0), 1.0 / 7.0)


class Fitter:
    """Counts how often it is asked; every fit is another one."""

    def __init__(self):
        self.asked = 0

    def __call__(self, solid, spheres):
        self.asked += 1
        rng = np.random.default_rng(self.asked)
        return rng.random((2, 3)), rng.random(2), QUALITY


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.setenv("REPOSE_CACHE", str(tmp_path / "kept"))
    return tmp_path / "kept"


def test_a_fit_comes_back_bit_for_bit(folder):
    fitter = Fitter()
    first, second = kept_fit(SEED, "coarse", fitter), kept_fit(SEED, "coarse", fitter)
    assert fitter.asked == 1
    np.testing.assert_array_equal(first[0], second[0])
    np.testing.assert_array_equal(first[1], second[1])
    assert first[2] == second[2] == QUALITY
    assert [path.suffix for path in folder.iterdir()] == [".npz"]


def test_another_solid_or_number_is_another_fit(folder):
    fitter = Fitter()
    kept_fit(SEED, "coarse", fitter)
    kept_fit(SEED, "12", fitter)
    kept_fit(Solid("ellipsoid", (27.5e-3, 11.5e-3, 6.6e-3)), "coarse", fitter)
    kept_fit(Solid("box", SEED.dimensions), "coarse", fitter)
    assert fitter.asked == 4


def test_a_mesh_is_known_by_its_contents(folder, tmp_path):
    fitter = Fitter()
    file = tmp_path / "body.stl"
    for size in (0.01, 0.02, 0.02):
        trimesh.creation.box((size, size, size)).export(file)
        kept_fit(Solid("mesh", file=str(file)), "8", fitter)
    assert fitter.asked == 2


@pytest.mark.parametrize("spoil", [b"", b"no archive", b"PK\x03\x04 cut"])
def test_a_spoilt_file_is_replaced(folder, spoil):
    fitter = Fitter()
    kept_fit(SEED, "coarse", fitter)
    (kept,) = folder.iterdir()
    kept.write_bytes(spoil)
    again = kept_fit(SEED, "coarse", fitter)
    assert fitter.asked == 2
    np.testing.assert_array_equal(again[0], kept_fit(SEED, "coarse", fitter)[0])
    assert fitter.asked == 2


def test_without_a_folder_it_fits_every_time(tmp_path, monkeypatch):
    (tmp_path / "file").write_text("")
    monkeypatch.setenv("REPOSE_CACHE", str(tmp_path / "file" / "below"))
    fitter = Fitter()
    kept_fit(SEED, "coarse", fitter)
    kept_fit(SEED, "coarse", fitter)
    assert fitter.asked == 2


def test_whoever_shares_the_folder_may_read_a_fit_and_half_a_fit_is_not_left(folder, monkeypatch):
    kept_fit(SEED, "coarse", Fitter())
    (path,) = folder.rglob("*.npz")
    assert path.stat().st_mode & 0o044 == 0o044

    def full(*_, **__):
        raise OSError("no space left on device")

    monkeypatch.setattr(np, "savez", full)
    kept_fit(SEED, "standard", Fitter())
    assert [one for one in folder.rglob("*") if one.is_file()] == [path]
