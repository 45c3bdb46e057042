"""The interface of a design family: its name, the options that it accepts, and the points that it returns.

To add one, write a subclass of :class:`Design` in a file of its own and list it in ``DESIGNS``, or declare an entry
point ``design.NAME`` in your own package (``solver/plugins.py``). The command line, the page and study files take their
lists of designs from there.
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
"""Without I, which stands for the identity."""


@dataclass(frozen=True)
class DesignOptions(Record):
    """Options of designs; a family accepts those in its ``options``. None, 0, () and False mean its default."""

    runs: int | None = None
    """Number of rows of a table, or number of points."""
    centre: int | None = None
    """Number of centre runs, with every factor in the middle of its range."""
    fold: bool = False
    """Whether the mirror image of every row is run too."""
    generators: tuple[str, ...] = ()
    """Generators of a fraction, such as "E=ABC"."""
    fraction: int = 0
    """P of the fraction 2^(k − P) with the standard generators."""
    alpha: Alpha = "rotatable"
    """Position of the axial points."""
    blocks: int | None = None
    """Number of orthogonal blocks of rows (days, batches, operators); ``centre`` is then the number in each block."""
    model: Model = "quadratic"
    """Model for which an optimal design is computed."""
    constraints: tuple[tuple[float, ...], ...] = ()
    """Constraints on the runs: rows (a_1, …, a_k, b) of a_1 x_1 + … <= b in coded units."""
    levels: tuple[int, ...] = ()
    """Number of names of each categorical factor, 0 for a numeric factor. Empty: all factors are numeric."""
    kept: tuple[tuple[float, ...], ...] = ()
    """Coded levels of finished runs to which new runs are added."""
    lattice: int | None = None
    """Degree of the simplex lattice of a mixture: number of steps of a share. None: the simplex centroid."""
    nonregular: bool = False
    """Whether no main effect may be fully aliased with a two-factor interaction where the default table is regular."""
    seed: int = 1
    """Seed of a random design."""

    def given(self) -> tuple[str, ...]:
        """Names of the options that differ from their defaults, except the seed."""
        usual = DesignOptions()
        names = (one.name for one in fields(self) if one.name != "seed")
        return tuple(name for name in names if getattr(self, name) != getattr(usual, name))


@dataclass(frozen=True)
class Efficiency(Record):
    """How precisely N runs estimate the p terms of a model. d = det(X'X)^(1/p)/N, a = p/(N tr (X'X)^-1), g = p/(N times
    the largest variance of the prediction), in percent of an orthogonal design; mean_variance: mean of the variance of
    the prediction over the region, in units of the variance of one run.
    """

    d: float
    a: float
    g: float
    mean_variance: float


@dataclass(frozen=True)
class Points:
    """The rows of a design, and its description."""

    coded: FloatArray
    """Levels in coded units, shape (rows, factors): low is −1, high is +1."""
    unused: FloatArray = field(default_factory=lambda: np.zeros((0, 0)))
    """Columns of its table without a factor, shape (rows, n), which estimate the error. Empty: there are none."""
    traits: tuple[str, ...] = ()
    generators: tuple[str, ...] = ()
    """Generators of a fraction."""
    aliases: tuple[str, ...] = ()
    """One line per column that is aliased with others, with factors named by their letters."""
    notes: tuple[str, ...] = ()
    """Remarks that the reader must know, as sentences."""
    block: npt.NDArray[np.int64] = field(default_factory=lambda: np.zeros(0, dtype=np.int64))
    """Block of each row, counted from 0, shape (rows,). Empty: there are no blocks."""
    efficiency: Efficiency | None = None
    """Efficiency of a design for a given model."""
    gained: tuple[str, ...] = ()
    """Terms of that model that the finished runs alone could not estimate separately from others."""


class Design(ABC):
    """A family of designs."""

    name: ClassVar[str]
    """Name on the command line and in study files."""
    title: ClassVar[str]
    """Name as written in a sentence."""
    doc: ClassVar[str]
    """Purpose in one line."""
    options: ClassVar[tuple[str, ...]] = ()
    """Fields of :class:`DesignOptions` that it accepts."""
    mixture: ClassVar[bool] = False
    """Whether its factors are the parts of a mixture."""
    main_effects_only: ClassVar[bool] = False
    """Whether it is meant for a model without interactions and squares."""

    @abstractmethod
    def points(self, factors: int, options: DesignOptions) -> Points:
        """Return the rows for a number of factors; raises StatisticsError if the family has none for it."""


@dataclass(frozen=True)
class ChosenDesign:
    """The design of a stage with its options, as declared in a study file."""

    design: Design
    options: DesignOptions

    # Cached: a running study needs the rows many times, and optimising a Latin hypercube takes seconds.
    @lru_cache(maxsize=64)  # noqa: B019 (a study file has three of them)
    def points(self, factors: int) -> Points:
        """Return the rows for a number of factors, not to be modified; raises StatisticsError if there are none."""
        return self.design.points(factors, self.options)


def factor_letters(factors: int) -> tuple[str, ...]:
    """Return the short names A, B, …, H, J, …, Z, AA, AB, … of `factors` factors."""
    doubled = [a + b for a in LETTERS for b in LETTERS]
    return tuple([*LETTERS, *doubled][:factors])


def with_centre(levels: npt.NDArray[np.int64], centre: int | None) -> FloatArray:
    """Return ``levels``, shape (rows, columns), followed by ``centre`` centre runs."""
    return np.vstack([levels, np.zeros((centre or 0, levels.shape[1]), dtype=np.int64)]).astype(np.float64)
