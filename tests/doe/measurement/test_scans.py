"""Scans of a made-up surface in every format: the same heights, on the plate and about the axis."""

import numpy as np
import pytest
import trimesh
from PIL import Image

from doe.errors import MeasurementError
from doe.measurement.piles import pile_files
from doe.measurement.scans import (
    Scan,
    ScanSettings,
    found_plate,
    read_scan,
    scan_files,
    spacing,
)
from solver import Frame, ParameterError, checked, coarsened, surface_features, without_holes

FRAME = Frame(radius=0.03, thickness=0.006)
GRID, NOISE = 0.5e-3, 0.02e-3
SLOPE, BASE = 0.45, 0.04
AXIS = (0.011, -0.007)
TILT = (0.05, 0.02, -0.01)
AXIS_TABLE = list(AXIS)


def cone(x, y):
    return SLOPE * np.maximum(0.0, BASE - np.hypot(x, y))


def made_up(half_width=0.08):
    """Places (n,) [m] of a square grid and heights (n, n) of a cone about the axis, on the plate z = 0."""
    axis = np.arange(-half_width, half_width, GRID) + 0.5 * GRID
    x, y = np.meshgrid(axis, axis, indexing="ij")
    rng = np.random.default_rng(1)
    return axis, cone(x - AXIS[0], y - AXIS[1]) + NOISE * rng.standard_normal(x.shape)


def points(tilt=(0.0, 0.0, 0.0)):
    axis, height = made_up()
    x, y = np.meshgrid(axis, axis, indexing="ij")
    z = height + tilt[0] + tilt[1] * x + tilt[2] * y
    return np.stack([x, y, z], axis=-1).reshape(-1, 3)


def volume_and_skew(scan):
    found = surface_features(without_holes(coarsened(scan.height_map(0.0600, GRID), 3)), FRAME)
    return found["ring_volume_m3"], found["skew_x_m"], found["skew_y_m"]


CONE_VOLUME = np.pi * SLOPE * BASE**3 / 3.0


def write(path, places, unit):
    if path.suffix == ".ply":
        trimesh.PointCloud(places / unit).export(path)
    elif path.suffix == ".stl":
        n = round(len(places) ** 0.5)
        corner = np.arange(n * n).reshape(n, n)
        a, b, c, d = corner[:-1, :-1], corner[1:, :-1], corner[1:, 1:], corner[:-1, 1:]
        faces = np.concatenate([np.stack([a, b, c], -1).reshape(-1, 3), np.stack([a, c, d], -1).reshape(-1, 3)])
        trimesh.Trimesh(places / unit, faces, process=False).export(path)
    elif path.suffix == ".csv":
        np.savetxt(path, places / unit, delimiter=",", header="x,y,z", comments="", fmt="%.6f")
    else:
        np.savetxt(path, places / unit, fmt="%.6f")


@pytest.mark.parametrize("name", ["scan.ply", "scan.stl", "scan.xyz", "scan.csv"])
def test_points_and_surfaces_give_the_cone(tmp_path, name):
    """Volume within 1 % (pixels, noise), the axis as stated, the tilted plate found: 0.1 mm over the scan."""
    path = tmp_path / name
    write(path, points(TILT), 1e-3)
    scan = read_scan(path, ScanSettings(unit="mm", axis=AXIS))
    volume, x, y = volume_and_skew(scan)
    assert volume == pytest.approx(CONE_VOLUME, rel=0.01)
    assert abs(x) < 0.2e-3
    assert abs(y) < 0.2e-3
    assert scan.grid == pytest.approx(GRID, rel=0.05)


def test_arrays_and_images_give_the_cone(tmp_path):
    axis, height = made_up()
    np.savez(tmp_path / "scan.npz", height=height, x=axis, y=axis)
    step = 1e-5
    counts = np.clip(np.rint((height + 1e-3) / step), 1, 65535).astype(np.uint16)
    # A row per y from +y down, a column per x.
    Image.fromarray(counts.T[::-1]).save(tmp_path / "scan.tif")
    for name, settings in (
        ("scan.npz", ScanSettings(axis=AXIS)),
        ("scan.tif", ScanSettings(axis=AXIS, pixel=GRID, step=step)),
    ):
        volume, x, y = volume_and_skew(read_scan(tmp_path / name, settings))
        assert volume == pytest.approx(CONE_VOLUME, rel=0.01)
        assert max(abs(x), abs(y)) < 0.2e-3


