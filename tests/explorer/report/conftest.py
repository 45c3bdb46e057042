"""What tests of reports share."""

import pytest

from tests.explorer.diagnosed import CASES, result_of_case


@pytest.fixture(scope="session")
def results():
    """The content of the file of every made-up diagnosis, by its case."""
    return {name: result_of_case(name) for name in CASES}
