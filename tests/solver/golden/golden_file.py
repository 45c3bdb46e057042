"""The golden file: digests of the bits of every case, on which machines they were taken, and what a difference means.

``golden.json``    physics, defaults of all parameters, and per kind of machine (instruction sets of the processor,
                   versions of Taichi and NumPy) the digest of every case; ``before``: the same of the physics before
``first_steps.npz``  state of each case after its first steps, and results of each bench test, for machines whose bits
                     are not known

``python -m tests.solver.golden.golden_file`` (``make golden``) records what is new. It refuses bits that changed under
the same number of the physics, and a raised number under which nothing changed. A bench test is recorded under the same
number: nothing is stored of it, and how it measures is no physics.
"""

import json
import platform
import re
import sys
import tempfile
from collections.abc import Sequence
from dataclasses import asdict, dataclass, field, replace
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from solver import backend
from solver.version import FITTING, PHYSICS

FILE = Path(__file__).with_name("golden.json")
FIRST_STEPS = Path(__file__).with_name("first_steps.npz")
TOLERANCE = 4e-12
"""On another processor. A change by one unit in the last place grows to 1e-12 rad/s of 5 rad/s over the first steps;
by the series of the velocity-dependent damper to 1.2e-12 between two processors."""
BENCH = "bench, "
"""How the names of bench tests begin."""
BENCH_TOLERANCE = 1e-5
"""Of a bench test's results on another processor, relative: where rounding moves the step at which something begins, a
quantity moves by a step's worth."""
INSTRUCTION_SETS = re.compile(r"sse|ssse|avx|fma|f16c|bmi|popcnt|movbe|adx|amx|neon|asimd|sve")

Digests = dict[str, str]
Numbers = dict[str, npt.NDArray[np.float64]]


class RefusalError(Exception):
    """The bits and the number of the physics do not belong together."""


@dataclass(frozen=True)
class Bits:
    """Digests of all cases on one kind of machine."""

    machine: dict[str, str]
    digests: Digests


@dataclass(frozen=True)
class Golden:
    """Contents of the file. ``defaults``: of every declared parameter, by path."""

    physics: int
    defaults: dict[str, Any]
    machines: tuple[Bits, ...] = ()
    before: "Golden | None" = None
    first_steps: Numbers = field(default_factory=dict)
    fitting: int = FITTING

    def on(self, machine: dict[str, str]) -> Digests | None:
        """The digests taken on such a machine, or None."""
        return next((bits.digests for bits in self.machines if bits.machine == machine), None)


def this_machine() -> dict[str, str]:
    """What the bits of a program may differ by."""
    cpuinfo = Path("/proc/cpuinfo")
    text = cpuinfo.read_text() if cpuinfo.exists() else ""
    found = re.search(r"^(?:flags|Features)\s*:\s*(.*)$", text, re.MULTILINE)
    flags = sorted(name for name in (found[1].split() if found else ()) if INSTRUCTION_SETS.match(name))
    instructions = " ".join([platform.machine(), *flags])
    return {"instructions": instructions, "taichi": version("taichi"), "numpy": version("numpy")}


def taken(folder: Path) -> Golden:
    """What the solver of today does; ``folder``: an empty one."""
    from tests.solver.golden import cases

    early, late = cases.everything(folder)
    return Golden(PHYSICS, cases.defaults(), (Bits(this_machine(), cases.digests(late)),), None, early)


def changed(one: dict[str, Any], other: dict[str, Any]) -> list[str]:
    """Names in both whose values differ."""
    return [name for name in one if name in other and one[name] != other[name]]


def apart(known: Numbers, now: Numbers) -> list[str]:
    """Cases in both whose first steps differ by more than ``TOLERANCE``, bench tests by ``BENCH_TOLERANCE``."""
    return [
        name
        for name in known
        if name in now
        and (
            known[name].shape != now[name].shape or (np.abs(now[name] - known[name]) > _slack(name, known[name])).any()
        )
    ]


