"""``explorer schema``: JSON Schema of a file, for an editor, and of an event of ``--json``, for CI."""

from __future__ import annotations

import json
from collections.abc import Iterable
from importlib import import_module
from pathlib import Path

import typer

from explorer.commands.listing import Listing

KINDS = {
    "material": ("solver.scenes.material_file", "MaterialFile"),
    "body": ("solver.scenes.material_file", "BodyFile"),
    "study": ("doe.studies.study", "StudyFile"),
    "measurement": ("doe.measurement.load", "MeasurementFile"),
    "factors": ("explorer.design.factors_file", "FactorsTable"),
    "part": ("explorer.laboratory.part", "PartFile"),
    "preset": ("explorer.scene.presets", "PresetFile"),
    "events": ("explorer.background.events", "ProgressEvent"),
}
"""Kind of file → where its table is declared. Read when one is asked for: help loads no solver."""


class Files(Listing):
    """Lists the kinds of files."""

    heading = "Files"

    def listed(self) -> Iterable[tuple[str, str]]:
        """Name and description of each kind of file."""
        return ((name, str(_table(name).__doc__).splitlines()[0]) for name in KINDS)


def schema(
    kind: str = typer.Argument(metavar="KIND", help="Kind of file from the list below."),
    out: Path | None = typer.Option(None, metavar="FILE", help="File to write the schema to instead of printing it."),
) -> None:
    """Write the JSON Schema of a TOML file or of the progress events of a long command.

    An editor with a TOML language server (taplo, Even Better TOML) uses it to complete and check keys in a file that
    begins with the line: #:schema FILE
    """
    from explorer.errors import CommandError
    from explorer.files.output_file import check_folder_of, write_whole
    from solver import json_schema

    if kind not in KINDS:
        raise CommandError(f"schema: {kind!r}; allowed: {', '.join(KINDS)}")
    text = json.dumps(json_schema(_table(kind)), ensure_ascii=False, indent=1) + "\n"
    if out is None:
        typer.echo(text, nl=False)
    else:
        check_folder_of(out, "--out")
        write_whole(out, text)


def _table(kind: str) -> type:
    module, name = KINDS[kind]
    table: type = getattr(import_module(module), name)
    return table
