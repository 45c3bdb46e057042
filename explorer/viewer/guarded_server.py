"""A viser server that neither a foreign web page nor a stranger can drive.

viser 1.1.1 checks neither Origin nor Host, moves to another port when one is busy, lets any client open a public
tunnel, and has no password. All of these gaps are closed here. The Host is checked as well as the Origin because of DNS
rebinding: a foreign page whose name has come to mean 127.0.0.1 has the same origin as this server, but that name gives
it away. Beyond this machine, the page is served only to those who know its token; a browser shows the token once and
gets a cookie for it. What a browser may send after that is in :mod:`explorer.viewer.incoming`.

Private names of viser and one of ``websockets`` are used; therefore viser is pinned and a test watches each name.
"""

from __future__ import annotations

import contextlib
import hmac
import io
import ipaddress
import logging
import socket
from collections.abc import Callable, Sequence
from hashlib import sha256
from http import HTTPStatus
from http.cookies import CookieError, SimpleCookie
from typing import Any
from urllib.parse import parse_qsl, urlencode

import viser
import websockets.asyncio.server
from viser import _messages

from explorer.errors import CommandError
from explorer.viewer.incoming import MOST_MESSAGE_BYTES, MOST_QUEUED, MOST_SOCKETS, Incoming
from explorer.viewer.shell.channel import PATH, ShellChannel
from explorer.viewer.shell.web_pages import WebPages

LOCAL_NAMES = ("127.0.0.1", "localhost", "[::1]")
ANY_ADDRESS = ("0.0.0.0", "::", "")
HTTP_PORT = 80
"""Port that browsers omit from Host and Origin."""
SHORTEST_TOKEN = 16
"""Minimum length of a token [characters]."""
TOKEN_VARIABLE = "EXPLORER_TOKEN"
TOKEN_KEY = "token"
"""Name of the token in an address."""
ASK_TOKEN = """<!doctype html><title>Token</title><meta name="viewport" content="width=device-width">
<form><label>Token of this page <input name="token" type="password" autofocus></label> <button>Open</button></form>
"""
COOKIE_DAYS = 30
ASK_AFTER, GIVE_UP_AFTER, CUT_AFTER = 20.0, 20.0, 10.0
"""Seconds until a browser is pinged, until its answer is due, and allowed for closing: a browser that takes nothing of
what it is sent is disconnected."""
MOST_CONNECTIONS = 256
"""Simultaneous connections of any kind; further ones are closed."""


class PortError(CommandError):
    """A host or port that the server cannot listen on; one line, fit for a user."""


def guarded_server(
    host: str,
    port: int,
    label: str,
    pages: WebPages | None = None,
    channel: ShellChannel | None = None,
    token: str | None = None,
) -> GuardedServer:
    """Server on ``host`` and ``port`` (0: a free one) that accepts only pages that it served itself.

    ``pages`` are served beside viser's; ``channel`` talks to what is around its page; both follow the same rules.
    ``token``: token that a browser has to show; None: none, allowed if only this machine can reach the page.

    Raises PortError for a port that is busy or not allowed, for a host that is not of this machine, and for one that
    others can reach without a token.
    """
    check_token(host, token)
    port = free_port(host, port)
    hosts, named = allowed_hosts(host, port), [f"{address(host)}:{port}"]
    origins: Any = [f"http://{name}" for name in hosts]
    real_serve = websockets.asyncio.server.serve
    incoming = Incoming()

    def serve(handler: Any, serve_host: str, serve_port: int, **options: Any) -> Any:
        async def either(connection: Any) -> None:
            if channel is not None and connection.request.path == PATH:
                await channel.handle(connection)
            else:
                await incoming.handle(connection, handler)

        options["process_request"] = _for_hosts(hosts, named, token, pages, options["process_request"])
        options |= {"max_size": MOST_MESSAGE_BYTES, "max_queue": MOST_QUEUED, "logger": _quiet_logger()}
        options |= {"ping_interval": ASK_AFTER, "ping_timeout": GIVE_UP_AFTER, "close_timeout": CUT_AFTER}
        return real_serve(
            either, serve_host, serve_port, origins=origins, create_connection=BoundedConnection, **options
        )

    websockets.asyncio.server.serve = serve  # type: ignore[assignment, misc]
    try:
        # viser prints a banner whatever ``verbose`` says; the caller prints the address.
        with contextlib.redirect_stdout(io.StringIO()):
            server = GuardedServer(host=host, port=port, label=label, verbose=False)
    finally:
        websockets.asyncio.server.serve = real_serve  # type: ignore[misc]
    if server.get_port() != port:
        server.stop()
        raise PortError(f"port {port} on {host} is busy; choose another one, or 0 for any free port")
    server.token, server._named = token, named
    for share in (_messages.ShareUrlRequest, _messages.ShareUrlDisconnect):
        server._websock_server.unregister_handler(share)
    incoming.serve(server)
    return server


class GuardedServer(viser.ViserServer):
    """viser's server behind the guard; ``token``: token that a browser has to show, None for none."""

    token: str | None = None
    _named: list[str]
    """The name (``name:port``) by which the latest browser has come."""

    def address(self, port: int | None = None) -> str:
        """Address for links to this server or another ``port``, under the name that the latest browser asked for."""
        own = self.get_port()
        return f"http://{self._named[0].removesuffix(f':{own}')}:{own if port is None else port}"


class BoundedConnection(websockets.asyncio.server.ServerConnection):
    """A connection that is closed at once if there are ``MOST_CONNECTIONS`` others."""

    def connection_made(self, transport: Any) -> None:
        """Called by asyncio."""
        super().connection_made(transport)
        if len(self.server.handlers) > MOST_CONNECTIONS:
            transport.abort()


