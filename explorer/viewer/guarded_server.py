"""A viser server that a foreign web page cannot drive.

viser 1.1.1 checks neither Origin nor Host, moves to another port when one is busy, and lets any client open a
public tunnel. All of this is closed here. The Host is checked besides the Origin because of DNS rebinding: a foreign
page whose name has come to mean 127.0.0.1 is of the same origin as this server, but gives itself away by that name.

Two private names of viser and one of ``websockets`` are used, which is why viser is pinned and a test watches each.
"""

from __future__ import annotations

import contextlib
import io
import socket
from collections.abc import Sequence
from http import HTTPStatus
from typing import Any

import viser
import websockets.asyncio.server
from viser import _messages

from explorer.errors import CommandError
from explorer.viewer.shell.channel import PATH, ShellChannel
from explorer.viewer.shell.web_pages import WebPages

LOCAL_NAMES = ("127.0.0.1", "localhost", "[::1]")
ANY_ADDRESS = ("0.0.0.0", "::", "")
HTTP_PORT = 80
"""Browsers leave this one out of Host and Origin."""


class PortError(CommandError):
    """A host or port that the server cannot listen on; one line, fit for a user."""


def guarded_server(
    host: str, port: int, label: str, pages: WebPages | None = None, channel: ShellChannel | None = None
) -> viser.ViserServer:
    """Server on ``host`` and ``port`` (0: a free one) that accepts pages which it served itself, and no
    other.

    ``pages`` are served beside viser's, ``channel`` talks to what stands around its page; both under the same rules.

    Raises PortError for a port that is busy or not allowed, and for a host that is not of this machine.
    """
    port = free_port(host, port)
    hosts = allowed_hosts(host, port)
    origins: Any = [f"http://{name}" for name in hosts]
    real_serve = websockets.asyncio.server.serve

    def serve(handler: Any, serve_host: str, serve_port: int, **options: Any) -> Any:
        async def either(connection: Any) -> None:
            if channel is not None and connection.request.path == PATH:
                await channel.handle(connection)
            else:
                await handler(connection)

        options["process_request"] = _for_hosts(hosts, pages, options["process_request"])
        return real_serve(either, serve_host, serve_port, origins=origins, **options)

    websockets.asyncio.server.serve = serve  # type: ignore[assignment, misc]
    try:
        # viser prints a banner whatever ``verbose`` says; the address is for the caller to tell.
        with contextlib.redirect_stdout(io.StringIO()):
            server = viser.ViserServer(host=host, port=port, label=label, verbose=False)
    finally:
        websockets.asyncio.server.serve = real_serve  # type: ignore[misc]
    if server.get_port() != port:
        server.stop()
        raise PortError(f"port {port} on {host} is busy; choose another one, or 0 for any free port")
    server._websock_server.unregister_handler(_messages.ShareUrlRequest)
    return server


def free_port(host: str, port: int) -> int:
    """``port`` if it can be listened on, or a free one for 0. Raises PortError."""
    if not 0 <= port <= 65535:
        raise PortError(f"port {port} is outside 0 … 65535")
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    with socket.socket(family, socket.SOCK_STREAM) as probe:
        # As the server itself will do: connections of a server that has just ended do not block the port.
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


def _for_hosts(hosts: Sequence[str], pages: WebPages | None, answer: Any) -> Any:
    """The answer of ``pages``, or viser's ``answer`` (to an HTTP request or the opening of a WebSocket), for ``hosts``;
    421 for others."""

    def process_request(connection: Any, request: Any) -> Any:
        named = [name.lower() for name in request.headers.get_all("Host")]
        if len(named) != 1 or named[0] not in hosts:
            return connection.respond(HTTPStatus.MISDIRECTED_REQUEST, "This server has another name.\n")
        own = None if pages is None else pages.answer(request)
        return answer(connection, request) if own is None else own

    return process_request


def allowed_hosts(host: str, port: int) -> list[str]:
    """What a browser may call this server (``name:port``): its own names and addresses, in lower case."""
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
