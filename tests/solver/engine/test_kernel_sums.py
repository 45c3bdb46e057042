"""Taichi makes ``a[w, b] += x`` on an array an atomic operation: a quarter of a pour's time, for nothing."""

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
