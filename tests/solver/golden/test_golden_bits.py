"""The number of the physics and the bits of the pours belong together: neither changes without the other."""

from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from multiprocessing import get_context

import numpy as np
import pytest

from solver.effects import EFFECTS
from solver.laws import CONTACT_LAWS, HertzMindlin
from solver.rigs import BENCH_RIGS, RIGS
from tests.solver.golden import golden_file
from tests.solver.golden.golden_file import (
    TOLERANCE,
    Bits,
    Golden,
    RefusalError,
    changed,
    contradiction,
    of_today,
    read,
    recorded,
    unrecorded,
)

HERE = {"instructions": "x86_64 avx2", "taichi": "1", "numpy": "2"}
THERE = HERE | {"instructions": "x86_64 avx512f"}
STATE = np.linspace(0.0, 1.0, 7)


def golden(heap="a", physics=1, machine=HERE, default=0.5, state=STATE, **more):
    digests = {"heap": heap, "pour": "p", **more}
    return Golden(physics, {"pair.static_friction": default}, (Bits(machine, digests),), None, {"heap": state})


def test_the_bits_of_today_are_those_of_this_physics(monkeypatch):
    # Compiled as users do: `make test` leaves out a pass of the compiler, which changes no bit but takes a while.
    monkeypatch.delenv("TI_ADVANCED_OPTIMIZATION", raising=False)
    with ProcessPoolExecutor(1, mp_context=get_context("spawn")) as pool:
        kept, now = read(), pool.submit(of_today).result()
    assert contradiction(kept, now) is None
    assert unrecorded(kept, now) is None


def test_every_effect_rig_law_and_batch_size_is_a_case():
    names = list(read().machines[0].digests)
    for one in (*EFFECTS, *RIGS, *BENCH_RIGS, *(set(CONTACT_LAWS) - {HertzMindlin.name})):
        assert any(one in name for name in names), one
    assert {"heap, alone", "heap, second of three"} <= set(names)


def test_the_file_itself_changed_with_its_number():
    """A number that was raised and recorded changed bits, or a default, on a machine that both files know."""
    now = read()
    if now.before is not None:
        both = [(bits.digests, now.before.on(bits.machine)) for bits in now.machines]
        known = [(one, other) for one, other in both if other is not None]
        assert not known or changed(now.defaults, now.before.defaults) or any(changed(*pair) for pair in known)


def test_nothing_changed_is_nothing_found():
    assert contradiction(golden(), golden()) is None
    assert unrecorded(golden(), golden()) is None


def test_a_changed_bit_under_the_same_number():
    assert "bits changed under the same PHYSICS = 1: heap." in contradiction(golden(), golden("b"))
    with pytest.raises(RefusalError, match="Undo that, or raise PHYSICS"):
        recorded(golden(), golden("b"))


def test_a_raised_number_without_a_changed_bit():
    line = "PHYSICS is 2 and was 1, but nothing changed: put it back"
    assert contradiction(golden(), golden(physics=2)) == line
    with pytest.raises(RefusalError, match=line):
        recorded(golden(), golden(physics=2))


def test_a_raised_number_and_a_changed_bit_have_to_be_recorded():
    raised = golden("b", physics=2)
    assert contradiction(golden(), raised) is None
    assert unrecorded(golden(), raised) == "PHYSICS is 2 and the golden file is of 1: record it (make golden)"
    after = recorded(golden(), raised)
    assert contradiction(after, raised) is unrecorded(after, raised) is None
    assert after.before.physics == 1


def test_a_number_is_never_lowered():
    with pytest.raises(RefusalError, match="below the recorded 2"):
        recorded(golden(physics=2), golden("b", physics=1))


def test_a_default_counts_like_a_bit():
    """A stored pour's key leaves defaults out: with another default it would stand for another pour."""
    assert "default of pair.static_friction" in contradiction(golden(), golden(default=0.4))
    assert contradiction(golden(), golden(default=0.4, physics=2)) is None


