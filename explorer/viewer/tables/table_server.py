"""Tables to fill in and pictures to click: NiceGUI pages on a port of their own on this machine.

viser has no editable table and no clickable picture. NiceGUI (an extra, ``pip install 'repose-explorer[tables]'``) has
both. Its server starts with the first request for one of its pages and listens on a loopback address only. The rules of
the main page apply: its own Host and Origin, no requests from other sites, and the page's token, whose cookie a browser
sends to every port of a host. What a person does there is posted to the page's loop, like every other action.
"""

from __future__ import annotations

import asyncio
import socket
import threading
from collections.abc import Awaitable, Callable, MutableMapping
from concurrent.futures import Future
from dataclasses import dataclass
from functools import partial
from html import escape
from http import HTTPStatus
from typing import Any

from explorer.viewer.actions import Post
from explorer.viewer.guarded_server import allowed_hosts, has_cookie, token_cookie
from explorer.viewer.shell.web_pages import GUARD, HTML, WebPage, WebPages

HOST = "127.0.0.1"
ADDRESS = "/tables/"
"""Path on the main page's port; each address under it leads to the page of the same name on the NiceGUI port."""
MISSING = "Tables need NiceGUI, which is not installed: pip install 'repose-explorer[tables]', and start again."
ELSEWHERE = "Tables open on the machine of the program only, at 127.0.0.1 or localhost; take the file along instead."
FAILED = "Tables cannot be served ({}); start the program again."
LOADING = "The tables are being loaded …"
MOST_CONNECTIONS, MOST_MESSAGE_BYTES = 64, 4_000_000
FAREWELL = 2.0
"""Seconds that the server has to end."""
BRAND = "#1f6ea5"
"""Colour of buttons: white text on it has a contrast of 5.5 : 1."""
REPLY = 30.0
"""Seconds that a browser has to send its table, and that the page's loop has to carry out what was posted."""
LOST = "Not saved: the browser has not sent the table."
BUSY = f"Not done: the page has not answered in {REPLY:g} s."
LEAD_ON = """<!doctype html><title>Tables</title><p>{said}</p><script>
const port = {port}, here = ["127.0.0.1", "localhost"].includes(location.hostname);
if (!here) document.querySelector("p").textContent = {elsewhere!r};
else if (port) location.replace(`http://${{location.hostname}}:${{port}}/{name}`);
else if ({wait}) setTimeout(() => location.reload(), 300);
</script>"""
NAMES = """<script>
document.documentElement.lang = "en";
new MutationObserver(() => {
  for (const one of document.querySelectorAll("img:not([alt])")) one.alt = document.title;
  const bars = document.querySelectorAll(".q-loading-bar:not([aria-label])");
  for (const one of bars) one.setAttribute("aria-label", "Loading");
}).observe(document.documentElement, {childList: true, subtree: true});
</script>"""
"""Adds what a screen reader needs and NiceGUI leaves out."""

Scope = MutableMapping[str, Any]
Receive = Callable[[], Awaitable[MutableMapping[str, Any]]]
Send = Callable[[MutableMapping[str, Any]], Awaitable[None]]
Application = Callable[[Scope, Receive, Send], Awaitable[None]]


@dataclass(frozen=True)
class TablePage:
    """A page with its ``name`` in the address; ``build`` fills it whenever a browser opens it."""

    name: str
    title: str
    build: Callable[[], None]


class TableServer:
    """Leads from ``pages`` to NiceGUI pages; ``token`` is what a browser must have presented to the main page."""

    def __init__(self, pages: WebPages, token: str | None) -> None:
        self._pages, self._token = pages, token
        self._made: dict[str, TablePage] = {}
        self._lock = threading.Lock()
        self._thread: threading.Thread | None = None
        self._server: Any = None
        self._port = 0
        self._trouble = ""

    def publish(self, page: TablePage) -> str:
        """Serve ``page`` from the next start of the server on; returns its address on the main page's port."""
        self._made[page.name] = page
        self._pages.publish_made(ADDRESS + page.name, lambda: self._lead_on(page.name))
        return ADDRESS + page.name

    def close(self) -> None:
        """End the server."""
        if self._server is not None:
            self._server.should_exit = True
        if self._thread is not None:
            self._thread.join(FAREWELL)

    def _lead_on(self, name: str) -> WebPage:
        """Start the server of the other port if necessary, and return the page that leads there."""
        with self._lock:
            if self._thread is None:
                self._thread = threading.Thread(target=self._serve, name="tables", daemon=True)
                self._thread.start()
        port = self._port if self._server is not None and self._server.started else 0
        said = self._trouble or LOADING
        wait = "false" if self._trouble else "true"
        text = LEAD_ON.format(said=escape(said, quote=False), port=port, elsewhere=ELSEWHERE, name=name, wait=wait)
        return WebPage(HTML, text.encode())

    def _serve(self) -> None:
        """Serve until :meth:`close`; if that fails, the page that leads here shows the reason."""
        try:
            self._run()
        except ImportError:
            self._trouble = MISSING
        except (Exception, SystemExit) as error:  # whatever the start of a server may raise: the page waits for it
            self._trouble = FAILED.format(error)

    def _run(self) -> None:
        import uvicorn
        from fastapi import FastAPI
        from nicegui import ui

        application = FastAPI(openapi_url=None)
        for page in self._made.values():
            ui.page(f"/{page.name}", title=page.title)(partial(_as_ours, page.build))
        ui.run_with(application, title="Tables", dark=None, show_welcome_message=False)
        with socket.create_server((HOST, 0)) as listening:
            self._port = listening.getsockname()[1]
            options = uvicorn.Config(
                TableGuard(application, self._port, self._token),
                loop="asyncio",
                log_level="critical",
                limit_concurrency=MOST_CONNECTIONS,
                ws_max_size=MOST_MESSAGE_BYTES,
                timeout_graceful_shutdown=1,
            )
            self._server = uvicorn.Server(options)
            self._server.run(sockets=[listening])


