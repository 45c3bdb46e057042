"""Photographs of a cone on a stage, traced through a camera: supports, a funnel, lenses, cameras above and close by.

Everything is a solid of revolution, a list of (radius, height) from the axis out, in radii of the pile; every pixel is
the mean of four rays. The plate is at height 0, x goes to the right, y away from the camera.
"""

from dataclasses import dataclass
from itertools import pairwise
from typing import Literal

import numpy as np
from scipy import ndimage

from tests.solver.photograph.rendered import Look, developed, texture

Support = Literal["plate", "disc", "tray", "dish", "funnel"]
FAR = 400.0
"""Distance of a camera that is far away [radii of the pile]."""
LIGHT = np.array([-0.5, -0.6, 0.62])
GLASS = 0.3
"""Share of a dish's wall in what is seen through it; its rim is opaque."""


@dataclass(frozen=True)
class Stage:
    """The pile, what it stands on, and the camera. Lengths in radii of the pile."""

    angle_deg: float
    support: Support = "plate"
    wide: float = 1.4
    """Radius of disc, tray or dish."""
    high: float = 0.1
    """Height of disc, or of the rim of tray or dish."""
    tone: float | None = None
    """Grey of the support; None: the pile's own."""
    stem: float = 0.06
    """Radius of the funnel's stem; it is as long as the funnel is wide, and enters the pile's apex."""
    mouth: float = 0.5
    """Radius of the funnel where it is widest, ``stem`` for a mere tube."""
    rounding: float = 0.0
    """Of the apex, over the height."""
    plate_wide: float = 8.0
    above_deg: float = 0.0
    """Direction from the foot of the pile to the camera, over the plate."""
    distance: float = FAR
    lens: float = 0.0
    """k of r (1 + k r²), r over half the picture's diagonal; negative: barrel."""
    fill: float = 0.6
    """Width of the pile over that of the picture."""
    aside: float = 0.0
    """Of the pile, from the support's axis."""
    rough: float = 0.0
    """Root mean square by which bodies shift the pile's edge, over the pile's height."""

    @property
    def height(self) -> float:
        """Of the pile over its foot."""
        return float(np.tan(np.radians(self.angle_deg)))

    @property
    def foot(self) -> float:
        """Height of the pile's foot over the plate."""
        return {"disc": self.high, "tray": 0.03, "dish": 0.02}.get(self.support, 0.0)


class Camera:
    """Places in the picture [px from its middle, y down] ↔ rays."""

    def __init__(self, stage: Stage, look: Look) -> None:
        self.rows, self.columns = round(0.62 * look.width), look.width
        self.focal = stage.fill * look.width / 2.0 * stage.distance
        self.k, self.half = stage.lens, 0.5 * np.hypot(self.rows, self.columns)
        turn = np.radians(look.tilt_deg)
        self.turn = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])
        # The foot is ``base`` down the picture: the camera is turned up by so much, seen from the line to the foot.
        up = np.arctan((look.base - 0.5) * self.rows / self.focal) - np.radians(stage.above_deg)
        self.forward = np.array([0.0, np.cos(up), np.sin(up)])
        self.up = np.array([0.0, -np.sin(up), np.cos(up)])
        above = np.radians(stage.above_deg)
        self.place = stage.distance * np.array([0.0, -np.cos(above), np.sin(above)])

    def rays(self, x, y):
        """Directions, shape (3, …), through places of the picture."""
        seen = np.tensordot(self.turn.T, np.stack([x, y]) / self.half, 1)
        straight = seen
        for _ in range(12 if self.k else 0):
            straight = seen / (1.0 + self.k * (straight**2).sum(axis=0))
        right, down = straight * self.half / self.focal
        return (
            self.forward.reshape(3, *[1] * x.ndim)
            + np.stack([right, np.zeros_like(right), np.zeros_like(right)])
            - self.up.reshape(3, *[1] * x.ndim) * down
        )

    def seen(self, points):
        """Places in the picture, shape (2, n), of ``points`` (n, 3)."""
        off = points - self.place
        depth = off @ self.forward
        straight = np.stack([off[:, 0], -(off @ self.up)]) * self.focal / depth / self.half
        return self.turn @ (straight * (1.0 + self.k * (straight**2).sum(axis=0)) * self.half)


