"""Reports and the live page in headless Chromium: no request leaves this machine, no tool bar offers an upload."""

import re
from urllib.parse import urlsplit

import pytest

from tests.browser.pages import new_page
from tests.browser.test_page import unfold
from tests.browser.test_study_page import address, data, opened  # noqa: F401
from tests.explorer.report.test_charts_stay_private import PAGES

pytestmark = pytest.mark.browser

UPLOAD = re.compile(r"share|cloud|studio|plotly", re.IGNORECASE)
"""What a tool-bar button of plotly.js says that leads to its makers: "Share chart...", "Produced with Plotly.js"."""
BUTTONS = """() => [...document.querySelectorAll('.modebar-btn')].map(
    button => [button.dataset.title, button.getAttribute('aria-label'), button.textContent, button.href].join(' '))"""
CONTEXTS = """() => [...document.querySelectorAll('.js-plotly-plot')].map(
    chart => [chart._context.showSendToCloud, chart._context.plotlyServerURL])"""
LINKS = "() => [...document.querySelectorAll('a[href]')].map(link => link.href)"
LOCAL_HOSTS = {"127.0.0.1", "localhost"}
LOCAL_SCHEMES = {"file", "data", "blob"}


@pytest.fixture
def page(browser):
    """An empty page; addresses that it asks for, sockets included, are collected in ``page.asked``."""
    page = new_page(browser, 1280, 1400)
    page.asked = []
    page.context.on("request", lambda request: page.asked.append(request.url))
    page.on("websocket", lambda socket: page.asked.append(socket.url))
    yield page
    page.close()


def foreign(addresses):
    """Those that lead away from this machine."""
    parts = [urlsplit(one) for one in addresses]
    return [one.geturl() for one in parts if one.scheme not in LOCAL_SCHEMES and one.hostname not in LOCAL_HOSTS]


def assert_no_upload(page):
    """The charts that are drawn have a tool bar, and no button in it leads away."""
    titles = page.evaluate(BUTTONS)
    assert any("Download plot" in title for title in titles)  # a tool bar is there at all
    assert [title for title in titles if UPLOAD.search(title)] == []
    contexts = page.evaluate(CONTEXTS)
    assert contexts
    assert all(context == [False, ""] for context in contexts)
    assert foreign(page.evaluate(LINKS)) == []


@pytest.mark.parametrize("kind", [kind for kind in PAGES if kind != "audit"])  # an audit has no chart
def test_a_report_offers_no_upload_and_asks_no_other_host(kind, page, tmp_path):
    path = tmp_path / f"{kind}.html"
    path.write_text(PAGES[kind](tmp_path), encoding="utf-8")
    page.goto(path.as_uri())
    charts = page.locator("figure > script").count()
    page.wait_for_function("charts => document.querySelectorAll('.modebar').length === charts", arg=charts)
    assert_no_upload(page)
    assert foreign(page.asked) == []


def test_the_live_page_offers_no_upload_and_asks_no_other_host(page, address):  # noqa: F811
    opened(page, address)
    # The board in its frame, then the profiler, whose enlarged chart is drawn anew.
    frame = page.frame_locator('iframe[title="Study"]')
    frame.locator(".js-plotly-plot .modebar").first.wait_for(state="attached")
    assert_no_upload(next(one for one in page.frames if "board.html" in one.url))
    unfold(page, "Profiler")
    page.locator(".js-plotly-plot .modebar").first.wait_for(state="attached")
    assert_no_upload(page)
    page.locator(".js-plotly-plot").hover()
    page.locator(".js-plotly-plot + button").click()
    page.locator(".mantine-Modal-body .js-plotly-plot .modebar").wait_for(state="attached")
    assert_no_upload(page)
    assert any(one.startswith("ws://") for one in page.asked)
    assert foreign(page.asked) == []
