"""A session without a solver process: takes over at once what it is asked for, for tests of panels."""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np

from explorer.live.frames import Frame
from explorer.live.messages import Event, SessionState, Status
from explorer.project.project import study_project
from explorer.scene.source import SceneSource, change_lines, differences
from explorer.study.process import CalibrationProcess
from explorer.viewer.actions import Actions, BackgroundWork
from explorer.viewer.page import Page
from explorer.viewer.panel import PageContext
from explorer.viewer.shell.channel import ShellChannel
from explorer.viewer.shell.web_pages import WebPages
from solver.scenes.scene import Scene, with_values
from tests.explorer.background.waiting import wait_for

PROJECT = study_project("sunflower_extract")


class PageSession:
    """What panels ask of a :class:`explorer.live.session.Session`; ``asked`` are the calls, in order."""

    def __init__(self, source: SceneSource) -> None:
        self.source = source
        self.asked: list[object] = []
        self.events: list[Event] = []
        self.now = Status(SessionState.RUNNING, "", source.scene, seed=1, generation=1, speed=1.0)
        self.newest: Frame | None = None

    def status(self) -> Status:
        return self.now

    def frame(self) -> Frame | None:
        return self.newest

    def details(self) -> None:
        return None

    def set_parameters(self, values: Mapping[str, float | str]) -> None:
        self.asked.append("set_parameters")
        changed = with_values(self.now.scene, dict(values))
        self.events += [
            Event(self.now.generation, self.now.time, line, True)
            for line in change_lines(differences(self.now.scene, changed))
        ]
        self.now = replace(self.now, scene=changed)

    def move_plate(self, motion) -> None:
        self.asked.append(motion)

    def pull(self, pull) -> None:
        self.asked.append(pull)

    def start(self, scene: Scene, seed: int, source: SceneSource | None = None) -> None:
        self.asked.append("start")
        self.source = source or self.source
        self.newest = None
        self.now = replace(self.now, scene=scene, seed=seed, generation=self.now.generation + 1, time=0.0)

    def restart(self, scene: Scene | None = None, seed: int | None = None) -> None:
        self.start(scene or self.now.scene, self.now.seed if seed is None else seed)


def page_context(server, session=None, post=None, data=Path("nowhere"), study=None, diagnosis=None):
    """What panels are made with; without ``post`` an action is carried out at once."""
    post = post or (lambda action: action())
    bar = server.gui.add_html("", visible=False)
    project = replace(PROJECT, results=data / "results")
    return PageContext(server, session, post, study, diagnosis, data, bar, project, ShellChannel(), WebPages("test"))


def page_of(server, session, diagnosis, data, channel=None, recorders=()):
    """The page of the shipped study, with results in the folder ``data``; ``channel``: that of the server."""
    study = CalibrationProcess(PROJECT.study, data / "studies", data / "runs.sqlite")
    return Page(server, session, PROJECT, study, diagnosis, channel or ShellChannel(), WebPages("test"), recorders)


def finished(actions: Actions, background: BackgroundWork) -> str:
    """Carry out what waits, what is done in the background, and what comes of it; the line of a refusal, or ""."""
    notices = []

    def is_done() -> bool:
        notices.append(actions.carry_out() or "")
        return not background.busy_with

    wait_for(is_done)
    return next((notice for notice in reversed(notices) if notice), "")


def frame_of(component: list[int], position: object, inside: list[bool] | None = None, generation: int = 1) -> Frame:
    """A frame of bodies at ``position`` (n, 3) [m], none of them turned."""
    n = len(component)
    return Frame(
        number=1,
        generation=generation,
        time=1.25,
        position=np.asarray(position, dtype=np.float32).reshape(n, 3),
        quaternion=np.tile(np.float32([1, 0, 0, 0]), (n, 1)),
        component=np.array(component, dtype=np.int32),
        inside=np.array([True] * n if inside is None else inside),
        scale=np.ones(n, dtype=np.float32),
    )


def event(handle, number, client_id=0, client=None):
    """What viser hands to a callback when a browser has sent ``number``."""

    class Event:
        target = type("Handle", (), {"value": number})

    Event.client_id, Event.client = client_id, client
    for callback in handle._impl.update_cb:
        callback(Event)
