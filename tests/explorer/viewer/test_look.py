"""How the pour is drawn: colours and their bar, force chains, cuts, and the controls that set them."""

import math
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from explorer.live.details import Details
from explorer.live.frames import Frame
from explorer.units import InputError
from explorer.viewer.actions import Actions
from explorer.viewer.look.colour_by import (
    QUANTITIES,
    ColourPanel,
    bar_html,
    body_colours,
    colour_key,
    colour_range,
    nice_top,
    shares,
)
from explorer.viewer.look.force_chains import (
    THICKEST,
    ForceChains,
    ForcePanel,
    chain_key,
    chain_radii,
    chain_segments,
    chain_text,
    strongest_drawn,
)
from explorer.viewer.look.look import COMPONENT, CUTS, NOTHING, Look, in_sight
from explorer.viewer.look.look_settings import CutPanel, LookSettings
from explorer.viewer.palette import (
    CORE,
    HALO,
    PLATE,
    SELECTED,
    STILL,
    TEXT,
    VIRIDIS,
    component_colour,
    linear,
    linear_all,
    mapped,
)
from explorer.viewer.scene_nodes import SceneNodes, another_set_up, tube_places
from solver import body_counts, load_material, with_values
from solver.scenes.insertion import rotation_matrix
from solver.scenes.scene import actual
from tests.explorer.beads import bead_scene
from tests.explorer.viewer.person import Person

FRAME = Frame(
    number=1,
    generation=1,
    time=2.0,
    position=np.float32([[0, 0, 0], [0.01, 0, 0], [0.02, 0, 0.01], [0.03, 0, 0]]),
    quaternion=np.tile(np.float32([1, 0, 0, 0]), (4, 1)),
    component=np.int32([0, 0, 1, 0]),
    inside=np.array([True, True, True, False]),
    scale=np.ones(4, dtype=np.float32),
)
DETAILS = Details(
    number=1,
    generation=1,
    time=2.0,
    mass=np.float32([1e-3] * 3),
    velocity=np.float32([[0, 0, 0], [0.3, 0.4, 0], [0, 0, -1]]),
    load=np.float32([5e-3, 1e-3, 0]),
    neighbours=np.int32([1, 2, 0]),
    entered=np.float32([0.5, 1.0, 1.5]),
    touching=40,
    mean_force=1e-3,
    body=np.int32([0, 0, 1, 2]),
    partner=np.int32([1, -1, 2, 3]),
    point=np.float32([[0.005, 0, 0], [0, 0, -0.006], [0.015, 0, 0.005], [0.025, 0, 0]]),
    normal_force=np.float32([5e-3, 1.5e-3, 0.5e-3, 3e-3]),
    tangential_force=np.float32([1e-3, 0, 0, 0]),
)


@pytest.fixture
def panel(server):
    """The controls in a place of their own, and a person at them."""
    actions = Actions()
    settings = LookSettings(actions.post)
    with server.gui.add_folder("Look") as place:
        colours = ColourPanel(server, server.gui.add_html(""), settings, QUANTITIES, actions.post)
        ForcePanel(server, settings, actions.post)
        CutPanel(server, settings, actions.post)
    person = Person(place, actions.carry_out)
    return SimpleNamespace(settings=settings, colours=colours, person=person, actions=actions)


def test_quantities_are_what_their_names_say():
    shown = {name: quantity.shown(DETAILS).tolist() for name, quantity in QUANTITIES.items()}
    assert shown["speed"] == pytest.approx([0.0, 0.5, 1.0])
    assert shown["contact force"] == pytest.approx([5.0, 1.0, 0.0])  # mN
    assert shown["coordination number"] == [1, 2, 0]
    assert shown["residence time"] == pytest.approx([1.5, 1.0, 0.5])


@pytest.mark.parametrize(
    ("values", "top"), [([0.0, 0.3], 0.5), ([0.11], 0.2), ([7.0], 10.0), ([0.5], 0.5), ([0.0], 1.0), ([], 1.0)]
)
def test_a_key_ends_at_a_round_number(values, top):
    assert nice_top(np.array(values)) == pytest.approx(top)


