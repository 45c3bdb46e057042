"""The interface: command line, live page, recordings, reports, and what scripts and notebooks use: ``__all__``.

Those names (docs/python.md) are fetched when they are first used: importing this package imports nothing else.
"""

import importlib
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from explorer.notebook.pours import Poured, load, observables, parameters, pour, sweep
    from explorer.notebook.results import Chart, Charts, charts, diagnose, load_diagnosis, load_study, run_study

_LATE = {
    "Chart": "explorer.notebook.results",
    "Charts": "explorer.notebook.results",
    "Poured": "explorer.notebook.pours",
    "charts": "explorer.notebook.results",
    "diagnose": "explorer.notebook.results",
    "load": "explorer.notebook.pours",
    "load_diagnosis": "explorer.notebook.results",
    "load_study": "explorer.notebook.results",
    "observables": "explorer.notebook.pours",
    "parameters": "explorer.notebook.pours",
    "pour": "explorer.notebook.pours",
    "run_study": "explorer.notebook.results",
    "sweep": "explorer.notebook.pours",
}

__all__ = [
    "Chart",
    "Charts",
    "Poured",
    "charts",
    "diagnose",
    "load",
    "load_diagnosis",
    "load_study",
    "observables",
    "parameters",
    "pour",
    "run_study",
    "sweep",
]


def __getattr__(name: str) -> Any:
    if name in _LATE:
        return getattr(importlib.import_module(_LATE[name]), name)
    raise AttributeError(f"module 'explorer' has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})


def _refuse_namesakes() -> None:
    """Raise ImportError where `solver` or `doe` would be somebody else's, such as a solver.py beside a notebook."""
    here = Path(__file__).resolve().parents[1]
    for name in ("doe", "solver"):
        spec = find_spec(name)
        found = spec.origin if spec and spec.origin else "none"
        if Path(found).resolve() != here / name / "__init__.py":
            raise ImportError(
                f"explorer needs the package `{name}` beside it in {here}, but Python finds {found}; rename what is in "
                "the way, or start Python elsewhere"
            )


_refuse_namesakes()
