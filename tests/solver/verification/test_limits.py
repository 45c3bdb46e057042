"""The limits of the verification. What misses one is listed here, point by point: no more may miss it, and no less."""

from functools import cache

import pytest

from solver.verification import FAMILIES, verify

pytestmark = pytest.mark.usefixtures("taichi")

T5_RECOIL = ("0.332", "0.671", "1.009", "1.335", "1.662", "2", "2.35", "2.991", "3.341", "4.006", "4.997")
T5_RECOIL_PE = ("0.344", "0.671", "0.997", "1.347", "1.674", "2.012", "2.326", "2.991", "3.341", "3.994", "4.997")
T5_SPIN = ("0.353", "0.682", "0.994", "1.341", "1.688", "2", "2.329", "2.988", "3.318", "3.994", "5")
T5_SPIN_PE = ("0.353", "0.682", "0.994", "1.341", "1.688", "2.017", "2.347", "3.023", "3.335", "4.012", "5")
T6_TAIL = ("1.454", "1.74", "2.093", "2.489", "2.996", "3.634", "4.515", "5.749", "7.819", "11.894", "24.009")
T6_NYLON = ("1.189", "1.454", "1.74", "2.093", "2.511", "2.996", "3.612", "4.515", "5.771", "7.819", "11.916", "24.009")

# The sticking parts of T4, T5, T6 and T8-B: printed curves of another tangential law (solver/verification/README.md).
KNOWN_MISSES = {
    "T4": {
        "e_t, Al oxide, sticking": {"θ = 5°", "θ = 10°"},
        "spin [rad/s], Al oxide, sticking": {"θ = 5°", "θ = 10°"},
        "e_t, Al alloy, sticking": {"θ = 5°", "θ = 10°"},
        "spin [rad/s], Al alloy, sticking": {"θ = 5°"},
    },
    "T5": {
        "ψ2, steel, sticking": {f"ψ1 = {x}" for x in T5_RECOIL},
        "rω'/μV, steel, sticking": {f"ψ1 = {x}" for x in T5_SPIN},
        "ψ2, polyethylene, sticking": {f"ψ1 = {x}" for x in T5_RECOIL_PE},
        "rω'/μV, polyethylene, sticking": {f"ψ1 = {x}" for x in T5_SPIN_PE},
    },
    "T6": {
        "β, Al alloy, sticking": {f"x = {x}" for x in T6_TAIL},
        "β, nylon, sticking": {f"x = {x}" for x in T6_NYLON},
    },
    "T8": {"β, case B, tail": {"x = 7.845", "x = 11.909", "x = 23.995"}},
}


@cache
def rows(family):
    return list(verify([family]))


@pytest.mark.parametrize("family", FAMILIES)
def test_every_limit_is_kept_but_for_the_known_misses(family):
    missed: dict[str, set[str]] = {}
    for row in rows(family):
        if not row.passed:
            missed.setdefault(row.quantity, set()).add(row.at)
    assert missed == KNOWN_MISSES.get(family, {})


@pytest.mark.parametrize("family", FAMILIES)
def test_every_row_is_a_finite_number_with_a_source(family):
    assert rows(family)
    for row in rows(family):
        assert abs(row.error) < 100.0, row
        assert row.source


@pytest.mark.parametrize(
    ("family", "test", "material", "limit"),
    [
        ("T4", "T4 convention", "Al oxide", 3.0),
        ("T4", "T4 convention", "Al alloy", 1.0),
        ("T5", "T5 convention", "steel", 1.0),
        ("T5", "T5 convention", "polyethylene", 1.0),
    ],
)
def test_the_printed_curves_are_those_of_the_named_other_laws(family, test, material, limit):
    """Reading a printed curve costs 0.5 % of its span; nothing is fitted."""
    errors = [abs(row.error) for row in rows(family) if row.test == test and material in row.quantity]
    assert len(errors) >= 6
    assert max(errors) < limit


def test_finite_elements_and_measurement_are_nearer_than_the_printed_curve_of_the_other_code():
    """T4 at 5°: measured e_t 0.73 (between 4.2° and 9.8°), ours 0.86, printed 0.95."""
    measured = [row for row in rows("T4") if row.test == "T4 experiment"]
    assert max(abs(row.ours - row.reference) for row in measured) < 0.13
    finite_elements = [abs(row.error) for row in rows("T5") if row.test == "T5 FEM"]
    printed = [abs(row.error) for row in rows("T5") if row.test == "T5" and row.quantity == "ψ2, steel, sticking"]
    assert max(finite_elements) < 0.5 * max(printed)
