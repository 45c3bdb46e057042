"""The report of photographed piles: each picture with its readings, the angles, and the outlines."""

from __future__ import annotations

import io

from PIL import Image

from explorer.photograph.annotated import MOST_PANELS
from explorer.photograph.result import MeasuredPhotographs, PhotographResult, ReadPile
from explorer.photograph.run import MeasureOrder, drawn_sheet
from explorer.report.content import (
    Banner,
    Block,
    Bullets,
    DataTable,
    Figure,
    Picture,
    Report,
    Section,
    Spec,
    Strong,
    Table,
    Word,
)
from explorer.report.figures.style import ASSUMPTION, CHOSEN, FACTOR, TARGET, axis, chart, label, line
from explorer.report.methods import photograph_methods
from explorer.terminal.photograph import lens_words, thirds_words
from explorer.units import MISSING, enumeration, fixed, number

MOST_BYTES = 1_500_000
"""Size of a picture, so that the page stays below 5 MB with its chart library and the overhead of base64."""
COLOURS = (FACTOR, ASSUMPTION, TARGET, CHOSEN)
READ = "read"
"""Name of the picture with the readings."""


def read_picture(order: MeasureOrder, measured: MeasuredPhotographs) -> bytes:
    """The pictures with the readings drawn in, as one PNG of at most ``MOST_BYTES``."""
    return png_within(MOST_BYTES, drawn_sheet(order, measured, thirds=True))


def png_within(most: int, picture: Image.Image) -> bytes:
    """A picture as PNG of at most ``most`` bytes, scaled down until it fits."""
    while len(found := _png(picture)) > most:
        size = round(0.8 * picture.width), round(0.8 * picture.height)
        picture = picture.resize(size, Image.Resampling.LANCZOS)
    return found


def _png(picture: Image.Image) -> bytes:
    file = io.BytesIO()
    picture.save(file, "PNG")
    return file.getvalue()


def photograph_report(result: PhotographResult, picture: bytes | None) -> Report:
    """The report; ``picture`` is the result of :func:`read_picture`, None if it is lost."""
    names = [*(pile.name for pile in result.piles), *result.refused]
    blocks: list[Block] = [_angles(result)] if result.piles else []
    if picture is not None:
        over = "the outline, both flank lines and the base line drawn over them: " if result.piles else "no angle: "
        blocks.append(
            Picture(
                READ,
                picture,
                f"Photographs of piles with {over}{', '.join(names[:MOST_PANELS])}",
                f"{_counted(result)} {_drawn(result)}".strip(),
            )
        )
    methods, references = photograph_methods(result)
    sections = [Section("Angle of repose", tuple(blocks))]
    if result.piles:
        sections.append(Section("Outlines", (Figure("outlines", outlines(result), _outline_words(result)),)))
    if result.refused:
        lines = tuple(f"{name}: {why}" for name, why in result.refused.items())
        sections.append(Section("Pictures without an angle", (Bullets(lines),)))
    inputs = tuple(table for table in (_inputs(result), _parts(result)) if table.rows)
    sections += [Section("What was read off", inputs)] if inputs else []
    data = DataTable(
        "outlines",
        ("picture", "unit", "u", "z"),
        tuple((pile.name, pile.unit, u, z) for pile in result.piles for u, z in zip(pile.u, pile.z, strict=True)),
    )
    angles = DataTable(
        "angles",
        ("picture", "flank", "angle_deg", "plus_minus_95_deg", "lower_deg", "middle_deg", "upper_deg", "refused"),
        (
            *(
                (pile.name, flank, *value, *(thirds or (None,) * 3), None)
                for pile in result.piles
                for flank, value, thirds in (
                    ("left", pile.left, pile.left_thirds),
                    ("right", pile.right, pile.right_thirds),
                    ("mean", pile.mean, ()),
                )
            ),
            *((name, *[None] * 6, why) for name, why in result.refused.items()),
        ),
    )
    return Report(
        "Angle of repose on photographs",
        ", ".join(names),
        banner(result),
        (*sections, methods),
        result.about,
        (angles, data),
        references,
    )


def _counted(result: PhotographResult) -> str:
    n = len(result.piles) + len(result.refused)
    return "n = 1 picture, read by its silhouette." if n == 1 else f"n = {n} pictures, read by one silhouette each."


def _drawn(result: PhotographResult) -> str:
    """What the lines on the pictures mean."""
    if not result.piles:
        return "None was read, and nothing is drawn."
    n = len(result.piles) + len(result.refused)
    lines = f"The first {MOST_PANELS} are drawn. " if n > MOST_PANELS else ""
    lines += "White: outline; orange: flank lines (least squares); green: their thirds; blue: base line."
    return f"{lines} Lowest: the simulated pile {result.simulated}." if result.simulated else lines


