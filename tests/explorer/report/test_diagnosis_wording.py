"""The words of a diagnosis: what each verdict says, what is cautioned, how features and amplitudes read."""

import copy
import re
from dataclasses import replace
from pathlib import Path

import pytest

from doe.diagnose.result import BODIES_ALONE
from doe.validation.sets import read_rows
from explorer.diagnosis.run import DiagnoseOrder, result_of
from explorer.report.diagnosis import wording
from explorer.report.diagnosis.wording import (
    SURFACE_LABELS,
    feature_label,
)
from explorer.terminal.validation import TRUE
from explorer.units import p_value
from solver import ASYMMETRY_NAMES, BULK_NAMES, HISTOGRAM_NAMES, PROFILE_NAMES, TEXTURE_NAMES
from tests.explorer.diagnosed import CASES, diagnosed, typed
from tests.explorer.reported_diagnoses import (
    amplitude_text,
    cautions,
    diagnosis_html,
    diagnosis_markdown,
    strained,
    verdict_sentence,
)
from tests.explorer.reported_studies import visible

pytestmark = pytest.mark.usefixtures("unprinted")


def probability(result, name):
    """Of an effect, as sentences give it."""
    return f"{100 * next(row['probability'] for row in result['effects'] if row['name'] == name):.1f} %"


def test_what_came_of_follow_ups_is_as_the_validation_found_it():
    rows = [row for row in read_rows(Path("assets/validation/sets.jsonl")) if row.root == 4 and row.asked]
    found = sum(row.answer == TRUE.get(row.kind, "right") for row in rows)
    stated = sum(row.chance for row in rows) / len(rows)
    assert f"{found} of {len(rows)} follow-ups found it, where {stated:.0%} had" in wording.FOLLOW_UPS_SO_FAR.replace(
        " %", "%"
    )


def test_what_each_verdict_says(results):
    says = {name: verdict_sentence(result) for name, result in results.items()}
    assert says["nothing"].startswith("Nothing is missing that these data could show")
    assert f"with probability {100 * results['nothing']['probabilities']['nothing']:.1f} %" in says["nothing"]
    assert re.match(
        r"The declared model lacks `adhesion_sjkr`, with probability (over 99|9\d\.\d) %\. It agrees", says["effect"]
    )
    amplitude = r"cohesion energy density [\d.]+ kJ/m³ \(95 % [\d.]+ … [\d.]+ kJ/m³\), \d+ % of the strongest"
    assert re.search(f"{amplitude} that the literature supports", says["effect"])
    assert "On data that were not fitted the error falls from" in says["effect"]
    assert "tilt x" in says["two amplitudes"]
    assert "tilt y" in says["two amplitudes"]
    odds = probability(results["not carried over"], "adhesion_sjkr")
    assert says["not carried over"].startswith(f"The fitted data give `adhesion_sjkr` ({odds}), but the held-out data")
    farthest = results["not carried over"]["held_out"]["farthest"]
    assert farthest > 5.0
    off = f"discharge t90 of condition holdout is {farthest:.1f} standard errors from fresh pours"
    assert off in says["not carried over"]
    assert "nothing independent confirms it" in says["no holdout"]
    assert "lacks two effects at once, `adhesion_sjkr` with `density_error`" in says["pair"]
    odds = {name: probability(results["ambiguous"], name) for name in ("twisting", "rolling_resistance")}
    both = f"`twisting` ({odds['twisting']}) and `rolling_resistance` ({odds['rolling_resistance']})"
    assert says["ambiguous"].startswith(f"The declared model lacks something; these data leave 2 answers: {both}.")
    assert "6 pours of `half the mass` would single out the right one" in says["ambiguous"]
    assert says["ambiguous"].endswith(wording.FOLLOW_UPS_SO_FAR)
    assert says["faint"].startswith("These data leave 4 answers: ")
    assert "nothing missing (" in says["faint"]
    assert "`adhesion_sjkr` (" in says["faint"]
    assert "something outside the library (" in says["faint"]
    assert "none of the 6 effects explains, with probability over 99 %" in says["unexplained"]
    assert "of the squared residual is in condition fit" in says["unexplained"]
    odds = probability(results["does not fit"], "adhesion_sjkr")
    assert f"`adhesion_sjkr` comes nearest ({odds}), and yet does not fit" in says["does not fit"]