def check_token(host: str, token: str | None) -> None:
    """Raise PortError for a host that others can reach without a token, and for a token that can be guessed."""
    advice = f"a token of at least {SHORTEST_TOKEN} characters, such as {TOKEN_VARIABLE}=$(openssl rand -hex 16)"
    if token is None and not is_loopback(host):
        raise PortError(f"--host {host}: anybody on the network could open this page; it needs {advice}")
    if token is not None and not (len(token) >= SHORTEST_TOKEN and token.isascii() and token.isprintable()):
        raise PortError(f"--token: {len(token)} characters; allowed: {advice}")


def is_loopback(host: str) -> bool:
    """Whether only this machine can reach ``host``."""
    try:
        return host == "localhost" or ipaddress.ip_address(host).is_loopback
    except ValueError:  # a name, which may mean any address
        return False


def _quiet_logger() -> logging.Logger:
    """A logger that ignores connections that were never opened, which anybody can make."""
    logger = logging.getLogger("explorer.page_server")
    logger.addFilter(_of_open_connections)
    return logger


def _of_open_connections(record: logging.LogRecord) -> bool:
    return not record.getMessage().startswith(("opening handshake failed", "connection rejected"))


def free_port(host: str, port: int) -> int:
    """``port`` if it can be listened on, or a free one for 0. Raises PortError."""
    if not 0 <= port <= 65535:
        raise PortError(f"port {port} is outside 0 … 65535")
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    with socket.socket(family, socket.SOCK_STREAM) as probe:
        # As the server itself will do, so that connections of a server that has just ended do not block the port.
        probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            probe.bind((host, port))
        except OSError as error:
            raise PortError(f"cannot listen on {host}, port {port}: {error.strerror or error}") from None
        return int(probe.getsockname()[1])


def address(host: str) -> str:
    """Name under which a browser on this machine finds ``host``."""
    if host in ANY_ADDRESS:
        return "127.0.0.1"
    return f"[{host}]" if ":" in host else host


def _for_hosts(
    hosts: Sequence[str], latest: list[str], token: str | None, pages: WebPages | None, answer: Any
) -> Callable[[Any, Any], Any]:
    """The answer of ``pages``, or viser's ``answer`` (to an HTTP request or the opening of a WebSocket), for ``hosts``
    and those who know the ``token``; 421 for other hosts, 401 and a form for those without a token. ``latest`` is
    changed to the name that was asked for last."""

    def process_request(connection: Any, request: Any) -> Any:
        named = [name.lower() for name in request.headers.get_all("Host")]
        if len(named) != 1 or named[0] not in hosts:
            return connection.respond(HTTPStatus.MISDIRECTED_REQUEST, "This server has another name.\n")
        if token is not None and not has_cookie(request.headers.get_all("Cookie"), *token_cookie(token)):
            return _login_response(connection, request, token)
        latest[0] = named[0]
        if "Upgrade" in request.headers and len(connection.server.connections) >= MOST_SOCKETS:
            return connection.respond(HTTPStatus.SERVICE_UNAVAILABLE, "Too many browsers are at this page.\n")
        own = None if pages is None else pages.answer(request)
        return answer(connection, request) if own is None else own

    return process_request


def token_cookie(token: str) -> tuple[str, str]:
    """Name and value of the cookie of pages with this token, on any port: recordings and tables have their own."""
    value = hmac.new(token.encode(), b"page", sha256).hexdigest()
    return f"explorer_{sha256(token.encode()).hexdigest()[:8]}", value


def has_cookie(sent: Sequence[str], name: str, value: str) -> bool:
    """Whether the headers ``sent`` by a browser hold the cookie ``name`` that it got for the token."""
    try:
        cookies = SimpleCookie("; ".join(sent))
    except CookieError:
        return False
    return name in cookies and hmac.compare_digest(cookies[name].value.encode(), value.encode())


def _login_response(connection: Any, request: Any, token: str) -> Any:
    """For an address with the token: the cookie, and the same address without the token. For others: a form for it."""
    path, _, query = request.path.partition("?")
    asked = parse_qsl(query, keep_blank_values=True)
    given = [value for key, value in asked if key == TOKEN_KEY]
    if len(given) != 1 or not hmac.compare_digest(given[0].encode(), token.encode()) or "Upgrade" in request.headers:
        response = connection.respond(HTTPStatus.UNAUTHORIZED, ASK_TOKEN)
        del response.headers["Content-Type"]
        response.headers["Content-Type"] = "text/html; charset=utf-8"
    else:
        rest = urlencode([(key, value) for key, value in asked if key != TOKEN_KEY])
        response = connection.respond(HTTPStatus.SEE_OTHER, "")
        # One slash: with two, what follows would name another server.
        response.headers["Location"] = "/" + path.lstrip("/\\") + (f"?{rest}" if rest else "")
        kept = f"Max-Age={COOKIE_DAYS * 86400}; Path=/; HttpOnly; SameSite=Lax"
        response.headers["Set-Cookie"] = "=".join(token_cookie(token)) + f"; {kept}"
    response.headers["Cache-Control"] = "no-store"
    return response


def allowed_hosts(host: str, port: int) -> list[str]:
    """Names (``name:port``) by which a browser may address this server: its own names and addresses, in lower case."""
    names = {*LOCAL_NAMES}
    if host in ANY_ADDRESS:
        names |= own_addresses()
    else:
        names.add(f"[{host}]" if ":" in host else host)
    endings = (f":{port}", "") if port == HTTP_PORT else (f":{port}",)
    return [f"{name.lower()}{ending}" for name in sorted(names) for ending in endings]


def own_addresses() -> set[str]:
    """Name and IPv4 addresses of this machine."""
    name = socket.gethostname()
    try:
        return {name, *socket.gethostbyname_ex(name)[2]}
    except OSError:
        return {name}
