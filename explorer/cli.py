"""The command line: one table of commands, and the one place where an error becomes a line and an exit code.

Exit codes: 0 done, 1 failure, 2 bad input, 130 interrupted. Files in `explorer/commands` import nothing heavy
at their top, so that ``explorer --help`` answers at once.
"""

from __future__ import annotations

import errno
import os
from typing import Any

import typer
from typer.core import TyperGroup

from explorer.commands import (
    analyse,
    audit,
    bench,
    board,
    calibrate,
    design,
    diagnose,
    doctor,
    export,
    lab,
    limit,
    measure,
    measurements,
    new,
    parameters,
    repeat,
    replay,
    report,
    runs,
    schema,
    serve,
    shape,
    simulate,
    store,
    validate_diagnosis,
    verify,
    warm_up,
)

BAD_INPUT, INTERRUPTED = 2, 130
OWN_PACKAGES = ("explorer", "doe", "solver")


class Commands(TyperGroup):
    """The group of all commands; turns errors about the input into ``error: …`` on stderr and exit code 2."""

    def invoke(self, ctx: typer.Context) -> Any:  # type: ignore[override]
        """Run the command that ``ctx`` names."""
        try:
            return super().invoke(ctx)
        except KeyboardInterrupt:
            raise typer.Exit(INTERRUPTED) from None
        except Exception as error:
            line = line_for_user(error)
            if line is None:
                raise
            typer.echo(f"error: {line}", err=True)
            raise typer.Exit(BAD_INPUT) from None


def line_for_user(error: Exception) -> str | None:
    """One line about an error in the input; None for an error of the program, which needs its traceback."""
    if isinstance(error, typer.Exit) or getattr(error, "errno", None) == errno.EPIPE:
        return None
    # What the parser of the command line raises: an unknown option, a missing argument.
    if hasattr(error, "format_message"):
        return _one_line(
            f"{error.format_message()} (`explorer --help` lists commands, `explorer COMMAND --help` options)"
        )
    if isinstance(error, OSError) and error.strerror:
        return _one_line(f"{error.filename}: {error.strerror}" if error.filename else error.strerror)
    return _one_line(str(error)) if isinstance(error, OSError) or _is_about_the_input(error) else None


def _is_about_the_input(error: Exception) -> bool:
    """True for a ValueError that this program defines: by the house rule, its message is a line for the user."""
    own = [kind for kind in type(error).__mro__ if kind.__module__.partition(".")[0] in OWN_PACKAGES]
    return any(issubclass(kind, ValueError) for kind in own)


def _one_line(text: str) -> str:
    return " ".join(text.split())


app = typer.Typer(
    name="explorer",
    cls=Commands,
    help="Simulate, calibrate and diagnose granular materials.",
    no_args_is_help=True,
    add_completion=False,
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
)


def _print_version(wanted: bool) -> None:
    if wanted:
        from explorer.files.run_result import package_version

        typer.echo(f"explorer {package_version('repose-explorer') or 'from a source tree that is not installed'}")
        raise typer.Exit


@app.callback()
def options(
    context: typer.Context,
    version: bool = typer.Option(
        False, "--version", callback=_print_version, is_eager=True, help="Print the version and exit."
    ),
    arch: str | None = typer.Option(
        None, metavar="ARCH", help="Processor for the solver: cpu, cuda or vulkan; by default $EXPLORER_ARCH or cpu."
    ),
    log_level: str | None = typer.Option(
        None,
        metavar="LEVEL",
        help="Lowest level logged to standard error, as JSON lines: debug, info, warning or error.",
    ),
) -> None:
    """Simulate, calibrate and diagnose granular materials."""
    if arch is not None:
        # Here and not above: `doctor` is to start where a package of the solver is missing.
        from solver.arch import choose

        choose(arch)
    if log_level is not None:
        import logging
        import sys

        from explorer.background.reporter import LEVELS, logged
        from explorer.errors import CommandError

        if log_level.lower() not in LEVELS:
            raise CommandError(f"--log-level {log_level}: allowed: {', '.join(LEVELS)}")
        context.with_resource(logged(logging.StreamHandler(sys.stderr), log_level))


app.command()(serve.serve)
app.command(cls=simulate.Rigs)(simulate.simulate)
app.command()(board.board)
app.command()(repeat.repeat)
app.command()(calibrate.calibrate)
app.command()(diagnose.diagnose)
app.command(cls=design.Designs)(design.design)
app.command()(analyse.analyse)
app.command()(runs.runs)
app.command()(parameters.parameters)
app.command(cls=schema.Files)(schema.schema)
app.command()(shape.shape)
app.command()(lab.lab)
app.command()(audit.audit)
app.command()(measure.measure)
app.command(cls=export.Programs)(export.export)
app.command()(replay.replay)
app.command()(report.report)
app.command()(verify.verify)
app.command()(bench.bench)
app.command()(warm_up.warm_up)
app.command()(doctor.doctor)
app.command()(validate_diagnosis.validate_diagnosis)
app.command()(limit.limit)
app.add_typer(new.app, name="new")
app.add_typer(measurements.app, name="measurements")
app.add_typer(store.app, name="store")


def main() -> None:
    """Entry point of the command ``explorer``."""
    # Matrices here are small, and beside busy workers OpenBLAS waits milliseconds for its own second thread: fitting 38
    # spheres to a mesh takes five times as long. NumPy reads it when it is imported, and worker processes inherit it.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    app(prog_name="explorer")
