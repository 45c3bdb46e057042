"""What a design family is to everything outside it: a name, the options that it takes, and the points that it makes.

To add one: a file with a class of :class:`Design` and a line in ``DESIGNS``, or an entry point ``design.NAME`` of a
package of one's own (``solver/plugins.py``). The command line, the page and study files list from there.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass, field, fields
from functools import lru_cache
from typing import ClassVar, Literal, get_args

import numpy as np
import numpy.typing as npt

from doe.record import Record

FloatArray = npt.NDArray[np.float64]
Alpha = Literal["rotatable", "face-centred", "inscribed"]
ALPHAS: tuple[str, ...] = get_args(Alpha)
Model = Literal["linear", "interactions", "quadratic"]
LETTERS = "ABCDEFGHJKLMNOPQRSTUVWXYZ"
"""Without I, which is the identity."""


@dataclass(frozen=True)
class DesignOptions(Record):
    """What may be asked of a design; a family takes those that it names. None, 0, (), False: as usual for it."""

    runs: int | None = None
    """Size of a table, or number of points."""
    centre: int | None = None
    """Runs with every factor in the middle."""
    fold: bool = False
    """Whether the mirror image of every row is run too."""
    generators: tuple[str, ...] = ()
    """Of a fraction, such as "E=ABC"."""
    fraction: int = 0
    """P of the fraction 2^(k − P) by the usual generators."""
    alpha: Alpha = "rotatable"
    """Where the axial points stand."""
    blocks: int | None = None
    """Orthogonal blocks of rows: days, batches, operators; with them, ``centre`` is of each block."""
    model: Model = "quadratic"
    """Whose terms an optimal design tells best."""
    constraints: tuple[tuple[float, ...], ...] = ()
    """Within which the runs stay: a_1, …, a_k, b of a_1 x_1 + … <= b in coded units."""
    levels: tuple[int, ...] = ()
    """Number of names of each factor that is no number; 0 of one that is. Empty: all are."""
    kept: tuple[tuple[float, ...], ...] = ()
    """Coded levels of finished runs, beside which others are looked for."""
    lattice: int | None = None
    """Steps of a share in a mixture."""
    nonregular: bool = False
    """Whether no main effect may be wholly confused with an interaction of two, where a regular table is as usual."""
    seed: int = 1
    """Of a design that is drawn."""

    def given(self) -> tuple[str, ...]:
        """Names of the options that differ from what is usual, but for the seed."""
        usual = DesignOptions()
        names = (one.name for one in fields(self) if one.name != "seed")
        return tuple(name for name in names if getattr(self, name) != getattr(usual, name))


@dataclass(frozen=True)
class Efficiency(Record):
    """How well N runs tell the p terms of a model. d = det(X'X)^(1/p)/N, a = p/(N tr (X'X)^-1), g = p/(N times the
    largest variance of the prediction), in percent of an orthogonal design; mean_variance of the prediction over the
    region, in units of the variance of one run.
    """

    d: float
    a: float
    g: float
    mean_variance: float


@dataclass(frozen=True)
class Points:
    """The rows of a design, and what is to be said of it."""

    coded: FloatArray
    """Levels in coded units, shape (rows, factors): low is −1, high is +1."""
    unused: FloatArray = field(default_factory=lambda: np.zeros((0, 0)))
    """Columns of its table that carry no factor, shape (rows, n): they serve as error. Empty: there are none."""
    traits: tuple[str, ...] = ()
    generators: tuple[str, ...] = ()
    """Of a fraction."""
    aliases: tuple[str, ...] = ()
    """One line per column that is confused with others, factors by their letters."""
    notes: tuple[str, ...] = ()
    """Sentences that a reader must know."""
    block: npt.NDArray[np.int64] = field(default_factory=lambda: np.zeros(0, dtype=np.int64))
    """In which block each row is run, from 0, shape (rows,). Empty: there are no blocks."""
    efficiency: Efficiency | None = None
    """Of a design for a given model."""
    gained: tuple[str, ...] = ()
    """Terms of that model that the finished runs alone could not tell from others."""


class Design(ABC):
    """A family of designs."""

    name: ClassVar[str]
    """As it is written on the command line and in study files."""
    title: ClassVar[str]
    """As a sentence writes it."""
    doc: ClassVar[str]
    """What it is for, in one line."""
    options: ClassVar[tuple[str, ...]] = ()
    """Fields of :class:`DesignOptions` that it takes."""
    mixture: ClassVar[bool] = False
    """Whether its factors are the parts of a whole."""
    main_effects_only: ClassVar[bool] = False
    """Whether it is made for a model without interactions and squares."""

    @abstractmethod
    def points(self, factors: int, options: DesignOptions) -> Points:
        """The rows for a number of factors; raises StatisticsError where there are none for it."""


@dataclass(frozen=True)
class ChosenDesign:
    """A design of a stage with its options, as a study file names it."""

    design: Design
    options: DesignOptions

    # Asked for at every look at a study that runs, and a Latin hypercube is optimised for seconds.
    @lru_cache(maxsize=64)  # noqa: B019 (a study file has three of them)
    def points(self, factors: int) -> Points:
        """The rows for a number of factors, not to be changed; raises StatisticsError where there are none for it."""
        return self.design.points(factors, self.options)


def factor_letters(factors: int) -> tuple[str, ...]:
    """Return the short names A, B, …, H, J, …, Z, AA, AB, … of `factors` factors."""
    doubled = [a + b for a in LETTERS for b in LETTERS]
    return tuple([*LETTERS, *doubled][:factors])


def with_centre(levels: npt.NDArray[np.int64], centre: int | None) -> FloatArray:
    """``levels``, shape (rows, columns), followed by as many runs in the middle as are asked for."""
    return np.vstack([levels, np.zeros((centre or 0, levels.shape[1]), dtype=np.int64)]).astype(np.float64)
