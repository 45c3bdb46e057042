"""A diagnosis that goes on from another one: what it takes from there, how it is asked, and what it says of it."""

import json
from dataclasses import replace

import pytest

from doe.declared.given import with_given
from doe.declared.model import effect_values, possible
from doe.diagnose.diagnosis import joined
from doe.diagnose.result import CalibratedModel
from doe.measurement import load_measurement
from doe.measurement.bodies import MeasuredBody
from explorer import load_diagnosis
from explorer.diagnosis import run
from explorer.diagnosis.next_folder import read_next, write_next
from explorer.diagnosis.piles import model_scene
from explorer.diagnosis.run import NOTHING_BEFORE, Earlier, earlier_answer
from explorer.errors import CommandError
from explorer.report.diagnosis import diagnosis_report
from explorer.report.diagnosis.answer import cautions, verdict_sentence
from explorer.report.diagnosis.evidence import strained
from explorer.report.diagnosis.method import command
from explorer.report.markdown import document
from solver import value, with_values
from solver.assets import measurement_folder
from tests.explorer.command_line import explorer
from tests.explorer.diagnosed import CASES, diagnosed, result_of_case, typed
from tests.explorer.diagnosis.test_next_folder import CHECK, SOURCE, TWICE, fill, suggestion, values_of
from tests.explorer.diagnosis.test_next_folder import written as write_next_folder

pytestmark = pytest.mark.usefixtures("unprinted")


def written(folder, content):
    folder.mkdir(exist_ok=True)
    (folder / "diagnosis.json").write_text(json.dumps(content), encoding="utf-8")
    return folder


@pytest.mark.parametrize("case", ["effect", "two amplitudes", "pair"])
def test_what_an_answer_names_is_given_with_its_amplitudes(tmp_path, case):
    content = result_of_case(case)
    result = typed(content)
    row = result.effect_row(result.named[0])
    given = earlier_answer(written(tmp_path / "first", content), SOURCE).given
    assert list(given) == result.named[0].split("+")
    assert [x for amplitude in given.values() for x in amplitude] == [one.value for one in row.amplitudes]


def test_what_was_given_before_stays_as_it_was_calibrated(tmp_path):
    content = result_of_case("effect")
    path = "effect.density_error.excess"
    known = content["parameters"][0] | {"name": path, "after": 0.17}
    content |= {"given": {"density_error": [0.2]}, "parameters": [*content["parameters"], known]}
    given = earlier_answer(written(tmp_path / "second", content), SOURCE).given
    assert given["density_error"] == (0.17,)
    assert len(given) == 2


@pytest.mark.parametrize("case", ["nothing", "ambiguous"])
def test_an_answer_without_a_probable_effect_gives_none(tmp_path, case):
    folder = written(tmp_path / "first", result_of_case(case))
    with pytest.raises(CommandError, match=r"allowed: a diagnosis in which one effect has a probability"):
        earlier_answer(folder, SOURCE)
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
    content["data"]["folder"] = str(SOURCE)
    first = written(tmp_path / "first", content)
    second = result_of_case("effect")
    second["order"]["given"] = str(first)
    earlier = earlier_answer(written(tmp_path / "second", second), SOURCE)
    carried, _ = earlier.carried_into(measured, ())
    assert len(carried.fit) == len(measured.fit) + 1
    ((name, amplitude),) = earlier.given.items()
    path = next(iter(effect_values(name, amplitude)))
    assert all(value(one.scene, path) > 0.0 for one in carried.conditions)
    alone, (beside,) = NOTHING_BEFORE.carried_into(measured, [carried])
    assert alone is measured
    assert beside is carried


def test_the_follow_ups_of_a_chain_come_in_their_order(tmp_path):
    """Each in the set-up that was asked for by the answer before it: names are given in that order."""
    measured, folder = load_measurement(SOURCE), None
    for number, change in enumerate((TWICE, "half the mass", "fed four times as fast")):
        asked = fill(write_next_folder(tmp_path / f"next {number}", SOURCE, measured, change))
        content = result_of_case("effect")
        content["order"] |= {"follow_up": str(asked), "given": str(folder) if folder else None}
        content["data"]["folder"] = str(SOURCE)
        folder = written(tmp_path / str(number), content)
    earlier = earlier_answer(folder, SOURCE)
    assert [str(one.folder.name) for one in earlier.follow_ups] == ["next 0", "next 1", "next 2"]
    carried, _ = earlier.carried_into(measured, ())
    heights = [value(one.scene, "rig.outlet_height") for one in carried.fit[len(measured.fit) :]]
    masses = [value(one.scene, "rig.mass") for one in carried.fit[len(measured.fit) :]]
    first = measured.fit[0].scene
    assert heights == [pytest.approx(k * value(first, "rig.outlet_height")) for k in (2.0, 1.0, 1.0)]
    assert masses == [pytest.approx(k * value(first, "rig.mass")) for k in (1.0, 0.5, 1.0)]


