"""Photographs as the measured target of a study: a folder that keeps them, and what was read off them.

photograph.json              what was read (`explorer.report.photograph`); a folder without it is no target
NAME-DIGEST.png              every photograph as it came
NAME-DIGEST.png.upright.jpg  where its scale is known: the part around its pile, upright, to stand behind its outline

One photograph tells an angle, and how well that was read; how piles differ among each other is seen on several, each of
another pile. Files of pictures are named by their content and ``photograph.json`` is written last and taken away first,
so that a target is there as a whole or not at all.
"""

from __future__ import annotations

import base64
import hashlib
import io
import json
import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from PIL import Image
from scipy import ndimage

from doe.record import RecordError
from doe.studies.study import load_study
from doe.target import Target
from explorer.background.output_folder import ResultFile
from explorer.errors import CommandError
from explorer.files.output_file import write_whole, write_whole_bytes
from explorer.files.run_folder import json_text
from explorer.files.uploads import label
from explorer.photograph.result import MeasuredPhotographs, PhotographResult, ReadPile, photograph_result
from explorer.report.figures.pours import Backdrop
from explorer.study.edit import remeasured
from explorer.terminal.photograph import angle_words
from explorer.units import enumeration, fixed
from solver.photograph import PhotographedPile, Picture, open_picture
from solver.photograph.reading_error import COVERAGE

FOLDER = "target"
"""Name of the folder in a project, and in the output folder of a study that was started with it."""
OBSERVABLE = "angle_of_repose_deg"
OF_ONE = "of reading one photograph"
"""What the standard deviation of a target is where nobody has seen how piles differ."""
UPRIGHT = ".upright.jpg"
WIDEST, QUALITY = 900, 80
"""Of an upright picture: columns [px], and quality of its JPEG."""
PLACES = 4
"""Decimal places of an angle [°] in a study's file."""
MARGIN = 0.08
"""Of an upright picture around its pile, as a share of the pile's width."""
DIGEST = re.compile(r"-[0-9a-f]{12}$")


@dataclass(frozen=True)
class PhotographedTarget:
    """Photographs of piles of one material, kept in ``folder``; angles [°]."""

    folder: Path
    result: PhotographResult

    @property
    def n(self) -> int:
        """Photographs, each of another pile."""
        return len(self.result.piles)

    @property
    def mean(self) -> float:
        """Mean angle over the photographs."""
        return self.result.over_pictures.mean_deg

    @property
    def sd(self) -> float:
        """Standard deviation between piles; of one photograph the standard error of reading it."""
        return self.result.over_pictures.sd_deg if self.n > 1 else self.result.piles[0].mean[1] / COVERAGE

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the photographs as they came."""
        return tuple(map(self.name_of, self.result.piles))

    @property
    def kept(self) -> bool:
        """Whether the photographs are kept under their digests; a record of before tells it by their names alone."""
        kept = self.result.kept
        return all(_digest(pile.name) for pile in self.result.piles) if kept is None else kept

    def name_of(self, pile: ReadPile) -> str:
        """Name of the photograph of ``pile`` as it came."""
        return shown_name(pile.name) if self.kept else pile.name

    @property
    def short(self) -> str:
        """The angle for a narrow place, with what is known of its error, by name."""
        of, places = "photograph" if self.n == 1 else f"{self.n} photographs", 1 if self.sd >= 0.1 else 2
        error = "standard error" if self.n == 1 else "standard deviation"
        return f"{fixed(self.mean, places)}° ({error} {fixed(self.sd, places)}°) · {of}"

    @property
    def line(self) -> str:
        """The angle, where it is from, and what each number beside it is."""
        if self.n == 1:
            left, right = self.result.piles[0].left[0], self.result.piles[0].right[0]
            return (
                f"{angle_words(self.mean, self.sd)}, read off {self.names[0]}: both of reading it. One photograph: how "
                f"piles differ among each other is in neither. Its flanks: {fixed(left)}° and {fixed(right)}°."
            )
        return (
            f"{fixed(self.mean)}° (standard deviation between piles {fixed(self.sd)}°; standard error of the mean "
            f"{fixed(self.sd / self.n**0.5)}°), n = {self.n}, read off {enumeration(self.names)}."
        )

    @property
    def provenance(self) -> str:
        """The photographs, their date of reading, and what the standard deviation is of, for a comment in a file."""
        names = ", ".join("".join(filter(str.isprintable, name)) for name in self.names)
        of = (
            "sd is the standard error of reading it; how piles differ is not in it, so that there is no n"
            if self.n == 1
            else f"sd is that between the {self.n} photographs (over n - 1), each taken for another pile"
        )
        return f"photographs: {names}, read {self.result.about.date}; {of}"

    def of_study(self, targets: Sequence[Target]) -> tuple[Target, ...]:
        """``targets`` of a study with its angle of repose as photographed; weight and margin stay.

        Of one photograph no number of piles is stated, so that the tests take its angle as exact. Raises CommandError
        where the study has no angle of repose for a target.
        """
        check_targets(targets)
        n, source = (self.n, "measured") if self.n > 1 else (None, OF_ONE)
        return tuple(
            replace(one, mean=self.mean, sd=self.sd, n=n, sd_source=source) if one.observable == OBSERVABLE else one
            for one in targets
        )

    @property
    def outlines(self) -> dict[str, tuple[tuple[float, ...], tuple[float, ...]]]:
        """Name → u, z [m] of every photographed outline whose scale is known."""
        known = [(self.name_of(pile), pile) for pile in self.result.piles if pile.unit == "m"]
        names = [name for name, _ in known]
        return {
            name if names.count(name) == 1 else f"{name} ({k})": (pile.u, pile.z)
            for k, (name, pile) in enumerate(known, start=1)
        }

    @property
    def backdrop(self) -> Backdrop | None:
        """The first photograph whose scale is known, on the axes of its outline; None without one."""
        for pile in self.result.piles:
            file = self.folder / (pile.name + UPRIGHT)
            if pile.unit == "m" and file.is_file():
                source = f"data:image/jpeg;base64,{base64.b64encode(file.read_bytes()).decode()}"
                return Backdrop(self.name_of(pile), source, *_window(pile))
        return None

    def copied(self, folder: Path) -> None:
        """The same target in another ``folder``, without the photographs as they came."""
        if folder.resolve() == self.folder.resolve():
            return
        folder.mkdir(parents=True, exist_ok=True)
        for pile in self.result.piles:
            if (file := self.folder / (pile.name + UPRIGHT)).is_file():
                write_whole_bytes(folder / file.name, file.read_bytes())
        _write(self.result, folder)


def check_targets(targets: Sequence[Target]) -> None:
    """Raise CommandError unless photographs can give one of a study's ``targets``."""
    if all(target.observable != OBSERVABLE for target in targets):
        named = ", ".join(target.observable for target in targets)
        raise CommandError(f"a photograph gives {OBSERVABLE}, but the study's target is {named}")


