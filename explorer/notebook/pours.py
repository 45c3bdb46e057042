"""Pours as NumPy and pandas: load a scene, pour it, sweep its parameters over seeds.

Observables are read off the raw pour that a store keeps (lengths to 0.01 mm, ``solver/pours/raw_pour.py``), as in every
study: one pour gives the same number from :func:`pour`, from :func:`sweep`, and years later from the store. Those that
``explorer simulate`` prints, ``solver.observe(poured.record)``, are read before the rounding.
"""

from __future__ import annotations

import math
import warnings
from collections import Counter
from collections.abc import Iterable, Mapping
from contextlib import ExitStack
from dataclasses import dataclass
from functools import cached_property
from html import escape
from itertools import product
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt
import pandas as pd

from doe.store import Store, default_store
from explorer.background.bar import Bar
from explorer.outcomes import outcome_text
from explorer.scene.file import named_scene
from solver import (
    OBSERVABLES,
    Outcome,
    ParameterError,
    Record,
    Scene,
    canonical,
    observable_names,
    observe,
    packed,
    pour_rig,
    unpacked,
    value,
    with_settings,
    with_values,
)
from solver import parameters as declared
from solver.arch import chosen
from solver.observables import COMPONENT_OBSERVABLES, ComponentObservable, Observable
from solver.observables.reading import PileReading

if TYPE_CHECKING:
    from doe.run_records import Run

Array = npt.NDArray[np.float64]

Source = Scene | str | Path
"""A scene, or what names one."""
Settings = Mapping[str, float | str]
"""Path → value in SI, text with a unit ("10 g", "56.3MPa"), or the name of a choice; ``rig.name`` is one of them."""


def load(source: Source, settings: Settings | None = None, *, material: str | Path | None = None) -> Scene:
    """Scene of a rig, material, set-up, study or finished calibration.

    Parameters
    ----------
    source
        As on the command line: a rig ("rotating_drum"), the file or shipped name of a material, set-up or study, or the
        folder of a finished calibration, which means its study at the optimum. A scene is taken as it is.
    settings
        What is changed: path → value, as in ``--set``.
    material
        File or shipped name of the material in the rig; only a rig takes one.

    Returns
    -------
    solver.Scene
        Frozen; ``load(scene, {…})`` gives a changed one.

    Raises
    ------
    ValueError
        One line with file, path, value and what is allowed.

    Warns
    -----
    UserWarning
        Where the optimum of a calibration is not known from its data.
    """
    if isinstance(source, Scene):
        if material is not None:
            raise ParameterError(
                f"material {material}: the scene has its own materials; allowed only with the name of a rig"
            )
        return with_settings(source, settings or {})
    scene, caution = named_scene(str(source), None if material is None else str(material))
    if caution:
        warnings.warn(caution, stacklevel=2)
    return with_settings(scene, settings or {})


def parameters(source: Source) -> pd.DataFrame:
    """Every parameter of a scene.

    Parameters
    ----------
    source
        See :func:`load`.

    Returns
    -------
    pandas.DataFrame
        Index ``path``; columns ``value`` (SI, or the name of a choice), ``unit``, ``low`` and ``high`` (SI; NaN where
        the value is a name), ``choices``, ``live`` (whether a running pile takes a new value at once), ``doc``.
    """
    scene = load(source)
    rows = [
        (
            path,
            value(scene, path),
            entry.unit,
            entry.low if entry.is_number else math.nan,
            entry.high if entry.is_number else math.nan,
            entry.choices,
            entry.live,
            entry.doc,
        )
        for path, entry in declared(scene).items()
    ]
    columns = ["path", "value", "unit", "low", "high", "choices", "live", "doc"]
    return pd.DataFrame(rows, columns=columns).set_index("path")


def observables(source: Source) -> pd.DataFrame:
    """What a pour of a scene gives: index ``name``; columns ``unit``, ``doc``. ``source``: see :func:`load`."""
    rows = [(name, one.unit, one.doc) for name, one in _observed(load(source)).items()]
    return pd.DataFrame(rows, columns=["name", "unit", "doc"]).set_index("name")


def _observed(scene: Scene) -> dict[str, Observable | ComponentObservable]:
    found: dict[str, Observable | ComponentObservable] = {name: OBSERVABLES[name] for name in observable_names(scene)}
    if len(scene.bodies) > 1 and any(OBSERVABLES[name].needs == "pile" for name in found):
        found |= {f"{one.name}.{body.name}": one for one in COMPONENT_OBSERVABLES for body in scene.bodies}
    return found