def test_a_follow_up_has_what_is_given_within_the_range_of_all_conditions():
    """A narrow outlet, which only one condition of the data has, draws scattered sizes in."""
    measured = load_measurement(measurement_folder("sunflower_extract"))
    (wide, *_) = measured.fit
    outlet = "rig.outlet_diameter"
    narrow = with_values(wide.scene, {outlet: 0.6 * value(wide.scene, outlet)})
    both = replace(measured, conditions=(wide, replace(wide, name="narrow", scene=narrow)))
    follow_up = replace(measured, conditions=(replace(wide, name="once more"),))
    amplitudes = {"size_dispersion": (0.1,), "density_error": (0.2,)}
    bodies = (MeasuredBody("seed", "sliding_force", 0.4, 0.01),)
    follow_up = replace(follow_up, bodies=bodies)
    data, (more,) = Earlier(amplitudes).carried_into(both, [follow_up])
    assert [one.name for one in joined(data, more).conditions] == [wide.name, "narrow", "once more"]
    assert joined(data, more).bodies == (*both.bodies, *bodies)
    sizes = next(one for one in more.parameters if one.path.startswith("effect.size_dispersion."))
    assert sizes.high < 0.1
    for one in joined(data, more).conditions:
        assert possible(one.scene, "size_dispersion", (sizes.high,))
        assert value(one.scene, "effect.density_error.excess") > 0.0


def test_what_cannot_be_gone_on_from_is_refused(tmp_path):
    content = result_of_case("effect")
    content["order"]["follow_up"] = str(tmp_path / "next")
    with pytest.raises(CommandError, match=r"has a follow-up of data/made up; allowed: of"):
        earlier_answer(written(tmp_path / "other", content), SOURCE)
    content = result_of_case("effect")
    content["order"]["given"] = str(tmp_path / "round")
    with pytest.raises(CommandError, match="continues itself"):
        earlier_answer(written(tmp_path / "round", content), SOURCE)
    first = written(tmp_path / "first", result_of_case("effect"))
    refused = explorer("diagnose", "trefoil_1", "--given", str(first), "--out", str(first), "--resume")
    assert (refused.exit_code, "is the same folder as --out" in refused.stderr) == (2, True)
    (name,) = typed(result_of_case("effect")).named
    out = tmp_path / "out"
    refused = explorer("diagnose", "trefoil_1", "--given", str(first), "--effects", name, "--out", str(out))
    assert (refused.exit_code, "all of them are already in the model" in refused.stderr) == (2, True)
    assert not out.exists()


def test_a_further_follow_up_has_a_name_of_its_own_and_its_command_names_what_is_given(tmp_path):
    measured = load_measurement(SOURCE)
    one = suggestion(TWICE, values_of(measured, TWICE), measured.fit[0].name)
    write_next(tmp_path / "first", SOURCE, measured, one)
    (taken,) = (file.stem for file in (tmp_path / "first").glob("*.csv"))
    write_next(tmp_path / "second", SOURCE, measured, one, tmp_path / "answer", (taken,))
    (name,) = (file.stem for file in (tmp_path / "second").glob("*.csv"))
    assert name != taken
    assert f"--given {tmp_path / 'answer'}" in (tmp_path / "second" / "README.md").read_text(encoding="utf-8")


def test_the_piles_of_an_answer_have_what_was_given():
    content = result_of_case("nothing")
    content["data"]["folder"] = str(SOURCE)
    measured = with_given(load_measurement(SOURCE), {"density_error": (0.2,)})
    model = CalibratedModel(tuple(0.5 * (one.low + one.high) for one in measured.parameters))
    for turned in (False, True):
        condition = replace(measured.fit[0], turned=turned)
        tilted = with_given(replace(measured, conditions=(condition,)), {"plate_tilt": (2.0, 0.0)})
        scene = model_scene(tilted, tilted.fit[0], replace(model, theta=(*model.theta, 2.0, 0.0)))
        assert value(scene, "effect.plate_tilt.tilt_x") == (-2.0 if turned else 2.0)
        assert value(scene, "effect.density_error.excess") == pytest.approx(model.theta[-1])


