"""A panel of studies with a study and a session that only remember, and a person at its controls."""

import json
from pathlib import Path
from types import SimpleNamespace

from explorer.background.command_process import CommandStatus
from explorer.live.messages import SessionState, Status
from explorer.viewer.actions import Actions
from explorer.viewer.panel import Now
from explorer.viewer.study.study_panel import StudyPanel
from solver import asset_path, load_material
from tests.explorer.viewer.page_session import page_context

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

    def restart(self, scene, seed=None):
        self.asked.append(("restart", scene, seed))


class PanelAtHand:
    """A panel with what it talks to; ``enter`` and ``press`` are a person at a browser."""

    def __init__(self, server):
        self.study, self.session, self.actions = FakeStudy(), FakeSession(), Actions()
        self.panel = StudyPanel(
            page_context(server, self.session, self.actions.post, study=self.study, diagnosis=STORELESS)
        )

    def show(self, notice=""):
        self.panel.show(Now(self.session.status(), notice=notice))

    def enter(self, handle, value):
        handle.value = value
        self._call(handle, value)
        return self.actions.carry_out()

    def press(self, button):
        self._call(self.panel._view._buttons, button)
        return self.actions.carry_out()

    def board(self):
        """The board of the panel, when it is made."""
        self.show()
        return board_at(self.panel)

    def _call(self, handle, value):
        event = type("Event", (), {"client_id": 0, "target": type("Handle", (), {"value": value})})
        for callback in handle._impl.update_cb:
            callback(event)


def board_at(panel, address="/study/page.json"):
    """What the board of ``panel`` draws, once it is made."""
    panel._board._worker.join(60)
    panel._show_board()
    panel._board._worker.join(60)
    return json.loads(panel._board._pages.page(address).body)


def written(folder, content, name="result.json"):
    folder.mkdir(exist_ok=True)
    (folder / name).write_text(json.dumps(content))
    return folder


def drawn(view):
    return json.loads(view._chart._plotly_json_str)
