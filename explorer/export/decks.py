"""What writes the deck of each engine."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from explorer.export.deck import Deck
from explorer.export.liggghts import write_liggghts
from explorer.export.yade import write_yade

WRITERS: dict[str, Callable[[Path, Deck], None]] = {"liggghts": write_liggghts, "yade": write_yade}
"""Engine → what writes its deck into an existing folder."""