def test_an_automatic_range_goes_from_percentile_to_percentile_in_few_digits():
    """Of 0 … 1 in even steps: 0.02 and 0.98; one body that is off by a factor of fifty does not count."""
    even = np.linspace(0.0, 1.0, 1001)
    assert colour_range(Look(), AGE, even) == (0.02, 0.98)
    assert colour_range(Look(), AGE, np.append(even, 50.0)) == (0.02, 0.99)
    assert colour_range(Look(), AGE, 1e3 + even) == (1000.02, 1000.98)
    assert colour_range(Look(automatic=False, low=1.0, high=4.0), AGE, even) == (1.0, 4.0)
    for nothing in (np.zeros(0), np.array([math.nan])):
        low, high = colour_range(Look(), AGE, nothing)
        assert low < high
    # All alike: as wide as makes a difference, not as wide as the noise.
    low, high = colour_range(Look(), AGE, np.full(9, 2.0) + 1e-9 * np.arange(9))
    assert high - low == pytest.approx(0.1, rel=0.1)


def test_a_logarithmic_range_begins_above_zero_and_its_middle_is_the_geometric_mean():
    look, values = Look(logarithmic=True), np.array([0.0, *np.geomspace(1e-2, 1e2, 1001)])
    low, high = colour_range(look, AGE, values)
    assert (low, high) == (pytest.approx(1e-2 * 10**0.08, rel=0.1), pytest.approx(1e2 / 10**0.08, rel=0.1))
    assert shares(look, (1e-2, 1e2), np.array([1e-2, 1.0, 1e2, 0.0])) == pytest.approx([0.0, 0.5, 1.0, 0.0])
    assert colour_range(replace(look, automatic=False, low=0.0, high=50.0), AGE, values) == (5e-3, 50.0)
    key = colour_key(replace(look, automatic=False, low=1.0, high=100.0), AGE, None)
    assert key.numbers == (1.0, pytest.approx(10.0), 100.0)


def test_bodies_at_rest_are_grey_and_do_not_stretch_the_range():
    """Dark on dark, noise had looked like motion: 0.2 mm/s is at rest, and the key says so."""
    slow = replace(DETAILS, velocity=np.float32([[2e-4, 0, 0], [0, 0.02, 0], [0, 0, 0]]))
    painted = body_colours(PLAIN, Look(colour_by="speed"), SPEED, slow, selected=None)
    assert painted[0].tolist() == painted[2].tolist() == list(linear(STILL))
    assert painted[1].tolist() != list(linear(STILL))
    assert "at rest: below 1 mm/s" in bar_html(Look(colour_by="speed"), SPEED, slow)
    resting = replace(DETAILS, velocity=np.zeros((3, 3), dtype=np.float32))
    assert colour_range(Look(), SPEED, SPEED.shown(resting)) == (0.0, 0.01)


def contrast(one, other):
    """Ratio of luminances as WCAG 2.2 has it."""
    dark, bright = sorted(
        float(np.where(c <= 0.04045, c / 12.92, ((c + 0.055) / 1.055) ** 2.4) @ [0.2126, 0.7152, 0.0722])
        for c in (np.array(one) / 255.0, np.array(other) / 255.0)
    )
    return (bright + 0.05) / (dark + 0.05)


def test_what_lies_still_stands_out_from_the_plate_and_lines_from_their_rim():
    assert contrast(STILL, PLATE) > 4.5
    assert contrast(CORE, HALO) > 15.0
    assert contrast(TEXT, PLATE) > 4.5


def test_viridis_gets_lighter_all_the_way():
    colours = mapped(np.linspace(-0.2, 1.2, 100))
    # Luminance of sRGB (ITU-R BT.709 weights, on linear light).
    luminance = (colours / 255.0) ** 2.2 @ [0.2126, 0.7152, 0.0722]
    assert (np.diff(luminance) >= 0.0).all()
    assert colours[0].tolist() == list(VIRIDIS[0])
    assert colours[-1].tolist() == list(VIRIDIS[-1])
    assert linear_all(np.array([[10.0, 128.0, 255.0]])).tolist() == [list(linear((10, 128, 255)))]


PLAIN = np.array([linear(component_colour(k)) for k in FRAME.component], dtype=np.uint8)
SPEED, AGE = QUANTITIES["speed"], QUANTITIES["residence time"]