@dataclass(frozen=True, eq=False, repr=False)
class Poured:
    """One finished pour; n bodies have entered. In a notebook it shows its outline and its observables.

    Attributes
    ----------
    record : solver.Record
        All that the run leaves behind: spheres, velocities, entries, free surface, time step.
    """

    record: Record

    @property
    def scene(self) -> Scene:
        """What was poured."""
        return self.record.scene

    @property
    def seed(self) -> int:
        """Of the sizes and the feed."""
        return self.record.seed

    @property
    def outcome(self) -> Outcome:
        """How it ended; equal to its name ("at_rest"), and ``outcome.valid`` says whether its observables count."""
        return self.record.outcome

    @property
    def message(self) -> str:
        """What the outcome's name does not say, such as the mass that jammed; mostly empty."""
        return self.record.message

    @property
    def positions(self) -> Array:
        """Centres of mass [m], shape (n, 3); the plate is z = 0."""
        return self.record.bodies.position

    @property
    def quaternions(self) -> Array:
        """Orientation of the principal frames, w x y z, shape (n, 4)."""
        return self.record.bodies.quaternion

    @property
    def components(self) -> npt.NDArray[np.str_]:
        """Name of each body's component, shape (n,)."""
        return np.array(self.record.bodies.component_names)[self.record.bodies.component]

    @property
    def in_pile(self) -> npt.NDArray[np.bool_]:
        """Whether a body lies on the plate and belongs to the pile, shape (n,)."""
        return self.record.in_pile

    @cached_property
    def curves(self) -> pd.DataFrame:
        """Masses, energies and contacts over time: index ``time_s``, a column per curve with its unit in the name.

        One row per ``numerics.sample_interval``; the columns are those of the ``trace_<seed>.csv`` of a result folder.
        """
        from explorer.files.run_folder import TRACE_COLUMNS

        trace = self.record.trace
        columns = {name: getattr(trace, curve) for name, curve in TRACE_COLUMNS.items()}
        return pd.DataFrame(columns).set_index("time_s")

    @cached_property
    def observables(self) -> pd.DataFrame:
        """What is read off: index ``name``; columns ``value`` (NaN: not measurable), ``spread``, ``unit``.

        ``spread``: sample standard deviation over the views or flanks of this one pile, not over seeds.
        """
        rows = [(name, found.value, found.spread, found.unit) for name, found in observe(self._kept).items()]
        table = pd.DataFrame(rows, columns=["name", "value", "spread", "unit"]).set_index("name")
        return table.astype({"value": np.float64, "spread": np.float64})

    @cached_property
    def _kept(self) -> Record:
        return unpacked(packed(self.record))

    def __repr__(self) -> str:
        """Title, seed, outcome and number of bodies, on one line."""
        told = outcome_text(self.outcome, self.message)
        return f"<Poured {self.scene.title!r}, seed {self.seed}: {told}; {len(self.positions)} bodies>"

    def _repr_html_(self) -> str:
        # The page's own drawing; what it is drawn with takes a second to import.
        from explorer.viewer.pour.outline_drawing import outline_html

        pile = PileReading(self._kept.pile)
        drawn = outline_html(pile.front, None) if pile.is_pile else ""
        return f"<div style='max-width:40em'>{escape(repr(self))}{drawn}{self.observables._repr_html_()}</div>"


def pour(source: Source, settings: Settings | None = None, *, seed: int = 1) -> Poured:
    """Pour a scene to its end, in this process and by one thread.

    Parameters
    ----------
    source, settings
        See :func:`load`.
    seed
        Same scene and seed, same bits.

    Returns
    -------
    Poured
        Whatever the outcome: a jam, a lost body or a cut-off is an outcome, not an error.

    Raises
    ------
    ValueError
        One line, as from :func:`load`; also for a bench test, into which nothing is poured.
    """
    from solver import run_pour  # imports Taichi, as do pours of a sweep: to look at a scene takes neither

    scene = load(source, settings)
    pour_rig(scene)
    return Poured(run_pour(scene, checked_seed(seed), threads=1))


def checked_seed(seed: int) -> int:
    """``seed`` as an int; raises ParameterError if it is none."""
    # Neither NaN nor infinity is equal to what is left of it; a store keeps 64 bits with a sign.
    if not isinstance(seed, int | float | np.integer) or seed != seed // 1 or not 0 <= seed < 2**63:
        raise ParameterError(f"seed {seed}: allowed: a whole number from 0, below 2^63")
    return int(seed)


def _checked_seeds(seeds: int | Iterable[int]) -> tuple[int, ...]:
    """Seeds that are told one by one or by their number. Raises ParameterError where there are none, or one twice."""
    if isinstance(seeds, Iterable):
        numbers = tuple(map(checked_seed, seeds))
    else:
        whole = isinstance(seeds, int | float | np.integer) and seeds == seeds // 1
        numbers = tuple(range(1, int(seeds) + 1)) if whole else ()
    if not numbers:
        raise ParameterError(f"seeds {seeds}: allowed: a number of seeds from 1 on, or the seeds themselves")
    seed, times = Counter(numbers).most_common(1)[0]
    if times > 1:
        raise ParameterError(
            f"seeds: {seed} appears {times} times; allowed: each seed once, as equal seeds give the same pour"
        )
    return numbers


