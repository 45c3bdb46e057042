"""A person at a page: finds a control by the words on it, moves it as a browser does, and reads what stands there.

What viser keeps for itself is used here, so that a test of a panel knows its words and none of its attributes.
"""

import json
import re
from collections.abc import Iterator
from contextlib import nullcontext
from html import unescape
from types import SimpleNamespace

import numpy as np
import viser
from viser._gui_handles import GuiProgressBarHandle, _GuiInputHandle

from explorer.viewer.incoming import valid_value

NUMBER_BOXES = (viser.GuiNumberHandle, viser.GuiVector2Handle, viser.GuiVector3Handle)
TEXTS = (viser.GuiHtmlHandle, viser.GuiMarkdownHandle)


class Person:
    """Sees what of ``place`` (a server, a folder, a tab) is not hidden.

    carry_out: lets the program do what was asked of it, and gives its line where it refused, else "" or None.
    """

    def __init__(self, place, carry_out=lambda: "", browser=None):
        self._place, self._carry_out, self.browser = place, carry_out, browser or Browser()

    def within(self, title, nth=0):
        """The same person, who looks at the folder or tab with this title only; ``nth`` of several."""
        found = [one for one in self._walk(self._place) if _title(one) == title]
        assert found, f"nothing is called {title!r} here"
        return Person(found[nth], self._carry_out, self.browser)

    @property
    def labels(self):
        """Words on the controls that are seen, in their order; an upload's and a button's too."""
        return [one.label for one in self._controls()]

    def sees(self, label):
        """Whether there is a control with these words."""
        return label in self.labels

    def control(self, label):
        """viser's handle of the one control with these words: its value, options, hint, whether it is disabled."""
        found = [one for one in self._controls() if one.label == label]
        assert len(found) == 1, f"{len(found)} controls are called {label!r} among {self.labels}"
        return found[0]

    def value(self, label):
        """What a control stands at."""
        return self.control(label).value

    def options(self, label):
        """What there is to choose."""
        return tuple(self.control(label).options)

    def enter(self, label, value):
        """Type, choose or tick; what a browser could not send is a mistake of the test. The line of a refusal."""
        handle = self.control(label)
        assert not handle.disabled, f"{label} is disabled"
        sent = list(value) if isinstance(value, tuple) else value
        assert valid_value(handle, sent) is not None, f"{label}: no browser could send {value!r}"
        return self.send(label, value)

    def press(self, label):
        """A button, or one of a row of buttons. The line of a refusal."""
        rows = [one for one in self._controls() if isinstance(one, viser.GuiButtonGroupHandle) and label in one.options]
        if rows:
            assert len(rows) == 1, f"{len(rows)} buttons are called {label!r}"
            return self.enter(rows[0].label, label)
        assert not self.control(label).disabled, f"{label} is disabled"
        return self.send(label, True)

    def upload(self, label, name, content):
        """Send a file by the button with these words. The line of a refusal."""
        return self.send(label, viser.UploadedFile(name, content))

    def send(self, label, value, before_call=lambda: None):
        """Send ``value`` to a control whatever it is, as nobody at the page could. The line of a refusal.

        before_call: what another thread does after viser has taken the value over and before it calls back.
        """
        handle = self.control(label)
        if not isinstance(handle, viser.GuiButtonHandle | viser.GuiUploadButtonHandle) and _fits(handle, value):
            handle.value = value
            before_call()
            value = handle.value
        told = SimpleNamespace(value=value)
        for callback in tuple(handle._impl.update_cb):
            callback(SimpleNamespace(client_id=0, client=self.browser, target=told))
        return self._carry_out() or ""

    def hit(self, label):
        """Press the key of the page's command with these words. The line of a refusal."""
        for callback in tuple(self._command(label)._impl.trigger_cb):
            callback(SimpleNamespace(client_id=0, client=self.browser))
        return self._carry_out() or ""

    def arrive(self):
        """Open the page, as a browser does that was not there yet. The line of a refusal."""
        for callback in tuple(self._place._client_connect_cb):
            callback(self.browser)
        return self._carry_out() or ""

    def uuid(self, label):
        """What a browser calls the control with these words where it talks over its socket."""
        return self.control(label)._impl.uuid

    def key_uuid(self, label):
        """The same of the page's command with these words."""
        return self._command(label)._impl.uuid

    @property
    def tabs(self):
        """Titles of the tabs that are seen here, a list for each row of them."""
        rows = {}
        for one in self._walk(self._place):
            if isinstance(one, viser.GuiTabHandle):
                rows.setdefault(id(one._parent), []).append(one._label)
        return list(rows.values())

    @property
    def html(self):
        """All that is written here, as it was sent."""
        return "\n".join(one.content for one in self._walk(self._place) if isinstance(one, TEXTS))

    @property
    def text(self):
        """All that is written here, as it is read: without marks, one blank between words."""
        return " ".join(unescape(re.sub(r"<style>[^<]*</style>|<[^>]*>", " ", self.html)).split())

    @property
    def charts(self):
        """The charts that are drawn here, as Plotly has them."""
        charts = (one for one in self._walk(self._place) if isinstance(one, viser.GuiPlotlyHandle))
        return [json.loads(one._plotly_json_str) for one in charts]

    @property
    def number_boxes(self):
        """viser's handles of the boxes for one number or several that are seen here."""
        return [one for one in self._controls() if isinstance(one, NUMBER_BOXES)]

    @property
    def progress(self):
        """How far the bars that are seen here are [%]."""
        return [one.value for one in self._walk(self._place) if isinstance(one, GuiProgressBarHandle)]

    @property
    def curves(self):
        """viser's handles of the curves over time that are drawn here: their ``data``, their ``series``."""
        return [one for one in self._walk(self._place) if isinstance(one, viser.GuiUplotHandle)]

    @property
    def pictures(self):
        """viser's handles of the pictures that are shown here."""
        return [one for one in self._walk(self._place) if isinstance(one, viser.GuiImageHandle)]

    def _command(self, label):
        commands = [one for one in self._place.gui._command_handle_from_uuid.values() if one.label == label]
        assert len(commands) == 1, f"{len(commands)} commands are called {label!r}"
        return commands[0]

    def _controls(self):
        return [one for one in self._walk(self._place) if isinstance(one, _GuiInputHandle) and hasattr(one, "label")]

    def _walk(self, place) -> Iterator:
        """All below ``place`` that is not hidden."""
        for one in _inside(place):
            if getattr(one, "visible", True):
                yield one
                yield from self._walk(one)


