"""Beside the number of one pour stands what other seeds give, and what one pour can tell of a change."""

import re
from dataclasses import replace
from types import SimpleNamespace

import pytest

from doe.population import Comparison, Population
from doe.store import Store
from explorer.background.command_process import BackgroundError, CommandStatus
from explorer.live.messages import SessionState, Status
from explorer.population.process import PopulationProcess
from explorer.scene.source import material_source
from explorer.viewer.actions import Actions, BackgroundWork
from explorer.viewer.panel import Now
from explorer.viewer.pour import population_panel
from explorer.viewer.pour.population_panel import (
    BASE,
    DOT,
    MORE,
    POUR_BOTH,
    POUR_MORE,
    PopulationPanel,
    ThisPour,
    population_html,
    stacked,
    strip_svg,
    told_difference,
)
from solver import Outcome, with_rig, with_values
from solver.observables import Value
from tests.doe.test_population import stored
from tests.explorer.viewer.page_session import PageSession, finished, page_context
from tests.explorer.viewer.person import Person

SOURCE = material_source("sunflower_extract")
FRICTION = "pair.seed.seed.static_friction"
IDLE = CommandStatus("idle")
PILE = ThisPour(21.7, 3, "", changed=False)
CANCEL = "Cancel these pours"


def population(*values, void=0):
    return Population("angle_of_repose_deg", tuple(range(1, len(values) + 1)), values, void)


def text(html):
    return " ".join(re.sub(r"<svg.*</svg>", "", re.sub(r"<(?!/?svg)[^>]*>", "", html)).split())


def told(found, pour=PILE, command=IDLE, changed="", comparison=None):
    return text(population_html(found, pour, command, changed, comparison))


def test_mean_spread_and_number_of_seeds_are_told():
    values = [18.8 + 6.8 * k for k in (-1.0, 0.0, 1.0)]
    assert "18.8 ± 6.8° SD (3 seeds)" in told(population(*values))
    # 1/√(2(n − 1)) = 1/2
    assert "the SD is known only to about ±50 %" in told(population(*values))
    assert "few" not in told(population(*values * 4))


def test_with_no_or_one_pour_nothing_is_claimed():
    assert "so the scatter between pours is unknown" in told(population())
    assert "±" not in told(population())
    assert "One stored pour, 17.2°: how far seeds scatter is unknown. 2 more gave no valid pile." in told(
        population(17.2, void=2)
    )


def test_the_single_pour_is_named_with_what_is_to_be_known_of_it():
    found = population(18.0, 20.0)
    assert "this pour 21.7° (seed 3)" in told(found)
    assert "this pour 21.7° (forming)" in told(found, replace(PILE, doubt="forming"))
    assert "this pour 21.7° (changed or disturbed on its way)" in told(found, replace(PILE, changed=True))


def test_a_change_that_one_pour_cannot_show_says_what_would():
    found = Comparison(-3.1, 9.6, 1, 20, 12, 4.02)
    assert (
        "friction 0.5 → 0.4: -3.1°, 95 % -12.7 … +6.5°, against 20 former: not distinguishable in one pour; "
        "12 pours of each would show 4.0°."
    ) in told(population(), changed="friction 0.5 → 0.4", comparison=found)
    seen = told(population(1.0, 2.0), changed="x", comparison=replace(found, half_width=1.0, pours=2))
    assert "distinguishable in 2 pours" in seen
    assert "not distinguishable" not in seen


def test_texts_from_outside_are_escaped():
    html = population_html(population(), PILE, CommandStatus("failed", message="<b>gone</b>"), "<i>x", None)
    assert "<b>gone" not in html
    assert "<i>" not in html


