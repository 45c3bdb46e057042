"""A chart that a person can choose by its title, drawn when it is chosen."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from explorer.report.content import Spec


@dataclass(frozen=True)
class Plot:
    """``make`` gives the chart, ``caption`` what its marks mean, ``aspect`` its height by its width."""

    make: Callable[[], Spec | None]
    caption: str
    aspect: float = 0.85


Plots = dict[str, Plot]
"""Title → plot, in the order of the list to choose from."""