def test_shadows_are_filled_with_what_stands_at_their_distance(tmp_path):
    """A third of the points of one quarter is missing: the volume stays within 1 %."""
    places = points()
    rng = np.random.default_rng(2)
    seen = ~((places[:, 0] > AXIS[0]) & (places[:, 1] > AXIS[1]) & (rng.random(len(places)) < 0.33))
    write(tmp_path / "scan.xyz", places[seen], 1.0)
    volume, _, _ = volume_and_skew(read_scan(tmp_path / "scan.xyz", ScanSettings(axis=AXIS)))
    assert volume == pytest.approx(CONE_VOLUME, rel=0.01)


def test_without_an_axis_the_centre_of_the_volume_stands_for_it(tmp_path):
    write(tmp_path / "scan.xyz", points(), 1.0)
    scan = read_scan(tmp_path / "scan.xyz", ScanSettings())
    assert scan.axis is None
    _, x, y = volume_and_skew(scan)
    assert max(abs(x), abs(y)) < 0.2e-3


def test_a_plate_that_lies_higher_is_found():
    places = points((0.003, 0.0, 0.0))
    assert found_plate(places) == pytest.approx((0.003, 0.0, 0.0), abs=0.02e-3)


def test_a_stated_plate_is_taken_and_heights_are_those_along_its_normal(tmp_path):
    """2 mm above z = 0.001 + 0.75 x are 2 mm · 4/5 along the normal of this plane, which no bare plate shows."""
    x, y = (axis.ravel() for axis in np.meshgrid(np.arange(20.0), np.arange(20.0)))
    places = np.column_stack([1e-3 * x, 1e-3 * y, 0.001 + 0.75e-3 * x + 0.002])
    write(tmp_path / "scan.xyz", places, 1.0)
    scan = read_scan(tmp_path / "scan.xyz", ScanSettings(plate=(0.001, 0.75, 0.0), axis=(0.0, 0.0)))
    # Written with six digits behind the point.
    assert scan.points[:, 2] == pytest.approx(0.0016, abs=1e-6)
    assert scan.points[:, :2] == pytest.approx(places[:, :2], abs=1e-6)


def test_a_tilted_plate_is_found_beside_a_large_pile():
    """The bare plate is half of the scan; the plane is found to a tenth of the noise."""
    a, b, c = found_plate(points(TILT))
    x, y = np.array([-0.08, 0.08]), np.array([0.08, -0.08])
    assert a + b * x + c * y == pytest.approx(TILT[0] + TILT[1] * x + TILT[2] * y, abs=NOISE)


def test_only_the_upper_surface_counts():
    """Points of an underside a body's thickness below change nothing."""
    top = points()
    both = np.concatenate([top, top - [0.0, 0.0, 0.006]])
    one, other = (Scan(places, GRID, True).height_map(FRAME.half_width, GRID).height for places in (top, both))
    assert np.array_equal(one, other, equal_nan=True)


def test_settings_are_read_with_their_units():
    found = checked(
        ScanSettings,
        {"unit": "mm", "pixel": "0.5mm", "axis": AXIS_TABLE, "plate": [0.0, 0, 0], "noise": "0.1mm"},
        "scan",
    )
    assert found.unit == "mm"
    assert found.pixel == pytest.approx(0.5e-3)
    assert found.axis == AXIS
    assert found.plate == (0.0, 0.0, 0.0)


@pytest.mark.parametrize(
    ("table", "line"),
    [
        ({"unit": "inch"}, r"scan\.unit: 'inch'; allowed: m, cm, mm, um"),
        ({"axis": [1.0]}, r"scan\.axis: \[1\.0\]; allowed: a list of 2 numbers"),
        ({"pixel": -1.0}, r"scan\.pixel: -1 m; allowed: more than 0"),
    ],
)
def test_settings_that_cannot_be_are_refused(table, line):
    with pytest.raises(ParameterError, match=line):
        checked(ScanSettings, table, "scan")


def test_files_belong_to_conditions_and_replicates(tmp_path):
    folder = tmp_path / "scans"
    folder.mkdir()
    for name in ("slow_1.ply", "slow_2.xyz", "fast_1.doc", "other_1.ply", "slow_0.ply"):
        (folder / name).touch()
    found, strangers = scan_files(tmp_path, ["slow", "fast"])
    assert {key: sorted(value) for key, value in found.items()} == {"slow": [1, 2], "fast": []}
    assert sorted(path.name for path in strangers) == ["fast_1.doc", "other_1.ply", "slow_0.ply"]
    (folder / "slow_1.xyz").touch()
    with pytest.raises(MeasurementError, match="replicate 1 has more than one scan"):
        scan_files(tmp_path, ["slow"])


