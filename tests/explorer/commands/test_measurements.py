"""`explorer measurements check`: the tables, plain data, and refusals in one line."""

import json
import re

import numpy as np
import pytest

from tests.doe.measurement.folders import MEASUREMENT, changed, write
from tests.explorer.command_line import explorer, refused


def test_a_shipped_data_set_by_its_name():
    result = explorer("measurements", "check", "granudrum_mcc")
    assert result.exit_code == 0, result.output
    text = result.stdout
    assert "drum_15rpm: fit, rotating_drum, replicates: 1" in text
    assert "drum_45rpm: holdout, rotating_drum, replicates: 1" in text
    assert "rig.filled_volume" in text
    assert "effects that nothing here could reveal:" in text
    assert "asymmetry: no" in text
    assert "whole pile" not in text  # a drum leaves none
    assert "warning: drum_15rpm: one replicate" in text


def test_what_was_ignored_and_clipped_is_listed(tmp_path):
    text = changed(MEASUREMENT, "{ mean = 0.3, sd = 0.05 }", "{ low = -1, high = 1 }")
    table = "replicate,observable,x,value\n1,apex_height_m,,0.02\n2,apex_height_m,,0.03\n1,colour,,3\n"
    result = explorer("measurements", "check", write(tmp_path, {"measurement.toml": text, "slow.csv": table}))
    assert "ignored: slow.csv: colour: no such observable" in result.stdout
    assert "note: pair.glass.glass.static_friction: range -1 … 1 clipped to 0 … 1" in result.stdout
    assert "warning: one number to fit" in result.stdout


def test_plain_data(tmp_path):
    result = explorer("measurements", "check", write(tmp_path), "--json")
    found = json.loads(result.stdout)
    assert [c["name"] for c in found["conditions"]] == ["slow", "fast"]
    angle = next(o for o in found["conditions"][0]["observations"] if o["observable"] == "angle_of_repose_deg")
    assert angle["values"] == [20.0, 22.0]
    assert found["parameters"][0]["path"] == "pair.glass.glass.static_friction"
    assert found["reach"]["unknowns"] == 1


def test_what_a_scan_adds(tmp_path):
    """Of one condition a surface of one replicate is there: a cone on a plate; of the other only scalars."""
    folder = write(tmp_path)
    (folder / "scans").mkdir()
    x, y = np.meshgrid(np.arange(-80, 81), np.arange(-80, 81))
    z = np.maximum(0.0, 20.0 - 0.4 * np.hypot(x, y))
    points = np.column_stack([x.ravel(), y.ravel(), z.ravel()])
    header = "[condition.scan]\nunit = 'mm'\n[[condition]]\nname = \"fast\""
    text = changed(MEASUREMENT, '[[condition]]\nname = "fast"', header)
    (folder / "measurement.toml").write_text(text)
    np.savetxt(folder / "scans/slow_1.xyz", points)
    found = explorer("measurements", "check", folder).stdout
    assert re.search(
        r"whole pile: surface of 1 of 2 piles in cells of 1 mm: 11 numbers of its profile and \d+ of its surface", found
    ), found
    scalars = re.search(r"whole pile: no more than (\d+) scalars; a scan would add (\d+) numbers", found)
    plain = json.loads(explorer("measurements", "check", folder, "--json").stdout)
    slow, fast = (condition["pile"] for condition in plain["conditions"])
    assert (slow["offered"], slow["scanned"], fast["offered"]) == ("scan", [1], "scalars")
    assert slow["resolution_m"] == pytest.approx(1e-3)
    assert int(scalars[1]) == len(fast["features"]["scalars"])
    assert int(scalars[2]) == len(fast["features"]["profile"]) + len(fast["features"]["surface"])


@pytest.mark.parametrize("option", [(), ("--json",)])
def test_bad_data_is_one_line_and_exit_code_2(tmp_path, option):
    folder = write(tmp_path, {"measurement.toml": changed(MEASUREMENT, "rate = 0.1", 'rate = "fast"')})
    line = refused(explorer("measurements", "check", folder, *option))
    assert line.startswith(f"{folder / 'measurement.toml'}: condition 'slow': insertion.rate: 'fast'")


def test_a_folder_that_is_not_there():
    assert "shipped: granudrum_mcc, sunflower_extract, trefoil_1, trefoil_2" in refused(
        explorer("measurements", "check", "nowhere")
    )
