"""No chart, report or page offers to upload its data, and none names an address outside this machine."""

import json
import re

import pytest
from plotly.offline import get_plotlyjs

from doe.audit import audit_study
from explorer.audit.read_study import read_study, shipped_study
from explorer.audit.report import audit_html
from explorer.design.analysis import AnalyseOrder, run_analyse
from explorer.logs.replay import replay_page
from explorer.report import report_html
from explorer.report.design import design_html
from explorer.report.diagnosis import diagnosis_html
from explorer.report.figures.style import CONFIG
from explorer.report.study_charts import study_plots
from explorer.viewer.study.plot_view import Drawn
from tests.explorer import diagnosed, reported_studies
from tests.explorer.command_line import explorer
from tests.test_architecture import PACKAGES, repository_sources

ADDRESS = re.compile(r"\b[a-z]+://[^\s\"'<>`]*|\b(?:src|href|action)\s*=\s*[\"'](?!#)[^\"']*")
"""An address with a protocol, or what an element loads, links to or sends to, but for places on the page itself.

There are no exceptions: SVG and its XML namespaces come from plotly.js only, and a publication is cited in words
("Processes 2022, 10, 185"), not by a link.
"""
RENDERERS = {
    r"\bget_plotlyjs\(": ["explorer/report/html.py"],
    r"\bPlotly\.(newPlot|react)\(": ["explorer/report/html.py"],
    r"\badd_plotly\(": ["explorer/viewer/study/plot_view.py"],
    r"\bplotly\.(io|graph_objects|express)\b|\b(to|write)_html\(|\bwrite_image\(": ["explorer/notebook/results.py"],
}
"""Ways to draw a chart, and the one place for each: no second one may forget CONFIG."""


def lab_page(folder):
    path = folder / "curves.html"
    assert explorer("lab", "compression", "compression", "--plot", path).exit_code == 0
    return path.read_text(encoding="utf-8")


PAGES = {
    "study": lambda _: report_html(reported_studies.typed(reported_studies.result_of_case("two targets"))),
    "design": lambda _: design_html(run_analyse(AnalyseOrder("sunflower_extract", target=24.68))),
    "diagnosis": lambda _: diagnosis_html(diagnosed.typed(diagnosed.result_of_case("ambiguous"))),
    "audit": lambda _: audit_html(audit_study(read_study(shipped_study()))),
    "lab": lab_page,
}
"""Every kind of report with charts, written as the program writes it."""


@pytest.fixture(scope="module", params=PAGES)
def page(request, tmp_path_factory):
    return PAGES[request.param](tmp_path_factory.mktemp("page"))


def test_a_page_names_no_address_outside_the_library(page):
    assert page.count(get_plotlyjs()) == 1
    assert ADDRESS.findall(page.replace(get_plotlyjs(), "")) == []


def test_a_page_may_load_nothing(page):
    policy = re.search(r'<meta http-equiv="Content-Security-Policy" content="([^"]*)">', page)[1]
    assert policy.startswith("default-src 'none'; ")
    assert "http" not in policy


def test_the_charts_of_a_page_are_drawn_with_the_upload_off(page):
    script = page.replace(get_plotlyjs(), "")
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
