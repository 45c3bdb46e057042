"""``explorer validate-diagnosis``: what it says where it cannot run, and before it has anything to say."""

from pathlib import Path

from explorer.commands import validate_diagnosis
from tests.explorer.command_line import explorer


def test_without_a_checkout_one_line_says_so(monkeypatch, tmp_path):
    monkeypatch.setattr(validate_diagnosis, "__file__", str(tmp_path / "site" / "explorer" / "commands" / "one.py"))
    result = explorer("validate-diagnosis", "--out", str(tmp_path / "out"))
    assert result.exit_code == 2
    assert result.stderr.strip() == (
        f"error: validate-diagnosis: {tmp_path / 'site'} has no tests/blind; run it from a source checkout"
    )
    assert not (tmp_path / "out").exists()


def test_sets_that_are_there_are_only_counted(tmp_path):
    header = "number,kind,label,strength,amplitude,shift,verdict,p_detect,cosine,before,after,pours,seconds"
    rows = [f"{k},null,none,,,0.5,no_missing_effect,0.4,,,,12,3.5" for k in range(2)]
    (tmp_path / "sets.csv").write_text("\n".join([header, *rows]) + "\n")
    result = explorer(
        "validate-diagnosis", "--n", "2", "--out", str(tmp_path), "--store", str(tmp_path / "none.sqlite")
    )
    assert result.exit_code == 0
    assert "an effect blamed where none is: ≤ 2 %; found 0/2 = 0.0 %" in result.stdout
    assert not Path(tmp_path / "none.sqlite").exists()
