"""The user's inputs for a laboratory test: a file (a shipped example or an upload), and optional numbers."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import viser

from explorer.errors import CommandError
from explorer.files.uploads import kept_file
from explorer.laboratory.command_results import CommandResult
from explorer.viewer.actions import Post, on_upload


class UploadSlot:
    """A list of examples, to which every upload is added and chosen. ``folder`` keeps the uploads.

    ``follow`` is called with the user's choice, from the list or by an upload.
    """

    def __init__(
        self,
        server: viser.ViserServer,
        label: str,
        examples: Sequence[str],
        suffixes: Sequence[str],
        folder: Path,
        post: Post,
        hint: str,
        follow: Callable[[str], None] = lambda chosen: None,
    ) -> None:
        self._suffixes, self._folder, self._follow = tuple(suffixes), folder, follow
        self._sent: dict[str, Path] = {}
        self._examples = tuple(examples)
        # In a folder of their own, because viser's client shows an upload button whether it is visible or not.
        self._place = server.gui.add_folder(None)
        with self._place:
            self._choice = server.gui.add_dropdown(label, self._examples, hint=hint)
            self.upload = server.gui.add_upload_button(
                f"Upload: {label.lower()}",
                mime_type=",".join(suffixes),
                hint=f"A file ending in {', '.join(suffixes)}.",
            )

        @self._choice.on_update
        def _(event: viser.GuiEvent[Any]) -> None:
            if event.client_id is not None:
                chosen = str(event.target.value)
                post(lambda: follow(chosen))

        on_upload(self.upload, self.take, post)

    @property
    def chosen(self) -> str:
        """The name of an example, or the path of an uploaded file."""
        value = str(self._choice.value)
        return str(self._sent.get(value, value))

    @property
    def visible(self) -> bool:
        """Whether the list and its button are shown."""
        return bool(self._place.visible)

    @visible.setter
    def visible(self, shown: bool) -> None:
        self._place.visible = shown

    def offer(self, examples: Sequence[str]) -> None:
        """Offer other examples; the first is chosen, unless an uploaded file is."""
        self._examples = tuple(examples)
        self._list(str(self._choice.value) if self._choice.value in self._sent else self._examples[0])

    def take(self, name: str, content: bytes) -> None:
        """Add an uploaded or generated file and choose it; raises CommandError if it is not of this kind."""
        path = kept_file(name, content, self._folder, self._suffixes)
        self._sent[path.name] = path
        self._list(path.name)
        self._follow(path.name)

    def _list(self, chosen: str) -> None:
        self._choice.options = (*self._examples, *self._sent)
        self._choice.value = chosen  # type: ignore[misc]


def positive(entered: object) -> float | None:
    """A number above zero; None for 0, which stands for none, and for anything that is not a number."""
    number = float(entered) if isinstance(entered, int | float) else math.nan
    return number if math.isfinite(number) and number > 0.0 else None


def number_or_none(text: str, what: str) -> float | None:
    """A typed number, None for nothing; raises CommandError for anything else."""
    if not text.strip():
        return None
    try:
        number = float(text)
    except ValueError:
        number = math.nan
    if not math.isfinite(number):
        point = " with a decimal point" if "," in text else ""
        raise CommandError(f"{what} {text.strip()[:40]!r}; allowed: a number{point}, or an empty field")
    return number


def whole_or_none(text: str, what: str, least: int, most: int | None) -> int | None:
    """A typed whole number, None for nothing; raises CommandError for anything else."""
    number = number_or_none(text, what)
    if number is None:
        return None
    if number != int(number) or not least <= number <= (math.inf if most is None else most):
        allowed = f"{least} … {most}" if most is not None else f"{least} and more"
        raise CommandError(f"{what} {text.strip()[:40]!r}; allowed: a whole number, {allowed}, or an empty field")
    return int(number)


def in_labels(work: Callable[[], CommandResult], labels: Mapping[str, str]) -> Callable[[], CommandResult]:
    """``work``, with the page's ``labels`` in place of command-line options in its answer and refusals.

    A key of ``labels`` may include a value, such as "--surrogate gp". The command line that repeats the answer is kept.
    """
    longest_first = sorted(labels, key=len, reverse=True)
    option = re.compile(rf"(?:{'|'.join(map(re.escape, longest_first))})(?![\w-])")

    def named(text: str) -> str:
        return option.sub(lambda found: labels[found[0]], text)

    def done() -> CommandResult:
        try:
            answer = work()
        except ValueError as error:
            raise CommandError(named(str(error))) from error
        return replace(answer, text=named(answer.text), note=named(answer.note))

    return done


def parts_of(text: str, mark: str) -> tuple[str, ...]:
    """Typed names, terms or conditions, separated by ``mark``."""
    return tuple(part for one in text.split(mark) if (part := one.strip()))