def load_target(folder: Path) -> PhotographedTarget | None:
    """The target in ``folder``; None where there is none. Raises CommandError in one line for a damaged one."""
    file = folder / PhotographResult.NAME
    if not file.is_file():
        return None
    try:
        result = PhotographResult.from_dict(json.loads(file.read_text(encoding="utf-8")))
    except (RecordError, ValueError) as error:
        raise CommandError(f"{file}: {' '.join(str(error).split())}") from None
    if not result.piles:
        raise CommandError(f"{file}: no photograph in it shows a pile that could be read")
    return PhotographedTarget(folder, result)


class TargetFile:
    """The target in ``folder``, read again only where it has changed."""

    def __init__(self, folder: Path) -> None:
        self.folder, self._file = folder, ResultFile(PhotographResult.NAME)
        self._version: object = None
        self._found: PhotographedTarget | None = None

    @property
    def there(self) -> bool:
        """Whether there is one, be it damaged."""
        return (self.folder / PhotographResult.NAME).is_file()

    @property
    def now(self) -> PhotographedTarget | None:
        """None where there is none, or a damaged one: its line is told where a study is started."""
        self._file.read(self.folder)
        if self._file.version != self._version:
            self._version = self._file.version
            self._found = _whole(self.folder)
        return self._found


def keep_target(
    folder: Path, files: Sequence[Path], measured: MeasuredPhotographs, anew: bool = False
) -> PhotographedTarget:
    """Add the photographs ``files``, which were ``measured``, to the target in ``folder``; ``anew``: in its place.

    Raises CommandError, with nothing changed, where one of them shows no pile or is in the target already.
    """
    for refusal in measured.refusals:
        raise CommandError(f"{refusal.name}: no angle: {refusal.reason}: {refusal.detail}")
    old = _whole(folder) if anew else None
    before = None if anew else load_target(folder)
    if before is not None and not before.kept:
        raise CommandError(f"{folder}: is a report of photographs, to which none is added; name another folder")
    result = replace(photograph_result(measured, "", ""), kept=True)
    kept = list(before.result.piles) if before else []
    pictures: dict[str, bytes] = {}
    for file, pile, read in zip(files, measured.piles, result.piles, strict=True):
        content = file.read_bytes()
        pile_read = replace(read, name=_kept_name(file.name, content))
        if any(_digest(one.name) == _digest(pile_read.name) for one in kept):
            raise CommandError(f"{shown_name(pile_read.name)}: is in the target already; take one of another pile")
        kept.append(pile_read)
        pictures[pile_read.name] = content
        if pile_read.unit == "m":
            pictures[pile_read.name + UPRIGHT] = _upright(open_picture(file), pile, pile_read)
    folder.mkdir(parents=True, exist_ok=True)
    for name, picture in pictures.items():
        write_whole_bytes(folder / name, picture)
    _write(replace(result, piles=tuple(kept)), folder)
    if old is not None:
        _remove_pictures(folder, {pile.name for pile in old.result.piles} - set(pictures))
    return PhotographedTarget(folder, replace(result, piles=tuple(kept)))


