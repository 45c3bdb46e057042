"""Which factors are said to be significant, and where the surface design is said to lie: on made-up studies."""

from dataclasses import replace

import numpy as np
import pytest

from doe.audit import audit_study
from doe.audit.finding import compared
from doe.audit.printed import printed, rounding_slack
from tests.doe.audit.made_up import clean_study
from tests.doe.audit.test_planted import ON_THE_WALK, at


@pytest.fixture(scope="module")
def clean():
    return clean_study()


def test_a_p_at_its_level_is_no_fault_and_a_bound_says_what_it_says(clean):
    """0.04 may stand for 0.035 … 0.045, so only F tells that F4 is not above 0.04; <0.05 may be above 0.01."""
    screening = replace(clean.screening, level_of_others=0.04)
    at_level = replace(screening, p=at(screening.p, 3, printed("0.04")))
    named, others = significant(replace(clean, screening=at_level))
    assert (named.status, others.status) == ("reproduced exactly", "differs")
    assert "0.0378 from F" in others.how
    unknown = replace(at_level, f=(), error_df=2)
    assert [f.status for f in significant(replace(clean, screening=unknown))] == ["reproduced exactly"] * 2
    # F5 is named at 0.01: 0.010 may stand for less, 0.011 does not.
    for text, status in (("0.010", "reproduced exactly"), ("0.011", "differs")):
        named = replace(screening, p=at(screening.p, 4, printed(text)))
        assert significant(replace(clean, screening=named))[0].status == status
    bound = replace(unknown, p=at(screening.p, 3, printed("<0.05")), level_of_others=0.01)
    assert [f.status for f in significant(replace(clean, screening=bound))] == ["reproduced exactly"] * 2


def significant(study):
    return [figure for figure in audit_study(study).figures if figure.check == "significance"]


def test_without_p_and_f_what_the_factors_leave_of_the_runs_decides(clean):
    """12 runs less 8 factors leave the 3 degrees of freedom of the error; with another number nothing can be said."""
    bare = replace(clean.screening, f=(), p=())
    assert [f.status for f in significant(replace(clean, screening=bare))] == ["reproduced exactly"] * 2
    fewer = replace(bare, significant=("F1", "F2"))
    assert [f.status for f in significant(replace(clean, screening=fewer))] == ["reproduced exactly", "differs"]
    lost = replace(bare, error_df=2)
    assert [f.status for f in significant(replace(clean, screening=lost))] == ["cannot be checked"] * 2


def test_a_design_off_the_best_step_or_off_the_walk_is_remarked(clean):
    """Nothing is said of steps here: the design around step 2, and one whose second factor goes between the steps."""
    surface = replace(clean.surface, steps=None)
    assert audit_study(replace(clean, surfaces=(surface,))).remarks == ()
    delta = clean.ascent.settings[1] - clean.ascent.settings[2]
    off = replace(surface, low=surface.low + delta, high=surface.high + delta)
    (remark,) = on_the_walk(replace(clean, surfaces=(off,)))
    assert "is step 2 and not the step called best, 3 (30, 0.4, 3), which lies at (+1.00, +1.00, -1.00)" in remark.text
    inward = np.array([0.0, 0.02, 0.0])
    narrow = replace(surface, low=surface.low + inward, high=surface.high - inward)
    (remark,) = on_the_walk(replace(clean, surfaces=(narrow,)))
    assert "are no steps of the walk: B 0.34 and 0.46, steps 0.24, 0.32, 0.4" in remark.text


def on_the_walk(study):
    """Remarks on the design's levels alone: the model and the optimum move with them."""
    audit = audit_study(replace(study, optimum=None, verified=None))
    return [remark for remark in audit.remarks if remark.check == ON_THE_WALK]


def test_levels_of_a_factor_that_was_not_walked_cannot_be_checked(clean):
    ascent = replace(clean.ascent, factors=("F1", "F2", "F8"))
    (figure,) = audit_study(replace(clean, ascent=ascent)).having("cannot be checked")
    assert figure.how == "the walk does not move C"


def test_what_is_not_defined_for_the_prints_is_no_difference():
    """sqrt(1 − r²) at r = 1.00: rounded up nothing is defined, rounded down it is 0.1."""
    of_print, root = printed("0.05"), lambda values: np.sqrt(1.0 - values[:1] ** 2)
    with np.errstate(invalid="ignore"):
        slack = float(rounding_slack(root, np.array([1.0]), np.array([0.005]))[0])
    assert slack == pytest.approx(0.0999, abs=1e-4)
    assert compared("a", "b", "c", of_print, 0.0, "by hand", slack).status == "only if rounded"
    assert compared("a", "b", "c", of_print, float("nan"), "by hand").status == "cannot be checked"