def test_a_pile_belongs_to_one_replicate(tmp_path):
    folder = tmp_path / "piles"
    folder.mkdir()
    (folder / "slow_01.npz").touch()
    assert pile_files(tmp_path, ["slow"])[0]["slow"] == {1: folder / "slow_01.npz"}
    (folder / "slow_1.npz").touch()
    with pytest.raises(MeasurementError, match="replicate 1 has more than one scan"):
        pile_files(tmp_path, ["slow"])


@pytest.mark.parametrize("head", ["", "x{0}y{0}z\n"])
@pytest.mark.parametrize("encoding", ["utf-8", "utf-16"])
@pytest.mark.parametrize(
    ("name", "between", "decimal"),
    [
        ("scan.csv", ";", ","),
        ("scan.csv", "; ", "."),
        ("scan.txt", "\t", ","),
        ("scan.xyz", " ", ","),
        ("scan.csv", ",", "."),
        ("scan.txt", ", ", "."),
    ],
)
def test_a_comma_is_decimal_where_something_else_divides_the_cells(tmp_path, name, between, decimal, head, encoding):
    axis = np.arange(-10, 10) + 0.5
    x, y = np.meshgrid(axis, axis)
    places = np.stack([x, y, np.maximum(0.0, 5.25 - np.hypot(x, y))], axis=-1).reshape(-1, 3)
    rows = [between.join(f"{number:.3f}".replace(".", decimal) for number in row) for row in places]
    path = tmp_path / name
    path.write_bytes((head.format(between) + "\n".join(rows) + "\n").encode(encoding))
    scan = read_scan(path, ScanSettings(unit="mm", axis=(0.0, 0.0), plate=(0.0, 0.0, 0.0)))
    assert 1e3 * scan.points == pytest.approx(np.round(places, 3), abs=1e-9)


@pytest.mark.parametrize("head", ["x,y,z,note\n", ""])
def test_commas_divide_the_cells_of_a_row_with_blanks_in_its_last_one(tmp_path, head):
    path = tmp_path / "scan.csv"
    path.write_text(head + "".join(f"{x},{y},{x * y},a note\n" for x in range(20) for y in range(20)))
    scan = read_scan(path, ScanSettings(axis=(0.0, 0.0), plate=(0.0, 0.0, 0.0)))
    assert scan.points[43].tolist() == [2.0, 3.0, 6.0]


@pytest.mark.parametrize(
    ("name", "content", "line"),
    [
        ("scan.xyz", b"\0\0", "not a text file"),
        ("scan.ply", b"no surface", "cannot be read"),
        ("scan.xyz", b"1 2 3\n", "1 finite points; allowed: 200"),
        ("scan.csv", b"x,y,z\na,b,c\n", "no table of x, y, z"),
        ("scan.npz", b"PK", "cannot be read as"),
        ("scan.tif", b"II*", "cannot be read as an image"),
    ],
)
def test_a_file_that_is_none_is_refused_in_one_line(tmp_path, name, content, line):
    path = tmp_path / name
    path.write_bytes(content)
    with pytest.raises(MeasurementError, match=line) as refused:
        read_scan(path, ScanSettings(pixel=1e-3, step=1e-5))
    assert str(refused.value).startswith(str(path))
    assert "\n" not in str(refused.value)


def test_an_image_of_far_too_many_pixels_is_refused_before_it_is_read(tmp_path, monkeypatch):
    Image.fromarray(np.zeros((30, 30), dtype=np.uint16)).save(tmp_path / "scan.tif")
    monkeypatch.setattr(Image, "MAX_IMAGE_PIXELS", 400)
    with pytest.raises(MeasurementError, match="more than 800 pixels; allowed: up to"):
        read_scan(tmp_path / "scan.tif", ScanSettings(pixel=1e-3, step=1e-5))


def test_a_scan_without_a_bare_plate_asks_for_the_plane():
    rng = np.random.default_rng(0)
    steep = np.column_stack([rng.random((5000, 2)) * 0.1, rng.random(5000) * 0.1])
    with pytest.raises(MeasurementError, match="no bare plate found"):
        found_plate(steep)


