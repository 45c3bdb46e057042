"""``explorer warm-up``: compile in advance the kernels that other commands need."""

from __future__ import annotations

from typing import TYPE_CHECKING

import typer

from explorer.commands.shared_options import SCENE_HELP

if TYPE_CHECKING:
    from solver import Scene

MANY_BODIES = 2000
"""Measurements with more bodies are left out: they pour for hours, so that seconds of compiling do not matter."""
AN_EFFECT = {"effect.rolling_resistance.rolling_friction": 0.1}
"""Any effect would do: kernels are compiled with all effects or with none."""


def warm_up(
    sources: list[str] = typer.Argument(
        None,
        metavar="[RIG_OR_FILE]...",
        help=f"{SCENE_HELP} By default the shipped rigs, study and diagnoses.",
    ),
    threads: int | None = typer.Option(
        None, min=1, metavar="N", help="Number of simultaneous compilations; by default one per CPU core."
    ),
) -> None:
    """Compile the solver in advance, so that later commands need not; existing compiled kernels are kept."""
    from explorer.errors import CommandError
    from solver import warm_up as compiled
    from solver.arch import chosen

    if chosen() != "cpu":
        raise CommandError(f"warm-up: kernels compiled for {chosen()} are not kept; allowed: --arch cpu")
    rooms = _rooms_of(sources) if sources else _shipped_rooms()
    names = list(rooms)
    for number, seconds in compiled(list(rooms.values()), threads):
        did = "there already" if seconds is None else f"compiled in {seconds:.1f} s"
        typer.echo(f"{names[number]}: {did}")


def _rooms_of(sources: list[str]) -> dict[str, list[Scene]]:
    """Name of a room → its scenes: each source with effects off, with effects on, and with both in one worker pool."""
    from explorer.scene.file import load_scene
    from solver import with_values
    from solver.effects.columns import kernel_effects

    rooms: dict[str, list[Scene]] = {}
    for source in sources:
        scene = with_values(load_scene(source), {})
        if not kernel_effects(scene):
            acting = with_values(scene, AN_EFFECT)
            rooms[f"{source}, effects off"] = [scene]
            rooms[f"{source}, effects on"] = [acting]
            rooms[f"{source}, effects off and on"] = [scene, acting]
        else:
            rooms[f"{source}, effects on"] = [scene]
    return rooms


def _shipped_rooms() -> dict[str, list[Scene]]:
    from doe.declared.pours import room_of
    from doe.measurement.load import load_measurement
    from explorer.scene.file import DEFAULT_STUDY, load_scene
    from solver import RIGS, body_counts
    from solver.assets import measurement_folder, shipped_measurements

    rooms = _rooms_of([DEFAULT_STUDY])
    rooms |= {f"{rig}, effects off": [load_scene(rig)] for rig in RIGS}
    for name in shipped_measurements():
        conditions = load_measurement(measurement_folder(name)).fit
        if max(sum(body_counts(condition.scene)) for condition in conditions) <= MANY_BODIES:
            rooms[f"diagnosis of {name}"] = room_of(conditions)
    return rooms
