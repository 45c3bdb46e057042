"""Data sets poured by LIGGGHTS with something added there that no file states, judged like any other: ``make foreign``.

The made-up laboratory of ``doe/validation/laboratories/trefoils`` with another engine: every pour is exported as
``explorer export`` writes it, the addition is made in LIGGGHTS's own input, and only where bodies come to rest is read.
The laboratory has no balance: it hands out no discharge times and no mass that stays in the funnel. A follow-up is
poured by LIGGGHTS too. Rows are those of ``explorer validate-diagnosis``, in ``assets/validation/foreign/sets.jsonl``.
"""

import dataclasses
import math
import sys
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from doe.declared.budget import Budget
from doe.store import Store
from doe.validation.campaign import Answers, CampaignOrder, measured_strengths
from doe.validation.laboratory import TREFOILS, LaboratoryPour, read_laboratory
from doe.validation.sets import append_rows, read_rows
from doe.validation.truth import REPLICATES, Case, Truth, drawn_theta
from doe.validation.work_place import WorkPlace
from explorer.export.deck import deck_of
from explorer.export.liggghts import INPUT, write_liggghts
from explorer.export.run import run_liggghts
from solver import EFFECTS, Job, observe_scan, scanned_pile

OUT = Path("assets/validation/foreign")
ROOT = 7
"""Of the sets, their parameters and seeds."""
SJKR = "fix cohesion all property/global cohesionEnergyDensity peratomtypepair 2 {0} {1} {1} 0\n"
SPEED = "fix speed all property/global characteristicVelocity scalar 1.0\n"


def nothing(deck, turned):
    """As it was exported."""
    return deck


def rolling(friction):
    """epsd2 at every contact."""
    return lambda deck, turned: dataclasses.replace(deck, rolling_friction=friction)


def tilted(degrees):
    """Gravity turned as by a plate that is lower towards +x by so much; a turned rig sees it the other way."""

    def changed(deck, turned):
        angle = math.radians(-degrees if turned else degrees)
        size = math.hypot(*deck.gravity)
        return dataclasses.replace(deck, gravity=(size * math.sin(angle), 0.0, -size * math.cos(angle)))

    return changed


def heavier(share):
    """Bodies of another density, of which as much is weighed out: the fewer, the heavier."""

    def changed(deck, turned):
        clumps = [
            dataclasses.replace(c, mass=share * c.mass, inertia=share * c.inertia, density=share * c.density)
            for c in deck.clumps
        ]
        # Spread over the whole feed, so that as much mass enters per second.
        kept = np.round(np.linspace(0, deck.bodies - 1, round(deck.bodies / share))).astype(int)
        entries = {f.name: getattr(deck.entries, f.name)[kept] for f in dataclasses.fields(deck.entries)}
        return dataclasses.replace(deck, clumps=tuple(clumps), entries=type(deck.entries)(**entries))

    return changed


@dataclass(frozen=True)
class Recipe:
    """What one set has. ``label``: its right answer; ``deck``: what is changed before, and ``text`` in the input."""

    label: str
    what: str
    deck: Callable = nothing
    text: Callable[[str], str] = str

    @property
    def kind(self):
        """As ``validate-diagnosis`` counts it."""
        return "effect" if self.label in EFFECTS else "outside" if self.label else "null"


def cohesive(density, at_walls):
    """Simplified JKR cohesion between bodies, and at walls, J/m³."""

    def changed(text):
        text = text.replace("tangential history", "tangential history cohesion sjkr")
        return text.replace("fix youngs", SJKR.format(density, at_walls) + "fix youngs", 1)

    return changed


def linear(text):
    """Hooke's springs for Hertz's."""
    return text.replace("model hertz", "model hooke").replace("fix youngs", SPEED + "fix youngs", 1)


