"""Output of a command-line command, for a page that waits for it in a thread while the solver runs beside it.

Such a command receives a scene of the page as a material file.
"""

from __future__ import annotations

import atexit
import subprocess
import tempfile
from collections.abc import Callable, Sequence
from pathlib import Path

from explorer.background.command_process import PROGRAM
from explorer.errors import CommandError
from explorer.files.uploads import kept_file
from explorer.priority import BACKGROUND, lowered, session_gives_way
from explorer.scene.text import material_toml
from solver import Scene

FAILURE = 1
"""Exit code of a command that has done its work, with a negative result."""
LONGEST_LINE = 300
TITLE_LETTERS = 20


def command_output(
    arguments: Sequence[str],
    program: Sequence[str] = PROGRAM,
    hear: Callable[[str], None] = lambda line: None,
    begun: Callable[[subprocess.Popen[str]], None] = lambda process: None,
) -> str:
    """Standard output of ``program arguments``, run at lower priority than everything that a user looks at.

    ``begun`` is called first, with the process, which may be killed from another thread. ``hear`` is called with every
    line of output as it arrives, in the caller's thread.
    A command that ends with ``FAILURE`` and has printed something also counts as answered. For any other failure,
    CommandError is raised with the command's last error line. The command does not outlive this process.
    """
    lines = []
    with (
        tempfile.TemporaryFile("w+") as errors,
        subprocess.Popen(
            lowered((*program, *arguments), BACKGROUND),
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=errors,
            text=True,
            start_new_session=True,
        ) as process,
    ):
        atexit.register(process.kill)
        begun(process)
        session_gives_way(process.pid, BACKGROUND)
        assert process.stdout is not None
        for line in process.stdout:
            lines.append(line)
            hear(line.strip())
        process.wait()
        atexit.unregister(process.kill)
        errors.seek(0)
        refused = errors.read()
    said = "".join(lines)
    if process.returncode == 0 or (process.returncode == FAILURE and said.strip()):
        return said.strip()
    *_, last = refused.strip().splitlines() or [f"{arguments[0]} ended with exit code {process.returncode}"]
    raise CommandError(last.removeprefix("error: ")[:LONGEST_LINE])


def kept_scene(scene: Scene, folder: Path) -> Path:
    """Write ``scene`` as a material file in ``folder``, under a name that follows from its contents."""
    text = material_toml(scene, f"{scene.title}, as it was poured on the page. SI.")
    return kept_file(f"{scene.title[:TITLE_LETTERS]}.toml", text.encode(), folder, (".toml",))
