"""Physical effects that the base model lacks: one file each, all off until an amplitude is set.

To add one, write a file with a frozen dataclass of ``ContactEffect``, ``BodyEffect`` or ``SetUpEffect`` (``effect.py``)
and add its import and its entry here, or declare an entry point ``effect.NAME`` in a package of your own
(``solver/plugins.py``). Files, ``--set``, page, studies, diagnosis and the contract tests follow.
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
from solver.plugins import Registry, derived_from

EFFECTS: Registry[type[Effect]] = Registry(
    "effect",
    (
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
    ),
    derived_from(Effect),
)


def contact_effects() -> tuple[type[ContactEffect], ...]:
    """Effects on contacts, in the order of their stages."""
    return tuple(sorted((k for k in EFFECTS.values() if issubclass(k, ContactEffect)), key=lambda kind: kind.stage))


def body_effects() -> tuple[type[BodyEffect], ...]:
    """Effects on moving bodies."""
    return tuple(kind for kind in EFFECTS.values() if issubclass(kind, BodyEffect))


def set_up_effects() -> tuple[type[SetUpEffect], ...]:
    """Effects that change material or set-up."""
    return tuple(kind for kind in EFFECTS.values() if issubclass(kind, SetUpEffect))


__all__ = [
    "EFFECTS",
    "BodyEffect",
    "ContactEffect",
    "Effect",
    "SetUpEffect",
    "Stage",
    "Telltale",
    "body_effects",
    "contact_effects",
    "set_up_effects",
]
