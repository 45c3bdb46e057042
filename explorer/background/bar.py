"""A progress bar in a terminal or a notebook."""

from __future__ import annotations

import sys
from typing import IO


class Bar:
    """A bar in the last line of a terminal, or below a notebook's cell; printed lines appear above it."""

    def __init__(self, file: IO[str] | None = None) -> None:
        # Imported only where it is used: the page reads progress, and has no terminal.
        from rich.console import Console
        from rich.progress import BarColumn, Progress, TextColumn

        console = Console(file=file)
        # On the same screen, lines go above the bar; output to a file or a pipe must not end up on the screen.
        one_screen = sys.stdout.isatty()
        shown = console.is_terminal or console.is_jupyter
        columns = TextColumn("{task.description}"), BarColumn()
        # Drawn when there is something new, without a thread of its own: Taichi's kernels are kept at once only if
        # there is a single thread (`solver.backend.keep_compiled`).
        self._progress = Progress(
            *columns,
            console=console,
            transient=True,
            disable=not shown,
            redirect_stdout=one_screen,
            auto_refresh=False,
        )
        self._task = self._progress.add_task("", total=None)

    def show(self, state: str, done: float, planned: float) -> None:
        """Show ``done`` of ``planned``; while nothing is planned, the bar only moves."""
        self._progress.start()
        self._progress.update(self._task, description=state, completed=done, total=planned or None, refresh=True)

    def close(self) -> None:
        """Remove the bar."""
        self._progress.stop()