def test_the_report_says_what_was_in_the_model_and_how_it_is_asked():
    first = typed(result_of_case("effect"))
    assert f"--given {first.order.out}" in document(diagnosis_report(first))
    assert not verdict_sentence(first).startswith("The declared model holds")
    second = replace(first, given={"density_error": (0.2,)}, order=replace(first.order, given="results/first"))
    assert verdict_sentence(second).startswith(
        "The declared model holds `density_error` here, by an earlier diagnosis. The declared model lacks "
    )
    assert command(second).endswith("--given results/first")
    said = document(diagnosis_report(second))
    assert "In the model already" in said
    assert "`density_error`, excess 0.2; calibrated with the other parameters about that" in said


def with_p(case, p):
    content = result_of_case(case)
    for row in content["effects"]:
        row["p"] = p
    return cautions(typed(content))


def test_a_name_that_fits_loosely_may_not_be_alone():
    """It is said of one effect whose p is below 0.3, and of no other answer."""
    assert not any("asks whether it is alone" in text for text in with_p("effect", 0.31))
    (said,) = (text for text in with_p("effect", 0.29) if "asks whether it is alone" in text)
    assert "come up in 29 % of cases" in said
    for case in ("pair", "ambiguous", "nothing"):
        assert not any("asks whether it is alone" in text for text in with_p(case, 0.02))


def test_a_given_amplitude_at_an_end_of_its_range_is_told_without_a_measurement():
    content = result_of_case("nothing")
    path = "effect.density_error.excess"
    known = content["parameters"][0] | {"name": path, "low": 0.08, "high": 0.3, "mean": None, "sd": None}
    known |= {"before": 0.3, "after": 0.3}
    content |= {"given": {"density_error": [0.2]}, "parameters": [*content["parameters"], known]}
    (line,) = strained(typed(content))
    assert "at the upper end of its range" in line
    assert "Its range is about an earlier answer" in line
    assert "If the measurement is right" not in line
    content["parameters"][-1] |= {"before": 0.2, "after": 0.2}
    assert strained(typed(content)) == []


@pytest.fixture
def asked(monkeypatch):
    """Calls of the loop that pours, which has the answer of a case ready, made from the data that it is asked about."""
    calls = []

    def run_diagnosis(measurement, store, pours, effects, budget, stage, on_pour, seed, follow_up, plan_next):
        calls.append((measurement, effects, follow_up))
        return diagnosed(**CASES["ambiguous"])[1]

    monkeypatch.setattr(run, "run_diagnosis", run_diagnosis)
    return calls


def test_a_diagnosis_goes_on_from_another_one_to_its_files(tmp_path, asked):
    """By the command: what the loop is asked, what the files say, and what the folder of the follow-up asks for."""
    first = result_of_case("effect")
    first["data"]["folder"] = str(SOURCE)
    first = written(tmp_path / "first", first)
    out, store = tmp_path / "second", ("--store", str(tmp_path / "pours.sqlite"))
    done = explorer("diagnose", str(SOURCE), "--given", str(first), "--out", str(out), *store)
    assert done.exit_code == 0, done.stderr
    ((measurement, _, follow_ups),) = asked
    path = "effect.adhesion_sjkr.cohesion_energy_density"
    sizes = {value(one.scene, path) for one in measurement.conditions}
    assert (len(sizes), follow_ups) == (1, ())
    (size,) = sizes
    assert measurement.parameters[-1].low < size < measurement.parameters[-1].high
    result = load_diagnosis(out)
    assert result.given == {"adhesion_sjkr": (size,)}
    assert result.order.given == str(first)
    assert "The declared model holds `adhesion_sjkr` here" in (out / "report.md").read_text(encoding="utf-8")
    assert f"--given {first}" in (out / "next/README.md").read_text(encoding="utf-8")

    (out / "next").rename(tmp_path / "next")
    fill(tmp_path / "next")
    last = tmp_path / "last"
    words = ("--given", str(first), "--follow-up", str(tmp_path / "next"), "--out", str(last))
    done = explorer("diagnose", str(SOURCE), *words, *store)
    assert done.exit_code == 0, done.stderr
    again, _, (follow_up,) = asked[-1]
    assert again.parameters == follow_up.parameters == measurement.parameters
    assert [value(one.scene, path) for one in follow_up.conditions] == [size]
    assert load_diagnosis(last).order.follow_up == str(tmp_path / "next")


