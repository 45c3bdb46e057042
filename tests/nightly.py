"""What is too long for CI: every slow test and every long target, part by part, with what came out of each.

``python -m tests.nightly`` (``make nightly``) runs all parts that fit into a night's 80 minutes on two cores and writes
``docs/nightly.md`` after each; ``--only PART`` (repeatable) runs that one, also one of those that are by hand only. The
exit code is 1 if a part failed.
"""

import argparse
import subprocess
import sys
import time
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).parents[1]
TABLE = ROOT / "docs/nightly.md"
HEAD = """# What is too long for CI, and how it last ended

`make nightly` runs all parts but those by hand, in at most 80 minutes on two cores, and writes this table: the last
line that each part printed. `python -m tests.nightly --only PART` runs one of them.

| part | when | minutes | commit | result |
|---|---|---|---|---|
"""
NOT_NIGHTLY = " (by hand)"
PYTEST = (sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider")
SLOW = (*PYTEST, "-m", "slow")
BOTH_CORES = (*SLOW, "-n", "2", "--dist")


@dataclass(frozen=True)
class Part:
    """One command, and whether it belongs to the night."""

    command: tuple[str, ...]
    nightly: bool = True


PARTS = {
    "solver": Part((*BOTH_CORES, "loadfile", "tests/solver", "--ignore=tests/solver/photograph")),
    "photographs": Part(
        (*SLOW, "tests/solver/photograph/test_campaign.py", "tests/solver/photograph/test_drum.py", "-k", "few or size")
    ),
    "photographs, 120 pictures and 400 outlines": Part(
        (*BOTH_CORES, "load", "tests/solver/photograph/test_campaign.py", "tests/solver/photograph/test_coverage.py"),
        nightly=False,
    ),
    "exports and laboratory": Part((*SLOW, "tests/explorer/export/test_paraview.py", "tests/explorer/laboratory")),
    "validation campaign, small": Part((*SLOW, "tests/doe/validation")),
    "other engines, short": Part((*PYTEST, "-m", "slow or not slow", "tests/peers/test_short_pour.py")),
    "statistics, reports and commands": Part(
        (
            *BOTH_CORES,
            "loadfile",
            "tests/doe/analysis",
            "tests/doe/test_store.py",
            "tests/explorer/commands",
            "tests/explorer/photograph",
            "tests/explorer/recordings",
            "tests/explorer/report",
            "tests/explorer/study",
            "tests/test_plugins.py",
        )
    ),
    "installed from a wheel": Part((*SLOW, "tests/test_installed.py")),
    "pages": Part((*SLOW, "tests/browser")),
    "page speed": Part((sys.executable, "-m", "tests.browser.page_speed")),
    "documents": Part((*SLOW, "tests/test_readme.py", "-k", "as_they_are_written")),
    "README, whole": Part((*SLOW, "tests/test_readme.py", "-k", "to_their_ends"), nightly=False),
    "a study killed 7 times": Part((sys.executable, "-m", "tests.faults.kills", "study", "--kills", "7")),
    "a study killed 20 times": Part(
        (sys.executable, "-m", "tests.faults.kills", "study", "--kills", "20"), nightly=False
    ),
    "fuzzing": Part((sys.executable, "-m", "tests.faults.fuzz", "--inputs", "100")),
    "a diagnosis killed 10 times": Part(
        (sys.executable, "-m", "tests.faults.kills", "diagnosis", "--kills", "10"), nightly=False
    ),
    "a page killed 10 times": Part(
        (sys.executable, "-m", "tests.faults.kills", "page", "--kills", "10"), nightly=False
    ),
    "memory over 10,000 pours": Part((sys.executable, "-m", "tests.faults.memory", "--pours", "10000"), nightly=False),
    "trefoils": Part((*SLOW, "tests/explorer/diagnosis/test_trefoils.py"), nightly=False),
    "other engines, 18 pours each": Part((*SLOW, "-s", "tests/peers/test_same_pile.py"), nightly=False),
    "benchmark": Part(
        (sys.executable, "-m", "explorer", "bench", "--table", "docs/benchmark.md", "--json", "docs/benchmark.json"),
        nightly=False,
    ),
    "pictures": Part((sys.executable, "-m", "tests.browser.pictures"), nightly=False),
}
"""In the order in which they run. Those that are not nightly take too long for it, or want an idle machine."""


@dataclass(frozen=True)
class Row:
    """How a part last ended."""

    part: str
    when: str
    minutes: str
    commit: str
    result: str

    @property
    def line(self) -> str:
        return f"| {' | '.join((self.part, self.when, self.minutes, self.commit, self.result))} |"


def rows(text: str) -> dict[str, Row]:
    """The rows of a table by part."""
    cells = [
        [cell.strip() for cell in line.strip("|").split("|")] for line in text.splitlines() if line.startswith("|")
    ]
    return {row[0].removesuffix(NOT_NIGHTLY): Row(*row) for row in cells[2:] if len(row) == 5}


def ended(name: str) -> tuple[Row, bool]:
    """Run a part; its row, and whether it ended well."""
    part, began = PARTS[name], time.monotonic()
    print(f"== {name}: {' '.join(part.command)}", flush=True)
    result = subprocess.run(part.command, cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    print(result.stdout, flush=True)
    minutes = (time.monotonic() - began) / 60.0
    said = [line.strip() for line in result.stdout.splitlines() if line.strip()]
    verdict = (said[-1] if said else "nothing said").replace("|", "/")
    if result.returncode:
        verdict = f"**exit code {result.returncode}**: {verdict}"
    commit = subprocess.run(("git", "rev-parse", "--short", "HEAD"), cwd=ROOT, capture_output=True, text=True)
    when = time.strftime("%Y-%m-%d %H:%M", time.gmtime())
    shown = name if part.nightly else name + NOT_NIGHTLY
    return Row(shown, when, f"{minutes:.1f}", commit.stdout.strip(), verdict), result.returncode == 0


def written(found: dict[str, Row]) -> str:
    """The document."""
    return HEAD + "".join(f"{found[name].line}\n" for name in PARTS if name in found)


def main() -> int:
    """Run what is asked for; 1 if something failed."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--only", action="append", choices=list(PARTS), default=[])
    asked = parser.parse_args().only or [name for name, part in PARTS.items() if part.nightly]
    well = True
    for name in asked:
        row, good = ended(name)
        well &= good
        found = rows(TABLE.read_text(encoding="utf-8")) if TABLE.exists() else {}
        TABLE.parent.mkdir(exist_ok=True)
        TABLE.write_text(written(found | {name: row}), encoding="utf-8")
    return 0 if well else 1


if __name__ == "__main__":
    sys.exit(main())