def test_the_strip_has_a_dot_per_seed_where_its_angle_is():
    found = population(16.0, 18.0, 18.1, 24.0)
    drawn = strip_svg(found, ThisPour(20.0, 3, "", changed=False))
    x = [float(one) for one in re.findall(r"<circle cx='([\d.]+)'", drawn)]
    assert len(x) == 4
    assert (x[1] - x[0]) / (x[3] - x[0]) == pytest.approx(2.0 / 8.0, abs=0.01)
    mark = float(re.search(r"<path d='M([\d.]+) ", drawn)[1])
    assert (mark - x[0]) / (x[3] - x[0]) == pytest.approx(0.5, abs=0.01)
    bar = re.search(r"<rect x='([\d.]+)' y='[\d.]+' width='([\d.]+)'", drawn)
    scale = (x[3] - x[0]) / 8.0
    assert float(bar[2]) / scale == pytest.approx(2 * found.sample.sd, rel=0.01)
    # A pour that is none of the population is an empty mark.
    assert "fill='none'" in strip_svg(found, replace(PILE, changed=True))
    assert "fill='none'" not in strip_svg(found, PILE)


def test_dots_do_not_hide_each_other():
    centres = stacked([10.0, 11.0, 30.0, 12.0])
    assert [y for _, y in centres][2] == centres[0][1] == BASE - 9
    for k, (x, y) in enumerate(centres):
        for other_x, other_y in centres[:k]:
            assert (x - other_x) ** 2 + (y - other_y) ** 2 >= (1.99 * DOT) ** 2


def test_the_change_is_told_by_what_was_changed():
    one = with_values(SOURCE.scene, {FRICTION: 0.4})
    assert told_difference(SOURCE.scene, one) == "static friction seed–seed 0.57 → 0.4"
    assert told_difference(SOURCE.scene, with_values(one, {"rig.mass": "20g"})) == (
        "static friction seed–seed 0.57 → 0.4; mass 30 g → 20 g"
    )
    assert told_difference(SOURCE.scene, with_rig(one, "rotating_drum")) == ""


class FakePours(PopulationProcess):
    """Reads the store, pours nothing, and remembers what it was asked for; ``now`` is what a test says of it."""

    def __init__(self, folder, store, place):
        super().__init__(folder, store, place=place)
        self.asked, self.now = [], IDLE
        self.status, self.cancel = lambda: self.now, lambda: self.asked.append("cancel")

    def start(self, scene, pours):
        self.asked.append((scene, pours))


@pytest.fixture
def table(server, tmp_path, monkeypatch):
    """A person at the panel, with a store of two pours of the scene and three of a smoother one."""
    session, actions, made = PageSession(SOURCE), Actions(), []
    work = BackgroundWork(actions.post)

    def process(*at, **more):
        made.append(FakePours(*at, **more))
        return made[0]

    monkeypatch.setattr(population_panel, "SETTLED", -1.0)
    monkeypatch.setattr(population_panel, "AGAIN", 0.0)
    monkeypatch.setattr(population_panel, "BackgroundWork", lambda post: work)
    monkeypatch.setattr(population_panel, "PopulationProcess", process)
    store = Store(tmp_path / "runs.sqlite")
    smooth = with_values(SOURCE.scene, {FRICTION: 0.2})
    for scene, angles in ((SOURCE.scene, (20.0, 24.0)), (smooth, (12.0, 13.0, 14.0))):
        for seed, angle in enumerate(angles):
            store.add(stored(scene, seed + 1, angle))
    diagnosis = SimpleNamespace(store=tmp_path / "runs.sqlite")
    with server.gui.add_folder("population") as place:
        panel = PopulationPanel(page_context(server, session, actions.post, tmp_path, diagnosis=diagnosis))
    person = Person(place, actions.carry_out)

    def look():
        panel.show(Now(session.now))
        finished(actions, work)
        panel.show(Now(session.now))
        return text(person.html)

    def refusal():
        panel.show(Now(session.now))
        return finished(actions, work)

    yield SimpleNamespace(person=person, session=session, store=store, look=look, refusal=refusal, pours=made[0])
    panel.close()
    store.close()


def rest(status: Status, angle: float) -> Status:
    found = {"angle_of_repose_deg": Value(angle, "deg", 2.0)}
    return replace(status, state=SessionState.ENDED, outcome=Outcome.AT_REST, observables=found)


def test_the_stored_pours_of_the_parameters_in_force_are_shown(table):
    assert "22.0 ± 2.8° SD (2 seeds)" in table.look()
    table.store.add(stored(SOURCE.scene, 9, 22.0))
    assert "22.0 ± 2.0° SD (3 seeds)" in table.look()


