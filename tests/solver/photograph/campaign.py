"""A campaign of photographs as people take them: supports, funnels, lenses, cameras above and close by, light, codec.

Every picture draws all of it from a seed, so that one may have a tray, a bent lens and a camera above at once.
`python -m tests.solver.photograph.campaign FIRST LAST FILE.json` reads those seeds, prints the table of
`docs/laboratory.md` and keeps a row for every picture in the file; seeds that are there already are not read again, so
that parts of a set may be read one after another (2 s of one core a picture).
"""

import json
import sys
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from solver.photograph import PhotographedPile, Refusal, read_photograph
from tests.solver.photograph.rendered import Look, picture_of
from tests.solver.photograph.staged import FAR, Stage, seen_deg, staged

WRONG = 1.0
"""Degrees beyond the stated interval from which a flank is read wrong."""
READABLE = 1.0
"""Degrees by which a perfect eye may miss the pile's angle on a picture that a person could read."""
ABOVE = 3.0
"""Degrees above the plate from which a camera counts as one that looks down."""
STANDS_OUT = 20.0
"""Grey levels between the pile and a plate that is behind it."""


@dataclass(frozen=True)
class Shot:
    """One picture and what was read off it."""

    seed: int
    stage: Stage
    look: Look
    focal: float | None
    """What the file says of the lens [px]."""
    found: PhotographedPile | Refusal

    @property
    def camera(self) -> str:
        """Kind of camera, for the table."""
        if self.stage.above_deg > ABOVE:
            return "above by 4 … 8°" if self.stage.above_deg < 8.0 else "above by 8 … 20°"
        return "level" if self.stage.distance == FAR else "close by"

    @property
    def lens(self) -> str:
        """Kind of lens, for the table."""
        return "straight" if self.stage.lens == 0.0 else "barrel" if self.stage.lens < 0.0 else "pincushion"

    @property
    def readable(self) -> bool:
        """Whether a person could read it: a perfect eye has the angle, half of the height is not hidden, and seen from
        above the flanks stand out from the plate behind them."""
        stage, plate = self.stage, self.look.plate
        seen = seen_deg(stage, self.look)
        if seen is None or np.abs(seen - stage.angle_deg).max() > READABLE:
            return False
        hidden = (stage.high - stage.foot) / stage.height if stage.support == "tray" else 0.0
        stands_out = stage.above_deg < ABOVE or plate is None or abs(plate - self.look.pile) >= STANDS_OUT
        return hidden <= 0.5 and stands_out

    @property
    def read(self) -> bool:
        """Whether there is an angle."""
        return isinstance(self.found, PhotographedPile)

    @property
    def errors(self) -> np.ndarray:
        """Of left, right and mean [°]."""
        angles = self.found.angles
        return np.array([one.value_deg for one in (angles.left, angles.right, angles.mean)]) - self.stage.angle_deg

    @property
    def half(self) -> np.ndarray:
        """Half widths of their intervals [°]."""
        angles = self.found.angles
        return np.array([2.0 * one.error_deg for one in (angles.left, angles.right, angles.mean)])

    @property
    def wrong(self) -> bool:
        """Whether a flank is off by more than ``WRONG`` beyond its interval."""
        return self.read and bool((np.abs(self.errors) - self.half).max() > WRONG)

    @property
    def row(self) -> dict:
        """What is kept of it, as JSON types. Errors and half widths [°]: left, right, mean."""
        stage = self.stage
        what = {
            "seed": self.seed,
            "support": stage.support,
            "lens": self.lens,
            "camera": self.camera,
            "angle_deg": round(float(stage.angle_deg), 2),
            "above_deg": round(float(stage.above_deg), 2),
            "k": round(float(stage.lens), 3),
            "readable": bool(self.readable),
            "read": self.read,
            "wrong": self.wrong,
        }
        if isinstance(self.found, Refusal):
            return what | {"reason": str(self.found.reason), "detail": self.found.detail}
        numbers = {"errors_deg": self.errors, "half_deg": self.half}
        return what | {name: [round(float(one), 3) for one in of] for name, of in numbers.items()}


