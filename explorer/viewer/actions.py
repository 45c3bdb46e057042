"""From what a person does at the page to its loop: actions, buttons, keys, work off the loop, and the loop's clock.

viser calls back on many threads. A callback only leaves an action here; the one thread that owns session and page
carries it out, and shows the one line of whatever was refused, by us or by the machine. What the program itself sets
is no click. Work that takes seconds (reading scans, fitting spheres) is done off the loop, one thing at a time.
"""

from __future__ import annotations

import math
import queue
import threading
import time
from collections import deque
from collections.abc import Callable, Mapping
from functools import partial
from typing import Any, TypeVar

import viser

from explorer.errors import CommandError

Action = Callable[[], None]
Post = Callable[[Action], None]
ClientAction = Callable[[Any], None]
"""Something that is done to one browser."""
Found = TypeVar("Found")
HANDS_OFF = 1.5
"""Seconds after a person's input during which the program's own value does not move the widget."""


class Actions:
    """A queue of actions."""

    def __init__(self) -> None:
        self._waiting: queue.SimpleQueue[Action] = queue.SimpleQueue()

    def post(self, action: Action) -> None:
        """Leave ``action`` for the loop; from any thread."""
        self._waiting.put(action)

    def carry_out(self) -> str | None:
        """Run all that waits now. The line of the last input that was refused, "" if none was, None if nothing ran.

        What comes meanwhile waits for the next call: between two of them the page is drawn, however much comes.
        """
        notice: str | None = None
        for _ in range(self._waiting.qsize()):
            action = self._waiting.get_nowait()
            try:
                action()
                notice = notice or ""
            except (ValueError, OSError) as error:
                notice = refusal(error)
        return notice


def refusal(error: ValueError | OSError) -> str:
    """The line of what was refused, by us or by the machine: a full disk, a folder that may not be written to."""
    return f"{error.filename or 'file'}: {error.strerror or error}" if isinstance(error, OSError) else str(error)


class FrameClock:
    """Frames every ``interval`` [s], counted from when the last one was due: what waits too long does not add up."""

    def __init__(self, interval: float) -> None:
        self._interval, self._due = interval, time.monotonic()

    def wait(self, stop: threading.Event) -> None:
        """Wait until the next frame is due, or ``stop`` is set; not at all where it is due already."""
        self._due = max(self._due + self._interval, time.monotonic())
        stop.wait(self._due - time.monotonic())


class SharedBox:
    """A widget that a person and the program (the solver's values, another panel) both move.

    viser writes what a browser sends into the handle at once and calls back on another thread, many milliseconds later
    on a busy machine. Whoever follows the program meanwhile would put the old value back, and the call would read that:
    so a value that the program did not write counts as a person's hand from the moment it is seen.
    """

    def __init__(self, handle: Any) -> None:
        self.handle, self._known, self._touched = handle, handle.value, -math.inf

    @property
    def value(self) -> Any:
        """What the widget shows."""
        return self.handle.value

    def held(self) -> bool:
        """Whether a person is at it, or was ``HANDS_OFF`` ago."""
        # `in` and not `==`: a browser may send NaN, which is the same thing and yet not equal.
        if self.handle.value not in (self._known,):
            self._touch()
        return time.monotonic() < self._touched + HANDS_OFF

    def listen(self, post: Post, take: Callable[[Any], None]) -> None:
        """Hand what a person enters, and not what the program shows, to ``take`` on the loop."""

        def entered(event: viser.GuiEvent[Any]) -> None:
            if event.client_id is not None:
                sent = event.target.value
                self._touch()
                post(lambda: take(sent))

        self.handle.on_update(entered)

    def _touch(self) -> None:
        self._touched, self._known = time.monotonic(), self.handle.value

    def show(self, value: Any) -> None:
        """Move it to what the program has."""
        self.handle.value = value
        self._known = self.handle.value


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
) -> Any:
    """A row of buttons named by the keys of ``acts``; a click posts the action with the browser that it came from.

    Returns viser's handle.
    """
    buttons = gui.add_button_group(title, tuple(acts), hint=hint)

    @buttons.on_click
    def _(event: viser.GuiEvent[Any]) -> None:
        if event.client is not None and event.target.value in acts:
            post(partial(acts[event.target.value], event.client))

    return buttons


def add_keys(gui: viser.GuiApi, acts: Mapping[str, Action], keys: Mapping[str, Any], post: Post) -> None:
    """A command per entry of ``keys`` (label → key), which posts the action of that label; in viser's palette too."""
    for label, key in keys.items():
        gui.add_command(label, hotkey=key).on_trigger(_posting(acts[label], post))


def add_client_key(gui: viser.GuiApi, label: str, key: Any, act: ClientAction, post: Post) -> None:
    """A command with a key, which posts ``act`` with the browser in which it was pressed."""

    def pressed(event: Any) -> None:
        if event.client is not None:
            post(partial(act, event.client))

    gui.add_command(label, hotkey=key).on_trigger(pressed)


def _posting(action: Action, post: Post) -> Any:
    def pressed(event: object) -> None:
        post(action)

    return pressed


def on_upload(button: viser.GuiUploadButtonHandle, take: Callable[[str, bytes], None], post: Post) -> None:
    """Post ``take`` (name, content) for every file that a browser sends by viser's upload ``button``."""

    @button.on_upload
    def _(event: viser.GuiEvent[Any]) -> None:
        if event.client_id is not None:
            sent = event.target.value
            post(lambda: take(str(sent.name), bytes(sent.content)))


class BackgroundWork:
    """Runs one piece of work in a thread; what it found, or what was wrong, comes back as an action."""

    def __init__(self, post: Post) -> None:
        self._post, self._busy_with = post, ""
        self._next: deque[Callable[[], None]] = deque()

    @property
    def busy_with(self) -> str:
        """What is being done, empty if nothing is."""
        return self._busy_with

    def start(self, what: str, work: Callable[[], Found], done: Callable[[Found], None]) -> None:
        """Begin ``work``; ``done`` is called with its result by the page's loop. From that loop only.

        Raises CommandError while something else is being done. ``work`` must neither touch the session nor the page.
        """
        if self._busy_with:
            raise CommandError(f"{what}: wait until this is done: {self._busy_with}")
        self._busy_with = what
        threading.Thread(target=self._run, args=(what, work, done), daemon=True, name="explorer-background").start()

    def start_when_free(self, what: str, work: Callable[[], Found], done: Callable[[Found], None]) -> None:
        """The same at once, or as soon as what is being done is done: for what would be lost by a refusal."""
        self._next.append(lambda: self.start(what, work, done))
        self._go_on()

    def _go_on(self) -> None:
        if not self._busy_with and self._next:
            self._next.popleft()()

    def _run(self, what: str, work: Callable[[], Found], done: Callable[[Found], None]) -> None:
        try:
            found = work()
        except OSError as error:
            line = f"{what}: {error.strerror or error}"
            self._post(lambda: self._refuse(CommandError(line)))
        except Exception as error:  # a refusal becomes the notice; a mistake of the program is raised in the loop
            problem = error
            self._post(lambda: self._refuse(problem))
        else:
            self._post(lambda: self._finish(done, found))

    def _finish(self, done: Callable[[Found], None], found: Found) -> None:
        self._busy_with = ""
        try:
            done(found)
        finally:
            self._go_on()

    def _refuse(self, error: Exception) -> None:
        self._busy_with = ""
        self._go_on()
        raise error
