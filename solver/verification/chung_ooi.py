"""Materials and tables of the benchmark of Chung & Ooi (2011), Granular Matter 13:643–656.

doi 10.1007/s10035-011-0277-0. Materials and set-ups as in the paper (cross-checked with the scripts of YADE,
``examples/Chung-Ooi``). The curves are the paper's, digitised by the Kratos project
(``applications/DEMApplication/test_examples/basic_benchmarks/paper_data``), rounded to 0.001 here; reading a printed
curve costs about 0.5 % of its span. The planes are rigid: E → infinity, so 1/E* = (1 − ν²)/E and 1/G* = (2 − ν)/G.
"""

from __future__ import annotations

from solver.scenes.material import Material

DIGITISED = "Chung & Ooi 2011, digitised by Kratos"


def solid(name: str, youngs_modulus: float, poisson_ratio: float, density: float) -> Material:
    """A material by Young's modulus E [Pa]; G = E/(2 (1 + ν))."""
    return Material(name, density, youngs_modulus / (2.0 * (1.0 + poisson_ratio)), poisson_ratio)


RIGID = solid("wall", 1e30, 0.3, 1e4)

GLASS = solid("glass", 4.8e10, 0.20, 2800.0)
LIMESTONE = solid("limestone", 2.0e10, 0.25, 2500.0)
ALUMINIUM_T2 = solid("Al alloy", 7.0e10, 0.30, 2699.0)
MAGNESIUM = solid("Mg alloy", 4.0e10, 0.35, 1800.0)
OXIDE = solid("Al oxide", 3.8e11, 0.23, 4000.0)
CAST_IRON = solid("cast iron", 1.0e11, 0.25, 7000.0)
ALUMINIUM = solid("Al alloy", 7.0e10, 0.33, 2700.0)
"""Of T4, T6, T7 and T8; T2 has another one."""
STEEL = solid("steel", 2.08e11, 0.30, 7850.0)
POLYETHYLENE = solid("polyethylene", 1.0e9, 0.40, 1400.0)
NYLON = solid("nylon", 2.5e9, 0.40, 1000.0)
COPPER = solid("copper", 1.2e11, 0.35, 8900.0)

Curve = tuple[tuple[float, float], ...]
"""(abscissa, ordinate) pairs."""


def span(curve: Curve) -> float:
    """Largest minus smallest ordinate."""
    values = [y for _, y in curve]
    return max(values) - min(values)


T4_RESTITUTION: dict[str, Curve] = {
    "Al oxide": (
        *((5, 0.948), (10, 0.687), (15, 0.624), (20, 0.616), (25, 0.634), (30, 0.684), (35, 0.737), (40, 0.781)),
        *((50, 0.845), (60, 0.893), (70, 0.932), (80, 0.966), (85, 0.983)),
    ),
    "Al alloy": (
        *((5, 0.899), (10, 0.671), (15, 0.613), (20, 0.609), (25, 0.633), (30, 0.683), (35, 0.736), (40, 0.780)),
        *((50, 0.844), (60, 0.891), (70, 0.932), (80, 0.966), (85, 0.983)),
    ),
}
"""T4: impact angle θ from the normal [°], tangential restitution e_t = v_t'/v_t of the centre."""

T4_EXPERIMENT: Curve = (
    *((2.24, 0.797), (4.22, 0.746), (9.84, 0.675), (20.2, 0.599), (30.4, 0.690), (39.5, 0.774), (49.6, 0.848)),
    *((71.1, 0.937), (79.2, 0.970), (85.2, 0.979)),
)
"""T4, Al oxide: θ [°], e_t measured by Kharaz, Gorham & Salman (2001), Powder Technology 120:281, from the paper."""

T4_SPIN: dict[str, Curve] = {
    "Al oxide": (
        *((5, -19.3), (10, -213.0), (15, -377.8), (20, -510.6), (25, -599.4), (30, -616.5), (35, -582.3)),
        *((40, -544.8), (50, -457.0), (60, -357.5), (70, -246.2), (80, -126.3), (85, -63.1)),
    ),
    "Al alloy": (
        *((5, -35.3), (10, -223.7), (15, -389.6), (20, -519.1), (25, -599.4), (30, -617.6), (35, -582.3)),
        *((40, -544.8), (50, -458.1), (60, -358.6), (70, -245.1), (80, -125.2), (85, -64.2)),
    ),
}
"""T4: θ [°], spin after the impact [rad/s]; negative: the contact point runs against the centre."""