def write_into_study(file: Path, measured: MeasuredPhotographs) -> str:
    """Put what was ``measured`` on photographs into the angle of repose of the study ``file``; the line that says so.

    Raises CommandError, with the file as it was, where one of them shows no pile, and as
    :func:`explorer.study.edit.remeasured`; the study's own errors for one that cannot be read.
    """
    for refusal in measured.refusals:
        raise CommandError(f"{refusal.name}: no angle: {refusal.reason}: {refusal.detail}")
    target = PhotographedTarget(file.parent, photograph_result(measured, "", ""))
    (angle,) = (one for one in target.of_study(load_study(str(file)).targets) if one.observable == OBSERVABLE)
    assert angle.sd is not None
    rounded = replace(angle, mean=round(angle.mean, PLACES), sd=round(angle.sd, PLACES))
    write_whole(file.resolve(), remeasured(file, rounded, target.provenance))
    return f"{file}: {target.line}"


def remove_target(folder: Path) -> None:
    """Take the target out of ``folder``, with the copies of its photographs. Raises CommandError where none is."""
    target, file = _whole(folder), folder / PhotographResult.NAME
    if not file.is_file():
        raise CommandError("the target is the study's own; there is none to remove")
    file.unlink()
    if target is not None:
        _remove_pictures(folder, {pile.name for pile in target.result.piles})
    if not any(folder.iterdir()):
        folder.rmdir()


def shown_name(name: str) -> str:
    """Name of a kept picture as it came."""
    path = Path(name)
    return DIGEST.sub("", path.stem) + path.suffix


def _whole(folder: Path) -> PhotographedTarget | None:
    """The target in ``folder``; None also for a damaged one, which can be replaced and removed."""
    try:
        return load_target(folder)
    except CommandError:
        return None


def _write(result: PhotographResult, folder: Path) -> None:
    write_whole(folder / PhotographResult.NAME, json_text(result.to_dict()) + "\n")


def _remove_pictures(folder: Path, names: set[str]) -> None:
    for name in names:
        # A record from elsewhere may say any name; only pictures of ours are named by their content.
        if _digest(name) and Path(name).name == name:
            (folder / name).unlink(missing_ok=True)
            (folder / (name + UPRIGHT)).unlink(missing_ok=True)


def _kept_name(name: str, content: bytes) -> str:
    path, digest = Path(name), f"-{hashlib.sha256(content).hexdigest()[:12]}"
    return f"{label(path.stem.removesuffix(digest))}{digest}{path.suffix.lower()}"


def _digest(name: str) -> str:
    found = DIGEST.search(Path(name).stem)
    return found[0] if found else ""


def _window(pile: ReadPile) -> tuple[float, float, float, float]:
    """Left, right, lower and upper end of the upright picture of ``pile`` [its unit]."""
    margin = MARGIN * (pile.u[-1] - pile.u[0])
    return pile.u[0] - margin, pile.u[-1] + margin, -0.5 * margin, max(pile.z) + margin


def _upright(picture: Picture, pile: PhotographedPile, read: ReadPile) -> bytes:
    """The part of ``picture`` around its pile with the base line level, as JPEG."""
    left, right, low, high = _window(read)
    columns = max(2, min(WIDEST, round((right - left) / pile.pixel)))
    rows = max(2, round(columns * (high - low) / (right - left)))
    u = left + (right - left) * (np.arange(columns) + 0.5) / columns
    z = high - (high - low) * (np.arange(rows) + 0.5) / rows
    x, y = pile.in_picture(*np.meshgrid(u, z))
    grey = ndimage.map_coordinates(picture.grey, [picture.index(y), picture.index(x)], order=1, mode="nearest")
    file = io.BytesIO()
    Image.fromarray(np.clip(grey, 0, 255).astype(np.uint8)).save(file, "JPEG", quality=QUALITY)
    return file.getvalue()