def bodies(stage):
    """Name → its solid as (radius, height) from the axis out and back."""
    high, wall, foot = stage.height, 0.03, stage.foot
    r = np.array([0.0, 0.03, 0.06, 0.1, 0.15, 0.25, 1.0])
    rounding = max(stage.rounding, 1e-6) * high
    pile = foot + high + rounding - np.hypot(high * r, rounding)
    found = {"pile": [*zip(r, pile, strict=True), (1.0, foot)]}
    top, wide = stage.high, stage.wide
    if stage.support == "disc":
        found["support"] = [(0.0, top), (wide, top), (wide, 0.0)]
    elif stage.support in ("tray", "dish"):
        found["support"] = [(0.0, foot), (wide - wall, foot), (wide - wall, top), (wide, top), (wide, 0.0)]
    elif stage.support == "funnel":
        tip = 0.97 * high
        neck = tip + 1.5 * stage.stem + 0.1
        found["support"] = [(0.0, tip), (stage.stem, tip), (stage.stem, neck), (stage.mouth, neck + stage.mouth + 0.05)]
    return found


def hit(profile, middle, camera, rays):
    """Distance along ``rays`` to the solid ``profile`` about x = ``middle``, infinite beside it, and its normal."""
    px, py, pz = camera.place - np.array([middle, 0.0, 0.0])
    dx, dy, dz = rays
    nearest = np.full(dx.shape, np.inf)
    normal = np.zeros_like(rays)
    for (r0, z0), (r1, z1) in pairwise(profile):
        if z0 == z1:
            with np.errstate(divide="ignore", invalid="ignore"):
                t = (z0 - pz) / dz
            radius = np.hypot(px + t * dx, py + t * dy)
            here = (t > 0) & (t < nearest) & (radius >= min(r0, r1)) & (radius <= max(r0, r1))
            nearest = np.where(here, t, nearest)
            normal[:, here] = np.array([[0.0], [0.0], [1.0]])
            continue
        grow = (r1 - r0) / (z1 - z0)
        start = r0 + grow * (pz - z0)
        a = dx * dx + dy * dy - (grow * dz) ** 2
        b = px * dx + py * dy - grow * start * dz
        c = px * px + py * py - start * start
        root = b * b - a * c
        for sign in (-1.0, 1.0):
            with np.errstate(divide="ignore", invalid="ignore"):
                t = (-b + sign * np.sqrt(root)) / a
            z = pz + t * dz
            here = (root >= 0) & (t > 0) & (t < nearest) & (z >= min(z0, z1)) & (z <= max(z0, z1))
            here &= start + grow * t * dz >= 0
            nearest[here] = t[here]
            x, y = px + t[here] * dx[here], py + t[here] * dy[here]
            out = np.stack([x, y, -grow * np.hypot(x, y)])
            normal[:, here] = out / np.maximum(np.sqrt((out**2).sum(axis=0)), 1e-9)
    return nearest, normal


