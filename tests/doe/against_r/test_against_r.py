"""Every number that R gave for the data sets of this folder, within the tolerance of its cause."""

import pytest

from tests.doe.against_r.compare import FOLDER, ORDERS, PAGE, compared, reference


@pytest.mark.parametrize("name", ORDERS)
def test_numbers_are_those_of_r(name):
    numbers = compared(name)
    assert len(numbers) >= 5
    wrong = [one for one in numbers if not one.difference <= one.tolerance]
    assert not wrong


def test_every_data_set_is_compared_and_on_the_page():
    names = {row[0] for row in reference()}
    assert names == set(ORDERS) == {path.stem for path in FOLDER.glob("*.csv")} - {"reference"}
    page = PAGE.read_text(encoding="utf-8")
    for name in names:
        count = sum(row[0] == name for row in reference())
        line = next(line for line in page.splitlines() if line.startswith(f"| `{name}` |"))
        assert f"| {count} |" in line
    for data, _, quantity, value in reference():
        if quantity in ("PRESS", "variance between"):
            assert f"| {quantity} | {value:.7g} |" in page, data
