"""A few inputs of each parser of `make fuzz`, other ones than the last campaign's."""

import pytest

from tests.faults.fuzz import PARSERS, fault_of


@pytest.mark.parametrize("name", PARSERS)
def test_damaged_files_are_read_or_refused_in_one_line(name):
    faults = [fault_of(PARSERS[name], f"{name} short {number}") for number in range(6)]
    assert [fault for fault in faults if fault] == []


def test_a_parser_that_breaks_is_told():
    """The campaign sees what it looks for: an exception of another kind than the program's own."""

    def breaks(path):
        raise KeyError(path.name)

    fault = fault_of(type(PARSERS["factors"])(PARSERS["factors"].seeds, breaks), "x")
    assert "KeyError: 'sunflower_extract.toml'" in fault
