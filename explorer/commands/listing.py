"""Help of a command whose argument names one of several things: they are listed below the options."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from typer.core import TyperCommand


class Listing(TyperCommand):
    """A command with a list below its options; the list is made only when the help of this command is requested."""

    heading: str

    def listed(self) -> Iterable[tuple[str, str]]:
        """Name and description of each thing."""
        raise NotImplementedError

    def format_epilog(self, ctx: Any, formatter: Any) -> None:
        """Write the list."""
        with formatter.section(self.heading):
            formatter.write_dl(list(self.listed()))
