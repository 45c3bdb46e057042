"""What tests of panels share: the server of a page, without a browser."""

import pytest


@pytest.fixture(scope="module")
def server():
    """A guarded server on a free port, for all tests of one file."""
    # Imported here: viser is loaded by those tests only that need it.
    from explorer.viewer.guarded_server import guarded_server

    server = guarded_server("127.0.0.1", 0, "test")
    yield server
    server.stop()
