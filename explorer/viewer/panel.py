"""Panels of the page: their protocol, the tabs, what panels are made with, and what they are shown.

A new panel is a class in a file of its own and a line in ``panels.py``, or an entry point ``panel.NAME`` of a package.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from enum import Enum, auto
from functools import cached_property
from pathlib import Path

import viser

from explorer.background.command_process import PourPlace
from explorer.diagnosis.process import DiagnosisProcess
from explorer.live.frames import Frame
from explorer.live.messages import Event, Status
from explorer.live.session import Session
from explorer.photograph.target import TargetFile
from explorer.project.project import Project
from explorer.project.steps import Room
from explorer.scene.link import pour_text
from explorer.study.process import StudyProcess
from explorer.viewer.actions import BackgroundWork, Post
from explorer.viewer.guarded_server import GuardedServer
from explorer.viewer.look.look_settings import LookSettings
from explorer.viewer.output.recording_switch import RecordingSwitch
from explorer.viewer.pour.beside_pile import BesidePile
from explorer.viewer.pour.ghost import Ghost
from explorer.viewer.shell.channel import ShellChannel
from explorer.viewer.shell.web_pages import WebPages
from explorer.viewer.tables.sheet_page import SheetInHand
from explorer.viewer.tables.table_server import TableServer

OFTEN, SELDOM = 0.2, 0.5
"""Seconds between two updates of a panel: for the pour, and for what runs in the background."""


class Place(Enum):
    """The place of a tab on the page."""

    CONTROLS = auto()
    """Right of the scene, narrow: what acts on the pour and on how it is drawn."""
    STUDY = auto()
    """Left of the scene, wide, collapsed at first: measurement, studies, reports."""
    AROUND = auto()
    """Not in a tab: the state line above the page and the timeline below it."""


@dataclass(frozen=True)
class Tab:
    """A tab of the page; tabs with the same name and place are one."""

    name: str
    place: Place = Place.STUDY


AROUND = Tab("", Place.AROUND)
CONTROLS, SET_UP, LOOK, EXPORT = (
    Tab(room, Place.CONTROLS) for room in (Room.CONTROLS, Room.SET_UP, Room.LOOK, Room.EXPORT)
)
POUR, CALIBRATE, DIAGNOSE, LABORATORY, REPORTS = (
    Tab(room) for room in (Room.POUR, Room.CALIBRATE, Room.DIAGNOSE, Room.LABORATORY, Room.REPORTS)
)
TABS = (CONTROLS, SET_UP, LOOK, EXPORT, POUR, CALIBRATE, DIAGNOSE, LABORATORY, REPORTS)
"""Tabs in order; further ones that panels name come after them."""


@dataclass(frozen=True)
class PageContext:
    """What panels are made with and share."""

    server: GuardedServer
    session: Session
    post: Post
    study: StudyProcess
    diagnosis: DiagnosisProcess
    data: Path
    """Folder of the user's data: presets, uploads, recordings."""
    colour_bar: viser.GuiHtmlHandle
    """Explains the colours of bodies, beside every tab."""
    project: Project
    """The project that the page works on."""
    channel: ShellChannel
    """Channel to the state line and the timeline."""
    pages: WebPages
    """Pages beside this one."""
    place: PourPlace = field(default_factory=PourPlace)
    """Where studies, diagnoses and further pours run."""

    @property
    def uploads(self) -> Path:
        """Folder of uploaded files."""
        return self.data / "uploads"

    def pour_text(self) -> str:
        """The pour on the screen and its moment, as text for a link. Raises CommandError if a link cannot hold it."""
        status = self.session.status()
        text = pour_text(self.session.source, status.scene, status.seed, self.project.source)
        return f"{text}&time={status.time!r}"

    @cached_property
    def study_panel(self) -> viser.PanelHandle:
        """The panel left of the scene, with the tabs of ``Place.STUDY``."""
        return self.server.gui.add_panel()

    @cached_property
    def background(self) -> BackgroundWork:
        """Runs work on the pour and its files that takes seconds."""
        return BackgroundWork(self.post)

    @cached_property
    def bench_work(self) -> BackgroundWork:
        """Runs work of the laboratory, independently of the other."""
        return BackgroundWork(self.post)

    @cached_property
    def tables(self) -> TableServer:
        """Pages with tables to fill in and pictures to click."""
        return TableServer(self.pages, self.server.token)

    @cached_property
    def sheet(self) -> SheetInHand:
        """The sheet of a designed experiment that is being filled in and analysed."""
        return SheetInHand()

    @cached_property
    def target(self) -> TargetFile:
        """Photographs that were made the target of the project's study."""
        return TargetFile(self.project.target)

    @cached_property
    def recording(self) -> RecordingSwitch:
        """The recordings that are begun and ended on the page."""
        return RecordingSwitch(self.server, self.data / "recordings", self.background)

    @cached_property
    def beside(self) -> BesidePile:
        """A second pour beside the first."""
        return BesidePile(self.server, self.session)

    @cached_property
    def ghost(self) -> Ghost:
        """The pile that stood before this pour."""
        return Ghost(self.server)

    @cached_property
    def look(self) -> LookSettings:
        """How the pour is drawn."""
        return LookSettings(self.post)


@dataclass(frozen=True)
class Now:
    """What there is to show in one iteration of the page's loop."""

    status: Status
    frame: Frame | None = None
    """The newest frame; None before a body has entered."""
    events: Sequence[Event] = ()
    notice: str = ""
    """The page's own last message, such as a refused click."""
    previewed: bool = False
    """Whether ``frame`` is from a recording that is shown while the solver loads."""


class Panel:
    """A block of controls, to be subclassed. Methods that a subclass does not override do nothing."""

    name: str
    tab: Tab
    title: str = ""
    """Title of the panel's folder in its tab; without one, the panel is in the tab itself."""
    folded: bool = True
    """Whether that folder is closed at first."""
    every: float = OFTEN
    """Seconds between two calls of :meth:`show`; if no more than ``OFTEN``, it is also called after every change."""

    def __init__(self, page: PageContext) -> None:
        """Make the controls, inside the panel's tab and folder."""

    @classmethod
    def offered(cls, page: PageContext) -> bool:
        """Whether this page has the panel."""
        return True

    def draw(self, now: Now) -> None:
        """Draw everything that moves, without omission: some 30 times a second, inside ``server.atomic()``."""

    def show(self, now: Now) -> None:
        """Show what is new, inside ``server.atomic()``; what is already shown is left alone."""

    def set_dark(self, dark: bool) -> None:
        """Adapt to a dark or a light page."""

    def close(self) -> None:
        """End what the panel has started."""
