"""Nothing that is read is executed: no pickle is loaded, by whatever name."""

import ast
import io
import pickle
from pathlib import Path

import numpy as np
import pytest

from solver.npz import NpzError, npz_arrays

ROOT = Path(__file__).parents[1]
SOURCES = sorted(path for package in ("solver", "doe", "explorer") for path in (ROOT / package).rglob("*.py"))
MODULES = {"pickle", "cPickle", "_pickle", "dill", "cloudpickle", "joblib", "shelve", "marshal", "jsonpickle"}
READERS = {"load", "load_npz", "read_pickle", "NpzFile", "memmap", "fromfile", "open_memmap", "read_array"}
"""Functions of NumPy, SciPy and pandas that may read a pickle."""


def called(node):
    """The last name of what a call calls."""
    return getattr(node.func, "attr", getattr(node.func, "id", ""))


def of_numpy(node):
    """Whether a call reads an array by a function that may read a pickle."""
    owner = getattr(getattr(node.func, "value", None), "id", "")
    return called(node) in READERS and owner in ("np", "numpy", "pd", "pandas", "sparse", "format")


def unsafe_reads(tree):
    """Lines of a parsed file that read arrays by a function that may read a pickle, and do not forbid it."""
    calls = [node for node in ast.walk(tree) if isinstance(node, ast.Call) and of_numpy(node)]
    safe = [
        call
        for call in calls
        if any(key.arg == "allow_pickle" and getattr(key.value, "value", None) is False for key in call.keywords)
    ]
    return [call.lineno for call in calls if call not in safe]


def modules_of(tree):
    """The modules that a parsed file imports, by their first name."""
    plain = (alias.name for node in ast.walk(tree) if isinstance(node, ast.Import) for alias in node.names)
    members = (node.module for node in ast.walk(tree) if isinstance(node, ast.ImportFrom) and node.module)
    return {name.split(".")[0] for name in (*plain, *members)}


def test_no_source_reads_a_pickle():
    trees = {path.relative_to(ROOT).as_posix(): ast.parse(path.read_text(encoding="utf-8")) for path in SOURCES}
    assert len(trees) > 500
    assert {name: modules_of(tree) & MODULES for name, tree in trees.items() if modules_of(tree) & MODULES} == {}
    assert {name: unsafe_reads(tree) for name, tree in trees.items() if unsafe_reads(tree)} == {}


def test_the_search_finds_what_it_looks_for():
    lines = (
        "np.load(path)",
        "numpy.load(path, allow_pickle=True)",
        "pd.read_pickle(path)",
        "np.load(x, allow_pickle=False)",
    )
    assert unsafe_reads(ast.parse("\n".join(lines))) == [1, 2, 3]
    assert modules_of(ast.parse("import pickle\nfrom dill import load")) & MODULES == {"pickle", "dill"}


class Trap:
    """Tells that it was unpickled."""

    def __reduce__(self):
        return (exec, ("raise SystemError('a pickle was read')",))


def test_an_array_of_objects_is_refused_and_not_executed():
    made = io.BytesIO()
    np.savez(made, xyz=np.array([Trap()], dtype=object))
    with pytest.raises(NpzError):
        npz_arrays(made.getvalue())
    with pytest.raises(NpzError):
        npz_arrays(pickle.dumps(Trap()))
