"""What Taichi says of a kernel that it cannot compile."""

from pathlib import Path

import pytest
import taichi as ti


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