def banner(result: PhotographResult) -> Banner:
    """The angle with its spread over pictures, or that there is none."""
    n, lost = len(result.piles), len(result.refused)
    if n == 0:
        first, why = next(iter(result.refused.items()))
        return Banner(
            Word.REFUSED,
            "",
            f"{first}: {why}" if lost == 1 else f"None of {lost} pictures shows a pile that can be read.",
            "Take the picture again as its refusal says." if lost == 1 else "Take them again as their refusals say.",
        )
    over = result.over_pictures
    mean, sd, half = over.mean_deg, over.sd_deg, over.interval_deg[1] - over.mean_deg
    beside = f" {lost} more show none that can be read." if lost else ""
    if n == 1:
        return Banner(
            Word.MEASURED,
            f"{fixed(mean)} ± {fixed(result.piles[0].mean[1])}°",
            f"One picture; ±: 95 % of reading this silhouette. How far pours differ it cannot say.{beside}",
            "Photograph four more pours: a study needs the standard deviation between them.",
        )
    return Banner(
        Word.MEASURED,
        f"{fixed(mean)} ± {fixed(half)}°",
        f"n = {n} pictures, SD {fixed(sd)}°; ±: 95 % of their mean, Student’s t.{beside}",
        f"Put mean {fixed(mean)}°, SD {fixed(sd)}° and n = {n} into the target of a study.",
    )


def outlines(result: PhotographResult) -> Spec:
    """The outlines superimposed on one scale: those whose scale is known, in pixels only if none is."""
    piles = _on_one_scale(result)
    factor, unit = (1e3, "mm") if piles[0].unit == "m" else (1.0, "px")
    traces = [
        {
            "type": "scatter",
            "mode": "lines",
            "x": [factor * u for u in pile.u],
            "y": [factor * z for z in pile.z],
            "name": label(pile.name),
            "line": line(COLOURS[k % len(COLOURS)]),
        }
        for k, pile in enumerate(piles)
    ]
    layout = {
        "xaxis": axis(f"distance from the pile’s middle [{unit}]"),
        "yaxis": axis(f"height [{unit}]", scaleanchor="x", rangemode="tozero"),
    }
    return chart(traces, layout, 340)


def _outline_words(result: PhotographResult) -> str:
    n = len(_on_one_scale(result))
    piles, left = "pile" if n == 1 else "piles", len(result.piles) - n
    without = f" {left} without a scale {'is' if left == 1 else 'are'} not drawn." if left else ""
    return f"n = {n} {piles}, the upper edge of each silhouette over its base line, both axes on one scale.{without}"


def _on_one_scale(result: PhotographResult) -> list[ReadPile]:
    return [pile for pile in result.piles if pile.unit == "m"] or list(result.piles)


def _angles(result: PhotographResult) -> Table:
    rows = []
    for pile in result.piles:
        factor, unit = (1e3, "mm") if pile.unit == "m" else (1.0, "px")
        angles = [f"{fixed(value)} ± {fixed(half)}°" for value, half in (pile.left, pile.right, pile.mean)]
        sizes = [f"{number(factor * length, 4)} {unit}" for length in (pile.height, pile.half_width)]
        thirds = [thirds_words(one) for one in (pile.left_thirds, pile.right_thirds)]
        rows.append((pile.name, *angles[:2], Strong(angles[2]), *sizes, *thirds))
    rows += [(name, *[MISSING] * 7) for name in result.refused]
    header = (
        "picture",
        "left flank",
        "right flank",
        "mean",
        "height",
        "half-width",
        "left by thirds",
        "right by thirds",
    )
    lenses = "".join(f" {pile.name}: {lens_words(pile.lens, pile.checkerboard)}." for pile in result.piles if pile.lens)
    return Table(
        header,
        tuple(rows),
        "±: 95 % of reading this silhouette, with a bend of its flanks, of lens and camera; another pour differs by "
        f"far more. By thirds: slopes [°] of the lower, middle and upper third of the fit.{lenses}",
    )


def _inputs(result: PhotographResult) -> Table:
    """Size, scale and base line of every picture, as stated or as found."""
    rows = tuple(
        (
            pile.name,
            f"{pile.size[0]} × {pile.size[1]}",
            f"{number(1e3 * pile.pixel, 4)} mm" if pile.unit == "m" else MISSING,
            fixed(pile.base[0], 1),
            fixed(pile.base[1], 1),
            fixed(pile.base_error),
            pile.base_from,
            number(pile.lens),
        )
        for pile in result.piles
        if pile.size[0]
    )
    header = (
        "picture",
        "size [px]",
        "a pixel is",
        "base line left [px]",
        "base line right [px]",
        "its standard error [px]",
        "found by",
        "lens k",
    )
    scales = dict.fromkeys(pile.scale_from or "as stated" for pile in result.piles if pile.unit == "m")
    scale = f" Scale: {enumeration(list(scales))}, taken as exact." if scales else ""
    return Table(header, rows, f"Base line: from the top, at both edges of the picture.{scale}")


def _parts(result: PhotographResult) -> Table:
    """Contributions to the ± of the mean."""
    names = list(dict.fromkeys(name for pile in result.piles for name in pile.parts))
    rows = tuple(
        (pile.name, *(fixed(pile.parts.get(name), 3) for name in names)) for pile in result.piles if pile.parts
    )
    header = ("standard errors of the mean [°]", *(name.replace("_", " ") for name in names))
    return Table(header, rows, "Taken as independent; ± is two standard errors of all together.")
