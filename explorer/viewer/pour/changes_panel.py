"""What was changed: undo and redo, the list against the default with the way back, and presets."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from html import escape
from typing import Any

import viser

from explorer.parameter_history import LiveValues, ParameterHistory
from explorer.scene.changes import Difference, differences, shown
from explorer.scene.presets import Preset, preset_names, preset_path, preset_values, read_preset, save_preset
from explorer.session import Session
from explorer.viewer.buttons import add_keys, button_group
from explorer.viewer.panel import POUR, Now, PageContext, Panel
from explorer.viewer.small_text import small_html
from solver.scenes.scene import Scene, parameters, with_values

UNDO, REDO, BACK, DEFAULT = "Undo (Z)", "Redo (Y)", "All back", "Pour the default"
KEYS: dict[str, Any] = {UNDO: "Z", REDO: "Y"}
MOST_SHOWN = 40
ONE = "one parameter …"
NO_PRESET = "choose …"


class ChangesPanel(Panel):
    """Buttons, list and presets."""

    name, tab, title, folded = "changes", POUR, "Changes and presets", False

    def __init__(self, page: PageContext) -> None:
        gui, post = page.server.gui, page.post
        self._session, self._folder = page.session, page.data / "presets"
        self._history = ParameterHistory()
        self._compared: tuple[Scene, Scene] | None = None
        self._differences: tuple[Difference, ...] = ()
        acts = {UNDO: self._undo, REDO: self._redo, BACK: self._back, DEFAULT: self._pour_default}
        self._buttons = button_group(
            gui,
            "Changes",
            acts,
            post,
            hint="Undo and redo: changes of what acts now, not of what needs a new pour. All back: those return to "
            "the default. Pour the default: everything does, with a new pour.",
        )
        self._list = gui.add_html("")
        self._one = gui.add_dropdown("Back to default", (ONE,), hint="One parameter returns to its default.")
        self._preset = gui.add_dropdown(
            "Preset", (NO_PRESET, *preset_names(self._folder)), hint="Sets the values that it names, at once."
        )
        self._about = gui.add_html("")
        self._name = gui.add_text("Name", "", hint="Name of a preset of your own: letters, digits, blanks, - and _.")
        save = gui.add_button("Save as preset", hint="Keeps everything that differs from the default.")
        save.on_click(lambda _: post(self._save))
        _on_choice(self._one.on_update, lambda chosen: post(lambda: self._one_back(chosen)))
        _on_choice(self._preset.on_update, lambda chosen: post(lambda: self._apply(chosen)))
        add_keys(gui, acts, KEYS, post)

    def draw(self, now: Now) -> None:
        """Take note of the parameters in force."""
        self._history.take(now.status.scene, time.monotonic())

    def show(self, now: Now) -> None:
        """The list against the default."""
        default, scene = self._session.source.scene, now.status.scene
        if self._compared is None or self._compared[0] is not default or self._compared[1] != scene:
            self._compared = (default, scene)
            self._differences = tuple(differences(default, scene))
            live = tuple(one.path for one in self._differences if one.live)
            self._one.options = (ONE, *live)
        if self._one.value != ONE:
            self._one.value = ONE  # type: ignore[misc]
        html = changes_html(self._differences, self._history.undoable, self._history.redoable)
        if self._list.content != html:
            self._list.content = html

    def _undo(self) -> None:
        self._go(self._history.undo())

    def _redo(self) -> None:
        self._go(self._history.redo())

    def _go(self, values: LiveValues) -> None:
        try:
            self._session.set_parameters(values)
        except ValueError:
            self._history.stay()
            raise

    def _back(self) -> None:
        self._session.set_parameters(defaults(self._session))

    def _pour_default(self) -> None:
        self._session.restart(self._session.source.scene)

    def _one_back(self, path: str) -> None:
        wanted = defaults(self._session)
        if path in wanted:
            self._session.set_parameters({path: wanted[path]})

    def _apply(self, name: str) -> None:
        if name == NO_PRESET:
            return
        preset = read_preset(preset_path(name, self._folder))
        apply_preset(self._session, preset)
        self._preset.value = NO_PRESET  # type: ignore[misc]
        self._say(f"{preset.title}: {preset.about}")

    def _save(self) -> None:
        path = save_preset(str(self._name.value).strip(), self._folder, self._differences)
        self._preset.options = (NO_PRESET, *preset_names(self._folder))
        self._say(f"Saved: {path}")

    def _say(self, text: str) -> None:
        self._about.content = small_html(escape(text))


def defaults(session: Session) -> dict[str, Any]:
    """Default values of the live parameters that differ from them."""
    return {one.path: one.before for one in differences(session.source.scene, session.status().scene) if one.live}


def apply_preset(session: Session, preset: Preset) -> None:
    """Set the values of ``preset``: at once, or with a new pour where it names what acts on restart only."""
    present = session.status().scene
    found = preset_values(preset, present)
    known = parameters(present)
    if all(known[path].live for path in found):
        session.set_parameters(found)
    else:
        session.restart(with_values(present, dict(found)))


def changes_html(found: Sequence[Difference], undoable: int, redoable: int) -> str:
    """One line per parameter that differs, default → now; marked where it acts on restart only."""
    rows = "".join(
        f"<tr><td style='padding-right:1em'>{escape(one.path)}"
        f"{'' if one.live else ' <i>(on restart)</i>'}</td>"
        f"<td style='white-space:nowrap'>{escape(shown(one.before, one.unit))} → "
        f"<b>{escape(shown(one.now, one.unit))}</b></td></tr>"
        for one in found[:MOST_SHOWN]
    )
    more = f"<div>and {len(found) - MOST_SHOWN} more</div>" if len(found) > MOST_SHOWN else ""
    head = f"{len(found)} changed against the default" if found else "Everything is at its default"
    steps = f"{undoable} to undo, {redoable} to redo"
    return small_html(f"{head}; {steps}.<table style='font-variant-numeric:tabular-nums'>{rows}</table>{more}")


def _on_choice(register: Callable[[Any], Any], act: Callable[[str], object]) -> None:
    """Call ``act`` with what a person chose; what the program sets itself is no choice."""

    def chosen(event: viser.GuiEvent[Any]) -> None:
        if event.client_id is not None:
            act(str(event.target.value))

    register(chosen)