def test_bodies_have_the_colour_of_their_value_and_newcomers_that_of_their_component():
    painted = body_colours(PLAIN, Look(colour_by="speed"), SPEED, DETAILS, selected=None)
    assert painted[0].tolist() == list(linear(STILL))
    assert painted[2].tolist() == list(linear(VIRIDIS[-1]))
    assert painted[3].tolist() == list(linear(component_colour(0)))
    plain = body_colours(PLAIN, Look(), None, DETAILS, selected=1)
    assert plain[2].tolist() == list(linear(component_colour(1)))
    assert plain[1].tolist() == list(linear(SELECTED))


def test_a_body_without_a_number_keeps_the_colour_of_its_component():
    some = replace(DETAILS, velocity=np.float32([[math.nan, 0, 0], [0, 1, 0], [0, 0, 0]]))
    painted = body_colours(PLAIN, Look(colour_by="speed"), SPEED, some, selected=None)
    assert painted[0].tolist() == PLAIN[0].tolist()
    assert painted[1].tolist() == list(linear(VIRIDIS[-1]))


def test_a_pour_that_was_brought_back_has_fewer_bodies_than_its_last_details():
    early = replace(FRAME, component=FRAME.component[:1], position=FRAME.position[:1], inside=FRAME.inside[:1])
    assert body_colours(PLAIN[:1], Look(colour_by="speed"), SPEED, DETAILS, 2).shape == (1, 3)
    segments = chain_segments(early, early.inside, DETAILS, 0.0)
    # Of the four contacts only that with the plate is between things that are there.
    assert len(segments[0]) == 1


def test_before_the_first_body_there_is_nothing_to_paint():
    assert body_colours(PLAIN[:0], Look(colour_by="speed"), SPEED, None, None).shape == (0, 3)


def test_the_bar_tells_quantity_unit_and_ends():
    text = bar_html(Look(colour_by="contact force"), QUANTITIES["contact force"], DETAILS)
    for part in (
        "contact force [mN]: sum of the normal forces",
        "no contact",
        "<span>1</span>",
        "<span>3</span>",
        "<span>5</span>",
    ):
        assert part in text
    assert "<span>7</span>" in bar_html(Look(colour_by="speed", automatic=False, low=1, high=7), SPEED, DETAILS)
    assert bar_html(Look(), None, DETAILS) == ""


def test_chains_go_from_centre_to_centre_and_are_as_thick_as_they_press():
    segments, force = chain_segments(FRAME, np.ones(4, dtype=bool), DETAILS, threshold=1.0)
    # 1.5 mN with the plate: one line, from the bead to the point. 3 and 5 mN: two lines each. 0.5 mN: none.
    assert sorted(force) == pytest.approx([1.5e-3, 3e-3, 3e-3, 5e-3, 5e-3])
    np.testing.assert_allclose(segments[np.isclose(force, 1.5e-3)], [[[0, 0, 0], [0, 0, -0.006]]])
    strong = segments[np.isclose(force, 5e-3)]
    np.testing.assert_allclose(strong, [[[0, 0, 0], [0.005, 0, 0]], [[0.005, 0, 0], [0.01, 0, 0]]])
    radius = chain_radii(force, DETAILS, 1.0)
    assert radius / force == pytest.approx(THICKEST / strongest_drawn(DETAILS, 1.0))
    assert strongest_drawn(DETAILS, 1.0) == pytest.approx(5e-3)
    text = chain_text(DETAILS, Look(chains=True))
    assert "from 1 mN on. 3 of 40 contacts; their mean is 1 mN" in text


def test_the_key_tells_what_the_thickness_means():
    key = chain_key(DETAILS, Look(chains=True))
    for part in ("normal force [mN]", "<span>0</span>", "<span>2.5</span>", "<span>5</span>", "<polygon"):
        assert part in key
    assert chain_key(DETAILS, Look()) == chain_key(None, Look(chains=True)) == ""


def test_chains_of_bodies_that_are_cut_away_are_not_drawn():
    _, force = chain_segments(FRAME, FRAME.inside, DETAILS, threshold=1.0)
    assert sorted(force) == pytest.approx([1.5e-3, 5e-3, 5e-3])


def test_a_threshold_of_nothing_leaves_out_contacts_that_do_not_press():
    idle = replace(DETAILS, normal_force=np.float32([0, 0, 0, 1e-3]))
    assert len(chain_segments(FRAME, np.ones(4, dtype=bool), idle, 0.0)[0]) == 2


