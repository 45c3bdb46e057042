"""What is taken along: the command line of what is on the screen, files of it, pictures and recordings."""

from __future__ import annotations

from collections.abc import Callable
from html import escape
from typing import Any

import viser

from explorer.errors import CommandError
from explorer.files.exports import bodies_csv, bodies_stl, png, zipped
from explorer.live.frames import Frame
from explorer.logs.recording import recorded_lines
from explorer.scene.source import SceneSource, command_line
from explorer.scene.text import material_toml
from explorer.viewer.output.engine_export import EngineExport
from explorer.viewer.output.recording_switch import HTML, RRD, RecordingSwitch
from explorer.viewer.output.send_file import send_file
from explorer.viewer.panel import TAKE_ALONG, Now, PageContext, Panel
from explorer.viewer.small_text import small_html
from solver.scene import Scene

LARGEST_PICTURE = (1440, 2560)
"""Height and width [pixels]."""
RENDER_WAIT = 30.0
"""Seconds that a browser has to draw a picture."""
MOST_SENT = 200_000_000
"""Bytes of a recording that are sent to a browser."""
START, STOP, DOWNLOAD = "Start", "Stop", "Download"


class OutputPanel(Panel):
    """Command line, exports, and the switch of the recording."""

    name, tab = "output", TAKE_ALONG

    def __init__(self, page: PageContext) -> None:
        self._session, self._recording, self._background = page.session, page.recording, page.background
        self._post = page.post
        self._compared: tuple[SceneSource, Scene, int] | None = None
        gui = page.server.gui
        gui.add_markdown("**This pour on the command line**, from the start with the parameters now in force:")
        self._command = gui.add_html("")
        gui.add_markdown("**Files of what is on the screen**")
        hints = {
            "Scene (TOML)": ("A material file that every command takes, with rig and parameters.", self._scene),
            "Bodies (CSV)": ("Component, mass, place and orientation of every body, SI.", self._bodies),
            "Bodies (STL)": ("True shapes of all bodies where they are, in millimetres.", self._mesh),
            "Picture (PNG)": ("The scene as this browser shows it, without the panels.", self._picture),
        }
        self._exports = {}
        for label, (hint, act) in hints.items():
            self._exports[label] = gui.add_button(label, hint=hint)
            self._listen(self._exports[label], act)
        self.engine = EngineExport(page)
        gui.add_markdown("**Recording** of the moving scene")
        self._kind = gui.add_dropdown(
            "Kind",
            (RRD, HTML),
            hint="rerun: bodies, curves, changes, parameters, for `explorer replay`. Web page: the scene alone, one "
            "file for any browser.",
        )
        self._switch = gui.add_button_group(
            "Record",
            (START, STOP, DOWNLOAD),
            hint="Every pour that is begun meanwhile has a file of its own; Download sends several as a ZIP file. "
            "Recordings stay in the folder named below.",
        )
        self._state = gui.add_html("")

        @self._switch.on_click
        def _(event: viser.GuiEvent[Any]) -> None:
            if event.client_id is not None:
                client, chosen = event.client, str(event.target.value)
                page.post(lambda: self._record(client, chosen))

    def show(self, now: Now) -> None:
        """Command line and state of the recording, or the page's last message."""
        present = (self._session.source, now.status.scene, now.status.seed)
        if self._compared is None or present != self._compared:
            self._compared = present
            self._command.content = command_html(*present)
        state = recording_html(self._recording, self._background.busy_with, now.notice)
        if self._state.content != state:
            self._state.content = state

    def close(self) -> None:
        """End a recording that was begun on the page, with its file whole."""
        self._recording.close()

    def _listen(self, button: Any, act: Callable[[Any], None]) -> None:
        def pressed(event: viser.GuiEvent[Any]) -> None:
            if event.client is not None:
                client = event.client
                self._post(lambda: act(client))

        button.on_click(pressed)

    def _scene(self, client: Any) -> None:
        status = self._session.status()
        heading = (
            f"{status.scene.title}, as on the page at {status.time:.3f} s of the pour with seed {status.seed}. SI."
        )
        send_file(client, "scene.toml", material_toml(status.scene, heading).encode())

    def _bodies(self, client: Any) -> None:
        frame, scene = self._drawn()
        send_file(client, f"bodies_{frame.time:.3f}s.csv", bodies_csv(frame, scene).encode())

    def _mesh(self, client: Any) -> None:
        frame, scene = self._drawn()
        name = f"bodies_{frame.time:.3f}s_mm.stl"
        self._background.start(
            "making the mesh", lambda: bodies_stl(frame, scene), lambda made: send_file(client, name, made)
        )

    def _picture(self, client: Any) -> None:
        name = f"picture_{self._session.status().time:.3f}s.png"
        self._background.start(
            "taking the picture", lambda: picture(client), lambda made: send_file(client, name, made)
        )

    def _drawn(self) -> tuple[Frame, Scene]:
        frame = self._session.frame()
        if frame is None:
            raise CommandError("no body has entered yet")
        return frame, self._session.status().scene

    def _record(self, client: Any, chosen: str) -> None:
        if chosen == START:
            self._recording.begin(str(self._kind.value))
        elif chosen == STOP:
            self._recording.end()
        elif chosen == DOWNLOAD and client is not None:
            files = self._recording.files()
            size = sum(file.stat().st_size for file in files)
            if size > MOST_SENT:
                listed = ", ".join(map(str, files))
                raise CommandError(f"recording: {size / 1e6:.0f} MB are too much to send; fetch {listed}")
            if len(files) == 1:
                send_file(client, files[0].name, files[0].read_bytes())
            else:
                self._background.start(
                    "packing the recording",
                    lambda: zipped({file.name: file for file in files}),
                    lambda made: send_file(client, f"{files[0].stem}.zip", made),
                )