RECIPES = (
    Recipe("", "nothing"),
    Recipe("", "nothing"),
    Recipe("rolling_resistance", "rolling_friction epsd2, 0.12", rolling(0.12)),
    Recipe("rolling_resistance", "rolling_friction epsd2, 0.25", rolling(0.25)),
    # 4e5 J/m3 shifts what is handed out by less than 3 standard errors: discharge times, which show it, are not.
    Recipe("adhesion_sjkr", "cohesion sjkr, 1e6 J/m3", text=cohesive(1e6, 1e6)),
    Recipe("density_error", "bodies heavier by a quarter", heavier(1.25)),
    Recipe("plate_tilt", "gravity turned by 4 degrees", tilted(4.0)),
    Recipe("linear_spring", "model hooke", text=linear),
    # The library's acts at walls as well.
    Recipe("bodies_stick", "cohesion sjkr between bodies alone, 1e6 J/m3", text=cohesive(1e6, 0)),
)


class ForeignAnswers(Answers):
    """The laboratory whose pours are made by LIGGGHTS."""

    def measured(self, truth, conditions, occasion="", pours=REPLICATES):
        """``pours`` of the recipe of ``truth`` in each condition."""
        recipe = RECIPES[truth.case.number]
        return {
            c.name: [self.poured(recipe, c, order) for order in self.orders(truth, c, range(pours), occasion)]
            for c in conditions
        }

    def orders(self, truth, condition, numbers, occasion=""):
        """As without an effect: it acts in LIGGGHTS alone."""
        plain = dataclasses.replace(truth, effects=(), case=dataclasses.replace(truth.case, kind="null", label=""))
        return super().orders(plain, condition, numbers, occasion)

    def poured(self, recipe, condition, order):
        """One pour: what lies on the plate."""
        queue = deque([Job(order.scene, order.seed)])
        ((_, record),) = self.place.pool.run_queue(queue, [order.scene])
        deck = recipe.deck(deck_of(record, order.scene.numerics.duration), condition.turned)
        with TemporaryDirectory() as folder:
            write_liggghts(Path(folder), deck)
            path = Path(folder) / INPUT
            path.write_text(recipe.text(path.read_text()))
            frame = run_liggghts(Path(folder)).final
        centre, radius, owner = on_the_plate(order.scene, deck, frame)
        pile = scanned_pile(order.scene, centre, radius, owner)
        read = observe_scan(pile, order.scene, dict.fromkeys(self.laboratory.readings))
        return LaboratoryPour({name: float(x) for name, x in read.items()}, centre, radius)


def on_the_plate(scene, deck, frame):
    """Centre, radius and body of the spheres that have run out, of bodies that are wholly inside the domain."""
    owner = np.repeat(np.arange(deck.bodies), [len(deck.members(b)) for b in range(deck.bodies)])
    members = np.bincount(owner)
    low = np.bincount(owner, frame.position[:, 2]) / members < scene.rig.outlet_height
    kept = low[owner] & (np.abs(frame.position[:, :2]).max(axis=1) < scene.rig.domain_half_width)
    # A body that is half outside the domain is out.
    kept &= (np.bincount(owner[kept], minlength=deck.bodies) == members)[owner]
    return frame.position[kept], frame.radius[kept], owner[kept]


def main(store, numbers):
    """Judge the sets ``numbers`` that are not there yet."""
    for folder in (OUT, Path(store).parent):
        folder.mkdir(parents=True, exist_ok=True)
    path, laboratory = OUT / "sets.jsonl", read_laboratory(TREFOILS)
    known = {row.number for row in read_rows(path)}
    with WorkPlace(Store(Path(store)), 1) as place:
        order = CampaignOrder(OUT, 1)
        strengths = measured_strengths(order, laboratory, place, print)
        answers = ForeignAnswers(laboratory, strengths, place, Budget())
        for number in sorted(set(numbers) - known):
            recipe = RECIPES[number]
            case = Case(ROOT, number, recipe.kind, recipe.label)
            theta = drawn_theta(strengths.declared, np.random.default_rng([ROOT, number]))
            named = recipe.label if recipe.kind == "effect" else ""
            truth = Truth(case, theta, ((named, ()),) if named else ())
            data = answers.measured(truth, laboratory.declared.conditions)
            rows = [answers.judged(truth, data, offer) for offer in ("scalars", "scan")]
            append_rows(path, rows)
            for row in rows:
                print(f"{number}: {recipe.what}, {row.offer}: {row.verdict} ({row.answer})", flush=True)


if __name__ == "__main__":
    main(sys.argv[1], [int(one) for one in sys.argv[2:]] or range(len(RECIPES)))
