"""The private names that the guard leans on, and what it keeps out."""

import asyncio
import http.client
import socket

import pytest
import viser
import websockets
from viser import _messages

from explorer.viewer.guarded_server import PortError, allowed_hosts, free_port, guarded_server


def answer(port, origin):
    """ "accepted", or the status of the refusal, for a page of ``origin`` that wants to talk to the server."""

    async def attempt():
        try:
            async with websockets.connect(
                f"ws://127.0.0.1:{port}",
                subprotocols=[f"viser-v{viser.__version__}"],
                origin=origin,
                max_size=None,
            ):
                return "accepted"
        except websockets.InvalidStatus as error:
            return error.response.status_code

    return asyncio.run(attempt())


@pytest.mark.parametrize(
    ("origin", "expected"),
    [
        ("http://127.0.0.1:{port}", "accepted"),
        ("http://localhost:{port}", "accepted"),
        ("http://evil.example", 403),
        ("http://127.0.0.1:1", 403),
        ("null", 403),
        (None, 403),
    ],
)
def test_only_its_own_pages_may_talk_to_the_server(server, origin, expected):
    port = server.get_port()
    assert answer(port, origin and origin.format(port=port)) == expected


def tunnel_handlers(server):
    """What viser does when a browser asks for a public tunnel; it has no public name for that."""
    return server._websock_server._incoming_handlers.get(_messages.ShareUrlRequest)


def test_nobody_can_ask_for_a_public_tunnel(server):
    assert not tunnel_handlers(server)


def test_an_unguarded_server_would_take_such_requests():
    plain = viser.ViserServer(host="127.0.0.1", port=free_port("127.0.0.1", 0), verbose=False)
    try:
        assert tunnel_handlers(plain)
    finally:
        plain.stop()


def test_a_busy_port_is_refused_with_one_line(server):
    port = server.get_port()
    with pytest.raises(PortError, match=rf"^cannot listen on 127.0.0.1, port {port}: .*in use"):
        guarded_server("127.0.0.1", port, "second")


def test_a_host_of_another_machine_and_an_impossible_port_are_refused():
    with pytest.raises(PortError, match=r"192\.0\.2\.1"):
        guarded_server("192.0.2.1", 0, "elsewhere")
    with pytest.raises(PortError, match="outside 0 … 65535"):
        guarded_server("127.0.0.1", 70000, "beyond")


def test_port_zero_is_a_free_one():
    port = free_port("127.0.0.1", 0)
    assert 1024 < port < 65536
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", port))


def test_a_server_for_all_addresses_knows_its_own_names():
    own = f"{socket.gethostname().lower()}:8080"
    assert own in allowed_hosts("0.0.0.0", 8080)
    assert own not in allowed_hosts("127.0.0.1", 8080)
    assert "[::1]:8080" in allowed_hosts("::1", 8080)
    assert "localhost" not in allowed_hosts("127.0.0.1", 8080)
    # RFC 9110, 4.2.1 and 7.2: the default port may be left out, and browsers do so.
    assert {"localhost", "localhost:80"} <= set(allowed_hosts("127.0.0.1", 80))


def page_status(port, hosts):
    """Status of the answer to a request for the page that carries these Host lines."""
    connection = http.client.HTTPConnection("127.0.0.1", port, timeout=10)
    connection.putrequest("GET", "/", skip_host=True)
    for host in hosts:
        connection.putheader("Host", host)
    connection.endheaders()
    status = connection.getresponse().status
    connection.close()
    return status


@pytest.mark.parametrize(
    ("hosts", "expected"),
    [
        (["127.0.0.1:{port}"], 200),
        (["LocalHost:{port}"], 200),
        (["[::1]:{port}"], 200),
        (["evil.example:{port}"], 421),
        (["127.0.0.1:1"], 421),
        (["127.0.0.1"], 421),
        ([], 421),
        (["127.0.0.1:{port}", "evil.example:{port}"], 421),
    ],
)
def test_the_page_is_served_under_its_own_names_only(server, hosts, expected):
    port = server.get_port()
    assert page_status(port, [host.format(port=port) for host in hosts]) == expected


def test_links_are_under_the_name_by_which_a_browser_came(server):
    port = server.get_port()
    for host, expected in (("LocalHost:{port}", "localhost"), ("[::1]:{port}", "[::1]"), ("evil.example", "[::1]")):
        page_status(port, [host.format(port=port)])
        assert server.address() == f"http://{expected}:{port}"
        assert server.address(9999) == f"http://{expected}:9999"


def test_a_rebound_name_cannot_open_a_socket(server):
    """DNS rebinding: the foreign name means 127.0.0.1 by now, so the page's requests reach the server under it."""
    port = server.get_port()
    request = (
        f"GET / HTTP/1.1\r\nHost: evil.example:{port}\r\nOrigin: http://localhost:{port}\r\nUpgrade: websocket\r\n"
        "Connection: Upgrade\r\nSec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\nSec-WebSocket-Version: 13\r\n"
        f"Sec-WebSocket-Protocol: viser-v{viser.__version__}\r\n\r\n"
    )
    with socket.create_connection(("127.0.0.1", port), timeout=10) as connection:
        connection.sendall(request.encode())
        assert connection.recv(12) == b"HTTP/1.1 421"
