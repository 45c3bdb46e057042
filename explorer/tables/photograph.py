"""What was read off photographs of piles, as text for a terminal and as plain data."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
from scipy import stats

from explorer.photograph.result import BASES, MeasuredPhotographs
from explorer.photograph.simulated import SimulatedPiles
from explorer.tables.text_table import text_table
from explorer.units import MISSING, fixed, signed
from solver.photograph import Board, PhotographedPile, Refusal
from solver.photograph.reading_error import COVERAGE, Angle

Array = npt.NDArray[np.float64]
MOST_POINTS = 400
"""Of a profile in plain data."""
Rows = Sequence[tuple[str, str]]
"""What was read → its value, with its unit."""
NOTE = (
    "95 % and standard error: of reading this silhouette, with a bend of its flanks, of lens and camera; another pour "
    "differs by far more. Thirds: lower, middle and upper third of the fit. Roughness: RMS distance of the outline "
    "from its lines."
)


def measure_text(measured: MeasuredPhotographs) -> str:
    """A table of the pictures, of the simulation below it, and what the numbers mean."""
    rows = [_row(pile) for pile in measured.piles]
    if measured.simulated is not None:
        rows.append(_simulated_row(measured.simulated))
    parts = []
    if rows:
        head = (
            "picture",
            "left °",
            "right °",
            "mean °",
            "height",
            "half-width",
            "roughness",
            "unit",
            "tilt °",
            "base line",
            "thirds left °",
            "thirds right °",
        )
        parts.append(text_table(head, rows))
    if measured.piles:
        parts.append(
            "±: 95 % of reading this silhouette, with a bend of its flanks, of lens and camera; another pour "
            "differs by far more. Roughness: RMS distance of the outline from its lines. Thirds: slopes of the lower, "
            "middle and upper third of the fit."
        )
        if measured.board is None:
            parts += [f"{pile.name}: {lens_words(pile.lens)}" for pile in measured.piles if pile.lens]
    if measured.board is not None:
        parts.append(_board_words(measured.board))
    if len(measured.piles) > 1:
        parts.append(_over_pictures(measured.piles))
    if measured.simulated is not None:
        parts.append(_comparison(measured))
    return "\n\n".join(parts)


def angle_words(value_deg: float, error_deg: float) -> str:
    """An angle with its interval and its standard error, both named [°]."""
    reach = COVERAGE * error_deg
    return (
        f"{fixed(value_deg)}° (95 % {fixed(value_deg - reach)} … {fixed(value_deg + reach)}°; standard error "
        f"{fixed(error_deg)}°)"
    )


def lens_words(k: float, checkerboard: str = "") -> str:
    """What was taken out of a picture that a lens had bent by ``k``, as its ``checkerboard`` or its base line tells."""
    bent = f"the lens bends the {f'checkerboard {checkerboard}' if checkerboard else 'base line'}"
    return f"{bent} ({'barrel' if k < 0 else 'pincushion'}, k = {signed(k, 3)}): taken out"


def _board_words(board: Board) -> str:
    """What a checkerboard told of the lens."""
    return (
        f"checkerboard {board.name}: {board.corners} corners, k = {signed(board.bend.k, 4)} ± "
        f"{COVERAGE * board.bend.error:.4f} (95 %), taken out of every picture; they miss a plane board by "
        f"{board.miss:.2f} px (RMS)"
    )


def thirds_words(thirds_deg: Sequence[float | None]) -> str:
    """Slopes of the lower, the middle and the upper third of a flank [°]."""
    return " / ".join(MISSING if one is None or np.isnan(one) else fixed(one, 1) for one in thirds_deg)


def measure_tables(result: Mapping[str, Any]) -> dict[str, Rows]:
    """What :func:`measure_result` gave, for a place too narrow for one line a picture: picture → its rows."""
    tables: dict[str, Rows] = {}
    board: Mapping[str, Any] | None = result.get("checkerboard")
    for picture in result["pictures"]:
        tables[picture["picture"]] = _pile_rows(picture, board) if picture["pile"] else _refusal_rows(picture)
    if board is not None:
        tables[f"checkerboard: {board['picture']}"] = _board_rows(board)
    simulation = result["simulation"]
    if simulation is not None:
        means = [picture["angles"]["mean"]["value_deg"] for picture in result["pictures"] if picture["pile"]]
        tables[f"simulated: {Path(simulation['source']).name}"] = _simulated_rows(simulation, means)
    return tables


def _board_rows(board: Mapping[str, Any]) -> Rows:
    k, reach = board["lens_k"], COVERAGE * board["error"]
    kind = "no bend seen" if abs(k) <= reach else "barrel" if k < 0 else "pincushion"
    return (
        ("lens k", f"{signed(k, 4)} (95 % {signed(k - reach, 4)} … {signed(k + reach, 4)}): {kind}, taken out"),
        ("in the corners", f"seen {fixed(100 * abs(k), 1)} % too {'near' if k < 0 else 'far from'} the middle"),
        ("corners", f"{board['corners']}; they miss a plane board by {fixed(board['miss_px'])} px (RMS)"),
    )


def _pile_rows(picture: Mapping[str, Any], board: Mapping[str, Any] | None) -> Rows:
    unit, base, rough = picture["length_unit"], picture["base_line"], picture["roughness"]
    places = 2 if unit == "mm" else 1
    angles = {name: angle_words(one["value_deg"], one["error_deg"]) for name, one in picture["angles"].items()}
    roughness = float(np.sqrt(np.mean(np.square([rough["left"], rough["right"]]))))
    return (
        ("angle of repose", angles["mean"]),
        ("left flank", angles["left"]),
        ("right flank", angles["right"]),
        *(
            (f"{side} by thirds", f"{thirds_words(picture['angles'][side]['thirds_deg'])}°")
            for side in ("left", "right")
        ),
        ("height", f"{fixed(picture['height'], places)} {unit}"),
        ("half-width", f"{fixed(picture['half_width'], places)} {unit}"),
        ("roughness", f"{fixed(roughness, places)} {unit}"),
        ("base line", f"{BASES[base['found_by']]}, tilted by {signed(base['tilt_deg'])}°"),
        *([("lens", lens_words(picture["lens_k"]))] if picture["lens_k"] and board is None else []),
    )


def _refusal_rows(picture: Mapping[str, Any]) -> Rows:
    return (("no angle", f"{picture['reason']}: {picture['detail']}"),)


def _simulated_rows(simulation: Mapping[str, Any], photographed_deg: Sequence[float]) -> Rows:
    def row(name: str, key: str, unit: str) -> tuple[str, str]:
        of = simulation[key]
        spread = "" if of["sd"] is None else f" (standard deviation {fixed(of['sd'])}{unit})"
        return name, f"{fixed(of['mean'])}{unit}{spread}"

    less = float(np.mean(photographed_deg)) - simulation["mean_deg"]["mean"] if photographed_deg else None
    return (
        row("angle of repose", "mean_deg", "°"),
        row("left flank", "left_deg", "°"),
        row("right flank", "right_deg", "°"),
        row("height", "height_mm", " mm"),
        row("half-width", "half_width_mm", " mm"),
        ("read on", f"{simulation['views']} views of {simulation['piles']} pile{'s' * (simulation['piles'] > 1)}"),
        *([] if less is None else [("photographed less simulated", f"{signed(less)}°, both by the same fit")]),
    )


def refusal_lines(refusals: Sequence[Refusal]) -> list[str]:
    """One line for each picture without an angle."""
    return [f"{refusal.name}: no angle: {refusal.reason}: {refusal.detail}" for refusal in refusals]


def angle_text(angle: Angle) -> str:
    """An angle with half its interval [°]."""
    return f"{angle.value_deg:.2f} ± {COVERAGE * angle.error_deg:.2f}"


def measure_result(measured: MeasuredPhotographs) -> dict[str, Any]:
    """The same as JSON types, with the profiles."""
    return {
        "pictures": [
            _pile_result(reading) if isinstance(reading, PhotographedPile) else _refusal_result(reading)
            for reading in measured.readings
        ],
        "over_pictures": _over_result(measured.piles),
        "simulation": None if measured.simulated is None else _simulated_result(measured.simulated),
        **({} if measured.board is None else {"checkerboard": _board_result(measured.board)}),
    }


def _board_result(board: Board) -> dict[str, Any]:
    return {
        "picture": board.name,
        "corners": board.corners,
        "lens_k": board.bend.k,
        "error": board.bend.error,
        "miss_px": board.miss,
    }


def _row(pile: PhotographedPile) -> tuple[str, ...]:
    shown, unit = _lengths(pile)
    angles = pile.angles
    rough = shown(float(np.sqrt(np.mean(np.square(pile.roughness)))))
    return (
        pile.name,
        angle_text(angles.left),
        angle_text(angles.right),
        angle_text(angles.mean),
        shown(pile.height),
        shown(pile.half_width),
        rough,
        unit,
        f"{pile.base.tilt_deg:+.2f}",
        BASES[pile.base.kind],
        thirds_words(angles.left.thirds_deg),
        thirds_words(angles.right.thirds_deg),
    )


def _simulated_row(simulated: SimulatedPiles) -> tuple[str, ...]:
    return (
        f"simulated: {simulated.source}",
        _spread(simulated.left_deg),
        _spread(simulated.right_deg),
        _spread(0.5 * (simulated.left_deg + simulated.right_deg)),
        f"{1e3 * simulated.height.mean():.2f}",
        f"{1e3 * simulated.half_width.mean():.2f}",
        "-",
        "mm",
        "-",
        f"mean and SD of {simulated.height.size} views of {simulated.piles} pile{'s' * (simulated.piles > 1)}",
        "-",
        "-",
    )


def _spread(values: Array) -> str:
    return f"{values.mean():.2f} (SD {values.std(ddof=1):.2f})" if values.size > 1 else f"{values.mean():.2f}"


def _over_pictures(piles: Sequence[PhotographedPile]) -> str:
    found = _over_result(piles)
    assert found is not None
    low, high = found["interval_deg"]
    return (
        f"{found['n']} pictures: mean {found['mean_deg']:.2f}°, SD {found['sd_deg']:.2f}°, "
        f"95 % {low:.2f} … {high:.2f}° (Student's t over the pictures)"
    )


def _over_result(piles: Sequence[PhotographedPile]) -> dict[str, Any] | None:
    """Mean angle over pictures, and the interval of that mean; None below two pictures."""
    if len(piles) < 2:
        return None
    means = np.array([pile.angles.mean.value_deg for pile in piles])
    sd = float(means.std(ddof=1))
    reach = float(stats.t.ppf(0.975, means.size - 1)) * sd / np.sqrt(means.size)
    mean = float(means.mean())
    return {"n": means.size, "mean_deg": mean, "sd_deg": sd, "interval_deg": [mean - reach, mean + reach]}


def _comparison(measured: MeasuredPhotographs) -> str:
    assert measured.simulated is not None
    simulated = 0.5 * (measured.simulated.left_deg + measured.simulated.right_deg)
    if not measured.piles:
        return "no photographed pile to compare with"
    photographed = float(np.mean([pile.angles.mean.value_deg for pile in measured.piles]))
    return (
        f"photographed less simulated: {photographed - simulated.mean():+.2f}°, both by the same fit; one view of the "
        f"simulated pile differs from the next by {simulated.std(ddof=1):.2f}° (SD)"
    )


def _lengths(pile: PhotographedPile) -> tuple[Any, str]:
    """How a length is written, and its unit."""
    return (
        ((lambda length: f"{1e3 * length:.2f}"), "mm") if pile.unit == "m" else ((lambda length: f"{length:.1f}"), "px")
    )


def _pile_result(pile: PhotographedPile) -> dict[str, Any]:
    factor, unit = (1e3, "mm") if pile.unit == "m" else (1.0, "px")
    angles = {name: getattr(pile.angles, name) for name in ("left", "right", "mean")}
    step = max(1, -(-pile.outline.u.size // MOST_POINTS))
    return {
        "picture": pile.name,
        "pile": True,
        "angles": {
            name: {
                "value_deg": angle.value_deg,
                "interval_deg": list(angle.interval_deg),
                "error_deg": angle.error_deg,
                "error_parts_deg": angle.parts_deg,
                "thirds_deg": [one if np.isfinite(one) else None for one in angle.thirds_deg],
            }
            for name, angle in angles.items()
        },
        "length_unit": unit,
        "height": factor * pile.height,
        "half_width": factor * pile.half_width,
        "roughness": {"left": factor * pile.roughness[0], "right": factor * pile.roughness[1]},
        "length_of_pixel": factor * pile.pixel,
        "base_line": {
            "found_by": pile.base.kind,
            "tilt_deg": pile.base.tilt_deg,
            "y_at_x0_px": pile.base.offset,
            "slope": pile.base.slope,
        },
        "lens_k": pile.lens,
        "contrast_levels": pile.contrast,
        "noise_levels": pile.noise,
        "profile": {
            "x": (factor * pile.outline.u[::step]).tolist(),
            "height": (factor * pile.outline.top[::step]).tolist(),
        },
    }


def _refusal_result(refusal: Refusal) -> dict[str, Any]:
    return {"picture": refusal.name, "pile": False, "reason": str(refusal.reason), "detail": refusal.detail}


def _simulated_result(simulated: SimulatedPiles) -> dict[str, Any]:
    views = {
        "left_deg": simulated.left_deg,
        "right_deg": simulated.right_deg,
        "mean_deg": 0.5 * (simulated.left_deg + simulated.right_deg),
        "height_mm": 1e3 * simulated.height,
        "half_width_mm": 1e3 * simulated.half_width,
    }
    return {
        "source": simulated.source,
        "piles": simulated.piles,
        "views": int(simulated.height.size),
        **{
            name: {"mean": float(of.mean()), "sd": float(of.std(ddof=1)) if of.size > 1 else None}
            for name, of in views.items()
        },
    }