def test_changed_member_spheres_are_a_new_fitting_as_well():
    """Under the old number the shipped and the cached fits would be those of the old code."""
    kept, refitted = golden(**{"shape, box": "s"}), golden("b", physics=2, **{"shape, box": "t"})
    assert "member spheres changed under the same FITTING = 1: shape, box." in contradiction(kept, refitted)
    assert contradiction(kept, replace(refitted, fitting=2)) is None
    assert "FITTING is 2 and was 1, but nothing changed" in contradiction(kept, replace(kept, fitting=2))


def test_a_new_case_is_recorded_under_the_same_number():
    now = golden(drum="d")
    assert contradiction(golden(), now) is None
    assert unrecorded(golden(), now) == "in the golden file or in the program only: drum; record it (make golden)"
    assert unrecorded(recorded(golden(), now), now) is None


def test_another_machine_is_compared_by_its_first_steps():
    """Its bits may differ, what it does may not."""
    near = golden("b", machine=THERE, state=STATE * (1.0 + 0.5 * TOLERANCE))
    assert contradiction(golden(), near) is None
    far = golden("b", machine=THERE, state=STATE + 3.0 * TOLERANCE)
    assert "first steps (this machine's bits are not known) changed" in contradiction(golden(), far)
    with pytest.raises(RefusalError):
        recorded(golden(), far)
    # A change may show later than in the first steps: a raised number is taken at its word.
    assert contradiction(golden(), golden(physics=2, machine=THERE)) is None
    both = recorded(golden(), near)
    assert [bits.machine for bits in both.machines] == [THERE, HERE]
    assert contradiction(both, near) is contradiction(both, golden()) is None
    assert contradiction(both, golden("b")) is not None


def test_what_is_written_is_what_is_read(tmp_path, monkeypatch):
    monkeypatch.setattr(golden_file, "FILE", tmp_path / "golden.json")
    monkeypatch.setattr(golden_file, "FIRST_STEPS", tmp_path / "first_steps.npz")
    whole = recorded(golden(), golden("b", physics=2))
    golden_file.write(whole)
    again = read()
    assert replace(again, first_steps={}) == replace(whole, first_steps={})
    assert np.array_equal(again.first_steps["heap"], STATE)


def test_a_machine_without_a_new_case_compares_that_case_by_its_first_steps():
    """Its other bits stay, and count, until it has recorded the new case itself."""
    both = recorded(golden(), golden(machine=THERE, drum="d"))
    both = replace(both, first_steps=both.first_steps | {"drum": STATE})
    assert [set(bits.digests) for bits in both.machines] == [{"heap", "pour", "drum"}, {"heap", "pour"}]

    def here(heap="a", drum=STATE):
        return replace(golden(heap, drum="of here"), first_steps={"heap": STATE, "drum": drum})

    assert contradiction(both, here()) is unrecorded(both, here()) is None
    assert "heap" in contradiction(both, here(heap="b"))
    assert "drum" in contradiction(both, here(drum=STATE + 3.0 * TOLERANCE))


def test_a_bench_test_that_measures_otherwise_is_recorded_under_the_same_number():
    """Nothing that is stored depends on it; but it does not change unseen, on this machine or on another."""
    kept = golden(**{"bench, slope": "s"})
    kept = replace(kept, first_steps=kept.first_steps | {"bench, slope": np.array([0.5, 1e7])})
    line = "measured otherwise than before: bench, slope; record it (make golden)"
    here = replace(golden(**{"bench, slope": "t"}), first_steps=kept.first_steps)
    assert (contradiction(kept, here), unrecorded(kept, here)) == (None, line)
    after = recorded(kept, here)
    assert contradiction(after, here) is unrecorded(after, here) is None
    for share, expected in ((1e-6, None), (1e-4, line)):
        moved = kept.first_steps | {"bench, slope": np.array([0.5, 1e7 * (1.0 + share)])}
        there = replace(golden(machine=THERE, **{"bench, slope": "u"}), first_steps=moved)
        assert (contradiction(kept, there), unrecorded(kept, there)) == (None, expected)
    # What another machine had recorded of it no longer counts.
    assert [set(bits.digests) for bits in recorded(kept, there).machines] == [
        {"heap", "pour", "bench, slope"},
        {"heap", "pour"},
    ]
