"""Elements of arrays in kernels: a sum is atomic, a quarter of a pour's time for nothing; all else is not."""

import ast
from pathlib import Path

import pytest

import solver

KERNELS = sorted((Path(solver.__file__).parent / "engine/kernels").glob("*.py"))


def atomic_lines(source: str) -> list[int]:
    """Lines with an augmented assignment to an element of an array."""
    nodes = ast.walk(ast.parse(source))
    return [n.lineno for n in nodes if isinstance(n, ast.AugAssign) and isinstance(n.target, ast.Subscript)]


def test_what_is_looked_for_is_found():
    assert atomic_lines("x += 1\ns.body.force[w, b] += f\ns.body.force[w, b] = s.body.force[w, b] + f") == [2]


@pytest.mark.parametrize("path", KERNELS, ids=lambda path: path.stem)
def test_no_atomic_sum(path):
    assert atomic_lines(path.read_text()) == []


def shared_maxima(source: str) -> list[int]:
    """Lines that keep the larger of two in an element whose place is looked up, so that others may find it, too."""
    found = []
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Assign) and isinstance(node.targets[0], ast.Subscript):
            target, value = node.targets[0], ast.unparse(node.value)
            looked_up = any(isinstance(part, ast.Subscript) for part in ast.walk(target.slice))
            if looked_up and value.startswith(("ti.max(", "ti.min(")) and ast.unparse(target) in value:
                found.append(node.lineno)
    return found


def test_what_several_threads_may_do_at_once_is_found():
    by_lookup = "s.swing[w, owner[m]] = ti.max(s.swing[w, owner[m]], x)"
    assert shared_maxima(f"s.swing[w, m] = ti.max(s.swing[w, m], x)\n{by_lookup}\ns.swing[w, owner[m]] = x") == [2]


@pytest.mark.parametrize("path", KERNELS, ids=lambda path: path.stem)
def test_no_maximum_is_lost_between_threads(path):
    """Of members of one body that run at once: ``ti.atomic_max``. Sums of contacts are one world's, on one thread."""
    assert shared_maxima(path.read_text()) == []