T4_ANGLE: dict[str, Curve] = {
    "Al oxide": (
        *((5, 3.76), (10, -1.56), (15, -5.54), (20, -7.54), (25, -7.54), (30, -3.55), (35, 3.43), (40, 11.57)),
        *((50, 29.35), (60, 47.8), (70, 64.6), (80, 78.7), (85, 84.5)),
    ),
}
"""T4: θ [°], rebound angle of the contact point, atan((v_t' + r ω')/v_n') [°]."""

T5_RECOIL: dict[str, Curve] = {
    "steel": (
        *((0.066, -0.080), (0.332, -0.280), (0.671, -0.493), (1.009, -0.747), (1.335, -1.000), (1.662, -1.267)),
        *((2.0, -1.533), (2.350, -1.813), (2.991, -2.440), (3.341, -2.693), (4.006, -2.787), (4.997, -2.000)),
        *((6.0, -1.013), (9.988, 3.013), (12.961, 6.013)),
    ),
    "polyethylene": (
        *((0.079, -0.080), (0.344, -0.293), (0.671, -0.573), (0.997, -0.880), (1.347, -1.120), (1.674, -1.440)),
        *((2.012, -1.760), (2.326, -2.053), (2.991, -2.680), (3.341, -2.947), (3.994, -2.933), (4.997, -2.000)),
        *((5.988, -1.000), (10.0, 3.000), (12.961, 6.013)),
    ),
}
"""T5: ψ1 = V_st/(μ V_cn), ψ2 = V_st'/(μ V_cn) of the contact point."""

T5_SPIN: dict[str, Curve] = {
    "steel": (
        *((0.058, -0.106), (0.353, -0.430), (0.682, -0.820), (0.994, -1.250), (1.341, -1.664), (1.688, -2.094)),
        *((2.0, -2.524), (2.329, -2.978), (2.988, -3.904), (3.318, -4.293), (3.994, -4.837), (5.0, -5.007)),
        *((6.006, -5.006), (10.012, -5.004), (20.0, -4.991)),
    ),
    "polyethylene": (
        *((0.075, -0.097), (0.353, -0.438), (0.682, -0.901), (0.994, -1.331), (1.341, -1.761), (1.688, -2.216)),
        *((2.017, -2.670), (2.347, -3.116), (3.023, -4.050), (3.335, -4.456), (4.012, -4.934), (5.0, -4.966)),
        *((6.006, -4.958), (9.994, -4.963), (20.0, -4.942)),
    ),
}
"""T5: ψ1, r ω'/(μ V_cn)."""

T5_RECOIL_FEM: Curve = (
    *((0.272, -0.027), (0.586, -0.027), (0.876, -0.080), (1.190, -0.213), (1.553, -0.373), (1.915, -0.627)),
    *((2.314, -0.947), (2.785, -1.253), (3.317, -1.520), (3.970, -1.720), (4.755, -1.707), (5.758, -1.200)),
    *((7.124, 0.133), (9.118, 2.147), (12.356, 5.427), (12.961, 6.013)),
)
"""T5, steel: ψ2 over ψ1 by the finite elements that the paper compares with."""

T6_BETA: dict[str, Curve] = {
    "Al alloy": (
        *((0.176, -0.820), (0.352, -0.633), (0.551, -0.445), (0.771, -0.243), (0.969, -0.028), (1.189, 0.097)),
        *((1.454, 0.119), (1.740, 0.100), (2.093, 0.058), (2.489, 0.005), (2.996, -0.050), (3.634, -0.100)),
        *((4.515, -0.140), (5.749, -0.175), (7.819, -0.208), (11.894, -0.258), (24.009, -0.342)),
    ),
    "nylon": (
        *((0.176, -0.824), (0.374, -0.638), (0.573, -0.443), (0.749, -0.243), (0.969, -0.026), (1.189, 0.093)),
        *((1.454, 0.119), (1.740, 0.117), (2.093, 0.095), (2.511, 0.056), (2.996, 0.007), (3.612, -0.056)),
        *((4.515, -0.120), (5.771, -0.159), (7.819, -0.118), (11.916, -0.113), (24.009, -0.116)),
    ),
}
"""T6: x = 3.5 μ (1 + e) V_cn/V_st, β = −V_st'/V_st of the contact point."""

T8_B_TAIL: Curve = ((7.845, -0.106), (11.909, -0.108), (23.995, -0.106))
"""T8 case B, x > 5.8; before, the case A and T6 have the same curve."""
T8_B_SPAN = 0.926
"""Of the whole curve of T8 case B, −0.815 … 0.111."""
