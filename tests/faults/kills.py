"""A study or a diagnosis that is killed again and again, against one that was left alone: `make faults`.

    python -m tests.faults.kills study --kills 20 --seed 1
    python -m tests.faults.kills diagnosis --kills 10
    python -m tests.faults.kills page --kills 10

Each kill is SIGKILL at a random moment: of the command, of one of its workers, of the page that has started it
(`tests.faults.page_host`; the command goes on alone then), or of all at once, as when the power fails. After each the
store is whole, every pour that was in it is in it with the same bits, and the command or page is started again with
``--resume``. In the end the result equals that of the unbroken run, to the last bit of every number.
"""

import argparse
import contextlib
import difflib
import hashlib
import json
import os
import random
import signal
import sqlite3
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass, field
from pathlib import Path

from doe.store_upkeep import bits

ROOT = Path(__file__).parents[2]
OF_THE_RUN = {"timing", "about", "versions", "reused", "wall_s", "seconds", "out", "run"}
"""Keys of a result that tell of the run, not of what it found: its folder and how many pours it made itself, too."""
MOST_POURS, LATEST = 6, 3.0
"""A command is killed at most so many new pours after its start, and so many seconds [s] later."""
VICTIMS = ("command", "worker", "all")


@dataclass(frozen=True)
class Order:
    """A module that leaves ``result`` in the folder it is given, or in one that it makes there."""

    arguments: tuple[str, ...]
    result: str
    victims: tuple[str, ...] = VICTIMS

    def found(self, folder: Path) -> Path:
        """The result in the output folder of ``folder``. Raises FileNotFoundError where there is none."""
        for file in (folder / "out").rglob(self.result):
            return file
        raise FileNotFoundError(folder / "out" / self.result)


ORDERS = {
    "study": Order(("explorer", "calibrate", "--headless", "--profile", "quick"), "result.json"),
    "diagnosis": Order(
        ("explorer", "diagnose", "trefoil_2", "--budget", "40", "--effects", "rolling_resistance,air_drag"),
        "diagnosis.json",
    ),
    "page": Order(("tests.faults.page_host",), "result.json", ("page", *VICTIMS)),
}


@dataclass
class Campaign:
    """What happened: kills by victim, and faults, which are none where all is well."""

    kills: dict[str, int]
    pours: int = 0
    faults: list[str] = field(default_factory=list)

    @property
    def line(self) -> str:
        killed = ", ".join(f"{number} of {victim}" for victim, number in self.kills.items())
        return (
            f"{sum(self.kills.values())} kills ({killed}), {self.pours} pours kept, {len(self.faults)} faults"
            + "".join(f"; {fault}" for fault in self.faults)
        )


def started(order: Order, folder: Path, *options: str) -> subprocess.Popen[bytes]:
    """The command at work in a session of its own, its output behind what is in ``folder/said.txt``."""
    out, store = folder / "out", folder / "pours.sqlite"
    command = [sys.executable, "-m", *order.arguments, "--out", str(out), "--store", str(store), *options]
    with (folder / "said.txt").open("ab") as said:
        return subprocess.Popen(command, cwd=ROOT, stdout=said, stderr=said, start_new_session=True)


def at_work(folder: Path) -> dict[str, list[int]]:
    """Processes that work on ``folder``, by what they are: "page", "command" and "worker" (those that pour)."""
    found: dict[str, list[int]] = {"page": [], "command": [], "worker": []}
    for place in Path("/proc").glob("[0-9]*/cmdline"):
        with contextlib.suppress(OSError):
            line = place.read_bytes()
            if str(folder / "out").encode() in line and b"python" in line.split(b"\0")[0]:
                found["page" if b"page_host" in line else "command"].append(int(place.parent.name))
    found["worker"] = [worker for command in found["command"] for worker in workers(command)]
    return found


def workers(command: int) -> list[int]:
    """The processes that pour for the process ``command``."""
    found = list[int]()
    with contextlib.suppress(OSError):
        for child in Path(f"/proc/{command}/task/{command}/children").read_text().split():
            # multiprocessing's resource tracker is a child, but none that pours.
            if b"spawn_main" in Path(f"/proc/{child}/cmdline").read_bytes():
                found.append(int(child))
    return found


def kept(store: Path) -> dict[str, str]:
    """Key → checksum of each raw pour. Raises sqlite3.DatabaseError for a store that is not whole."""
    if not store.exists():
        return {}
    with sqlite3.connect(store) as db:
        ((verdict,),) = db.execute("PRAGMA integrity_check")
        if verdict != "ok":
            raise sqlite3.DatabaseError(verdict)
        if not db.execute("SELECT * FROM sqlite_master WHERE name = 'pours'").fetchone():
            return {}  # killed before it had made the table
        return {key: hashlib.sha256(bits(raw)).hexdigest() for key, raw in db.execute("SELECT key, raw FROM pours")}


