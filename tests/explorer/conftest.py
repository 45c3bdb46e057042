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


@pytest.fixture(scope="module")
def unprinted():
    """Reports of one file's tests keep the names of their figures for print, and leave them empty.

    Drawing them takes seconds for each report; `tests/explorer/report/test_report_files.py` looks at drawn ones.
    """
    # Imported here: matplotlib is loaded by those tests only that write reports.
    from explorer.report import printed

    def nothing(spec):
        return {f"{width}mm.{kind}": b"" for width in printed.WIDTHS for kind in ("svg", "pdf")}

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(printed, "printed", nothing)
        yield
