"""What was read off photographs of piles, as text for a terminal and as plain data."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from explorer.photograph.result import BASES, MeasuredPhotographs
from explorer.photograph.simulated import SimulatedViews, Spread
from explorer.terminal.text_table import text_table
from explorer.units import MISSING, fixed, signed
from solver.photograph import Board, PhotographedPile, Refusal
from solver.photograph.reading_error import COVERAGE, Angle

MOST_POINTS = 400
"""Of a profile in plain data."""
LENS_LEFT = "a stated base line tells no distortion of the lens: it is in the ±, not taken out; a checkerboard tells it"
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
        rows.append(_simulated_row(measured.simulated.summary))
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
            parts += [LENS_LEFT] if any(pile.base.kind == "given" for pile in measured.piles) else []
    if measured.board is not None:
        parts.append(_board_words(measured.board))
    if len(measured.piles) > 1:
        parts.append(str(measured.over_pictures))
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


def measure_tables(measured: MeasuredPhotographs, simulated: SimulatedViews | None = None) -> dict[str, Rows]:
    """What was measured, for a place too narrow for one line a picture: picture → its rows.

    ``simulated``: piles beside them that another process has read.
    """
    tables: dict[str, Rows] = {}
    for reading in measured.readings:
        tables[reading.name] = (
            _pile_rows(reading, measured.board)
            if isinstance(reading, PhotographedPile)
            else (("no angle", f"{reading.reason}: {reading.detail}"),)
        )
    if measured.board is not None:
        tables[f"checkerboard: {measured.board.name}"] = _board_rows(measured.board)
    if simulated is not None:
        means = [pile.angles.mean.value_deg for pile in measured.piles]
        tables[f"simulated: {Path(simulated.source).name}"] = _simulated_rows(simulated, means)
    return tables


def _board_rows(board: Board) -> Rows:
    k, reach = board.bend.k, COVERAGE * board.bend.error
    kind = "no bend seen" if abs(k) <= reach else "barrel" if k < 0 else "pincushion"
    return (
        ("lens k", f"{signed(k, 4)} (95 % {signed(k - reach, 4)} … {signed(k + reach, 4)}): {kind}, taken out"),
        ("in the corners", f"seen {fixed(100 * abs(k), 1)} % too {'near' if k < 0 else 'far from'} the middle"),
        ("corners", f"{board.corners}; they miss a plane board by {fixed(board.miss)} px (RMS)"),
    )


def _pile_rows(pile: PhotographedPile, board: Board | None) -> Rows:
    factor, unit, places = _length_unit(pile)
    angles = pile.angles
    sides = (("left", angles.left), ("right", angles.right))
    roughness = float(np.sqrt(np.mean(np.square(pile.roughness))))
    return (
        ("angle of repose", _angle_words(angles.mean)),
        *((f"{side} flank", _angle_words(angle)) for side, angle in sides),
        *((f"{side} by thirds", f"{thirds_words(angle.thirds_deg)}°") for side, angle in sides),
        ("height", f"{fixed(factor * pile.height, places)} {unit}"),
        ("half-width", f"{fixed(factor * pile.half_width, places)} {unit}"),
        ("roughness", f"{fixed(factor * roughness, places)} {unit}"),
        ("base line", f"{BASES[pile.base.kind]}, tilted by {signed(pile.base.tilt_deg)}°"),
        *([("lens", lens_words(pile.lens))] if pile.lens and board is None else []),
        *([("lens", LENS_LEFT)] if pile.base.kind == "given" and board is None else []),
    )


def _angle_words(angle: Angle) -> str:
    return angle_words(angle.value_deg, angle.error_deg)


def _simulated_rows(simulated: SimulatedViews, photographed_deg: Sequence[float]) -> Rows:
    def row(name: str, of: Spread, unit: str) -> tuple[str, str]:
        spread = "" if np.isnan(of.sd) else f" (standard deviation {fixed(of.sd)}{unit})"
        return name, f"{fixed(of.mean)}{unit}{spread}"

    less = float(np.mean(photographed_deg)) - simulated.mean_deg.mean if photographed_deg else None
    return (
        row("angle of repose", simulated.mean_deg, "°"),
        row("left flank", simulated.left_deg, "°"),
        row("right flank", simulated.right_deg, "°"),
        row("height", simulated.height_mm, " mm"),
        row("half-width", simulated.half_width_mm, " mm"),
        ("read on", f"{simulated.views} views of {simulated.piles} pile{'s' * (simulated.piles > 1)}"),
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
        "over_pictures": measured.over_pictures.to_dict() if len(measured.piles) > 1 else None,
        "simulation": None if measured.simulated is None else measured.simulated.summary.to_dict(),
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
    factor, unit, places = _length_unit(pile)
    angles = pile.angles
    roughness = float(np.sqrt(np.mean(np.square(pile.roughness))))
    return (
        pile.name,
        angle_text(angles.left),
        angle_text(angles.right),
        angle_text(angles.mean),
        *(f"{factor * length:.{places}f}" for length in (pile.height, pile.half_width, roughness)),
        unit,
        f"{pile.base.tilt_deg:+.2f}",
        BASES[pile.base.kind],
        thirds_words(angles.left.thirds_deg),
        thirds_words(angles.right.thirds_deg),
    )


def _simulated_row(simulated: SimulatedViews) -> tuple[str, ...]:
    return (
        f"simulated: {simulated.source}",
        _spread(simulated.left_deg),
        _spread(simulated.right_deg),
        _spread(simulated.mean_deg),
        f"{simulated.height_mm.mean:.2f}",
        f"{simulated.half_width_mm.mean:.2f}",
        "-",
        "mm",
        "-",
        f"mean and SD of {simulated.views} views of {simulated.piles} pile{'s' * (simulated.piles > 1)}",
        "-",
        "-",
    )


def _spread(of: Spread) -> str:
    return f"{of.mean:.2f}" if np.isnan(of.sd) else f"{of.mean:.2f} (SD {of.sd:.2f})"


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


def _length_unit(pile: PhotographedPile) -> tuple[float, str, int]:
    """Its size, its name, and the decimal places of a length in it."""
    return (1e3, "mm", 2) if pile.unit == "m" else (1.0, "px", 1)


def _pile_result(pile: PhotographedPile) -> dict[str, Any]:
    factor, unit, _ = _length_unit(pile)
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
