"""What a panel of the page is: its protocol, the tabs, what it is made with, and what it is shown.

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
"""Seconds between two looks of a panel: at the pour, and at what runs in the background."""


class Place(Enum):
    """Where a tab stands on the page."""

    CONTROLS = auto()
    """Right of the scene, narrow: what acts on the pour and on how it is drawn."""
    STUDY = auto()
    """Left of the scene, wide, folded away at first: measurement, studies, reports."""
    AROUND = auto()
    """No tab: the state line above the page and the timeline below it."""


@dataclass(frozen=True)
class Tab:
    """A tab of the page; those of the same name and place are one."""

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
"""In order; another one that a panel names comes after them."""


@dataclass(frozen=True)
class PageContext:
    """What panels are made with, and what they have in common."""

    server: GuardedServer
    session: Session
    post: Post
    study: StudyProcess
    diagnosis: DiagnosisProcess
    data: Path
    """Folder of what the user made: presets, uploads, recordings."""
    colour_bar: viser.GuiHtmlHandle
    """Explains the colours of bodies, beside every tab."""
    project: Project
    """What the page works on."""
    channel: ShellChannel
    """To the state line and the timeline."""
    pages: WebPages
    """Pages beside this one."""
    place: PourPlace = field(default_factory=PourPlace)
    """Where studies, diagnoses and further pours are made."""

    @property
    def uploads(self) -> Path:
        """Folder of the files that browsers sent."""
        return self.data / "uploads"

    def pour_text(self) -> str:
        """What is on the screen with its moment, as a link holds it. Raises CommandError where a link cannot."""
        status = self.session.status()
        text = pour_text(self.session.source, status.scene, status.seed, self.project.source)
        return f"{text}&time={status.time!r}"

    @cached_property
    def study_panel(self) -> viser.PanelHandle:
        """Left of the scene, with the tabs of ``Place.STUDY``."""
        return self.server.gui.add_panel()

    @cached_property
    def background(self) -> BackgroundWork:
        """Work about the pour and its files that takes seconds."""
        return BackgroundWork(self.post)

    @cached_property
    def bench_work(self) -> BackgroundWork:
        """Work of the laboratory, beside the other."""
        return BackgroundWork(self.post)

    @cached_property
    def tables(self) -> TableServer:
        """Pages with tables to fill in and pictures to click."""
        return TableServer(self.pages, self.server.token)

    @cached_property
    def sheet(self) -> SheetInHand:
        """The sheet of a designed experiment that is filled in and analysed."""
        return SheetInHand()

    @cached_property
    def target(self) -> TargetFile:
        """Photographs that were made the target of the project's study."""
        return TargetFile(self.project.target)

    @cached_property
    def recording(self) -> RecordingSwitch:
        """Recordings that are begun and ended on the page."""
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
    """What there is to show in one turn of the page's loop."""

    status: Status
    frame: Frame | None = None
    """The newest one; None before a body has entered."""
    events: Sequence[Event] = ()
    notice: str = ""
    """The page's own last message, such as a refused click."""
    previewed: bool = False
    """Whether ``frame`` is of a recording that is shown while the solver loads."""


class Panel:
    """A block of controls; derive from this one. What a panel leaves as it is here does nothing."""

    name: str
    tab: Tab
    title: str = ""
    """Of the folder in the tab that it stands in; without one it stands in the tab itself."""
    folded: bool = True
    """Whether that folder is closed at first."""
    every: float = OFTEN
    """Seconds between two calls of :meth:`show`; where they are no more than ``OFTEN``, also after every change."""

    def __init__(self, page: PageContext) -> None:
        """Make the controls; tab and folder are open."""

    @classmethod
    def offered(cls, page: PageContext) -> bool:
        """Whether this page has it."""
        return True

    def draw(self, now: Now) -> None:
        """Move what moves, and miss nothing: some 30 times a second, inside ``server.atomic()``."""

    def show(self, now: Now) -> None:
        """Tell what is new, inside ``server.atomic()``; what is shown already is left alone."""

    def set_dark(self, dark: bool) -> None:
        """Follow the page: dark, or light."""

    def close(self) -> None:
        """End what the panel has started."""