def found_in(result: Path) -> str:
    """What a result says, without what tells of the run."""

    def told(value: object) -> object:
        if isinstance(value, dict):
            return {name: told(entry) for name, entry in value.items() if name not in OF_THE_RUN}
        return [told(entry) for entry in value] if isinstance(value, list) else value

    return json.dumps(told(json.loads(result.read_text(encoding="utf-8"))), sort_keys=True, indent=1)


def killed(folder: Path, victim: str, draw: random.Random) -> bool:
    """Kill ``victim`` of those that work on ``folder``; False where there is none any more."""
    present = at_work(folder)
    try:
        if victim == "all":
            groups = {os.getpgid(one) for one in (*present["page"], *present["command"])}
            for group in groups:
                os.killpg(group, signal.SIGKILL)
            return bool(groups)
        os.kill(draw.choice(present[victim]), signal.SIGKILL)
    except (ProcessLookupError, IndexError):
        return False
    return True


def unbroken(order: Order, folder: Path) -> Path:
    """The result of a run that nobody disturbs."""
    folder.mkdir()
    if started(order, folder).wait():
        raise RuntimeError((folder / "said.txt").read_text())
    return order.found(folder)


def rows(store: Path) -> int:
    """Pours in the store."""
    with (
        contextlib.suppress(sqlite3.Error),
        contextlib.closing(sqlite3.connect(f"file:{store}?mode=ro", uri=True)) as db,
    ):
        return int(db.execute("SELECT count(*) FROM pours").fetchone()[0])
    return 0


def campaign(order: Order, folder: Path, kills: int, draw: random.Random) -> Campaign:
    """Run ``order`` in ``folder`` to its end through ``kills`` kills."""
    folder.mkdir()
    store, seen, story = folder / "pours.sqlite", dict[str, str](), Campaign(dict.fromkeys(order.victims, 0))
    itself = {"all", order.victims[0]}

    def look() -> None:
        now = kept(store)
        story.faults += [f"pour {key[:12]} is lost or another" for key in seen if now.get(key) != seen[key]]
        seen.update(now)

    process = started(order, folder)
    while sum(story.kills.values()) < kills:
        victim, enough = draw.choice(order.victims), rows(store) + draw.randint(0, MOST_POURS)
        while rows(store) < enough and process.poll() is None:
            time.sleep(0.05)
        time.sleep(draw.uniform(0.0, LATEST))
        if killed(folder, victim, draw):
            story.kills[victim] += 1
            print(f"{sum(story.kills.values())}: {victim}, {len(seen)} pours kept", flush=True)
            if victim in itself:
                process.wait()
        look()
        if process.poll() is None:
            continue
        if process.returncode == 0:
            # Finished before it was killed often enough: the rest of the kills meet a command that only reads.
            order.found(folder).unlink()
        elif process.returncode != -signal.SIGKILL:
            story.faults.append(f"the command ended with {process.returncode}")
            break
        process = started(order, folder, "--resume")
    if process.wait():
        story.faults.append(f"the last command ended with {process.returncode}")
    look()
    story.pours = len(seen)
    return story


def main() -> int:
    """Run one campaign; 1 if anything was lost or is another."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("order", choices=list(ORDERS))
    parser.add_argument("--kills", type=int, default=20)
    parser.add_argument("--seed", type=int, default=1)
    asked = parser.parse_args()
    order, draw = ORDERS[asked.order], random.Random(asked.seed)
    with tempfile.TemporaryDirectory() as place:
        story = campaign(order, Path(place, "killed"), asked.kills, draw)
        left_alone = unbroken(order, Path(place, "unbroken"))
        if not story.faults:
            results = [found_in(path).splitlines() for path in (left_alone, order.found(Path(place, "killed")))]
            if differing := list(difflib.unified_diff(*results, "unbroken", "killed", n=2, lineterm="")):
                print("\n".join(differing[:200]))
                story.faults.append("the result is another")
            alike = kept(Path(place, "unbroken/pours.sqlite")) == kept(Path(place, "killed/pours.sqlite"))
            story.faults += [] if alike else ["the pours are others"]
        if story.faults:
            print(Path(place, "killed/said.txt").read_text())
    print(f"{asked.order}, seed {asked.seed}: {story.line}")
    return 1 if story.faults else 0


if __name__ == "__main__":
    raise SystemExit(main())
