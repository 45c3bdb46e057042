"""`explorer warm-up`: which rooms are warmed, and one line for each."""

import pytest

import solver
from solver.effects.columns import kernel_effects
from solver.pours.run import capacity_for
from tests.explorer.command_line import explorer, refused


@pytest.fixture
def warmed(monkeypatch):
    """The rooms that would be warmed; the first is there already."""
    seen = []

    def warm_up(rooms, workers):
        seen.extend(rooms)
        yield from ((k, float(k) or None) for k in range(len(rooms)))

    monkeypatch.setattr(solver, "warm_up", warm_up, raising=False)
    return seen


def test_a_source_is_warmed_with_and_without_effects(warmed):
    done = explorer("warm-up", "lifting_cylinder")
    assert done.exit_code == 0
    assert done.stdout.splitlines() == [
        "lifting_cylinder, effects off: there already",
        "lifting_cylinder, effects on: compiled in 1.0 s",
        "lifting_cylinder, effects off and on: compiled in 2.0 s",
    ]
    assert [[kernel_effects(scene) for scene in room] for room in warmed] == [[False], [True], [False, True]]


def test_by_default_everything_shipped_is_warmed(warmed):
    done = explorer("warm-up")
    assert done.exit_code == 0
    sizes = {capacity_for(room, 1) for room in warmed}
    assert len(sizes) >= 6
    for name in ("sunflower_extract", "rotating_drum", "mesh_funnel", "diagnosis of trefoil_1"):
        assert name in done.stdout
    assert "granudrum" not in done.stdout  # 28 000 bodies


def test_a_source_that_is_not_there_is_refused(warmed):
    assert "nowhere.toml" in refused(explorer("warm-up", "nowhere.toml"))


def test_another_processor_is_refused(warmed, monkeypatch):
    monkeypatch.setenv("EXPLORER_ARCH", "cpu")
    assert "cuda" in refused(explorer("--arch", "cuda", "warm-up"))
