"""Changes: undo and redo, the list of differences from the default with a way back, and presets.

Undo and redo step through former values of the live parameters, one entry per change. The solver decides: an entry is
what it has in force, whoever asked for it. What undo and redo ask for also comes back as such a change, and is
recognised by its values.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from html import escape
from typing import Any

import viser

from explorer.errors import CommandError
from explorer.live.session import Session
from explorer.scene.presets import Preset, preset_names, preset_path, preset_values, read_preset, save_preset
from explorer.scene.source import Difference, differences, shown
from explorer.viewer.actions import add_keys, button_group
from explorer.viewer.panel import SET_UP, Now, PageContext, Panel
from explorer.viewer.view import small_html
from solver.scenes.scene import Scene, parameters, values, with_values

LiveValues = Mapping[str, Any]
"""Path → value in SI, of all live parameters."""

MOST_ENTRIES = 200
"""Changes that can be undone."""
MERGED = 1.0
"""Changes of the same parameters within this wall time [s] of each other are one entry: a slider being dragged."""
UNDO, REDO, BACK, DEFAULT = "Undo (Z)", "Redo (Y)", "All back", "Pour the default"
KEYS: dict[str, Any] = {UNDO: "Z", REDO: "Y"}
MOST_SHOWN = 40
"""Lines of the list of differences from the default."""
ONE = "one parameter …"
NO_PRESET = "choose …"


class ChangesPanel(Panel):
    """Buttons, list and presets."""

    name, tab, title, folded = "changes", SET_UP, "Changes and presets", False

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
        """Show the list of differences from the default."""
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
        self._preset.value = NO_PRESET  # type: ignore[misc]  # also of one that is refused: it can be chosen again
        preset = read_preset(preset_path(name, self._folder))
        apply_preset(self._session, preset)
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
    """Set the values of ``preset``: at once, or with a new pour if it has parameters that act on restart only."""
    present = session.status().scene
    found = preset_values(preset, present)
    known = parameters(present)
    if all(known[path].live for path in found):
        session.set_parameters(found)
    else:
        session.restart(with_values(present, dict(found)))


def changes_html(found: Sequence[Difference], undoable: int, redoable: int) -> str:
    """One line per parameter that differs, default → now; marked if it acts on restart only."""
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
    """Call ``act`` with the user's choice; values that the program sets do not count."""

    def chosen(event: viser.GuiEvent[Any]) -> None:
        if event.client_id is not None:
            act(str(event.target.value))

    register(chosen)


class ParameterHistory:
    """Entries of one session; a scene with other live parameters starts over."""

    def __init__(self) -> None:
        self._entries: list[LiveValues] = []
        self._at = self._goal = 0
        self._scene: Scene | None = None
        self._changed: frozenset[str] = frozenset()
        self._changed_at = 0.0

    @property
    def undoable(self) -> int:
        """How many changes can be undone."""
        return self._goal

    @property
    def redoable(self) -> int:
        """How many can be redone."""
        return len(self._entries) - 1 - self._goal if self._entries else 0

    def take(self, scene: Scene, wall: float) -> None:
        """Take note of the scene in force at the moment ``wall`` [s] of any steady clock."""
        if scene == self._scene:
            return
        self._scene = scene
        now = live_values(scene)
        if not self._entries or now.keys() != self._entries[0].keys():
            self._entries, self._at, self._goal = [now], 0, 0
            self._changed = frozenset()
        elif now != self._entries[self._at]:
            self._step(now, wall)

    def undo(self) -> LiveValues:
        """Values to be set so that the last change is undone; raises CommandError if there is none."""
        if self.undoable == 0:
            raise CommandError("nothing to undo: no live parameter was changed")
        return self._towards(self._goal - 1)

    def redo(self) -> LiveValues:
        """Values to be set so that the change that was undone last is made again; raises CommandError."""
        if self.redoable == 0:
            raise CommandError("nothing to redo")
        return self._towards(self._goal + 1)

    def stay(self) -> None:
        """The solver was not asked after all: where undo and redo stand is where the parameters are."""
        self._goal = self._at

    def _towards(self, goal: int) -> LiveValues:
        now, self._goal = self._entries[self._goal], goal
        self._changed = frozenset()  # the next change is an entry of its own
        return {path: wanted for path, wanted in self._entries[goal].items() if wanted != now[path]}

    def _step(self, now: LiveValues, wall: float) -> None:
        on_the_way = range(min(self._at, self._goal), max(self._at, self._goal) + 1)
        reached = next((k for k in on_the_way if self._entries[k] == now), None)
        if reached is not None:
            self._at = reached
            return
        before = self._entries[self._at]
        changed = frozenset(path for path in now if now[path] != before[path])
        merged = changed == self._changed and wall <= self._changed_at + MERGED and self._at > 0
        kept = self._entries[: self._at if merged else self._at + 1]
        self._entries = [*kept, now][-MOST_ENTRIES:]
        self._at = self._goal = len(self._entries) - 1
        self._changed, self._changed_at = changed, wall


def live_values(scene: Scene) -> LiveValues:
    """Values of all live parameters of ``scene``."""
    declared = parameters(scene)
    return {path: number for path, number in values(scene).items() if declared[path].live}
