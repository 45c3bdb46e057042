"""What a report says of a study's runs, valid ones and seeds tried, and of the limits that its method sets."""

import re

from explorer.report import report_html, report_markdown
from explorer.report.sections import designs
from solver.scenes.contact_model import ContactModel
from tests.explorer.reported_studies import PROFILE, result_of_case, table, typed, visible


def test_a_study_of_runs_that_last_their_time_counts_its_valid_runs():
    """A drum, or ``numerics.duration``: runs end "measured" and no pour comes to rest."""
    result = result_of_case("ended measured")
    assert set(result["runs"]["by_outcome"]) == {"measured", "jammed"}
    valid, total = result["runs"]["valid"], result["runs"]["total"]
    stages = {row[0]: row for row in table(result, "stage", "pours", "valid")}
    for stage, pours in result["runs"]["by_stage"].items():
        measured = sum(run["outcome"] == "measured" for run in result["runs"]["list"] if run["stage"] == stage)
        assert stages[stage][1:3] == [str(pours), str(measured)]
        assert stages[stage][3] == f"{100 * (1 - measured / pours):.1f} %"
    points = table(result, "point")
    assert [int(row[4]) for row in points] == [PROFILE.surface_replicates] * len(points)
    steps, rows = table(result, "step"), table(result, "row", "levels")
    assert {int(row[4]) for row in steps} == {PROFILE.ascent_replicates}
    assert {int(row[2]) for row in rows} == {PROFILE.screening_replicates}
    share = f"{100 * (1 - valid / total):.1f} % not valid"
    for text in (visible(report_html(typed(result))), report_markdown(typed(result))):
        assert share in text.replace("\xa0", " ")
        assert not re.search(r"\b(gave|given|without) (a|no) pile|no pile", text)


def test_numbers_of_the_method_are_printed_from_where_they_are_decided(monkeypatch):
    result = result_of_case("planted")
    text = report_markdown(typed(result))
    assert "at most 3 seeds are tried" in text
    assert "main effects in the 28-run design" in text
    assert "misses by more than 5° under" in text
    assert "touch fewer than 5 bodies" in text
    result["study"]["tries"] = 1
    result["screening"]["analysis"]["rows"] = 36
    monkeypatch.setattr(designs, "BIAS_LIMIT_DEG", 7.5)
    monkeypatch.setattr(designs, "MIN_BODIES", 9)
    text = report_markdown(typed(result))
    assert "at most 1 seed is tried" in text
    assert "main effects in the 36-run design" in text
    assert "misses by more than 7.5° under" in text
    assert "touch fewer than 9 bodies" in text


def test_the_contact_law_is_named_with_the_conventions_that_matter_to_it():
    result = result_of_case("planted")
    for contact, words in (
        ({"clump_rule": "body_mass"}, "Contact law: Hertz–Mindlin; clump rule body_mass ("),
        (
            ContactModel().stated,
            "Contact law: Hertz–Mindlin; clump rule body_mass, tangential law mindlin_rescale, tan",
        ),
        (
            ContactModel(law="linear_spring_dashpot").stated,
            "Contact law: linear springs and dashpots; clump rule body_mass, characteristic velocity 1.0, tangential d",
        ),
        ({"law": "uninstalled", "clump_rule": "body_mass"}, "Contact law: uninstalled; clump rule body_mass ("),
    ):
        result["study"]["contact"] = contact
        assert words in report_markdown(typed(result)).replace("\\_", "_")
