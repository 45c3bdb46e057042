"""A diagnosis that goes on from another one: what it takes from there, how it is asked, and what it says of it."""

import json
from dataclasses import replace

import pytest

from doe.declared.model import effect_values
from doe.measurement import load_measurement
from explorer.diagnosis.run import NOTHING_BEFORE, earlier_answer
from explorer.errors import CommandError
from explorer.report.diagnosis import diagnosis_report
from explorer.report.diagnosis.answer import verdict_sentence
from explorer.report.diagnosis.method import command
from explorer.report.markdown import document
from solver import value
from tests.explorer.command_line import explorer
from tests.explorer.diagnosed import result_of_case, typed
from tests.explorer.diagnosis.test_next_folder import SOURCE, fill
from tests.explorer.diagnosis.test_next_folder import written as write_next_folder


def written(folder, content):
    folder.mkdir(exist_ok=True)
    (folder / "diagnosis.json").write_text(json.dumps(content), encoding="utf-8")
    return folder


@pytest.mark.parametrize("case", ["effect", "two amplitudes", "pair"])
def test_what_an_answer_names_is_given_with_its_amplitudes(tmp_path, case):
    content = result_of_case(case)
    result = typed(content)
    row = result.effect_row(result.named[0])
    given = earlier_answer(written(tmp_path / "first", content)).given
    assert list(given) == result.named[0].split("+")
    assert [x for amplitude in given.values() for x in amplitude] == [one.value for one in row.amplitudes]


def test_what_was_given_before_stays_as_it_was_calibrated(tmp_path):
    content = result_of_case("effect")
    path = "effect.density_error.excess"
    known = content["parameters"][0] | {"name": path, "after": 0.17}
    content |= {"given": {"density_error": [0.2]}, "parameters": [*content["parameters"], known]}
    given = earlier_answer(written(tmp_path / "second", content)).given
    assert given["density_error"] == (0.17,)
    assert len(given) == 2


@pytest.mark.parametrize("case", ["nothing", "ambiguous"])
def test_an_answer_without_a_probable_effect_gives_none(tmp_path, case):
    folder = written(tmp_path / "first", result_of_case(case))
    with pytest.raises(CommandError, match=r"allowed: a diagnosis in which an effect has 90%"):
        earlier_answer(folder)
    refused = explorer("diagnose", "trefoil_1", "--given", str(tmp_path), "--out", str(tmp_path / "out"))
    assert refused.exit_code == 2
    assert "holds no diagnosis.json; allowed: a finished diagnosis" in refused.stderr
    assert not (tmp_path / "out").exists()


def test_what_was_measured_for_the_answer_before_is_joined(tmp_path):
    measured = load_measurement(SOURCE)
    asked = write_next_folder(tmp_path / "next", SOURCE, measured)
    fill(asked)
    content = result_of_case("effect")
    content["order"]["follow_up"] = str(asked)
    first = written(tmp_path / "first", content)
    second = result_of_case("effect")
    second["order"]["given"] = str(first)
    earlier = earlier_answer(written(tmp_path / "second", second))
    carried = earlier.carried_into(measured)
    assert len(carried.fit) == len(measured.fit) + 1
    ((name, amplitude),) = earlier.given.items()
    path = next(iter(effect_values(name, amplitude)))
    assert all(value(one.scene, path) > 0.0 for one in carried.conditions)
    assert NOTHING_BEFORE.carried_into(measured) is measured


def test_the_report_says_what_was_in_the_model_and_how_it_is_asked():
    first = typed(result_of_case("effect"))
    assert f"--given {first.order.out}" in document(diagnosis_report(first))
    assert not verdict_sentence(first).startswith("The declared model holds")
    second = replace(first, given={"density_error": (0.2,)}, order=replace(first.order, given="results/first"))
    assert verdict_sentence(second).startswith(
        "The declared model holds `density_error` here, as an earlier diagnosis found. The declared model lacks "
    )
    assert command(second).endswith("--given results/first")
    said = document(diagnosis_report(second))
    assert "In the model already" in said
    assert "`density_error`, excess 0.2; calibrated with the other parameters about that" in said
