"""Which processor the solver runs on: chosen once, before anything starts, and inherited by child processes."""

from __future__ import annotations

import os

from solver.params import ParameterError

VARIABLE = "EXPLORER_ARCH"
"""Environment variable that holds the choice."""
ARCHITECTURES = ("cpu", "cuda", "vulkan")
"""``cpu`` is the reference: same seed, same bits. The others need a device with double precision."""


def choose(name: str) -> None:
    """Let this process and its children compute on ``name``."""
    if name not in ARCHITECTURES:
        raise ParameterError(f"--arch: {name!r} is not one of {', '.join(ARCHITECTURES)}")
    os.environ[VARIABLE] = name


def chosen() -> str:
    """The choice, ``cpu`` unless told otherwise."""
    name = os.environ.get(VARIABLE, "cpu")
    if name not in ARCHITECTURES:
        raise ParameterError(f"{VARIABLE}: {name!r} is not one of {', '.join(ARCHITECTURES)}")
    return name
