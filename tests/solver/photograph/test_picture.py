"""Picture files in: formats, orientation, depth, transparency, and every bad file in one line."""

import io
import struct

import numpy as np
import pytest
from PIL import Image, ImageOps

from solver.photograph import PhotographError, open_picture
from solver.photograph.picture import LONGEST, MOST_PIXELS


def ramp(columns=80, rows=40):
    return np.broadcast_to(np.linspace(0, 255, columns).round().astype(np.uint8), (rows, columns))


@pytest.mark.parametrize(("suffix", "tolerance"), [("png", 0), ("tif", 0), ("bmp", 0), ("jpg", 6), ("webp", 12)])
def test_formats(tmp_path, suffix, tolerance):
    # Lossless ones give the levels back; JPEG and WebP round within blocks.
    path = tmp_path / f"a.{suffix}"
    Image.fromarray(ramp()).save(path)
    picture = open_picture(path)
    assert (picture.width, picture.height, picture.reduced) == (80, 40, 1)
    np.testing.assert_allclose(picture.grey, ramp(), atol=tolerance)


def test_the_contents_decide_and_not_the_name(tmp_path):
    file = io.BytesIO()
    Image.fromarray(ramp()).save(file, "PNG")
    path = tmp_path / "a.jpg"
    path.write_bytes(file.getvalue())
    np.testing.assert_array_equal(open_picture(path).grey, ramp())


def test_the_noted_orientation_is_applied(tmp_path):
    exif = Image.Exif()
    exif[0x0112] = 6  # to be turned a quarter clockwise
    path = tmp_path / "a.png"
    Image.fromarray(ramp()).save(path, exif=exif)
    np.testing.assert_array_equal(open_picture(path).grey, np.rot90(ramp(), -1))


def test_sixteen_bits_have_the_same_white(tmp_path):
    path = tmp_path / "a.png"
    Image.fromarray(ramp().astype(np.uint16) * 257).save(path)
    np.testing.assert_allclose(open_picture(path).grey, ramp(), atol=1e-3)  # single precision


def test_a_sensor_of_twelve_bits_has_its_own_white(tmp_path):
    path = tmp_path / "a.tif"
    Image.fromarray(np.round(ramp() * (4095 / 255)).astype(np.uint16)).save(path)
    np.testing.assert_allclose(open_picture(path).grey, ramp(), atol=0.04)  # half a level of 4095


def test_transparent_is_white(tmp_path):
    path = tmp_path / "a.png"
    Image.new("RGBA", (40, 40), (0, 0, 0, 0)).save(path)
    assert (open_picture(path).grey == 255).all()


def test_a_large_picture_is_reduced_and_keeps_its_coordinates(tmp_path):
    path = tmp_path / "a.png"
    levels = np.zeros((200, LONGEST + 601), dtype=np.uint8)
    levels[:, 1500:1502] = 255
    Image.fromarray(levels).save(path)
    picture = open_picture(path)
    assert picture.reduced == 2
    bright = np.array([float(picture.grey[50].argmax())])
    # The two bright columns are one reduced pixel, whose middle lies between them.
    assert picture.place(bright)[0] == 1500.5
    assert picture.index(picture.place(bright)) == pytest.approx(bright)


def png_of(columns, rows):
    """A PNG of one bit per pixel: small as a file, whatever its size."""
    file = io.BytesIO()
    Image.new("1", (columns, rows)).save(file, "PNG")
    return file.getvalue()


def noise_png():
    """A PNG that cannot be compressed."""
    file = io.BytesIO()
    Image.fromarray(np.random.default_rng(0).integers(0, 256, (100, 100), dtype=np.uint8)).save(file, "PNG")
    return file.getvalue()


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (b"", ["0 bytes"]),
        (b"not a picture at all", ["not a picture", "JPEG, PNG"]),
        (noise_png()[:3000], ["cannot be decoded"]),
        (png_of(10, 100), ["10 × 100 px", "32 px"]),
        (png_of(10_000, 10_000), ["100 megapixels", "up to 60", "scale"]),
        (png_of(20_000, 10_000), ["up to 60 megapixels"]),
    ],
    ids=["empty", "text", "cut off", "tiny", "too large", "bomb"],
)
def test_a_bad_file_is_one_line(tmp_path, content, words):
    path = tmp_path / "a.png"
    path.write_bytes(content)
    with pytest.raises(PhotographError) as error:
        open_picture(path)
    text = str(error.value)
    assert "\n" not in text
    assert all(word in text for word in [str(path), *words]), text


def test_a_missing_file_and_a_folder_are_refused(tmp_path):
    for path in (tmp_path / "nothing.png", tmp_path):
        with pytest.raises(PhotographError, match="no such file"):
            open_picture(path)


def test_the_limit_is_above_a_camera_of_fifty_megapixels():
    assert 8160 * 6120 < MOST_PIXELS < 100_000_000


@pytest.mark.parametrize("orientation", range(1, 9))
def test_every_orientation_is_set_upright_even_beside_a_text_in_the_place_of_a_number(orientation, tmp_path):
    """A resolution written as text made Pillow's own turning fail with a traceback."""
    # A TIFF block of two entries: orientation, a short, and the horizontal resolution, a text at the end.
    entries = struct.pack("<HHHIIHHII", 2, 0x0112, 3, 1, orientation, 0x011A, 2, 12, 38)
    exif = b"Exif\0\0" + b"II*\0\x08\0\0\0" + entries + b"\0\0\0\0" + b"seventy-two\0"
    path, levels = tmp_path / "turned.png", np.arange(120 * 160, dtype=np.uint32).reshape(120, 160) % 251
    image = Image.fromarray(levels.astype(np.uint8))
    image.save(path, exif=exif)
    plain = Image.Exif()
    plain[0x0112] = orientation
    image.save(tmp_path / "plain.png", exif=plain)
    with Image.open(tmp_path / "plain.png") as known:
        expected = np.asarray(ImageOps.exif_transpose(known), dtype=np.float32)
    assert np.array_equal(open_picture(path).grey, expected)
