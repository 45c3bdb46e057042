"""What the tests of the command line share: calling it, and a pour that takes milliseconds."""

from typer.testing import CliRunner

from explorer.cli import app

TINY = {
    "rig.mass": "1g",
    "body.spheres": "coarse",
    "numerics.max_time": "0.1s",
    "numerics.rayleigh_fraction": "0.6",
}
"""Five bodies, cut off while they fall: nothing here is about the pile."""


def explorer(*arguments):
    """Result of `explorer ARGUMENTS…`, run in this process."""
    return CliRunner().invoke(app, [str(argument) for argument in arguments], prog_name="explorer")


def settings(values):
    """`--set` options."""
    return [word for path, value in values.items() for word in ("--set", f"{path}={value}")]


def refused(result):
    """The one line of a refusal, without its prefix; fails if the command did anything else."""
    assert (result.exit_code, result.stdout) == (2, ""), result.output
    lines = result.stderr.splitlines()
    assert len(lines) == 1, result.stderr
    assert lines[0].startswith("error: ")
    return lines[0].removeprefix("error: ")
