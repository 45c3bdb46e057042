"""Every shipped bench test on the solver: it gives back what went in, within 1 %. Slow: minutes."""

import json

import pytest

from tests.explorer.command_line import explorer

pytestmark = [pytest.mark.slow, pytest.mark.usefixtures("taichi")]

CLOSING = {
    "inclined_plane": {"static_friction": 9},
    "drop": {"restitution": 9},
    "rebound": {"restitution": 3},
    "rolling": {"rolling_friction": 1},
    "compression": {"effective_youngs_modulus": 3, "effective_shear_modulus": 3},
    "shear": {"effective_youngs_modulus": 3, "effective_shear_modulus": 3},
}
"""What has to close for how many pairs or components."""


@pytest.mark.parametrize("test", CLOSING)
def test_all_shipped_pairs_and_components_close(test):
    result = explorer("lab", test, test, "--simulate", "--json")
    assert result.exit_code == 0, result.output
    rows = json.loads(result.stdout)["twins"]
    for quantity, number in CLOSING[test].items():
        found = [row for row in rows if row["quantity"] == quantity]
        assert len(found) == number
        for row in found:
            assert row["simulated"] == pytest.approx(row["put_in"], rel=0.01), row
            assert row["closes"]
