"""Boxes of numbers take what a person types: viser derives from a box's first numbers how many decimals that is."""

from explorer.scene.source import material_source
from explorer.viewer.number_box import DECIMALS, with_decimals
from explorer.viewer.panel import Now
from explorer.viewer.pour.controls_panel import ControlsPanel
from solver.scenes.scene import value
from tests.explorer.viewer.page_session import PageSession, page_context
from tests.explorer.viewer.person import Person


def test_a_box_of_whole_numbers_takes_decimals_and_one_of_finer_ones_keeps_its_own(server):
    assert with_decimals(server.gui.add_number("mean", 25.0)).precision == DECIMALS
    assert with_decimals(server.gui.add_vector3("range", (32.0, 48.0, 40.0))).precision == DECIMALS
    assert with_decimals(server.gui.add_number("spread", 0.000125)).precision == 6


def test_the_shear_modulus_beside_the_pile_is_entered_in_its_unit(server):
    session = PageSession(material_source("nine_sphere_seed"))
    with server.gui.add_folder("controls") as place:
        panel = ControlsPanel(page_context(server, session))
    person = Person(place)
    panel.show(Now(session.now))
    person.enter("Shear modulus [MPa]", 45.5)
    moduli = {value(session.now.scene, f"material.{body.material}.shear_modulus") for body in session.now.scene.bodies}
    assert moduli == {45.5e6}
