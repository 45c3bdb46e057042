"""Buttons and keys that leave an action for the page's loop; what the program itself sets is no click."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from typing import Any

import viser

from explorer.viewer.actions import Action, Post

ClientAction = Callable[[Any], None]
"""Something that is done to one browser."""


def button_group(gui: viser.GuiApi, title: str, acts: Mapping[str, Action], post: Post, hint: str | None = None) -> Any:
    """A row of buttons named by the keys of ``acts``; a click posts the action. Returns viser's handle."""
    buttons = gui.add_button_group(title, tuple(acts), hint=hint)

    @buttons.on_click
    def _(event: viser.GuiEvent[Any]) -> None:
        # A browser may send any name.
        if event.client_id is not None and event.target.value in acts:
            post(acts[event.target.value])

    return buttons


def client_buttons(
    gui: viser.GuiApi, title: str, acts: Mapping[str, ClientAction], post: Post, hint: str | None = None
) -> None:
    """A row of buttons named by the keys of ``acts``; a click posts the action with the browser that it came from."""
    buttons = gui.add_button_group(title, tuple(acts), hint=hint)

    @buttons.on_click
    def _(event: viser.GuiEvent[Any]) -> None:
        if event.client is not None and event.target.value in acts:
            post(partial(acts[event.target.value], event.client))


def add_client_key(gui: viser.GuiApi, label: str, key: Any, act: ClientAction, post: Post) -> None:
    """A command with a key, which posts ``act`` with the browser in which it was pressed."""

    def pressed(event: Any) -> None:
        if event.client is not None:
            post(partial(act, event.client))

    gui.add_command(label, hotkey=key).on_trigger(pressed)


def add_keys(gui: viser.GuiApi, acts: Mapping[str, Action], keys: Mapping[str, Any], post: Post) -> None:
    """A command per entry of ``keys`` (label → key), which posts the action of that label; in viser's palette too."""
    for label, key in keys.items():
        gui.add_command(label, hotkey=key).on_trigger(_posting(acts[label], post))


def on_upload(button: viser.GuiUploadButtonHandle, take: Callable[[str, bytes], None], post: Post) -> None:
    """Post ``take`` (name, content) for every file that a browser sends by viser's upload ``button``."""

    @button.on_upload
    def _(event: viser.GuiEvent[Any]) -> None:
        if event.client_id is not None:
            sent = event.target.value
            post(lambda: take(str(sent.name), bytes(sent.content)))


def _posting(action: Action, post: Post) -> Any:
    def pressed(event: object) -> None:
        post(action)

    return pressed
