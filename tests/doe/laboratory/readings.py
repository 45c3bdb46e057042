"""A laboratory's file for a test, and what every refusal of one has in common."""


def written(tmp_path, content, name="readings.csv"):
    path = tmp_path / name
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    return path


def assert_one_line(error, path, words):
    """The refusal is one line that names the file first and holds ``words``."""
    line = str(error)
    assert line.startswith(str(path))
    assert "\n" not in line
    for word in words:
        assert word in line
