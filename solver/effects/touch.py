"""What an effect sees of one contact and of one body, inside a kernel."""

from solver.backend import ti
from solver.engine.state import Vec3, Vec4

Touch = ti.types.struct(
    # Geometry and motion: body i is pushed by j along the normal, from j to i.
    normal=Vec3,
    overlap=ti.f64,  # [m]; negative while a pull holds surfaces that are apart
    reduced_radius=ti.f64,  # R* [m]
    mass=ti.f64,  # m* [kg]
    part=ti.f64,  # of the pair's stiffness that is this contact's; 1 where contacts do not share
    v_n=ti.f64,  # relative velocity along the normal [m/s], positive while separating
    v_t=Vec3,  # and across it [m/s]
    omega=Vec3,  # relative angular velocity ω_i − ω_j [rad/s]
    dt=ti.f64,  # [s]
    before=ti.f64,  # contact radius a at the last step [m]; 0: the first step of this touch
    # Constants of the pair
    e_star=ti.f64,  # E* [Pa]
    g_star=ti.f64,  # G* [Pa]
    restitution=ti.f64,
    friction=ti.f64,  # μ
    # What the stages work out
    radius=ti.f64,  # contact radius a [m]
    elastic=ti.f64,  # NORMAL, ADHESION: force without damping [N], tensile where negative
    adhesive=ti.f64,  # what JKR sets: the contact law's whole force, with adhesion JKR's [N]
    work=ti.f64,  # ADHESION: work of adhesion so far [J/m²]; those of several effects add up
    pull_off=ti.f64,  # ADHESION: JKR's pull-off force in ``floor`` and ``pull`` so far [N]
    damper=ti.f64,  # NORMAL: damping force over speed [kg/s]
    shear_damper=ti.f64,  # of the tangential direction while it sticks [kg/s]
    floor=ti.f64,  # ADHESION: the normal force never falls below this [N], ≤ 0
    pull=ti.f64,  # ADHESION: what the Coulomb limit takes in addition to the normal force [N], ≥ 0
    held=ti.i32,  # ADHESION: 1: the contact lasts although the surfaces are apart
    force=ti.f64,  # then: normal force [N]
    limit=ti.f64,  # then TANGENTIAL: largest tangential force [N]
    torque=Vec3,  # ROLLING, TWISTING: torque on i, its opposite on j [N m]
)
"""One contact. ``k_t = 8 G* a`` is the tangential stiffness of the contact law [N/m]: a law with another formula shows
the G* with which it is."""

Flight = ti.types.struct(
    velocity=Vec3,  # [m/s]
    rotation=ti.types.matrix(3, 3, ti.f64),  # principal frame → world
    semi_axes=Vec3,  # of the ellipsoid that stands for the body in the wind [m], `engine/tables.py`
    diameter=ti.f64,  # of the sphere of the same volume [m]
    drag_factors=Vec4,  # a, b, c, d of its drag coefficient (`air_drag.py`)
)
"""One body."""