def test_a_named_effect_that_may_not_be_alone_is_told_so(results):
    result = copy.deepcopy(results["effect"])
    (row,) = (one for one in result["effects"] if one["name"] == "adhesion_sjkr")
    row |= {"probability": 0.6, "beside": 0.36}
    assert verdict_sentence(result).startswith(
        "The declared model lacks `adhesion_sjkr`, with probability 96.0 %, alone (60.0 %) or with another effect. It"
    )
    text = diagnosis_markdown(result)
    assert "adhesion sjkr, 96.0 %" in text
    assert "| 60.0 % | 96.0 % |" in text
    before = result | {"effects": [{k: v for k, v in one.items() if k != "beside"} for one in result["effects"]]}
    assert "with probability 60.0 %, alone (60.0 %)" in verdict_sentence(before)


def test_single_bodies_stand_beside_both_models(results):
    assert "## Single bodies" not in diagnosis_markdown(results["effect"])
    row = {"body": "bead", "quantity": "mass", "unit": "kg", "mean": 2.2e-3, "standard_error": 2e-5}
    result = copy.deepcopy(results["effect"]) | {"bodies": [row | {"declared": 2e-3, "final": 2.19e-3}]}
    text = diagnosis_markdown(result).partition("## Single bodies")[2].partition("## ")[0]
    assert "| bead | mean mass of one body | 2.2 g ± 0.02 g | 2 g | +10.0 | 2.19 g | +0.5 |" in text


def test_a_follow_up_that_asks_for_bodies_says_so(results):
    result = copy.deepcopy(results["ambiguous"])
    result["next_experiment"][0]["bodies"] = [["bead", "mass"], ["bead", "length_spread"]]
    assert (
        "6 pours of `half the mass`, with mass and length spread of single bodies, would single out the right one"
        in verdict_sentence(result)
    )


@pytest.mark.parametrize("case", ["effect", "nothing"])
def test_an_answer_that_is_given_says_what_would_check_it(results, case):
    result = copy.deepcopy(results[case])
    assert "To check it" not in diagnosis_markdown(result | {"next_experiment": []})
    experiment = {"name": BODIES_ALONE, "chance": 0.93, "separation": 2.0}
    told = {"values": {}, "condition": "fit", "levers": [], "pours": 0, "turned": False, "bodies": [["bead", "mass"]]}
    rivals = ["adhesion_sjkr", "base"] if case == "effect" else ["base", "density_error"]
    result["next_experiment"] = [{"experiment": experiment, "rivals": rivals, **told}]
    text = diagnosis_markdown(result)
    other = "the declared model" if case == "effect" else "`density_error`"
    assert f"To check it, measure mass of single bodies, without a pour: that tells it from {other}." in text
    assert "`explorer diagnose … --follow-up` takes them" in text
    assert "0 pours" not in text


def test_a_declared_model_that_does_not_fit_and_has_no_rival_is_called_so(results):
    result = copy.deepcopy(results["nothing"]) | {"verdict": "unexplained"}
    assert verdict_sentence(result).startswith("The calibrated declared model does not fit the data, and no effect")


def test_an_answer_that_is_taken_back_keeps_its_numbers(results):
    result = results["not carried over"]
    text = diagnosis_markdown(result)
    assert "which the held-out data took back" in text
    assert result["final"] == "adhesion_sjkr"
    assert "`adhesion_sjkr`: vary the load on a contact" in text
    assert result["held_out"]["p"] < 0.01
    assert f"p = {p_value(result['held_out']['p'])}" in text