def test_a_tube_lies_along_its_segment_whichever_way_that_points():
    rng = np.random.default_rng(1)
    segments = np.concatenate([rng.normal(size=(20, 2, 3)), [[[0, 0, 1], [0, 0, -1]], [[0, 0, 0], [0, 0, 2]]]])
    radius = rng.uniform(0.1, 1.0, len(segments))
    places = tube_places(segments, radius, 32)
    for k, (start, end) in enumerate(segments):
        turn = rotation_matrix(places.quaternion[k].astype(float))
        top, rim = np.array([0, 0, 0.5]), np.array([1, 0, 0])
        assert places.position[k] + turn @ (places.scale[k] * top) == pytest.approx(end, abs=1e-5)
        assert places.position[k] - turn @ (places.scale[k] * top) == pytest.approx(start, abs=1e-5)
        assert np.linalg.norm(turn @ (places.scale[k] * rim)) == pytest.approx(radius[k], rel=1e-5)
    assert (places.scale[len(segments) :] == 0).all()


def test_chains_are_hidden_and_their_room_grows(server):
    def drawn():
        return [server.scene.get_handle_by_name(f"/forces/{part}") for part in ("core", "rim")]

    chains = ForceChains(server)
    chains.show(FRAME, FRAME.inside, DETAILS, 1.0)
    core, rim = drawn()
    assert (core.batched_scales[:, 0] > 0).sum() == 3
    assert (rim.batched_scales[:3, 0] > core.batched_scales[:3, 0]).all()
    assert (core.side, rim.side) == ("front", "back")
    assert core.visible
    assert rim.visible
    chains.hide()
    assert not core.visible
    assert not rim.visible
    contacts = ("body", "partner", "point", "normal_force", "tangential_force")
    many = replace(DETAILS, **{name: np.repeat(getattr(DETAILS, name), 14, axis=0) for name in contacts})
    chains.show(FRAME, FRAME.inside, many, 1.0)
    assert [(node.batched_scales[:, 2] > 0).sum() for node in drawn()] == [42, 42]


def test_a_cut_hides_one_side_and_nothing_else():
    assert in_sight(FRAME, Look()).tolist() == [True, True, True, False]
    assert in_sight(FRAME, Look(cut_away="x above", cut_at=0.015)).tolist() == [True, True, False, False]
    assert in_sight(FRAME, Look(cut_away="x below", cut_at=0.015)).tolist() == [False, False, True, False]
    assert in_sight(FRAME, Look(cut_away="z above", cut_at=0.005)).tolist() == [True, True, False, False]
    assert len(CUTS) == 6


def test_only_what_frames_do_not_carry_is_asked_for():
    assert not Look(cut_away="x above", rig_opacity=0.5).needs_details
    assert Look(chains=True).needs_details
    assert all(Look(colour_by=name).needs_details for name in QUANTITIES)


def test_bodies_are_drawn_as_they_are_poured(server):
    """Lighter ones are more, and a stretched one is longer, than declared."""
    lighter = with_values(bead_scene(), {"effect.density_error.excess": -0.3})
    (node,) = SceneNodes(server, lighter).bodies.nodes
    assert len(node.batched_scales) == sum(body_counts(actual(lighter))) > sum(body_counts(lighter))
    seeds = load_material("sunflower_extract")
    longer = with_values(seeds, {"effect.shape_elongation.elongation": 0.5})
    lengths = [np.ptp(SceneNodes(server, one).meshes[0].vertices, axis=0).max() for one in (seeds, longer)]
    assert lengths[1] > 1.2 * lengths[0]
    assert another_set_up(longer, seeds)
    assert not another_set_up(with_values(longer, {"pair.seed.seed.static_friction": 0.1}), longer)


