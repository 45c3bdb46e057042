"""What Taichi says of a kernel that it cannot compile, and that it looks for nothing that a kernel printed."""

import functools
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
    if sys.stdout is sys.__stdout__:
        pytest.skip("standard output is not replaced (-s)")
    assert not ti.lang.shell.pybuf_enabled


def test_functions_of_one_code_are_read_once_and_others_are_not_mixed_up():
    def made(text):
        space = {"functools": functools}
        exec(compile(text, "a.py", "exec"), space)
        return space

    seen = []
    read = _read_once(lambda function: seen.append(function) or len(seen))
    closures = made("def make(x):\n    def f():\n        return x\n    return f\n")["make"]
    assert [read(closures(x)) for x in (1, 2)] == [1, 1]
    # edited and read again: their codes are equal
    single, double = (made(f"def f():\n    x: {kind} = 1\n    return x\n")["f"] for kind in ("ti.f32", "ti.f64"))
    assert single.__code__ == double.__code__
    assert [read(single), read(double), read(single)] == [2, 3, 2]
    wrapped = "def w(g):\n    @functools.wraps(g)\n    def h():\n        return g()\n    return h\n"
    wrap = made(wrapped)["w"]
    assert [read(wrap(single)), read(wrap(closures(1)))] == [4, 5]
