"""A linear world with known answers: d summaries, 3 calibrated parameters, 8 effects, two pairs of them at cosine 0.9.

    y = J theta + sum_k a_k s_k + e,   e ~ N(0, 1) per pour; six measured pours per set

Columns of J are orthogonal, 20 sigma (of the measured mean) per coded unit. s_k has a random part along J, which
recalibration takes up, and a part of 20 sigma per coded amplitude off J, where effects 0, 1 and 2, 3 are at cosine
0.9 and the
others in random directions. So the amplitude strength/20 shifts the data by `strength` sigma, projected and whitened.
"""

from collections import Counter
from dataclasses import dataclass

import numpy as np
from scipy import stats

from doe.diagnose.decision.decide import judge
from doe.diagnose.emulation.emulator import Block, Emulator, fit_emulator
from doe.diagnose.emulation.noise import LEAST_SHRINKAGE, PourNoise
from doe.diagnose.emulation.terms import base_candidates
from doe.diagnose.runs import BASE, Condition, Declared, Effect, Observed, Parameter, Runs

PARAMETERS, EFFECTS, REPLICATES, FULL = 3, 8, 6, 20.0
SIGMA = 1 / np.sqrt(REPLICATES)
OUTCOMES = ("right", "wrong", "ambiguous", "none known", "nothing")


@dataclass(frozen=True)
class Toy:
    """jacobian: (d, 3). off: (8, d) unit parts off J. signatures: (8, d), shift at coded amplitude 1."""

    declared: Declared
    jacobian: np.ndarray
    off: np.ndarray
    signatures: np.ndarray
    complement: np.ndarray

    @property
    def summaries(self):
        return len(self.jacobian)

    def measured(self, generator, shift):
        theta = generator.uniform(-0.3, 0.3, PARAMETERS)
        mean = self.jacobian @ theta + shift
        block = mean + generator.standard_normal((REPLICATES, self.summaries))
        return Observed((block,), (np.zeros(self.summaries),))

    def outside(self, generator, strength):
        """The shift by an effect that is in no list, in a random direction off J."""
        direction = self.complement @ generator.standard_normal(self.complement.shape[1])
        return strength * SIGMA * direction / np.linalg.norm(direction)

    def listed(self, effect, strength):
        return self.signatures[effect] * strength / FULL


def make_toy(summaries, seed):
    generator = np.random.default_rng(seed)
    q, _ = np.linalg.qr(generator.standard_normal((summaries, summaries)))
    jacobian, complement = q[:, :PARAMETERS] * FULL * SIGMA, q[:, PARAMETERS:]
    off = np.array([_unit(complement @ generator.standard_normal(summaries - PARAMETERS)) for _ in range(EFFECTS)])
    for one, twin in ((0, 1), (2, 3)):
        aside = _unit(off[twin] - off[twin] @ off[one] * off[one])
        off[twin] = 0.9 * off[one] + np.sqrt(1 - 0.81) * aside
    along = jacobian @ generator.uniform(-0.3, 0.3, (PARAMETERS, EFFECTS))
    declared = Declared(
        tuple(Parameter(f"p{i}", -1.0, 1.0) for i in range(PARAMETERS)),
        tuple(Effect(f"e{i}", (0.0,), (1.0,)) for i in range(EFFECTS)),
        (Condition("one", tuple(f"s{i}" for i in range(summaries))),),
    )
    return Toy(declared, jacobian, off, FULL * SIGMA * off + along.T, complement)


