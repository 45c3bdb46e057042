"""How a recording opens: the scene, the curves beside it, the parameters and the log below."""

from __future__ import annotations

from dataclasses import dataclass

import rerun.blueprint as rrb

TIMELINE = "sim_time"


@dataclass(frozen=True)
class Curve:
    """A recorded curve: its entity is ``curves/<plot>/<name>``; the name carries the unit."""

    name: str
    plot: str


CURVES = (
    Curve("entered_mass_g", "mass"),
    Curve("discharged_mass_g", "mass"),
    Curve("angle_of_repose_deg", "angle"),
    Curve("kinetic_energy_mJ", "energy"),
    Curve("contacts", "contacts"),
)
PLOTS = {
    "mass": "Mass [g]",
    "angle": "Angle of repose [°]",
    "energy": "Kinetic energy [mJ]",
    "contacts": "Contacts",
}
"""Plot → title."""


def curve_entity(curve: Curve) -> str:
    """Path of a curve in the recording."""
    return f"curves/{curve.plot}/{curve.name}"


def motion_curves(
    entered_mass: float, discharged_mass: float, kinetic_energy: float, contacts: float
) -> dict[str, float]:
    """Curves of a moment by name; masses [kg] and energy [J] in the units of the names."""
    return {
        "entered_mass_g": 1e3 * entered_mass,
        "discharged_mass_g": 1e3 * discharged_mass,
        "kinetic_energy_mJ": 1e3 * kinetic_energy,
        "contacts": float(contacts),
    }


def blueprint(eye_distance: float) -> rrb.Blueprint:
    """Layout of the viewer; the eye looks at the outlet from ``eye_distance`` [m]."""
    eye = rrb.EyeControls3D(
        position=[0.35 * eye_distance, -0.85 * eye_distance, 0.55 * eye_distance],
        look_target=[0.0, 0.0, 0.2 * eye_distance],
        eye_up=[0.0, 0.0, 1.0],
    )
    plots = [rrb.TimeSeriesView(origin=f"curves/{plot}", name=title) for plot, title in PLOTS.items()]
    texts = rrb.Tabs(
        rrb.TextLogView(origin="log", name="Events"),
        rrb.TextDocumentView(origin="parameters", name="Parameters"),
        rrb.TextDocumentView(origin="outcome", name="Outcome"),
    )
    return rrb.Blueprint(
        rrb.Horizontal(
            rrb.Spatial3DView(origin="world", name="Pour", eye_controls=eye),
            rrb.Vertical(*plots, texts),
            column_shares=[3, 2],
        ),
        rrb.TimePanel(timeline=TIMELINE, state="collapsed"),
        collapse_panels=True,
    )