def _slack(name: str, state: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    """``TOLERANCE`` of the largest value of each column, or of 1 SI unit if that is more; see ``BENCH_TOLERANCE``."""
    if name.startswith(BENCH):
        return np.asarray(BENCH_TOLERANCE * np.abs(state))
    slack: npt.NDArray[np.float64] = TOLERANCE * np.maximum(1.0, np.abs(state).max(axis=0))
    return slack


def contradiction(golden: Golden, now: Golden) -> str | None:
    """How a number and the bits of ``now``, taken on one machine, contradict each other; None: they do not."""
    found, what = _differing(golden, now)
    differing = [name for name in found if not name.startswith(BENCH)]
    if golden.on(now.machines[0].machine) is None and now.physics > golden.physics:
        return None  # what changed may show after the first steps only, and its bits are not known here
    line = at_odds("PHYSICS", golden.physics, now.physics, differing, what)
    if line is None and golden.on(now.machines[0].machine) is not None:
        shapes = [name for name in differing if name.startswith("shape")]
        line = at_odds("FITTING", golden.fitting, now.fitting, shapes, "member spheres")
    return line


def at_odds(version: str, recorded: int, now: int, differing: Sequence[str], what: str) -> str | None:
    """How a version and what it stands for contradict each other; None: both changed, or neither.

    ``differing`` names the cases whose ``what`` is not as recorded.
    """
    if now < recorded:
        return f"{version} is {now}, below the recorded {recorded}"
    if now > recorded and not differing:
        return f"{version} is {now} and was {recorded}, but nothing changed: put it back"
    if now == recorded and differing:
        return (
            f"{what} changed under the same {version} = {now}: {', '.join(differing)}. "
            f"Undo that, or raise {version} and record it (make golden)"
        )
    return None


def unrecorded(golden: Golden, now: Golden) -> str | None:
    """What the golden file does not hold yet, or holds for nothing; None: it is up to date."""
    if now.physics != golden.physics:
        return f"PHYSICS is {now.physics} and the golden file is of {golden.physics}: record it (make golden)"
    cases = {name for bits in golden.machines for name in bits.digests}
    names = set(golden.defaults) ^ set(now.defaults) | set(now.machines[0].digests) ^ cases
    if names:
        return f"in the golden file or in the program only: {', '.join(sorted(names))}; record it (make golden)"
    benches = _benches(golden, now)
    return f"measured otherwise than before: {', '.join(benches)}; record it (make golden)" if benches else None


def _benches(golden: Golden, now: Golden) -> list[str]:
    """Bench tests that measure otherwise."""
    return [name for name in _differing(golden, now)[0] if name.startswith(BENCH)]


def _differing(golden: Golden, now: Golden) -> tuple[list[str], str]:
    """Cases and defaults that differ, and by what they were compared."""
    (today,) = now.machines
    known = golden.on(today.machine)
    defaults = [f"default of {path}" for path in changed(golden.defaults, now.defaults)]
    if known is None:
        return apart(golden.first_steps, now.first_steps) + defaults, "first steps (this machine's bits are not known)"
    # A case that this machine has not recorded yet is compared like all of an unknown machine.
    others = apart({name: state for name, state in golden.first_steps.items() if name not in known}, now.first_steps)
    return changed(known, today.digests) + others + defaults, "bits"


def recorded(golden: Golden | None, now: Golden) -> Golden:
    """The golden file with ``now`` in it. Raises RefusalError where number and bits contradict each other."""
    if golden is None:
        return now
    if (line := contradiction(golden, now)) is not None:
        raise RefusalError(line)
    if now.physics > golden.physics:
        return replace(now, before=replace(golden, before=None, first_steps={}))
    (today,) = now.machines
    benches = _benches(golden, now)
    others = [
        replace(
            bits,
            digests={
                name: bits.digests[name] for name in bits.digests if name in today.digests and name not in benches
            },
        )
        for bits in golden.machines
        if bits.machine != today.machine
    ]
    return replace(now, machines=(today, *others), before=golden.before)


def read() -> Golden:
    """The golden file that is kept."""
    with np.load(FIRST_STEPS) as file:
        return replace(_golden(json.loads(FILE.read_text(encoding="utf-8"))), first_steps=dict(file))


def _golden(table: dict[str, Any]) -> Golden:
    machines = tuple(Bits(**bits) for bits in table["machines"])
    before = _golden(table["before"]) if table["before"] else None
    return Golden(table["physics"], table["defaults"], machines, before, fitting=table["fitting"])


def write(golden: Golden) -> None:
    """Replace the golden file."""
    table = asdict(replace(golden, first_steps={}))
    FILE.write_text(json.dumps(table, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")
    np.savez_compressed(FIRST_STEPS, allow_pickle=False, **golden.first_steps)


def of_today() -> Golden:
    """What the solver of today does, in a process in which Taichi has not started."""
    backend.init(threads=2)
    with tempfile.TemporaryDirectory() as folder:
        return taken(Path(folder))


def main() -> int:
    """Take all bits and record them; 1 where that is refused."""
    now = of_today()
    try:
        write(recorded(read() if FILE.exists() else None, now))
    except RefusalError as error:
        print(error, file=sys.stderr)
        return 1
    print(f"{FILE.name}: physics {now.physics}, {len(now.machines[0].digests)} cases")
    return 0


if __name__ == "__main__":
    sys.exit(main())
