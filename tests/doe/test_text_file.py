"""Files that people bring: what is read, and the one line for what is not."""

import re

import pytest

from doe.text_file import read_text


def wrong(path, most=100):
    with pytest.raises(ValueError, match=re.escape(str(path))) as caught:
        read_text(path, most, ValueError)
    return str(caught.value)


@pytest.mark.parametrize("content", [b"a,b\n1,2\n", b"\xef\xbb\xbfa,b\n1,2\n", b"a,b\r\n1,2\r\n"])
def test_a_mark_and_foreign_line_ends_are_taken_off(tmp_path, content):
    (tmp_path / "t.csv").write_bytes(content)
    assert read_text(tmp_path / "t.csv", 100, ValueError) == "a,b\n1,2\n"


@pytest.mark.parametrize("content", [b"a\xff", b"a\0b", "a,b".encode("utf-16")])
def test_what_is_no_text(tmp_path, content):
    path = tmp_path / "t.csv"
    path.write_bytes(content)
    assert wrong(path) == f"{path}: not a text file in UTF-8; a spreadsheet saves one as CSV UTF-8"


def test_too_large_missing_and_a_folder(tmp_path):
    path = tmp_path / "t.csv"
    path.write_text("x" * 101)
    assert wrong(path) == f"{path}: 101 bytes; allowed: up to 100"
    assert wrong(tmp_path / "none") == f"{tmp_path / 'none'}: no such file"
    assert wrong(tmp_path, most=10**6) == f"{tmp_path}: Is a directory"
