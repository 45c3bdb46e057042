"""What an effect sees of one contact and of one body, inside a kernel."""

from solver.backend import ti
from solver.engine.state import Vec3, Vec4

Touch = ti.types.struct(
    # Geometry and motion: body i is pushed by j along the normal, from j to i.
    normal=Vec3,
    overlap=ti.f64,  # [m]; negative while a pull holds surfaces that are apart
    reduced_radius=ti.f64,  # R* [m]
    mass=ti.f64,  # m* [kg]
    part=ti.f64,  # this contact's share of the pair's stiffness; 1 where contacts do not share
    v_n=ti.f64,  # relative velocity along the normal [m/s], positive while separating
    v_t=Vec3,  # and across it [m/s]
    omega=Vec3,  # relative angular velocity ω_i − ω_j [rad/s]
    dt=ti.f64,  # [s]
    before=ti.f64,  # contact radius a at the last step [m]; 0: the first step of this contact
    # Constants of the pair
    e_star=ti.f64,  # E* [Pa]
    g_star=ti.f64,  # G* [Pa]
    restitution=ti.f64,
    friction=ti.f64,  # μ
    # What the stages compute
    radius=ti.f64,  # contact radius a [m]
    elastic=ti.f64,  # NORMAL, ADHESION: force without damping [N], tensile where negative
    adhesive=ti.f64,  # the whole elastic force, not only this contact's share: the law's or, once JKR acts, JKR's [N]
    work=ti.f64,  # ADHESION: work of adhesion so far [J/m²]; those of several effects add up
    pull_off=ti.f64,  # ADHESION: JKR's pull-off force that ``floor`` and ``pull`` contain so far [N]
    damper=ti.f64,  # NORMAL: damping force / speed [kg/s]
    shear_damper=ti.f64,  # the same in the tangential direction while the contact sticks [kg/s]
    floor=ti.f64,  # ADHESION: the normal force never falls below this [N], ≤ 0
    pull=ti.f64,  # ADHESION: what is added to the normal force in the Coulomb limit [N], ≥ 0
    held=ti.i32,  # ADHESION: 1: the contact lasts although the surfaces are apart
    force=ti.f64,  # after ADHESION: normal force [N]
    limit=ti.f64,  # TANGENTIAL: largest tangential force [N]
    torque=Vec3,  # ROLLING, TWISTING: torque on i, its opposite on j [N m]
)
"""One contact. ``k_t = 8 G* a`` is the tangential stiffness of the contact law [N/m]: a law with another formula gives
the G* for which this is true."""

Flight = ti.types.struct(
    velocity=Vec3,  # [m/s]
    rotation=ti.types.matrix(3, 3, ti.f64),  # principal frame → world
    semi_axes=Vec3,  # of the ellipsoid that represents the body in air drag [m], `engine/tables.py`
    diameter=ti.f64,  # of the sphere of the same volume [m]
    drag_factors=Vec4,  # a, b, c, d of its drag coefficient (`air_drag.py`)
)
"""One body."""
