"""Single measured files: what is drawn of them, and what is refused in one line."""

import io

import numpy as np
import pytest

from explorer.errors import CommandError
from explorer.files.measured_curves import FARTHEST, measured_curves, measured_file
from solver.assets import asset_path, measurement_folder

SCAN = measurement_folder("trefoil_1") / "piles" / "fit_1.npz"


def npz(**arrays):
    packed = io.BytesIO()
    np.savez_compressed(packed, **arrays)
    return packed.getvalue()


def test_a_scan_by_itself_is_drawn_as_in_its_data_set():
    alone, among = measured_file("my pile.NPZ", SCAN.read_bytes()), measured_curves("trefoil_1")["fit: scan 1"]
    np.testing.assert_array_equal(alone.u, among.u)
    np.testing.assert_array_equal(alone.z, among.z)
    assert alone.flanks == among.flanks
    assert alone.name == "my pile.NPZ"


def test_the_points_of_an_outline_are_drawn_from_left_to_right():
    curve = measured_file("photo.csv", b"# traced by hand\nu_m, z_m\n0.02,0.0\n-0.02,0\n\n0.0,0.01\n")
    assert curve.u.tolist() == [-0.02, 0.0, 0.02]
    assert curve.z.tolist() == [0.0, 0.01, 0.0]


@pytest.mark.parametrize(
    ("name", "content", "words"),
    [
        ("a.csv", b"", "0 bytes"),
        ("a.txt", b"u_m,z_m\n", "ending in .npz, .csv"),
        ("a.csv", b"x,y\n0,0\n1,1\n", "u_m,z_m"),
        ("a.csv", b"u_m,z_m\n0,0\n", "1 points"),
        ("a.csv", b"u_m,z_m\n0,0\n1\n", "u_m,z_m"),
        ("a.csv", b"u_m,z_m\n0,zero\n", "line 2, column z_m: 'zero'"),
        ("a.csv", b"u_m,z_m\n0,nan\n0,1\n", "line 2, column z_m: 'nan'; allowed: a finite number in m"),
        ("a.csv", b"# nothing else\n", "u_m,z_m"),
        ("a.csv", b"a\0", "not a text file"),
        ("a.npz", b"no archive", "cannot be read as .npz"),
        ("a.npz", SCAN.read_bytes()[:-99], "cannot be read as .npz"),
        ("a.npz", npz(xyz=np.zeros((2, 3))), "xyz, radius"),
        ("a.npz", npz(xyz=np.zeros((2, 3)), radius=np.ones(3)), "shapes"),
        ("a.npz", npz(xyz=np.zeros((0, 3)), radius=np.ones(0)), "shapes"),
        ("a.npz", npz(xyz=np.zeros((1, 3)), radius=np.zeros(1)), "must be positive"),
        ("a.npz", npz(xyz=np.full((1, 3), 2 * FARTHEST), radius=np.ones(1)), "beyond 2 m"),
        ("a.npz", npz(xyz=np.full((1, 3), np.nan), radius=np.ones(1)), "not finite"),
        ("a.npz", npz(xyz=np.array([["a", "b", "c"]]), radius=np.ones(1)), "plain arrays"),
        ("a.npz", npz(xyz=np.array([[{}, 1, 2]], dtype=object), radius=np.ones(1)), "plain arrays"),
        ("a.npz", npz(xyz=np.zeros((9_000_000, 1)), radius=np.ones(1)), "unpacked; allowed"),
    ],
)
def test_a_bad_file_is_refused_in_one_line(name, content, words):
    with pytest.raises(CommandError, match=words) as refused:
        measured_file(name, content)
    assert str(refused.value).startswith(f"{name}: ")
    assert "\n" not in str(refused.value)


def test_a_photograph_lies_over_the_pile_in_metres():
    """A rendered cone of 25° on the left and 30° on the right, 200 px high."""
    picture = asset_path("photographs", "cone_25_30").read_bytes()
    curve = measured_file("cone.jpg", picture, 0.25e-3)
    left, right = (flank.angle_deg for flank in curve.flanks)
    assert (left, right) == (pytest.approx(25.0, abs=0.5), pytest.approx(30.0, abs=0.5))
    assert curve.name.startswith("cone.jpg: 27.")
    assert curve.z.max() == pytest.approx(0.25e-3 * 200, rel=0.03)
    with pytest.raises(CommandError, match=r"^cone\.jpg: a photograph needs its scale"):
        measured_file("cone.jpg", picture)
    with pytest.raises(CommandError, match=r"^bad\.png: not a picture"):
        measured_file("bad.png", b"nothing", 1e-3)