def test_an_answer_after_a_follow_up_asks_for_the_next_one(tmp_path, asked):
    """Which is joined with the one before it, in the order in which they were asked for."""
    store, folders = ("--store", str(tmp_path / "pours.sqlite")), []
    for number in range(3):
        words = ("--follow-up", str(folders[-1])) if folders else ()
        out = tmp_path / str(number)
        done = explorer("diagnose", str(SOURCE), "--out", str(out), *words, *store)
        assert done.exit_code == 0, done.stderr
        folders.append(fill(out / "next"))
    names = [[one.name for one in follow_up.conditions] for _, _, follow_ups in asked for follow_up in follow_ups]
    (first, second) = (file.stem for folder in folders[:2] for file in folder.glob("*.csv"))
    assert names == [[first], [first], [second]]
    assert first != second
    assert read_next(folders[2]).before == tuple(folders[:2])
    readme = (folders[1] / "README.md").read_text(encoding="utf-8")
    assert f"It reads `{folders[0]}` too, which has to stay where it is." in readme
    assert "53 of 59" not in readme
    for folder in folders[:2]:
        refused = explorer("diagnose", str(SOURCE), "--out", str(folder.parent), "--resume", "--follow-up", str(folder))
        assert (refused.exit_code, "lies in --out" in refused.stderr) == (2, True)


def test_an_answer_with_follow_ups_is_gone_on_from_with_each_of_them_once(tmp_path, asked):
    """Its own check asks for single bodies again, and reads them with those before it."""
    measured, store = load_measurement(SOURCE), ("--store", str(tmp_path / "pours.sqlite"))
    first, second = tmp_path / "first/next", tmp_path / "second/next"
    for folder, before in [(first, ()), (second, (first,))]:
        write_next(folder, SOURCE, measured, CHECK, before=before)
        table = folder / "bodies.csv"
        table.write_text(table.read_text().replace("# trefoil,mass,g,,", "trefoil,mass,g,0.21,0.002"))
    content = result_of_case("effect")
    content["order"]["follow_up"], content["data"]["folder"] = str(first), str(SOURCE)
    written(second.parent, content)
    assert [one.folder for one in earlier_answer(second.parent, SOURCE).follow_ups] == [first]
    words = ("--given", str(second.parent), "--follow-up", str(second), "--out", str(tmp_path / "third"))
    done = explorer("diagnose", str(SOURCE), *words, *store)
    assert done.exit_code == 0, done.stderr
    ((joined_before, _, (last,)),) = asked
    assert (len(joined_before.bodies), last.folder, len(last.bodies)) == (1, second, 1)
    (tmp_path / "first").rename(tmp_path / "taken away")
    gone = explorer("diagnose", str(SOURCE), "--follow-up", str(second), "--out", str(tmp_path / "fourth"))
    told = f"{second}/follow_up.json: before: {first}/follow_up.json: no such file"
    assert (gone.exit_code, told in gone.stderr) == (2, True), gone.stderr


def test_a_diagnosis_gone_on_with_leaves_a_follow_up_that_is_filled_in(tmp_path, asked):
    out = tmp_path / "first"
    words = ("diagnose", str(SOURCE), "--out", str(out), "--store", str(tmp_path / "pours.sqlite"))
    assert explorer(*words).exit_code == 0
    fill(out / "next")
    (table,) = (out / "next").glob("*.csv")
    measured = table.read_text()
    again = explorer(*words, "--resume")
    assert again.exit_code == 0, again.stderr
    told = f"{out}/next: exists already and is not changed, as it may be filled in"
    assert told in again.stdout
    assert "not what this answer asks for" not in again.stdout
    assert table.read_text() == measured
    order = out / "next/follow_up.json"
    order.write_text(order.read_text().replace('"change": "', '"change": "another one, '))
    assert f"{told}; it is not what this answer asks for" in explorer(*words, "--resume").stdout
