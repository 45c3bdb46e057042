"""No chart, report or page offers to upload its data, and none names an address outside this machine."""

import base64
import gzip
import json
import re

import pytest
from plotly.offline import get_plotlyjs

from doe.audit import audit_study
from explorer.audit.read_study import read_study, shipped_study
from explorer.audit.report import audit_html
from explorer.design.analysis import AnalyseOrder, run_analyse
from explorer.recordings.replay import replay_page
from explorer.report import report_html
from explorer.report.content import Word
from explorer.report.design import design_html
from explorer.report.diagnosis import diagnosis_html
from explorer.report.figures.style import CONFIG
from explorer.report.study_charts import study_plots
from explorer.viewer.study.plot_view import Drawn
from tests.explorer import diagnosed, reported_studies
from tests.explorer.command_line import explorer
from tests.test_architecture import PACKAGES, repository_sources

ADDRESS = re.compile(r"\b[a-z]+://[^\s\"'<>`]*|\b(?:src|href|action)\s*=\s*[\"'](?!#|data:image/png;)[^\"']*")
"""An address with a protocol, or what an element loads, links to or sends to, but for places on the page itself and
pictures in it.

There are no exceptions: SVG and its XML namespaces come from plotly.js only, and a publication is cited in words
("Processes 2022, 10, 185"), not by a link.
"""
RENDERERS = {
    r"\bget_plotlyjs\(": ["explorer/report/html.py"],
    r"\bPlotly\.(newPlot|react)\(": [],  # in explorer/report/templates/charts.js
    r"\badd_plotly\(": ["explorer/viewer/study/plot_view.py"],
    r"\bplotly\.(io|graph_objects|express)\b|\b(to|write)_html\(|\bwrite_image\(": ["explorer/notebook/results.py"],
}
"""Ways to draw a chart, and the one place for each: no second one may forget CONFIG."""


def lab_page(folder):
    path = folder / "curves.html"
    assert explorer("lab", "compression", "compression", "--plot", path).exit_code == 0
    return path.read_text(encoding="utf-8")


def photograph_page(folder):
    made = explorer("measure", "cone_25_30", "--reference-length", 100, "--report", folder / "report")
    assert made.exit_code == 0
    return (folder / "report" / "report.html").read_text(encoding="utf-8")


def library(page):
    """The packed plotly.js of a page, or "" where there is none."""
    found = re.search(r'<script id="plotly" type="application/gzip">([^<]*)</script>', page)
    return found[1] if found else ""


PAGES = {
    "study": lambda _: report_html(reported_studies.typed(reported_studies.result_of_case("two targets"))),
    "design": lambda _: design_html(run_analyse(AnalyseOrder("sunflower_extract", target=24.68))),
    "diagnosis": lambda _: diagnosis_html(diagnosed.typed(diagnosed.result_of_case("ambiguous"))),
    "audit": lambda _: audit_html(audit_study(read_study(shipped_study()))),
    "lab": lab_page,
    "photograph": photograph_page,
}
"""Every kind of report, written as the program writes it."""


@pytest.fixture(scope="module", params=PAGES)
def page(request, tmp_path_factory):
    return PAGES[request.param](tmp_path_factory.mktemp("page"))


def test_a_page_names_no_address_outside_the_library(page):
    assert get_plotlyjs() not in page
    packed = library(page)
    assert ADDRESS.findall(page.replace(packed, "") if packed else page) == []


def test_a_page_holds_the_library_once_and_only_where_it_has_a_chart(page):
    charts = page.count('<script type="application/json">')
    assert page.count('<script id="plotly"') == (1 if charts else 0)
    if charts:
        assert gzip.decompress(base64.b64decode(library(page))).decode() == get_plotlyjs()
    assert len(page.encode()) < 5e6


def test_a_page_begins_with_a_verdict_of_the_fixed_list(page):
    before, _, _ = page.partition("<nav")
    (headline,) = re.findall(r'<div class="banner (?:good|bad|open)" role="status">\s*<strong>(.*?)</strong>', before)
    assert any(headline.startswith(word) for word in Word)
    why, then = re.findall(r"<p>(.*?)</p>", before[before.index('<div class="banner') :])
    assert len(why) > 20
    assert then.startswith("<b>Next:</b> ")


def test_figures_are_numbered_and_say_axes_n_and_what_they_show_without_sight(page):
    captions = re.findall(r"<figcaption><b>Figure (\d+)\.</b> (.*?)</figcaption>", page)
    assert [int(number) for number, _ in captions] == list(range(1, 1 + page.count("<figure ")))
    charts = re.findall(
        r'<figure id="([^"]*)"><script type.*?<div role="img" aria-label="([^"]*)".*?<figcaption>(.*?)</figc', page
    )
    assert len(charts) == page.count('<script type="application/json">')
    for name, words, caption in charts:
        assert "Across: " in words, name
        assert "Across: " in caption, name
        assert re.search(r"\bn = \d+", caption), name


def test_a_page_may_load_nothing(page):
    policy = re.search(r'<meta http-equiv="Content-Security-Policy" content="([^"]*)">', page)[1]
    assert policy.startswith("default-src 'none'; ")
    assert "http" not in policy


def test_the_charts_of_a_page_are_drawn_with_the_upload_off(page):
    script = page.replace(library(page), "") if library(page) else page
    if not library(page):
        assert "<script" not in page
        return
    assert json.loads(re.search(r"const config = (\{.*?\});", script)[1]) == CONFIG
    drawn = re.findall(r"Plotly\.newPlot\(.*", script)
    assert len(drawn) == 1
    assert "...config" in drawn[0]


def test_the_charts_of_the_live_page_are_drawn_with_the_upload_off():
    plots = study_plots(reported_studies.typed(reported_studies.result_of_case("two targets")))
    for title, plot in plots.items():
        sent = json.loads(Drawn(plot.make(), True, title).to_json())
        assert sent["config"] == CONFIG
        assert ADDRESS.findall(json.dumps(sent)) == []


def test_the_upload_is_off_by_options_that_the_library_knows():
    assert CONFIG["showSendToCloud"] is False
    assert CONFIG["plotlyServerURL"] == ""
    assert CONFIG["displaylogo"] is False
    for option in CONFIG:
        assert f"{option}:{{valType:" in get_plotlyjs()


@pytest.mark.parametrize("way", RENDERERS)
def test_each_way_to_draw_a_chart_is_used_in_one_place(way):
    sources = repository_sources(*PACKAGES)
    assert [source.path for source in sources if re.search(way, source.text)] == RENDERERS[way]


def test_what_is_added_to_the_replay_page_names_no_address():
    assert ADDRESS.findall(replay_page("<head>")) == []
