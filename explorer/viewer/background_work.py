"""Work that takes seconds (reading scans, fitting spheres), off the page's loop: one thing at a time."""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import TypeVar

from explorer.errors import CommandError
from explorer.viewer.actions import Post

Found = TypeVar("Found")


class BackgroundWork:
    """Runs one piece of work in a thread; what it found, or what was wrong, comes back as an action."""

    def __init__(self, post: Post) -> None:
        self._post, self._busy_with = post, ""

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
        done(found)

    def _refuse(self, error: Exception) -> None:
        self._busy_with = ""
        raise error