def any_shot(seed):
    """The stage, the look and what the file says of the lens, drawn from ``seed``."""
    rng = np.random.default_rng(seed)
    backdrop = rng.uniform(120, 220)
    contrast = rng.uniform(50, 0.8 * backdrop)
    dark = rng.random() < 0.75
    pile, backdrop = (backdrop - contrast, backdrop) if dark else (backdrop, backdrop - contrast)
    support = str(rng.choice(["plate", "disc", "tray", "dish", "funnel"]))
    angle = rng.uniform(10, 45)
    height = np.tan(np.radians(angle))
    lens = 0.0 if rng.random() < 0.7 else rng.choice([-1, 1]) * rng.uniform(0.03, 0.15)
    camera = rng.choice(["level", "above", "close"], p=[0.55, 0.3, 0.15])
    between = 0.5 * (pile + backdrop)
    plates = (None, pile, pile, min(backdrop + 25.0, 250.0), between)
    stage = Stage(
        angle_deg=angle,
        support=support,
        wide=rng.uniform(1.1, 1.6),
        high=height * (rng.uniform(0.1, 0.5) if support == "disc" else rng.uniform(0.15, 0.45)),
        tone=None if support in ("disc", "tray") or rng.random() < 0.5 else rng.uniform(0.5, 1.0) * pile,
        stem=rng.uniform(0.03, 0.08),
        mouth=rng.uniform(0.08, 0.5),
        rounding=rng.choice([0.0, 0.03, 0.06]),
        plate_wide=rng.choice([1.8, 2.5, 8.0, 8.0]),
        above_deg=rng.uniform(4, 20) if camera == "above" else rng.uniform(0, 1),
        distance=2.5 * 8.0 ** rng.random() if camera == "close" else FAR,
        lens=lens,
        fill=rng.uniform(0.35, 0.6),
        aside=rng.uniform(-0.05, 0.05),
        rough=rng.choice([0.0, 0.003, 0.006]),
    )
    tall = height * stage.fill * 0.5 / 0.62
    look = Look(
        width=int(rng.choice([500, 640, 800])),
        pile=pile,
        backdrop=backdrop,
        plate=plates[rng.integers(len(plates))],
        tilt_deg=rng.uniform(-4, 4),
        noise=rng.uniform(0.7, min(6.0, contrast / 12)),
        blur=rng.uniform(0.4, 1.3),
        slant=rng.uniform(-0.3, 0.3),
        falloff=rng.uniform(0, 0.2),
        shading=rng.uniform(0, 0.3),
        shadow=rng.uniform(0, 0.3 * contrast / backdrop) if dark else rng.uniform(0, 0.2),
        texture=rng.uniform(0, 0.08) * contrast,
        jpeg=int(rng.choice([60, 75, 92])),
        base=min(rng.uniform(0.66, 0.84), 0.9) if tall < 0.5 else 0.8,
        seed=int(rng.integers(1 << 30)),
    )
    return stage, look, stage.fill * look.width / 2.0 * stage.distance if rng.random() < 0.7 else None


def shot(seed):
    """The picture of ``seed``, read."""
    stage, look, focal = any_shot(seed)
    picture = replace(picture_of(staged(stage, look)), focal=focal)
    return Shot(seed, stage, look, focal, read_photograph(picture))


def summary(rows):
    """Numbers of pictures, of those that a person could read, that are read, and that are read wrong; root mean square
    error and median half width of the flanks' intervals [°]."""
    readable, read = [row for row in rows if row["readable"]], [row for row in rows if row["read"]]
    return {
        "pictures": len(rows),
        "readable": len(readable),
        "of these read": sum(row["read"] for row in readable),
        "read": len(read),
        "wrong": sum(row["wrong"] for row in rows),
        "rms": float(np.sqrt(np.mean([np.square(row["errors_deg"][:2]) for row in read]))) if read else 0.0,
        "half width": float(np.median([row["half_deg"][:2] for row in read])) if read else 0.0,
    }


def table(rows):
    """Lines of a Markdown table: all, and each support, lens and camera."""
    groups = {"all": rows}
    for key in ("support", "lens", "camera"):
        for name in sorted({row[key] for row in rows}):
            groups[name if key == "support" else f"{key} {name}"] = [row for row in rows if row[key] == name]
    lines = []
    for name, group in groups.items():
        found = summary(group)
        lines.append(
            f"| {name} | {found['pictures']} | {found['of these read']} of {found['readable']} | {found['read']} "
            f"| {found['wrong']} | {found['rms']:.2f} | {found['half width']:.2f} |"
        )
    return lines


def kept(seeds, path):
    """The rows of ``seeds``: those that the file ``path`` has, and the others, read now and added to it one by one."""
    rows = {row["seed"]: row for row in json.loads(path.read_text())} if path.exists() else {}
    for seed in seeds:
        if seed not in rows:
            rows[seed] = shot(seed).row
            lines = ",\n".join(json.dumps(rows[one], ensure_ascii=False) for one in sorted(rows))
            path.write_text(f"[\n{lines}\n]\n", encoding="utf-8")
    return [rows[seed] for seed in seeds]


if __name__ == "__main__":
    print("\n".join(table(kept(range(int(sys.argv[1]), int(sys.argv[2]) + 1), Path(sys.argv[3])))))