class Browser:
    """What is asked of a person's browser: its size, its picture (``error``: why it gives none), files for it."""

    def __init__(self, error=None):
        self.sent, self.error, self.client_id, self.atomic = {}, error, 0, nullcontext
        self.waiting = {}  # messages that are on their way to it, by number
        buffer = SimpleNamespace(buffer_lock=nullcontext(), message_from_id=self.waiting)
        self._websock_connection = SimpleNamespace(get_message_buffer=lambda: buffer)
        self.camera = SimpleNamespace(
            image_height=90, image_width=5120, position=np.array([0.0, -0.5, 0.0]), look_at=np.zeros(3), fov=0.6
        )

    def send_file_download(self, name, content, save_immediately):
        assert save_immediately
        self.sent[name] = content

    def get_render(self, height, width, transport_format, timeout):
        if self.error:
            raise self.error
        assert transport_format == "png"
        return np.zeros((height, width, 4), dtype=np.uint8)  # nothing but what is transparent


def drawn(server, below="/"):
    """viser's handles of what is drawn in the scene below a node, by name: nobody can find a mesh by its words."""
    return {name: node for name, node in server.scene._handle_from_node_name.items() if name.startswith(below)}


def _inside(place):
    """What viser keeps directly in ``place``; nothing in what is no container."""
    if isinstance(place, viser.ViserServer):
        panels = (tab for one in place.gui._panel_handle_from_uuid.values() for tab in one._tab_handles)
        return (*place.gui._container_handle_from_uuid["root"]._children.values(), *panels)
    if isinstance(place, viser.GuiTabGroupHandle):
        return tuple(place._tab_handles)
    return tuple(getattr(place, "_children", {}).values())


def _fits(handle, value):
    """Whether viser would keep it: no text in the place of a number."""
    try:
        type(handle.value)(value)
    except (TypeError, ValueError):
        return False
    return True


def _title(one):
    """What a folder or a tab is called; None for anything else."""
    if isinstance(one, viser.GuiTabHandle):
        return one._label
    return one.label if isinstance(one, viser.GuiFolderHandle) else None