def test_a_change_is_held_against_the_former_parameters(table):
    table.look()
    table.session.set_parameters({FRICTION: 0.2})
    table.look()
    seen = table.look()
    assert "13.0 ± 1.0° SD (3 seeds)" in seen
    assert "static friction seed–seed 0.57 → 0.2: -9.0°, 95 % " in seen
    assert "in 3 pours" in seen


def test_a_single_pour_of_new_parameters_is_held_against_them_too(table):
    table.look()
    table.session.set_parameters({FRICTION: 0.3})
    table.session.now = rest(table.session.now, 21.0)
    table.look()
    seen = table.look()
    assert "so the scatter between pours is unknown" in seen
    # 21 against 22 ± 2.8 over 2: t(0.975, 1) = 12.7
    assert (
        "-1.0°, 95 % -45.0 … +43.0°, against 2 former: not distinguishable in one pour; 12 pours of each would show"
        in seen
    )


def test_more_pours_are_asked_for_and_can_be_cancelled(table):
    assert table.person.press(POUR_MORE) == ""
    assert table.pours.asked == [(SOURCE.scene, MORE)]
    table.pours.now = CommandStatus("running", done=3, planned=8, eta_s=64.0)
    assert "Pouring in the background: 3 of 8, time left 1 min 04 s." in table.look()
    assert table.person.labels == [CANCEL]
    assert table.person.press(CANCEL) == ""
    assert table.pours.asked[1:] == ["cancel"]
    table.pours.now = IDLE
    table.look()
    assert table.person.labels == [POUR_MORE]


def test_both_sides_of_a_change_are_poured_until_they_have_as_many(table):
    """Two stored pours before the change, three after it: five more of the new ones, then six of the former."""
    table.look()
    table.session.set_parameters({FRICTION: 0.2})
    table.look()
    assert table.person.press(POUR_BOTH) == ""
    assert table.pours.asked == [(table.session.now.scene, MORE - 3)]
    table.pours.now = CommandStatus("running", done=0, planned=5)
    table.look()
    assert len(table.pours.asked) == 1
    table.pours.now = IDLE
    table.look()
    assert table.pours.asked[1:] == [(SOURCE.scene, MORE - 2)]
    table.pours.now = CommandStatus("running", done=1, planned=6, eta_s=64.0)
    assert "Pouring in the background (the former parameters): 1 of 6" in table.look()
    # What is added to the former ones counts at once.
    for seed in (11, 12, 13, 14, 15, 16):
        table.store.add(stored(SOURCE.scene, seed, 22.0))
    table.look()
    assert "against 8 former" in table.look()


def test_a_second_order_that_is_refused_is_told_and_ends_nothing(table, monkeypatch):
    table.look()
    table.session.set_parameters({FRICTION: 0.2})
    table.look()
    assert table.person.press(POUR_BOTH) == ""

    def full(scene, pours):
        raise BackgroundError("No space left on device")

    monkeypatch.setattr(table.pours, "start", full)
    assert table.refusal() == "No space left on device"
    assert table.person.labels == [POUR_BOTH]


def test_cancelled_pours_of_the_one_side_are_not_followed_by_those_of_the_other(table):
    table.look()
    table.session.set_parameters({FRICTION: 0.2})
    table.look()
    assert table.person.press(POUR_BOTH) == ""
    table.pours.now = CommandStatus("running", done=0, planned=5)
    table.look()
    assert table.person.press(CANCEL) == ""
    table.pours.now = IDLE
    table.look()
    assert table.pours.asked == [(table.session.now.scene, MORE - 3), "cancel"]


def test_what_a_comparison_lacks_is_named():
    no_former = told(population(), changed="friction 0.5 → 0.4")
    assert "no stored pour of the former parameters; Pour to compare tells whether it is real." in no_former
    waits = text(population_html(population(), PILE, IDLE, "friction 0.5 → 0.4", None, population(18.0, 20.0)))
    assert "2 stored pours of the former parameters, none of these yet." in waits
