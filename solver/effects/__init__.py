"""Physical effects that the base model lacks: one file each, all off until an amplitude is set.

To add one: a file with a frozen dataclass of ``ContactEffect``, ``BodyEffect`` or ``SetUpEffect`` (``effect.py``), and
its two lines here. Files, ``--set``, page, studies, diagnosis and the contract tests follow.
"""

from solver.effects.adhesion_jkr import AdhesionJKR
from solver.effects.adhesion_sjkr import AdhesionSJKR
from solver.effects.air_drag import AirDrag
from solver.effects.capillary_bridge import CapillaryBridge
from solver.effects.density_error import DensityError
from solver.effects.effect import BodyEffect, ContactEffect, Effect, SetUpEffect, Stage, Telltale
from solver.effects.funnel_offset import FunnelOffset
from solver.effects.kinetic_friction import KineticFriction
from solver.effects.plastic_contact import PlasticContact
from solver.effects.plate_tilt import PlateTilt
from solver.effects.rolling_resistance import RollingResistance
from solver.effects.shape_elongation import ShapeElongation
from solver.effects.size_dispersion import SizeDispersion
from solver.effects.twisting import Twisting
from solver.effects.velocity_dependent_restitution import VelocityDependentRestitution
from solver.effects.wall_adhesion import WallAdhesion

EFFECTS: dict[str, type[Effect]] = {
    kind.name: kind
    for kind in (
        RollingResistance,
        AdhesionJKR,
        AdhesionSJKR,
        CapillaryBridge,
        AirDrag,
        Twisting,
        VelocityDependentRestitution,
        PlasticContact,
        KineticFriction,
        WallAdhesion,
        SizeDispersion,
        ShapeElongation,
        DensityError,
        PlateTilt,
        FunnelOffset,
    )
}
"""Effects by name."""

CONTACT_EFFECTS: tuple[type[ContactEffect], ...] = tuple(
    sorted((kind for kind in EFFECTS.values() if issubclass(kind, ContactEffect)), key=lambda kind: kind.stage)
)
"""In the order of their stages."""
BODY_EFFECTS: tuple[type[BodyEffect], ...] = tuple(k for k in EFFECTS.values() if issubclass(k, BodyEffect))
SET_UP_EFFECTS: tuple[type[SetUpEffect], ...] = tuple(k for k in EFFECTS.values() if issubclass(k, SetUpEffect))

__all__ = [
    "BODY_EFFECTS",
    "CONTACT_EFFECTS",
    "EFFECTS",
    "SET_UP_EFFECTS",
    "BodyEffect",
    "ContactEffect",
    "Effect",
    "SetUpEffect",
    "Stage",
    "Telltale",
]