class TableGuard:
    """Passes a request on to ``application`` if the main page would serve it, and refuses any other.

    A browser may follow a link from the main page (another port of the same site); all else must come from this port.
    """

    def __init__(self, application: Application, port: int, token: str | None) -> None:
        self._application, self._token = application, token
        self._hosts = allowed_hosts(HOST, port)

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Serve one request, or refuse it."""
        if scope["type"] == "lifespan":
            await self._application(scope, receive, send)
            return
        refused = self._refusal(scope)
        if refused is None:
            await self._application(scope, receive, _guarded(send))
        elif scope["type"] == "websocket":
            await send({"type": "websocket.close", "code": 1008})
        else:
            headers = [(b"content-type", b"text/plain")]
            await send({"type": "http.response.start", "status": refused.value, "headers": headers})
            await send({"type": "http.response.body", "body": f"{refused.phrase}\n".encode()})

    def _refusal(self, scope: Scope) -> HTTPStatus | None:
        """Why this request is refused; None if it is not."""
        hosts = [value.lower() for value in _headers(scope, b"host")]
        if len(hosts) != 1 or hosts[0] not in self._hosts:
            return HTTPStatus.MISDIRECTED_REQUEST
        origins = _headers(scope, b"origin")
        if origins not in ([], [f"http://{hosts[0]}"]) or (scope["type"] == "websocket" and not origins):
            return HTTPStatus.FORBIDDEN
        came_from, mode = _headers(scope, b"sec-fetch-site"), _headers(scope, b"sec-fetch-mode")
        if came_from == ["cross-site"] or (came_from == ["same-site"] and mode != ["navigate"]):
            return HTTPStatus.FORBIDDEN
        if self._token is not None and not has_cookie(_headers(scope, b"cookie"), *token_cookie(self._token)):
            return HTTPStatus.UNAUTHORIZED
        return None


def _as_ours(build: Callable[[], None]) -> None:
    from nicegui import ui

    ui.colors(primary=BRAND)
    ui.add_head_html(NAMES)
    build()


def _headers(scope: Scope, name: bytes) -> list[str]:
    return [value.decode("latin-1") for key, value in scope["headers"] if key == name]


def _guarded(send: Send) -> Send:
    """``send``, with the headers that every page of this program has."""
    added = [(key.lower().encode(), value.encode()) for key, value in GUARD.items()]

    async def send_guarded(message: MutableMapping[str, Any]) -> None:
        if message["type"] == "http.response.start":
            message = {**message, "headers": [*message["headers"], *added]}
        await send(message)

    return send_guarded


async def done_by(post: Post, act: Callable[[], None]) -> str:
    """Have the page's loop carry out ``act``; returns why it was refused, empty if it was not."""
    done: Future[str] = Future()

    def carry_out() -> None:
        if not done.set_running_or_notify_cancel():  # too late: the caller has already been told so
            return
        try:
            act()
        except (ValueError, OSError) as error:
            done.set_result(str(error))
            raise
        except BaseException as error:
            done.set_exception(error)
            raise
        done.set_result("")

    post(carry_out)
    try:
        return await asyncio.wait_for(asyncio.wrap_future(done), REPLY)
    except TimeoutError:
        return BUSY


def link_html(where: str, words: str) -> str:
    """A link that opens a page of tables in a tab of its own."""
    return f"<a href='{escape(where)}' target='_blank' rel='noopener'>{escape(words)}</a>"
