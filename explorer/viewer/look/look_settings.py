"""The settings of how things are drawn: handles on the page show a :class:`Look`, and change it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

import viser

from explorer.screen_units import InputError
from explorer.viewer.actions import Post
from explorer.viewer.look.look import Look

Take = Callable[[object], Mapping[str, Any]]
"""From what a browser sent to settings of :class:`Look`; raises InputError for what may not be sent."""


class LookSettings:
    """Holds the settings; what they do is up to who reads :attr:`look`."""

    def __init__(self, post: Post) -> None:
        self.look, self._post = Look(), post
        self._shown: list[tuple[Any, Callable[[Look], Any]]] = []

    def bind(self, handle: Any, shown: Callable[[Look], Any], take: Take) -> None:
        """Let ``handle`` always show ``shown`` of the look, and take over what a person enters there."""
        self._shown.append((handle, shown))
        self.listen(handle, take)

    def listen(self, handle: Any, take: Take) -> None:
        """Take over what a person enters at ``handle``, and not what this program writes there."""

        def entered(event: viser.GuiEvent[Any]) -> None:
            if event.client_id is not None:
                value = event.target.value
                self._post(lambda: self.change(**take(value)))

        handle.on_update(entered)

    def change(self, **settings: Any) -> None:
        """Take over settings of :class:`Look` and show them; raises InputError for a range that is none."""
        look = replace(self.look, **settings)
        if look.high <= look.low:
            raise InputError(f"colour range: its end {look.high:g} is not above its beginning {look.low:g}")
        self.look = look
        for handle, shown in self._shown:
            if handle.value != shown(look):
                handle.value = shown(look)

    def next(self, setting: str, choices: tuple[str, ...]) -> None:
        """Change ``setting`` to the choice that comes after the present one, around."""
        following = (choices.index(getattr(self.look, setting)) + 1) % len(choices)
        self.change(**{setting: choices[following]})


def one_of(value: object, choices: tuple[str, ...], name: str) -> str:
    """A choice that came from a browser; raises InputError if it is none."""
    for choice in choices:
        if value == choice:
            return choice
    raise InputError(f"{name}: {str(value)[:40]!r} is not one of {', '.join(choices)}")