def known_emulator(toy, generator, df=40):
    """The emulator that knows the model and has estimated only the covariance of a pour, with `df` degrees of
    freedom.
    """
    d = toy.summaries
    covariance = stats.wishart(df, np.eye(d) / df).rvs(random_state=generator)
    covariance = covariance * np.where(np.eye(d), 1.0, 1 - LEAST_SHRINKAGE)
    linear = np.zeros((1, PARAMETERS + 1), dtype=np.int64)
    linear[0, -1] = 1
    coefficients = np.concatenate([np.zeros((1, d)), toy.jacobian.T, toy.signatures])
    noise = PourNoise(covariance, float(df), LEAST_SHRINKAGE, np.empty((0, d)))
    terms = len(coefficients)
    block = Block(
        coefficients=coefficients,
        information_inverse=np.zeros((terms, terms)),
        noise=noise,
        lack_of_fit=np.zeros(d),
        straying=np.zeros((EFFECTS, d), dtype=bool),
        excess=np.zeros((EFFECTS, d)),
        r2=np.ones(d),
        standardised_error=np.ones(d),
    )
    return Emulator(
        declared=toy.declared,
        base_exponents=base_candidates(PARAMETERS)[0],
        effect_exponents=(linear,) * EFFECTS,
        blocks=(block,),
        theta_low=-np.ones(PARAMETERS),
        theta_high=np.ones(PARAMETERS),
        low=(np.zeros(1),) * EFFECTS,
        high=(np.ones(1),) * EFFECTS,
    )


def simulated_runs(toy, generator, base, per_effect, curvature=0.0):
    """Noisy runs: `base` of the base model, `per_effect` of each effect, uniform in the box (amplitudes stratified).

    curvature: squares of parameters and amplitudes, as a share of the linear change.
    """
    effect = np.concatenate([np.full(base, BASE), np.repeat(np.arange(EFFECTS), per_effect)])
    n = len(effect)
    theta = generator.uniform(-1, 1, (n, PARAMETERS))
    amplitude = np.zeros((n, 2))
    strata = (np.arange(per_effect) + generator.uniform(0, 1, (EFFECTS, per_effect))) / per_effect
    amplitude[base:, 0] = generator.permuted(strata, axis=1).ravel()
    mean = true_mean(toy, theta, effect, amplitude[:, 0], curvature)
    return Runs(theta, effect, amplitude, (mean + generator.standard_normal((n, toy.summaries)),))


def true_mean(toy, theta, effect, amplitude, curvature=0.0):
    bent = theta + curvature * theta**2
    strength = np.where(effect == BASE, 0.0, amplitude - curvature * amplitude**2)
    return bent @ toy.jacobian.T + strength[:, None] * toy.signatures[effect]


def estimated_emulator(toy, generator, base, per_effect, curvature=0.0):
    runs = simulated_runs(toy, generator, base, per_effect, curvature)
    return fit_emulator(toy.declared, runs, (np.zeros(toy.summaries),))


def outcome(kind, truth):
    """Classify a verdict where `truth` names the effect (None: no effect, "outside": in no list)."""
    if kind == "no_missing_effect":
        return "nothing"
    if kind == "unexplained":
        return "none known"
    if kind.startswith("ambiguous"):
        return "ambiguous"
    return "right" if kind == f"effect:{truth}" else "wrong"


def rates(sets, summaries, strength, kind, emulate=known_emulator, seed=0, sets_per_emulator=1, bootstrap=500):
    """Count outcomes over sets; kind: "null", "listed" or "outside". A new toy and emulator every sets_per_emulator."""
    counts = Counter(dict.fromkeys(OUTCOMES, 0))
    for number in range(sets):
        generator = np.random.default_rng([seed, number])
        if number % sets_per_emulator == 0:
            toy = make_toy(summaries, [seed, number])
            emulator = emulate(toy, np.random.default_rng([seed, number, 1]))
        effect = int(generator.integers(EFFECTS))
        shift = {
            "null": lambda: np.zeros(summaries),
            "listed": lambda effect=effect, toy=toy: toy.listed(effect, strength),
            "outside": lambda toy=toy, generator=generator: toy.outside(generator, strength),
        }[kind]()
        verdict = judge(emulator, toy.measured(generator, shift), bootstrap=bootstrap, seed=number)
        counts[outcome(verdict.kind, f"e{effect}" if kind == "listed" else kind)] += 1
    return counts


def wilson(count, total, z=2.58):
    """Wilson's interval of a rate, 99 % by default (Wilson 1927)."""
    p = count / total
    centre = (p + z * z / (2 * total)) / (1 + z * z / total)
    half = z * np.sqrt(p * (1 - p) / total + z * z / (4 * total**2)) / (1 + z * z / total)
    return centre - half, centre + half


def _unit(vector):
    return vector / np.linalg.norm(vector)
