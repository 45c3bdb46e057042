"""Pages beside viser's own on its port: reports, boards of studies, and the first page with its surroundings.

An address names an entry that this program made; a browser never sends a file path. All pages are read-only.
"""

from __future__ import annotations

import gzip
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cache, cached_property, lru_cache, partial
from hashlib import sha256
from html import escape
from http import HTTPStatus
from pathlib import Path

import viser
from websockets.datastructures import Headers
from websockets.http11 import Request, Response

from explorer.errors import CommandError

HERE = Path(__file__).parent
TITLE = "<title>Viser</title>"
"""Title of viser's first page, which is replaced by our title, style and script."""
TEXT = """<title>{title}</title>
    <link rel="stylesheet" href="/shell/text.css" />
    <script src="/shell/accessibility.js" type="module"></script>"""
AROUND = """
    <script>
      window.linked = location.hash;
      if (linked) history.replaceState(null, "", location.pathname + location.search);
    </script>
    <link rel="stylesheet" href="/shell/shell.css" />
    <script src="/shell/shell.js" type="module"></script>"""
"""The part of the address after # is removed before viser's script runs, which derives its socket address from it."""
SHIPPED = ("element.js", "accessibility.js", "text.css", "shell.js", "shell.css", "board.html", "board.js", "board.css")
"""Files beside this one that are served."""
HTML, JSON = "text/html; charset=utf-8", "application/json"
KINDS: Mapping[str, str] = {
    ".html": HTML,
    ".css": "text/css; charset=utf-8",
    ".js": "text/javascript; charset=utf-8",
    ".json": JSON,
    ".md": "text/plain; charset=utf-8",
    ".csv": "text/csv; charset=utf-8",
    ".bib": "text/plain; charset=utf-8",
    ".svg": "image/svg+xml",
    ".pdf": "application/pdf",
    ".png": "image/png",
    ".rrd": "application/octet-stream",
}
"""Suffix of a file name → media type sent to the browser; other files are not served."""
FOREIGN = ("cross-site", "same-site")
"""Values of `Sec-Fetch-Site` that a browser sends for requests from pages other than ours."""
GUARD = {
    "X-Content-Type-Options": "nosniff",
    "X-Frame-Options": "SAMEORIGIN",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Referrer-Policy": "no-referrer",
}
LETTERS = 12
"""Length of the id of a folder."""


@dataclass(frozen=True)
class WebPage:
    """What is sent for an address."""

    kind: str
    """Media type."""
    body: bytes
    lasting: bool = False
    """Whether a browser may keep it for a day."""

    @cached_property
    def tag(self) -> str:
        """Changes whenever the body does."""
        return f'"{sha256(self.body).hexdigest()[:16]}"'


class WebPages:
    """Addresses and what makes their pages.

    ``title``: of the first page; ``around``: whether it has a state line and a timeline, and hence a channel.
    """

    def __init__(self, title: str, around: bool = True) -> None:
        self._pages: dict[str, Callable[[], WebPage]] = {
            "/": lambda: _first_page(title, around),
            "/index.html": lambda: _first_page(title, around),
            "/shell/plotly.js": _plotly,
            **{f"/shell/{name}": partial(_shipped, name) for name in SHIPPED},
        }

    def publish(self, address: str, page: WebPage) -> None:
        """Serve ``page`` at ``address`` from now on, in place of a former one."""
        self._pages[address] = lambda: page

    def publish_made(self, address: str, make: Callable[[], WebPage]) -> None:
        """Serve at ``address`` what ``make`` gives for every request."""
        self._pages[address] = make

    def page(self, address: str) -> WebPage:
        """What is served at ``address``. Raises KeyError if nothing is."""
        return self._pages[address]()

    def publish_folder(self, folder: Path) -> str:
        """Serve the files that ``folder`` and its folders hold now, of known kinds; returns their common address."""
        address = f"/reports/{folder_id(folder)}/"
        for file in folder.glob("**/*"):
            if file.is_file() and file.suffix in KINDS and not file.is_symlink():
                name = file.relative_to(folder).as_posix()
                self._pages[address + name] = _reading(file)
        return address

    def answer(self, request: Request) -> Response | None:
        """The response to ``request``; None if it is for viser."""
        path = request.path.partition("?")[0]
        make = self._pages.get(path)
        if make is None:
            ours = path.startswith(("/reports/", "/study/", "/diagnosis/", "/shell/", "/tables/"))
            # The channel is a WebSocket, which the server's handler takes.
            return _refusal(HTTPStatus.NOT_FOUND) if ours and "Upgrade" not in request.headers else None
        if path not in ("/", "/index.html") and request.headers.get("Sec-Fetch-Site") in FOREIGN:
            return _refusal(HTTPStatus.FORBIDDEN)
        if "Upgrade" in request.headers:  # viser's WebSocket is at the first page's address
            return None
        try:
            page = make()
            if request.headers.get("If-None-Match") == page.tag:
                return Response(HTTPStatus.NOT_MODIFIED, "Not Modified", Headers({"ETag": page.tag, **GUARD}))
            return _response(page, "gzip" in request.headers.get("Accept-Encoding", ""))
        except OSError:  # a file that no longer exists
            return _refusal(HTTPStatus.NOT_FOUND)


def folder_id(folder: Path) -> str:
    """Id of a folder in an address: the same each time, and without its name."""
    return sha256(str(folder.absolute()).encode()).hexdigest()[:LETTERS]


def first_page(title: str, viser_page: str, around: bool = True) -> str:
    """viser's first page with our title and style, and the script for what is ``around`` it.

    Raises CommandError if it is not the page known here.
    """
    if viser_page.count(TITLE) != 1:
        raise CommandError(f"viser {viser.__version__}: its first page has no {TITLE}, another version is needed")
    return viser_page.replace(TITLE, TEXT.format(title=escape(title)) + (AROUND if around else ""))


@cache
def _first_page(title: str, around: bool) -> WebPage:
    file = Path(viser.__file__).parent / "client" / "build" / "index.html"
    return WebPage(HTML, first_page(title, file.read_text(encoding="utf-8"), around).encode())


@cache
def _shipped(name: str) -> WebPage:
    return WebPage(KINDS[Path(name).suffix], (HERE / name).read_bytes())


@cache
def _plotly() -> WebPage:
    import plotly

    file = Path(plotly.__file__).parent / "package_data" / "plotly.min.js"
    return WebPage(KINDS[".js"], file.read_bytes(), lasting=True)


def _reading(file: Path) -> Callable[[], WebPage]:
    return lambda: WebPage(KINDS[file.suffix], file.read_bytes())


def _response(page: WebPage, may_zip: bool) -> Response:
    body = _zipped(page.body) if may_zip and len(page.body) > 100_000 else page.body
    headers = Headers(
        {
            "Content-Type": page.kind,
            "Content-Length": str(len(body)),
            "Cache-Control": "max-age=86400" if page.lasting else "no-cache",
            "ETag": page.tag,
            **GUARD,
        }
    )
    if body is not page.body:
        headers["Content-Encoding"] = "gzip"
    return Response(HTTPStatus.OK, "OK", headers, body)


@lru_cache(maxsize=4)
def _zipped(body: bytes) -> bytes:
    return gzip.compress(body, 5)


def _refusal(status: HTTPStatus) -> Response:
    body = f"{status.phrase}\n".encode()
    headers = Headers({"Content-Type": "text/plain", "Content-Length": str(len(body)), **GUARD})
    return Response(status, status.phrase, headers, body)
