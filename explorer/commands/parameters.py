"""``explorer parameters``: every parameter path with its value, unit, range and meaning."""

from __future__ import annotations

import typer

from explorer.commands.shared_options import SCENE_HELP


def parameters(
    source: str = typer.Argument(
        "sunflower_extract",
        metavar="[RIG_OR_FILE]",
        help=SCENE_HELP,
    ),
) -> None:
    """List every parameter that --set, a study or a slider can change.

    The column "acts" is "at once" if a change acts on a running pour, and "on restart" if it acts on the next pour.
    """
    from explorer.scene.file import load_scene
    from explorer.terminal.text_table import text_table
    from solver import Parameter, value
    from solver import parameters as declared

    def allowed(entry: Parameter) -> str:
        if entry.files:
            return f"a file {', '.join(entry.files)}"
        return ", ".join(entry.choices) if entry.choices else f"{entry.low:g} … {entry.high:g}"

    def shown(number: float | str) -> str:
        return number if isinstance(number, str) else f"{number:.6g}"

    scene = load_scene(source)
    rows = [
        (
            path,
            shown(value(scene, path)),
            entry.unit,
            allowed(entry),
            "at once" if entry.live else "on restart",
            entry.doc,
        )
        for path, entry in declared(scene).items()
    ]
    typer.echo(text_table(("path", "value", "unit", "allowed", "acts", "meaning"), rows))