def picture(client: Any) -> bytes:
    """The scene as ``client`` sees it, as PNG; CommandError where its browser does not draw it."""
    height, width = client.camera.image_height, client.camera.image_width
    shrink = min(1.0, LARGEST_PICTURE[0] / max(height, 1), LARGEST_PICTURE[1] / max(width, 1))
    if height < 1 or width < 1:
        raise CommandError("picture: the browser has not told its size yet")
    try:
        pixels = client.get_render(round(shrink * height), round(shrink * width), timeout=RENDER_WAIT)
    except (RuntimeError, TimeoutError) as error:
        raise CommandError(f"picture: the browser did not draw it: {' '.join(str(error).split())[:120]}") from None
    return png(pixels)


def command_html(source: SceneSource, scene: Scene, seed: int) -> str:
    """The command line in a box that one click selects as a whole; in words where there is none."""
    try:
        line, select = command_line(source, scene, seed), "all"
    except CommandError as error:
        line, select = f"None: {error}", "auto"
    style = f"display:block; user-select:{select}; white-space:pre-wrap; padding:0.4em; margin-bottom:0.6em"
    return small_html(f"<code style='{style}; background:rgba(128,150,170,0.14)'>{escape(line)}</code>")


def recording_html(recording: RecordingSwitch, busy_with: str, notice: str) -> str:
    """What is being recorded or done, and where the files are."""
    lines = [notice, f"Busy {busy_with}." if busy_with else ""]
    pours = recording.pours
    if recording.running:
        so_far = f" (pour {len(pours)} of this recording)" if len(pours) > 1 else ""
        lines.append(f"Recording into {pours[-1].path if pours else recording.path}{so_far}")
    elif pours:
        lines += recorded_lines(pours)
        if len(pours) > 1 and not busy_with:
            files = recording.files()
            lines.append(f"Download sends {files[0].name}" if len(files) == 1 else "Download sends all in one ZIP file")
    elif recording.path is not None and recording.path.is_file():
        lines.append(f"Recorded: {recording.path}")
    return small_html("<br>".join(escape(line) for line in lines if line))
