"""What a person gives to a panel of the laboratory, and in which words it is answered."""

import pytest

from explorer.errors import CommandError
from explorer.laboratory.command_results import CommandResult
from explorer.viewer.laboratory.analysis_panel import LABELS
from explorer.viewer.laboratory.inputs import in_labels, number_or_none


def test_an_answer_names_what_stands_on_the_page_and_the_line_that_repeats_it_the_options():
    told = CommandResult(
        "A day goes into --block.", "explorer analyse runs.csv --block day", note="--surrogate gp fits."
    )
    answer = in_labels(lambda: told, LABELS)()
    assert answer.text == "A day goes into Block."
    assert answer.note == "Gaussian process beside it fits."
    assert answer.command == told.command


def test_a_refusal_names_what_stands_on_the_page_and_leaves_other_options_alone():
    def refused():
        raise CommandError("--target-error -1, --blocks 2: allowed: --only A,B")

    with pytest.raises(CommandError, match=r"^Standard error of the target -1, --blocks 2: allowed: Only A,B$"):
        in_labels(refused, LABELS)()


def test_a_decimal_comma_is_refused_with_the_way_to_write_it():
    with pytest.raises(
        CommandError, match=r"^target '25,5'; allowed: a number with a decimal point, or an empty field$"
    ):
        number_or_none("25,5", "target")
    assert number_or_none(" 25.5 ", "target") == 25.5
