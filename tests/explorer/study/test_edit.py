"""A study changed on the page, or by a measurement: the same study but for what was changed."""

import dataclasses

import pytest

from doe.studies.study import load_study
from explorer.errors import CommandError
from explorer.study.edit import StudyEdits, edited_study, listed_edits, remeasured
from solver import asset_path
from solver.assets import shipped_assets
from tests.explorer.command_line import explorer

FILE = asset_path("studies", "sunflower_extract")


@pytest.mark.parametrize("name", shipped_assets("studies"))
def test_all_but_what_was_changed_stays_with_its_comments(name, tmp_path):
    before = asset_path("studies", name)
    text, _ = edited_study(before, StudyEdits({}, {"mean": 25.25}))
    old, new = before.read_text().splitlines(), text.splitlines()
    assert new[0].startswith("# ")
    changed = [pair for pair in zip(old, new[2:], strict=True) if pair[0] != pair[1]]
    ((was, now),) = changed
    assert was.startswith("mean = ")
    assert now.startswith("mean = 25.25")
    file = tmp_path / f"{name}.toml"
    file.write_text(text)
    again, study = load_study(str(file)), load_study(name)
    same = dataclasses.replace(again.targets[0], mean=study.targets[0].mean)
    assert dataclasses.replace(again, file=study.file, targets=(same, *again.targets[1:])) == study


def test_only_what_was_changed_differs():
    study = load_study(str(FILE))
    edits = StudyEdits({"X4": {"low": 45e6, "high": 80e6}, "X7": {}}, {"mean": 26.5, "n": 12.0})
    text, changed = edited_study(FILE, edits)
    assert (changed.factors[3].low, changed.factors[3].high, changed.factors[3].reference) == (45e6, 80e6, 56.3e6)
    assert (changed.targets[0].mean, changed.targets[0].n, changed.targets[0].sd) == (26.5, 12, study.targets[0].sd)
    back = dataclasses.replace(
        changed,
        factors=tuple(study.factors[k] if k == 3 else factor for k, factor in enumerate(changed.factors)),
        targets=study.targets,
    )
    assert back == study
    assert "changed on the page: X4, target" in text
    assert listed_edits(study, edits) == [
        ("X4", "low", 40.1e6, 45e6),
        ("X4", "high", 70.5e6, 80e6),
        ("target", "mean", 24.68, 26.5),
        ("target", "n", 10, 12.0),
    ]


def test_nothing_changed_is_no_edit():
    assert not StudyEdits()
    assert not StudyEdits({"X4": {}}, {})
    assert StudyEdits({"X4": {"low": 1.0}})


@pytest.mark.parametrize(
    ("edits", "line"),
    [
        (StudyEdits({"X4": {"low": 60e6}}), r"changed study: X4 .*: reference 5.63e\+07 is outside 6e\+07"),
        (StudyEdits({"X7": {"high": -1.0}}), r"changed study: pair.seed.seed.static_friction.*-1"),
        (StudyEdits({"X99": {"high": 1.0}}), r"factor 'X99' is not in the study; allowed: X1, X2"),
        (StudyEdits({}, {"margin": 0.0}), r"changed study: target.margin: 0; allowed: more than 0"),
        (StudyEdits({}, {"n": 1}), r"changed study: target.n: 1"),
    ],
)
def test_what_is_not_allowed_is_one_line(edits, line):
    with pytest.raises(ValueError, match=line) as raised:
        edited_study(FILE, edits)
    assert "\n" not in str(raised.value)


def test_a_material_beside_the_study_is_still_found_from_elsewhere(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert explorer("new", "study", "lentil").exit_code == 0
    file = tmp_path / "lentil_study.toml"
    study = load_study(str(file))
    factor = study.factors[0]
    text, changed = edited_study(file, StudyEdits({factor.name: {"low": float(factor.reference) * 0.999}}))
    away = tmp_path / "elsewhere" / "changed.toml"
    away.parent.mkdir()
    away.write_text(text)
    monkeypatch.chdir(away.parent)
    assert load_study(str(away)).scene == changed.scene


@pytest.mark.parametrize("name", shipped_assets("studies"))
@pytest.mark.parametrize("end", ["\n", "\r\n"])
def test_a_measurement_changes_its_own_lines_alone(name, end, tmp_path):
    before = asset_path("studies", name).read_text(encoding="utf-8")
    file = tmp_path / f"{name}.toml"
    file.write_bytes(before.replace("\n", end).encode())
    target = load_study(str(file)).targets[0]
    new = dataclasses.replace(target, mean=25.5, sd=None, n=None, sd_source="read twice")
    text = remeasured(file, new, "photographs: a.png")
    old, now = before.splitlines(), text.split(end)[:-1]
    assert "\n" not in "".join(now)
    kept = [line for line in now if line in old]
    gone = [line for line in old if line not in now]
    assert {line.partition("=")[0].strip() for line in gone} <= {"mean", "sd", "n", "sd_source"}
    assert kept == [line for line in old if line not in gone]
    file.write_bytes(text.encode())
    again = load_study(str(file))
    assert again.targets[0] == new
    assert again.targets[1:] == load_study(name).targets[1:]
    # A second measurement takes the place of the first, its note with it, and keys that were away come back.
    last = dataclasses.replace(target, mean=24.0, sd=1.0, n=3)
    file.write_bytes(remeasured(file, last, "photographs: b.png").encode())
    assert load_study(str(file)).targets[0] == last
    text = file.read_text(encoding="utf-8")
    assert "a.png" not in text
    assert text.count("# photographs: b.png") == 1


def test_a_target_that_has_no_lines_is_left_alone(tmp_path):
    """In one line, or with a header of its own inside a text: whatever a line edit would get wrong is refused."""
    shipped = asset_path("studies", "sunflower_extract").read_text(encoding="utf-8")
    head, _, tail = shipped.partition("[[target]]")
    inline = 'target = [{ observable = "angle_of_repose_deg", mean = 24.68 }]\n'
    rest = tail[tail.index("[[") :]
    for text in (
        inline + head + rest,
        head.replace("format = 1", 'format = 1\ntitle = """\n[[target]]\n"""', 1) + "[[target]]" + tail,
    ):
        file = tmp_path / "own.toml"
        file.write_text(text, encoding="utf-8")
        target = load_study(str(file)).targets[0]
        with pytest.raises(CommandError, match=r"allowed: a .*target.* with a line for each key"):
            remeasured(file, dataclasses.replace(target, mean=20.0), "photographs: a.png")
