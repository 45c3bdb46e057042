"""``explorer export``: write a pour or a material for another program."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

import typer

from explorer.commands.listing import Listing
from explorer.commands.shared_options import RIG_MATERIAL, SCENE_HELP, SET

SHORTEST, LONGEST = 0.1, 3600.0
"""Range of the simulated time of an exported pour [s]; a pour made here is limited to 0.1 … 60 s."""


class Programs(Listing):
    """Lists the programs."""

    heading = "Programs"

    def listed(self) -> Iterable[tuple[str, str]]:
        """Name of each program, with what it gets and the options that it accepts."""
        from explorer.export import EXPORTS
        from explorer.export.target import described

        return ((name, described(target)) for name, target in EXPORTS.items())


def export(
    source: str = typer.Argument(
        metavar="RIG_OR_FILE",
        help=f"{SCENE_HELP[:-1]}, or output folder of a calibration.",
    ),
    folder: Path = typer.Argument(metavar="DIR", help="New folder for the files."),
    to: str = typer.Option(..., metavar="PROGRAM", help="Program from the list below."),
    material: str | None = RIG_MATERIAL,
    set_: list[str] = SET,
    seed: int | None = typer.Option(None, min=0, help="Seed of the pour; by default 1."),
    time: float | None = typer.Option(
        None, min=SHORTEST, max=LONGEST, metavar="S", help="Simulated time [s]; by default that of the pour made here."
    ),
    every: float | None = typer.Option(
        None,
        min=1e-3,
        max=60.0,
        metavar="S",
        help="Simulated time between exported states [s]; by default only the last state is exported.",
    ),
) -> None:
    """Write a pour or a material for another program.

    For an input deck the pour runs here first, because when and where a body enters depends on what lies in its way.
    The folder explains what the coefficients mean in the other program. The output folder of `explorer calibrate`
    stands for its study with the factors at the optimum.
    """
    from explorer.errors import CommandError
    from explorer.export import EXPORTS
    from explorer.export.target import ExportOrder
    from explorer.files.run_folder import appearing
    from explorer.scene.file import named_scene, with_settings
    from explorer.scene.pour_cost import large_pour_text
    from solver import ParameterError, parameters, with_values

    if to not in EXPORTS:
        raise CommandError(f"--to {to}: not a program; allowed: {', '.join(EXPORTS)}")
    target = EXPORTS[to]
    if every is not None and "every" not in target.options:
        takers = " or ".join(name for name, one in EXPORTS.items() if "every" in one.options)
        raise CommandError(f"--every: allowed only with --to {takers}, not with {to}")
    if target.of_material and (time is not None or seed is not None):
        raise CommandError(f"--time, --seed: not allowed with --to {to}, which exports only the material")
    scene, caution = named_scene(source, material)
    if caution:
        typer.echo(f"note: {caution}", err=True)
    scene = with_settings(scene, set_)
    longest = scene.numerics.duration or scene.numerics.max_time
    if time is not None and time > longest and not target.goes_on:
        raise CommandError(f"--time {time:g}: the pour for --to {to} lasts {longest:g} s at most; allowed: up to that")
    if time is not None:
        try:
            # A longer feed has to come to its end in the pour made here, or a deck would go on without the rest.
            longest = min(time, parameters(scene)["numerics.max_time"].high)
            duration = 0.0 if target.goes_on else min(scene.numerics.duration, longest)
            scene = with_values(scene, {"numerics.max_time": longest, "numerics.duration": duration})
        except ParameterError as error:
            raise CommandError(f"--time {time:g}: {error}") from None
    target.check(scene)
    if target.pours and (large := large_pour_text(scene)):
        typer.echo(large, err=True)
    with appearing(folder, "DIR") as temporary:
        told = target.write(temporary, ExportOrder(scene, 1 if seed is None else seed, time, every))
    typer.echo(f"{folder}: {told}")