def test_a_declared_model_that_held_out_data_contradict_is_called_so(results):
    sentence = verdict_sentence(results["wrong elsewhere"])
    odds = f"{100 * results['wrong elsewhere']['probabilities']['nothing']:.1f} %"
    assert sentence.startswith(f"The fitted data give nothing missing ({odds}), but the held-out data contradict it")
    assert "standard errors from fresh pours of the declared model (p" in sentence
    assert sentence.endswith("that none of the effects explains in all conditions.")


def test_cautions_say_what_the_numbers_cannot(results):
    texts = {name: visible(diagnosis_html(result)) for name, result in results.items()}
    assert "it is smaller than on new ones" in texts["no holdout"]
    for name, text in texts.items():
        rows = results[name]["error"]["holdout"]
        assert ("times as far off as noise alone" in text) == bool(rows and rows[-1]["ratio"] > 2.0)
    assert "even the final model is" in texts["not carried over"]
    assert "even the final model is" not in texts["effect"]
    assert "needs static friction grain–steel" in texts["at the edge"]
    assert "at the upper end of its range" in texts["at the edge"]
    assert "at the upper end of its range" not in texts["effect"]
    assert "Only 6 effects were considered" in texts["effect"]
    for text in texts.values():
        assert "Fresh pours that broke off or left nothing to be read: 1 of the declared model" in text
        assert "is in no error of this report" not in text


def test_a_condition_that_fresh_pours_do_not_reach_is_named(results):
    result = copy.deepcopy(results["effect"])
    role = {row["condition"]: row["role"] for row in result["measured"]}
    for model, tests in [("before", True), ("after", False)]:
        row = result["confirmation"][model]["conditions"][-1]
        assert role[row["condition"]] == "holdout"
        row["pours"] = 1
        (said,) = (text for text in cautions(result) if "is in no error of this report" in text)
        assert said.startswith(row["condition"])
        assert ("does not test the answer" in said) != tests


def test_a_correction_that_held_out_data_do_not_bear_out_is_called_so(results):
    result = copy.deepcopy(results["effect"])
    result["error"]["holdout"][-1] |= {"skill": -0.2, "skill_low": -0.9}
    assert "The held-out data do not confirm it" in verdict_sentence(result)
    assert any("does not carry over to the held-out conditions" in text for text in cautions(result))
    assert not any("does not carry over" in text for text in cautions(results["effect"]))


def test_a_single_value_is_said_to_tell_no_scatter(results):
    single, means = copy.deepcopy(results["measured once"]), copy.deepcopy(results["effect"])
    for row in single["measured"]:
        row |= {"replicates": 10, "mean_of": 10}
    for row in means["measured"]:
        row |= {"replicates": 30, "mean_of": 10}
    for result, told in ((single, False), (results["measured once"], False), (means, True), (results["effect"], True)):
        page = visible(diagnosis_html(result))
        assert ("does not tell its scatter" not in page) == told
        assert ("No condition has two values" not in page) == told


def test_an_amplitude_that_is_cut_and_a_wide_scatter_are_called_so(results):
    result = copy.deepcopy(results["effect"])
    assert not any("largest amplitude" in text or "times the variance" in text for text in cautions(result))
    result["effects"][0]["amplitudes"][0]["at_end"] = True
    result["scatter"] = 2.25
    assert any("fits best at the largest amplitude that was considered" in text for text in cautions(result))
    assert any("2.25 times the variance of simulated ones" in text for text in cautions(result))
    assert "the largest that was considered" in verdict_sentence(result)


