"""From the user's input on the page to its loop: actions, buttons, keys, work off the loop, and the loop's clock.

viser calls back on many threads. A callback only posts an action here. The one thread that owns session and page
carries it out, and shows a one-line message if the program or the machine refuses it. Values set by the program itself
do not count as clicks. Work that takes seconds (reading scans, fitting spheres) is done off the loop, one job at a
time.
"""

from __future__ import annotations

import math
import queue
import threading
import time
from collections import deque
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from typing import Any, TypeVar

import viser

from explorer.errors import CommandError

Action = Callable[[], None]
Post = Callable[[Action], None]
ClientAction = Callable[[Any], None]
"""An action on one browser."""
Found = TypeVar("Found")
HANDS_OFF = 1.5
"""Seconds after the user's input during which the program's own value does not move the widget."""


@dataclass(frozen=True)
class OwnAction:
    """An action that nobody asked for, such as a look into the store: if it succeeds, the last refusal stays told."""

    act: Action

    def __call__(self) -> None:
        """Act."""
        self.act()


class Actions:
    """A queue of actions."""

    def __init__(self) -> None:
        self._waiting: queue.SimpleQueue[Action] = queue.SimpleQueue()

    def post(self, action: Action) -> None:
        """Post ``action`` for the loop; from any thread."""
        self._waiting.put(action)

    def carry_out(self) -> str | None:
        """Run all waiting actions. Returns the message of the last refused input, "" if none was, None if nothing of
        the user's ran.

        Actions posted meanwhile wait for the next call, so the page is drawn between two calls, however many arrive.
        """
        notice: str | None = None
        for _ in range(self._waiting.qsize()):
            action = self._waiting.get_nowait()
            try:
                action()
                if not isinstance(action, OwnAction):
                    notice = notice or ""
            except (ValueError, OSError) as error:
                notice = refusal(error)
        return notice


def refusal(error: ValueError | OSError) -> str:
    """One-line message of a refusal by the program or the machine (a full disk, a folder without write permission)."""
    return f"{error.filename or 'file'}: {error.strerror or error}" if isinstance(error, OSError) else str(error)


class FrameClock:
    """Frames every ``interval`` [s], counted from when the last one was due, so that overlong waits do not add up."""

    def __init__(self, interval: float) -> None:
        self._interval, self._due = interval, time.monotonic()

    def wait(self, stop: threading.Event) -> None:
        """Wait until the next frame is due, or ``stop`` is set; not at all if it is already due."""
        self._due = max(self._due + self._interval, time.monotonic())
        stop.wait(self._due - time.monotonic())


class SharedBox:
    """A widget that both the user and the program (the solver's values, another panel) move.

    viser writes what a browser sends into the handle at once but calls back on another thread, on a busy machine many
    milliseconds later. An update by the program in between would restore the old value, which the callback would read.
    So a value that the program did not write counts as the user's from the moment it is seen.
    """

    def __init__(self, handle: Any) -> None:
        self.handle, self._known, self._touched = handle, handle.value, -math.inf

    @property
    def value(self) -> Any:
        """What the widget shows."""
        return self.handle.value

    def held(self) -> bool:
        """Whether the user is moving the widget, or did so within the last ``HANDS_OFF``."""
        # `in` and not `==`: a browser may send NaN, which is identical to itself but not equal.
        if self.handle.value not in (self._known,):
            self._touch()
        return time.monotonic() < self._touched + HANDS_OFF

    def listen(self, post: Post, take: Callable[[Any], None]) -> None:
        """Hand what the user enters, but not what the program shows, to ``take`` on the loop."""

        def entered(event: viser.GuiEvent[Any]) -> None:
            if event.client_id is not None:
                sent = event.target.value
                self._touch()
                post(lambda: take(sent))

        self.handle.on_update(entered)

    def _touch(self) -> None:
        self._touched, self._known = time.monotonic(), self.handle.value

    def show(self, value: Any) -> None:
        """Move the widget to the program's value."""
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
    """A row of buttons named by the keys of ``acts``; a click posts the action with the browser it came from.

    Returns viser's handle.
    """
    buttons = gui.add_button_group(title, tuple(acts), hint=hint)

    @buttons.on_click
    def _(event: viser.GuiEvent[Any]) -> None:
        if event.client is not None and event.target.value in acts:
            post(partial(acts[event.target.value], event.client))

    return buttons


def add_keys(gui: viser.GuiApi, acts: Mapping[str, Action], keys: Mapping[str, Any], post: Post) -> None:
    """A command per entry of ``keys`` (label → key), which posts its action; also listed in viser's palette."""
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
    """Runs one job at a time in a thread; its result or error comes back as an action."""

    def __init__(self, post: Post) -> None:
        self._post, self._busy_with = post, ""
        self._next: deque[Callable[[], None]] = deque()

    @property
    def busy_with(self) -> str:
        """The job being done; empty if there is none."""
        return self._busy_with

    def start(self, what: str, work: Callable[[], Found], done: Callable[[Found], None]) -> None:
        """Begin ``work``; the page's loop calls ``done`` with its result. Call it from that loop only.

        Raises CommandError while another job is being done. ``work`` must touch neither the session nor the page.
        """
        if self._busy_with:
            raise CommandError(f"{what}: wait until this is done: {self._busy_with}")
        self._busy_with = what
        threading.Thread(target=self._run, args=(what, work, done), daemon=True, name="explorer-background").start()

    def start_when_free(self, what: str, work: Callable[[], Found], done: Callable[[Found], None]) -> None:
        """Begin ``work`` at once, or as soon as the present job is done: for work that a refusal would lose."""
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
        except Exception as error:  # a refusal becomes the notice; a program error is raised in the loop
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
