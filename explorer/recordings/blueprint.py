"""How a recording opens: of a pour its scene with curves beside it; of an answer its piles, with charts below them."""

from __future__ import annotations

from collections.abc import Sequence
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
    plots = [rrb.TimeSeriesView(origin=f"curves/{plot}", name=title) for plot, title in PLOTS.items()]
    texts = rrb.Tabs(
        rrb.TextLogView(origin="log", name="Events"),
        rrb.TextDocumentView(origin="parameters", name="Parameters"),
        rrb.TextDocumentView(origin="outcome", name="Outcome"),
    )
    return rrb.Blueprint(
        rrb.Horizontal(
            rrb.Spatial3DView(origin="world", name="Pour", eye_controls=_eye(eye_distance)),
            rrb.Vertical(*plots, texts),
            column_shares=[3, 2],
        ),
        rrb.TimePanel(timeline=TIMELINE, state="collapsed"),
        collapse_panels=True,
    )


def answer_blueprint(
    eye_distance: float, models: Sequence[str], measured_pile: bool, outlines: bool, errors: Sequence[str]
) -> rrb.Blueprint:
    """Layout of an answer (`explorer.recordings.answer_recording`): piles side by side, all seen from the same place.

    ``models``: entities of the pours; ``outlines``, ``errors``: which charts there are.
    """
    eye = _eye(eye_distance)
    measured = (
        rrb.Spatial3DView(origin="measured/world", name="Measured", eye_controls=eye)
        if measured_pile
        else rrb.TextDocumentView(origin="measured/words", name="Measured")
    )
    piles = [rrb.Spatial3DView(origin=f"{one}/world", name=one.capitalize(), eye_controls=eye) for one in models]
    charts: list[rrb.View] = [
        rrb.TimeSeriesView(
            contents=[f"/{one}/curves/{plot}/{name}" for one in ("measured", *models) for name in names],
            name=PLOTS[plot],
        )
        for plot, names in {"angle": ["angle_of_repose_deg"], "mass": ["discharged_mass_g"]}.items()
    ]
    if outlines:
        charts.append(rrb.Spatial2DView(origin="outlines", name="Outlines [mm]"))
    charts += [rrb.BarChartView(origin=f"errors/{of}", name=f"Error / noise, {of}") for of in errors]
    texts = rrb.Tabs(
        rrb.TextDocumentView(origin="answer", name="Answer"),
        *(rrb.TextDocumentView(origin=f"{one}/outcome", name=f"Outcome, {one}") for one in models),
        *(rrb.TextDocumentView(origin=f"{one}/parameters", name=f"Parameters, {one}") for one in models),
    )
    return rrb.Blueprint(
        rrb.Vertical(rrb.Horizontal(measured, *piles), rrb.Horizontal(*charts, texts), row_shares=[3, 2]),
        rrb.TimePanel(timeline=TIMELINE, state="collapsed"),
        collapse_panels=True,
    )


def _eye(distance: float) -> rrb.EyeControls3D:
    return rrb.EyeControls3D(
        position=[0.35 * distance, -0.85 * distance, 0.55 * distance],
        look_target=[0.0, 0.0, 0.2 * distance],
        eye_up=[0.0, 0.0, 1.0],
    )