def test_nodes_are_painted_faded_and_hidden(server):
    scene = bead_scene()
    nodes = SceneNodes(server, scene)
    beads = replace(FRAME, component=np.zeros(4, dtype=np.int32))
    nodes.show(beads, np.array([True, False, True, False]))
    (node,) = nodes.bodies.nodes
    assert node.batched_scales.tolist() == [1, 0, 1, 0, 0, 0]
    nodes.bodies.paint(beads, np.arange(12, dtype=np.uint8).reshape(4, 3))
    assert node.batched_colors[1].tolist() == [3, 4, 5]
    assert node.batched_colors[5].tolist() == list(linear(component_colour(0)))
    nodes.bodies.fade(0.3)
    nodes.fade(0.7)
    assert node.opacity == 0.3
    opacity = {name: server.scene.get_handle_by_name(f"/rig/{name}").opacity for name in ("cone", "plate", "gate")}
    assert opacity == {"cone": 0.7, "plate": None, "gate": 0.5}
    nodes.remove()


def test_controls_make_a_look(panel):
    entered = {
        "Colour by": "speed",
        "Force chains": True,
        "From × mean force": 2.0,
        "Cut away": "y below",
        "Place of the cut [mm]": -20.0,
        "Opacity of the rig": 0.5,
        "Shadows": False,
    }
    for label, value in entered.items():
        assert panel.person.enter(label, value) == ""
    assert panel.settings.look == Look(
        colour_by="speed", chains=True, threshold=2.0, cut_away="y below", cut_at=-0.02, rig_opacity=0.5, shadows=False
    )
    assert panel.person.send("From × mean force", 99.0) == ""
    assert panel.settings.look.threshold == 5.0


@pytest.mark.parametrize(
    ("label", "value"),
    [
        ("Colour by", "<script>"),
        ("Colour by", ["speed"]),
        ("Cut away", 3),
        ("Place of the cut [mm]", math.nan),
        ("From × mean force", "much"),
        ("Opacity of the rig", None),
        ("From", math.inf),
    ],
)
def test_what_a_browser_may_not_send_is_refused_in_a_line(panel, label, value):
    before = panel.settings.look
    assert panel.person.send(label, value)
    assert panel.settings.look == before


def test_what_the_page_writes_itself_is_no_input(panel):
    panel.person.control("Colour by").value = "speed"
    assert panel.actions.carry_out() is None
    assert panel.settings.look == Look()


def test_an_entered_end_fixes_the_range_at_what_is_on_the_screen(panel):
    settings, person = panel.settings, panel.person

    def fixed():
        return settings.look.automatic, settings.look.low, settings.look.high

    person.enter("Colour by", "speed")
    panel.colours.show(DETAILS)
    assert (person.value("From"), person.value("To")) == (0.51, 0.99)
    assert person.control("From").disabled
    person.send("From", 0.25)  # by somebody who does not know that yet
    assert fixed() == (False, 0.25, 0.99)
    assert person.value("Automatic range") is False
    person.enter("Automatic range", True)
    panel.colours.show(DETAILS)
    person.enter("Automatic range", False)
    assert fixed() == (False, 0.51, 0.99)
    panel.colours.show(DETAILS)
    person.enter("From", 0.25)
    assert fixed() == (False, 0.25, 0.99)
    assert "not above" in person.enter("From", 3.0)
    with pytest.raises(InputError, match="colour range"):
        settings.change(low=1.0, high=1.0)


def test_an_automatic_range_asks_for_no_ends(panel):
    """What was refused stands in its box still; the tick is a way out of it."""
    panel.person.enter("To", 1.0)
    assert "is not above its beginning" in panel.person.enter("From", 3.0)
    assert panel.person.enter("Automatic range", True) == ""
    assert panel.settings.look.automatic


def test_a_range_is_reset(panel):
    for label, value in {"Automatic range": False, "Logarithmic": True, "From": 0.5, "To": 2.0}.items():
        assert panel.person.enter(label, value) == ""
    assert panel.settings.look == Look(automatic=False, logarithmic=True, low=0.5, high=2.0)
    panel.person.press("Reset the range")
    assert panel.settings.look == Look(low=0.5, high=2.0)
    assert panel.person.value("Logarithmic") is False
    assert panel.person.value("Automatic range") is True


def test_keys_walk_through_the_choices(panel):
    settings, choices = panel.settings, (COMPONENT, *QUANTITIES)
    for _ in choices[1:]:
        settings.next("colour_by", choices)
    assert (settings.look.colour_by, panel.person.value("Colour by")) == (choices[-1], choices[-1])
    settings.next("colour_by", choices)
    assert settings.look.colour_by == COMPONENT
    assert settings.look.cut_away == NOTHING
