"""What Taichi says of a kernel that it cannot compile, and that it looks for nothing that a kernel printed."""

import sys
from pathlib import Path

import pytest

from solver.backend import _read_once, ti


def test_a_mistake_in_a_kernel_is_named_with_file_and_line(taichi):
    @ti.kernel
    def wrong() -> ti.f64:
        return 2.0 * nowhere_defined  # noqa: F821

    with pytest.raises(ti.TaichiCompilationError) as caught:
        wrong()
    lines = Path(__file__).read_text(encoding="utf-8").splitlines()
    number = 1 + next(k for k, line in enumerate(lines) if "nowhere_defined  #" in line)
    told = str(caught.value)
    assert f'File "{__file__}", line {number}, in wrong:\n' in told
    assert "return 2.0 * nowhere_defined" in told
    assert 'Name "nowhere_defined" is not defined' in told


def test_no_launch_fetches_what_a_kernel_may_have_printed(taichi):
    """Tests, like notebooks, replace standard output, which Taichi takes for a reason to do so after each launch."""
    assert sys.stdout is not sys.__stdout__
    assert not ti.lang.shell.pybuf_enabled


def test_functions_of_one_source_are_read_once_and_others_are_not_mixed_up():
    def made(text, name):
        space = {}
        exec(compile(text, name, "exec"), space)
        return space["f"]

    seen = []
    read = _read_once(lambda function: seen.append(function) or function.__code__.co_filename)
    text = "def f():\n    return 1\n"
    assert [read(made(text, name)) for name in ("a.py", "a.py", "b.py")] == ["a.py", "a.py", "b.py"]
    assert len(seen) == 2
    assert read(made("def f():\n    return 2\n", "a.py")) == "a.py"
    assert len(seen) == 3