@pytest.mark.parametrize("jitter", [0.2, None])
def test_points_that_are_no_grid_are_read_without_a_shift(jitter):
    """A point per mm², jittered or at random. Cells of the nearest distance read the cone 0.3 and 1 mm too low."""
    rng = np.random.default_rng(2)
    n = 120
    places = rng.uniform(-0.06, 0.06, (n * n, 2))
    if jitter is not None:
        axis = (np.arange(n) + 0.5) * 1e-3 - 0.06
        places = np.stack(np.meshgrid(axis, axis), axis=-1).reshape(-1, 2)
        places = places + rng.normal(0.0, jitter * 1e-3, places.shape)
    cloud = np.column_stack([places, cone(*places.T)])
    cell = spacing(cloud)
    assert 1.5e-3 < cell < 3e-3
    surface = without_holes(Scan(cloud, cell, (0.0, 0.0), 0.0, 0.0).height_map(0.05, cell))
    centre = (np.arange(len(surface.height)) + 0.5) * surface.pixel - 0.5 * len(surface.height) * surface.pixel
    x, y = np.meshgrid(centre, centre, indexing="ij")
    off = surface.height - cone(x, y)
    # The flank alone: within a cell the top of the cone and its foot are rounded.
    flank = (np.hypot(x, y) > 2.0 * cell) & (np.hypot(x, y) < BASE - 2.0 * cell)
    assert abs(off[flank].mean()) < 0.1e-3


def test_spacing_of_a_grid_is_that_of_its_points():
    axis = np.arange(30) * 1e-3
    grid = np.stack(np.meshgrid(axis, axis), axis=-1).reshape(-1, 2)
    c, s = np.cos(0.5), np.sin(0.5)
    for places in (grid, grid @ np.array([[c, -s], [s, c]])):
        assert spacing(np.column_stack([places, places[:, 0] ** 2])) == pytest.approx(1e-3)


@pytest.mark.parametrize(("between", "decimal"), [(",", "."), (";", ","), ("\t", "."), ("\t", ",")])
def test_an_empty_cell_is_a_height_that_was_not_seen(tmp_path, between, decimal):
    """Not that in the column after it."""
    rows = [(f"{x}.5", f"{y}.5", "" if x == y else "0.25", "120") for x in range(20) for y in range(20)]
    text = "".join(between.join(row).replace(".", decimal) + "\n" for row in [("x", "y", "z", "intensity"), *rows])
    path = tmp_path / "scan.csv"
    path.write_text(text)
    scan = read_scan(path, ScanSettings(unit="mm", axis=(0.0, 0.0), plate=(0.0, 0.0, 0.0)))
    assert len(scan.points) == 380
    assert scan.points[:, 2].max() == pytest.approx(0.25e-3)


@pytest.mark.parametrize("row", ["{0},{1},{2}\t", "{0},\t{1},\t{2}", "\t{0}\t{1}\t{2}", " {0} , {1} , {2} "])
def test_what_else_stands_between_cells_does_not_matter(tmp_path, row):
    path = tmp_path / "scan.txt"
    path.write_text("".join(row.format(x, y, 0.25 * x) + "\n" for x in range(20) for y in range(20)))
    scan = read_scan(path, ScanSettings(axis=(0.0, 0.0), plate=(0.0, 0.0, 0.0)))
    assert scan.points[43].tolist() == [2.0, 3.0, 0.5]


def test_the_last_corner_may_be_unseen(tmp_path):
    path = tmp_path / "scan.txt"
    rows = [f"{x},5\t{y},5\t{'' if x == y == 19 else '0,25'}\n" for x in range(20) for y in range(20)]
    path.write_text("".join(rows))
    assert len(read_scan(path, ScanSettings(axis=(0.0, 0.0), plate=(0.0, 0.0, 0.0))).points) == 399


def test_an_image_of_real_numbers_is_read(tmp_path):
    path = tmp_path / "scan.tif"
    Image.fromarray(np.full((20, 20), 0.5, dtype=np.float32)).save(path)
    scan = read_scan(path, ScanSettings(pixel=1e-3, step=1e-2, axis=(0.0, 0.0), plate=(0.0, 0.0, 0.0)))
    assert scan.points[:, 2] == pytest.approx(5e-3)


def test_spacing_of_points_that_all_coincide_is_zero():
    assert spacing(np.zeros((300, 3))) == 0.0


def test_a_plate_that_scatters_about_zero_in_an_image_of_real_numbers_keeps_both_sides(tmp_path):
    """Half of its pixels would be unseen otherwise, and the plate lie above zero."""
    path, rng = tmp_path / "scan.tif", np.random.default_rng(5)
    heights = rng.normal(0.0, 1e-4, (60, 60)).astype(np.float32)
    heights[:5, :5] = 0.0
    Image.fromarray(heights).save(path)
    scan = read_scan(path, ScanSettings(pixel=1e-3, step=1.0, axis=(0.0, 0.0), plate=(0.0, 0.0, 0.0)))
    assert len(scan.points) == 60 * 60 - 25
    assert abs(float(scan.points[:, 2].mean())) < 1e-5