@pytest.mark.parametrize(
    ("left", "settled"),
    [
        (
            {"twisting": 0.5, "twisting+adhesion_sjkr": 0.3, "air_drag+twisting": 0.16},
            "In all of them `twisting` is missing, alone or with something else (96.0 %).",
        ),
        (
            {"adhesion_jkr": 0.5, "adhesion_sjkr+capillary_bridge": 0.3, "wall_adhesion": 0.16},
            "All of them are laws of adhesion: that surfaces stick is settled (96.0 %), by which law is not.",
        ),
        ({"twisting": 0.5, "air_drag+adhesion_sjkr": 0.46}, ""),
        ({"adhesion_jkr": 0.5, "twisting": 0.46}, ""),
    ],
)
def test_what_is_settled_though_several_answers_are_left_is_told(results, left, settled):
    result = copy.deepcopy(results["ambiguous"])
    row = result["effects"][0]
    result["effects"] = [row | {"name": name, "probability": p} for name, p in {**left, "plate_tilt": 0.02}.items()]
    result["verdict"] = f"ambiguous:{','.join(left)}"
    text = verdict_sentence(result)
    assert (settled in text) if settled else (" of them " not in text)


def test_a_parameter_far_from_its_measurement_is_called_so(results):
    result = copy.deepcopy(results["effect"])
    assert strained(result) == []
    result["parameters"][0] |= {"after": 0.57 + 2.4 * 0.05}
    (line,) = strained(result)
    assert "2.4 standard deviations from its measurement" in line
    assert "the declared model with `adhesion_sjkr` needs static friction grain–grain" in line


def test_features_read_as_words():
    words = {
        "angle_of_repose_deg": "angle of repose",
        "angle_of_repose_deg@45": "angle of repose seen from 45°",
        "height_profile_m(0.0125)": "height profile at 0.0125",
        "bulk_density_kg_m3": "bulk density",
        "overall": "all together",
        "ring_height_3_m": "mean height of ring 3",
        "ring_height_10_m@3 x 0.5 mm": "mean height of ring 10",
        "ring_volume_m3@1a2b3c4d": "volume of the pile",
        "height_q90_m": "height that 10 % of the covered area exceeds",
        "height_share_4": "share of the covered area 1.25 to 1.75 bodies high",
        "ring_roughness_2_m": "roughness of rings 3 and 4",
        "curvature_per_m": "mean curvature of the core",
        "inner_skew_y_m": "centre of volume of the core, y",
    }
    assert {name: feature_label(name) for name in words} == words


def test_every_feature_of_a_scan_has_words_and_a_unit(results):
    diagnosis = typed(results["effect"])
    names = {*PROFILE_NAMES, *BULK_NAMES, *HISTOGRAM_NAMES, *TEXTURE_NAMES, *ASYMMETRY_NAMES}
    assert SURFACE_LABELS.keys() == names
    assert len(set(SURFACE_LABELS.values())) == len(names)
    values = {
        "ring_height_3_m@3 x 0.5 mm": (0.0141, "14.1 mm"),
        "ring_volume_m3": (5.1e-5, "51 cm³"),
        "covered_area_m2": (0.0128, "128 cm²"),
        "curvature_per_m": (210.0, "0.21 1/mm"),
        "height_share_4": (0.13, "0.13"),
        "slope": (0.52, "0.52"),
        "skew_x_m": (-3e-4, "−0.3 mm"),
    }
    for name, (value, text) in values.items():
        assert wording.feature_value(diagnosis, name, value) == text


def test_a_direction_round_the_plane_has_no_rounding_left_in_it():
    estimate = {"effect": "plate_tilt", "index": 1, "value": -0.27, "low": -0.5, "high": 4.15e-17, "at_end": False}
    assert amplitude_text(estimate) == "−0.27° (95 % −0.5 … 0°)"


def test_what_was_not_looked_for_is_called_so_and_repeated(results):
    """An ambiguous answer without what could be measured next."""
    measurement, found = diagnosed(**CASES["ambiguous"])
    order = DiagnoseOrder(measurement.folder, Path("results/made up"), plan_next=False)
    result = result_of(measurement, order, {}, replace(found, suggestions=()), 1.0).to_dict()
    text = diagnosis_markdown(result)
    assert "What could tell them apart was not looked for (`--no-next`)." in text
    assert "No change of the rig that was tried" not in text
    assert "--no-next\n" in text
    assert "--no-next" not in diagnosis_markdown(results["ambiguous"])
