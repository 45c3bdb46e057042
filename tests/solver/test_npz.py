"""Archives of arrays: what is damaged, foreign or too large is one error in one line, at every byte."""

import io
import zipfile

import numpy as np
import pytest

from solver.npz import NpzError, npz_arrays


def archive(**arrays):
    buffer = io.BytesIO()
    np.savez_compressed(buffer, **arrays)
    return buffer.getvalue()


WHOLE = archive(x=np.arange(50.0), name=np.array("a"))


def test_arrays_come_back_from_a_file_and_from_its_content(tmp_path):
    path = tmp_path / "a.npz"
    path.write_bytes(WHOLE)
    for source in (path, WHOLE):
        np.testing.assert_array_equal(npz_arrays(source, ("x",))["x"], np.arange(50.0))
        assert set(npz_arrays(source)) == {"x", "name"}
    with pytest.raises(FileNotFoundError):
        npz_arrays(tmp_path / "none.npz")


@pytest.mark.parametrize("change", ["cut", "flip", "zero"])
def test_damage_at_any_byte_is_one_error(change):
    for place in range(len(WHOLE)):
        damaged = bytearray(WHOLE)
        if change == "cut":
            del damaged[place:]
        else:
            damaged[place] = damaged[place] ^ 0xFF if change == "flip" else 0
        try:
            found = npz_arrays(bytes(damaged))
        except NpzError as error:
            assert "\n" not in str(error)  # noqa: PT017
        else:
            assert all(isinstance(array, np.ndarray) for array in found.values())


def test_objects_missing_arrays_and_bombs_are_refused():
    with pytest.raises(NpzError, match="Object arrays cannot be loaded"):
        npz_arrays(archive(x=np.array([{}], dtype=object)))
    with pytest.raises(NpzError, match="array 'y' is missing; allowed: x, y"):
        npz_arrays(WHOLE, ("x", "y"))
    with pytest.raises(NpzError, match=r"^\d+ bytes unpacked; allowed: up to 1000 bytes$"):
        npz_arrays(archive(x=np.zeros(1000)), most=1000)
    bare = io.BytesIO()
    with zipfile.ZipFile(bare, "w") as file:
        file.writestr("x.npy", b"no array")
    with pytest.raises(NpzError, match="plain arrays"):
        npz_arrays(bare.getvalue())