def sweep(
    source: Source,
    values: Mapping[str, float | str | Iterable[float | str]],
    seeds: int | Iterable[int] = 3,
    *,
    observables: Iterable[str] | None = None,
    store: str | Path | None = None,
    workers: int | None = None,
    progress: bool = True,
) -> pd.DataFrame:
    """Pour a scene with every combination of values and every seed, on all cores.

    A pour that is in the store is read from there, so a sweep that was interrupted goes on, and one that grows pours
    only what is new.

    Parameters
    ----------
    source
        See :func:`load`.
    values
        Path → values, as in :func:`load`; several paths make a full grid, and none at all replicates the scene.
    seeds
        Seeds, each once, or their number N for 1 … N; the same for every combination.
    observables
        Names to be listed; all of the rig if not given.
    store
        SQLite file that keeps every pour; that of all studies if not given (``$REPOSE_STORE``, or the file in the
        user's data folder).
    workers
        Processes, each with one pour at a time; one per core if not given.
    progress
        Whether a bar is shown.

    Returns
    -------
    pandas.DataFrame
        One row per pour, in the order of the grid and then of the seeds: a column per path (SI, or the name of a
        choice), ``seed``, ``outcome``, ``valid`` (whether what was read off counts), a column per observable (NaN: not
        measurable), ``message``. ``attrs["units"]`` maps paths and observables to their units.

    Raises
    ------
    ValueError
        One line about a path, a value, the seeds, an observable, the workers or the store, before anything is poured.
    """
    from doe.pour_runner import PourRunner
    from doe.run_records import Setting
    from solver import executor

    scene = load(source)
    given = _observed(scene)
    names = tuple(given if observables is None else [observables] if isinstance(observables, str) else observables)
    for name in names:
        if name not in given:
            raise ParameterError(f"observables: {name!r} is not one of {', '.join(given)}")
    if not isinstance(values, Mapping):
        raise ParameterError(f"values {values!r}: allowed: a dictionary of paths and their values, which may be empty")
    paths = Counter(canonical(scene, path) for path in values)
    if twice := [path for path, times in paths.items() if times > 1]:
        raise ParameterError(f"values: {twice[0]} is named twice; allowed: each path once")
    numbers = _checked_seeds(seeds)
    levels = [list(one) if isinstance(one, Iterable) and not isinstance(one, str) else [one] for one in values.values()]
    for path, level in zip(values, levels, strict=True):
        if not level:
            raise ParameterError(f"{path}: no values; name one or more, or leave it out")
    grid = [dict(zip(values, row, strict=True)) for row in product(*levels)]
    # As they are in the scene: in SI, and a mass fraction after those that were set behind it.
    poured = [{path: value(changed, path) for path in values} for changed in (with_values(scene, row) for row in grid)]
    labels = [", ".join(f"{path}={one}" for path, one in row.items()) for row in poured]
    if labels and (more := Counter(labels).most_common(1)[0])[1] > 1:
        raise ParameterError(f"values: {more[0]} comes {more[1]} times; allowed: each once, as for seeds")
    settings = [Setting(label, row, len(numbers)) for label, row in zip(labels, grid, strict=True)]
    total = len(settings) * len(numbers)
    with ExitStack() as stack:
        crew = stack.enter_context(executor(workers)) if chosen() == "cpu" else None
        kept = Store(default_store() if store is None else Path(store))
        stack.callback(kept.close)
        bar = Bar() if progress else None
        if bar:
            stack.callback(bar.close)
            bar.show("compiling the solver", 0, total)

        def ended(_: str, run: Run, left: int) -> None:
            if bar:
                bar.show(f"{total - left} of {total} pours", total - left, total)

        runner = PourRunner(
            scene, kept, "sweep", 0, workers, on_run=ended, pours=crew.run_queue if crew else None, seeds=numbers
        )
        found = runner.run("sweep", settings)
    rows = [
        {
            **row,
            "seed": run.seed,
            "outcome": run.outcome,
            "valid": run.valid,
            **{name: run.observables.get(name) for name in names},
            "message": run.message,
        }
        for row, runs in zip(poured, found, strict=True)
        for run in runs
    ]
    table = pd.DataFrame(rows, columns=[*values, "seed", "outcome", "valid", *names, "message"])
    table = table.astype(dict.fromkeys(names, np.float64))
    units = {path: declared(scene)[canonical(scene, path)].unit for path in values}
    table.attrs["units"] = units | {name: given[name].unit for name in names}
    return table
