"""A panel of studies with a study and a session that only remember, and a person at its controls."""

import json
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from unittest import mock

from explorer.background.command_process import CommandStatus
from explorer.live.messages import SessionState, Status
from explorer.viewer.actions import Actions
from explorer.viewer.panel import Now
from explorer.viewer.study import study_panel
from explorer.viewer.study.study_panel import StudyPanel
from solver import asset_path, load_material
from tests.explorer.viewer.page_session import page_context
from tests.explorer.viewer.person import Person

SCENE = load_material("sunflower_extract")


OWN_PROFILES = ("first look", "thesis-2", "fine")


def study_with_own_profiles(folder):
    """The shipped study with other names for its profiles, as a file in ``folder``."""
    text = asset_path("studies", "sunflower_extract").read_text(encoding="utf-8")
    for shipped, own in zip(("quick", "standard", "full"), OWN_PROFILES, strict=True):
        assert f"[profile.{shipped}]" in text
        text = text.replace(f"[profile.{shipped}]", f'[profile."{own}"]')
    path = folder / "my study.toml"
    path.write_text(text, encoding="utf-8")
    return path


STORELESS = SimpleNamespace(store=Path("nowhere.sqlite"))


class FakeStudy:
    """Keeps what it was asked; its status and its folders are what the test says."""

    study_file = asset_path("studies", "sunflower_extract")
    store = STORELESS.store
    present = None

    def __init__(self):
        self.asked, self.now, self.out, self.queued, self.done = [], CommandStatus("idle"), None, (), ()

    def start(self, profile, edits):
        self.asked.append(("start", profile, edits))

    def queue(self, profile, edits):
        self.asked.append(("queue", profile, edits))

    def __getattr__(self, name):
        if name not in ("cancel", "pause", "go_on", "resume", "retry", "clear_queue"):
            raise AttributeError(name)
        return lambda: self.asked.append(name)

    def resumable(self):
        return True

    def waiting(self):
        return self.queued

    def status(self):
        return self.now

    def finished(self):
        return self.done


class FakeSession:
    def __init__(self):
        self.asked = []

    def status(self):
        return Status(SessionState.RUNNING, "", SCENE, seed=1, generation=1, speed=1.0)

    def set_parameters(self, values):
        self.asked.append(("set", values))

    def start(self, scene, seed, source):
        self.asked.append(("start", scene, seed, source))

    def restart(self, scene, seed=None):
        self.asked.append(("restart", scene, seed))


class PanelAtHand:
    """A panel with what it talks to, and a person at its controls."""

    def __init__(self, server, place=None, data=Path("nowhere")):
        self.study, self.session, self.actions = FakeStudy(), FakeSession(), Actions()
        self.page = page_context(server, self.session, self.actions.post, data, self.study, STORELESS)
        if place is not None:
            self.page = replace(self.page, place=place)
        handed = {}
        # What the pages of the two tables get; there are no controls of the panel for it.
        pages = {name: handed_over(name, handed) for name in ("ranges_page", "runs_page")}
        with server.gui.add_folder("study") as folder, mock.patch.multiple(study_panel, **pages):
            self.panel = StudyPanel(self.page)
        self.all_ranges, self.all_runs = handed["ranges_page"], handed["runs_page"]
        self.person = Person(folder, self.actions.carry_out)
        self.early = Person(folder)  # what this one asks for waits until the test carries it out
        self.ranges = self.person.within("Ranges and target of the next study")
        self.profiler = self.person.within("Profiler")
        self.others = self.person.within("Other results")

    def show(self, notice=""):
        self.panel.show(Now(self.session.status(), notice=notice))

    def press(self, button):
        """A button of the row *Study*, also one that is not offered now."""
        return self.person.send("Study", button)

    def board(self):
        """The board of the panel, when it is made."""
        self.show()
        return board_at(self.panel)


def handed_over(name, handed):
    """The function ``name`` of the panel's module, which leaves in ``handed`` what it gets."""
    made = getattr(study_panel, name)

    def page(in_hand, post):
        handed[name] = in_hand
        return made(in_hand, post)

    return page


def board_at(panel, address="/study/page.json"):
    """What the board of ``panel`` draws, once it is made: a thread makes it, which nobody at the page sees."""
    panel._board._worker.join(60)
    panel._show_board()
    panel._board._worker.join(60)
    return json.loads(panel._board._pages.page(address).body)


def written(folder, content, name="result.json"):
    folder.mkdir(exist_ok=True)
    (folder / name).write_text(json.dumps(content))
    return folder


def drawn(person):
    """The one chart that a person sees."""
    (chart,) = person.charts
    return chart