def staged(stage, look):
    """Grey levels (rows, columns), 8 bit, of ``stage``; the plate is there if the look has a grey for it."""
    rng = np.random.default_rng(look.seed)
    camera = Camera(stage, look)
    rows, columns = camera.rows, camera.columns
    x, y = np.meshgrid(0.5 * np.arange(2 * columns) + 0.25 - columns / 2, 0.5 * np.arange(2 * rows) + 0.25 - rows / 2)
    pattern = np.repeat(np.repeat(texture(look, rng), 2, axis=0), 2, axis=1)
    grey, depth, pile = np.full(x.shape, look.backdrop), np.full(x.shape, np.inf), np.zeros(x.shape, dtype=bool)
    solids = bodies(stage)
    if look.plate is not None:
        wide = stage.plate_wide
        solids = {"plate": [(0.0, 0.0), (wide, 0.0), (wide, -0.15)], **solids}
    straight, shaken = camera.rays(x, y), camera.rays(*_shaken(x, y, stage, look, rng))
    for name, profile in solids.items():
        rays = shaken if name == "pile" else straight
        middle = stage.aside if name == "pile" or stage.support == "funnel" else 0.0
        t, normal = _hit_within(profile, middle, camera, rays, x, y, name != "plate", 4.0 * stage.rough * look.width)
        tone = {"plate": look.plate, "pile": look.pile}.get(name, look.pile if stage.tone is None else stage.tone)
        lit = np.clip(np.tensordot(LIGHT, normal, 1), 0.0, 1.0)
        body = tone * (1.0 - look.shading * (1.0 - lit)) + (0.0 if name == "plate" else pattern)
        share = np.where(t < depth, 1.0, 0.0)
        if name == "support" and stage.support == "dish":
            share *= np.where(camera.place[2] + np.where(t < depth, t, 0.0) * rays[2] > stage.high - 0.03, 1.0, GLASS)
        grey = share * body + (1.0 - share) * grey
        pile = pile & (share < 1.0) | ((share > 0.0) & (name == "pile"))
        depth = np.minimum(depth, t)
    if look.shadow:
        shift = (-round(2 * look.shadow_shift[1] * columns), round(2 * look.shadow_shift[0] * columns))
        shade = ndimage.gaussian_filter(
            ndimage.shift(pile.astype(float), shift, order=0), 2 * look.shadow_blur * columns
        )
        grey = np.where(pile, grey, grey * (1.0 - look.shadow * shade))
    return developed(grey.reshape(rows, 2, columns, 2).mean(axis=(1, 3)), look, rng)


def _hit_within(profile, middle, camera, rays, x, y, small, shift):
    """:func:`hit`, traced only near the solid where it is ``small``; ``shift`` [px]: by how much rays are moved."""
    rows = columns = slice(None)
    if small:
        turn = np.linspace(0.0, 2.0 * np.pi, 64)
        rings = [np.stack([middle + r * np.cos(turn), r * np.sin(turn), np.full(64, z)], axis=1) for r, z in profile]
        across, down = camera.seen(np.concatenate(rings))
        rows = slice(*np.searchsorted(y[:, 0], [down.min() - shift - 4.0, down.max() + shift + 4.0]))
        columns = slice(*np.searchsorted(x[0], [across.min() - shift - 4.0, across.max() + shift + 4.0]))
    t, normal = np.full(x.shape, np.inf), np.zeros_like(rays)
    t[rows, columns], normal[:, rows, columns] = hit(profile, middle, camera, rays[:, rows, columns])
    return t, normal


def _shaken(x, y, stage, look, rng):
    """x, y shifted as bodies of a twelfth of the pile's height shift its edge."""
    height = stage.height * stage.fill * look.width / 2.0
    field = ndimage.gaussian_filter(rng.normal(size=(2, *x.shape)), (0.0, *[height / 12.0] * 2))
    moved = field / field.std() * stage.rough * height
    return x + moved[0], y + moved[1]


def seen_deg(stage, look):
    """Angles [°] that a perfect eye has from the picture: lines through the cone's two contours between 20 % and 80 %
    of its height, against the plate's direction; None where the camera looks down on all of the cone."""
    camera = Camera(stage, look)
    apex = np.array([stage.aside, 0.0, stage.foot + stage.height])
    # The planes through camera and apex that touch the cone meet its foot's plane in the tangents from this point.
    share = (stage.foot - camera.place[2]) / (apex[2] - camera.place[2])
    x, y, _ = camera.place + share * (apex - camera.place) - apex
    if np.hypot(x, y) <= 1.0:
        return None
    found = []
    for sign in (-1.0, 1.0):
        turn = np.arctan2(y, x) + sign * np.arccos(1.0 / np.hypot(x, y))
        touch = np.array([stage.aside + np.cos(turn), np.sin(turn), stage.foot])
        points = apex + np.linspace(0.2, 0.8, 13)[:, None] * (touch - apex)
        across, down = camera.turn.T @ camera.seen(points)
        found.append((touch[0], float(np.degrees(np.arctan(abs(np.polyfit(across, down, 1)[0]))))))
    return np.array([angle for _, angle in sorted(found)])
