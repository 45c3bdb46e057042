"""The rules of the architecture, read from the source itself.

Each rule is a function from one parsed file to its violations. It runs over every file of the repository, and
over a made-up file that breaks it, so that no rule can pass by finding nothing.
"""

import ast
import re
import tomllib
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cache, cached_property
from pathlib import Path

import numpy as np
import pytest
from scipy.sparse.csgraph import connected_components

ROOT = Path(__file__).parents[1]
PACKAGES = ("explorer", "doe", "solver")

MAY_IMPORT = {"explorer": {"explorer", "doe", "solver"}, "doe": {"doe", "solver"}, "solver": {"solver"}}

THIRD_PARTY_HOMES = {
    "viser": ("explorer/viewer/",),
    "rerun": ("explorer/recordings/",),
    "typer": ("explorer/cli.py", "explorer/commands/"),
    "taichi": ("solver/backend.py",),
    "distributed": ("solver/pours/dask_pool.py",),
}

# The rest of doe is statistics and must stay testable without Taichi.
DOE_PARTS_THAT_MAY_USE_THE_SOLVER = {
    "doe/designs/__init__.py": "lists designs of other packages beside its own, by the registry of the solver",
    "doe/store.py": "keeps raw pours, and reads observables off them",
    "doe/store_upkeep.py": "reads every raw pour of a store that is checked",
    "doe/run_records.py": "reads what the solver says of a run: whether its outcome is valid",
    "doe/pour_runner.py": "turns a row of a design into a batch of simulated worlds",
    "doe/studies/factors.py": "checks a factor's path and range against the declared parameters",
    "doe/studies/economy.py": "changes the numerical settings of a study's scene",
    "doe/studies/profile.py": "declares the forms of its keys, as files are read",
    "doe/target.py": "declares the forms of its keys, as files are read",
    "doe/studies/study.py": "reads a study file: its material, rig and insertion make a scene",
    "doe/stages/__init__.py": "lists stages of other packages beside its own, by the registry of the solver",
    "doe/studies/study_result.py": "says which outcomes are valid, and how well the clumps fit",
    "doe/measurement/": "a condition is a scene, and data and runs are read by the same functions",
    "doe/validation/": "laboratories that pour what the diagnosis is then asked about",
    "doe/declared/": "turns what is declared, and a point of a plan, into simulated worlds",
    "doe/diagnose/training_pours.py": "asks a rig for its symmetries",
    "doe/diagnose/candidate_experiments.py": "set-ups that a rig can do",
}

# In the order of the data: each file of the diagnosis may import from those before it.
DIAGNOSIS_FILES = (
    "result",
    "emulator",
    "posterior",
    "compared_features",
    "levels",
    "budget",
    "training_pours",
    "verdict",
    "confirm",
    "next_experiment",
    "candidate_experiments",
    "diagnosis",
)
# What a laboratory may not take of the diagnosis: the features, the noise model and the emulator that it is read with.
LABORATORY_FILES = ("doe/validation/laboratory.py", "doe/validation/scanner.py", "doe/validation/outside.py")

TI_INIT_HOME = "solver/backend.py"
MAX_LINES = 600
"""A file answers one question, usually in 100 to 500 lines."""
FEW_LINES, MOST_PIECES = 100, 3
"""Shorter files that only one file of their folder imports: each has to be a method, a plug-in or a process of its own,
or else a part of that neighbour. There may be fewer of them than today, never more."""
# A protocol whose file, or a file that it needs, knows those who keep it: the only circles of imports that there are.
CIRCLES_AROUND = {
    "doe/stages/stage.py": "a stage builds on what was found before it: a record with the result of every stage",
    "solver/laws/law.py": "a contact model holds one of the laws, and a law is asked about a contact model",
    "solver/pours/executor.py": "makes the executor that is asked for",
    "solver/rigs/rig.py": "a scene holds one of the rigs, and a rig is asked about a scene",
}
# Names that say nothing about what is inside.
EMPTY_NAMES = {"util", "utils", "helper", "helpers", "manager", "managers"}


@dataclass(frozen=True)
class Source:
    """One Python file: its path from the root, with forward slashes, and its text."""

    path: str
    text: str

    @property
    def package(self) -> str:
        return self.path.split("/")[0]

    @cached_property
    def tree(self) -> ast.Module:
        return ast.parse(self.text, filename=self.path)


@dataclass(frozen=True)
class Import:
    """One imported module, the names taken from it (none in `import a.b`) and the names bound in the file."""

    module: str
    names: tuple[str, ...]
    aliases: tuple[str, ...]

    @property
    def top(self) -> str:
        return self.module.split(".")[0]


@cache
def repository_sources(*folders: str) -> list[Source]:
    paths = sorted(path for folder in folders for path in (ROOT / folder).rglob("*.py"))
    return [Source(path.relative_to(ROOT).as_posix(), path.read_text(encoding="utf-8")) for path in paths]


def public_solver_names(text: str | None = None) -> set[str]:
    """`solver.__all__`, read without importing Taichi."""
    tree = ast.parse((ROOT / "solver/__init__.py").read_text(encoding="utf-8") if text is None else text)
    for node in tree.body:
        targets = node.targets if isinstance(node, ast.Assign) else [getattr(node, "target", None)]
        if any(isinstance(target, ast.Name) and target.id == "__all__" for target in targets):
            return set(ast.literal_eval(node.value))  # type: ignore[attr-defined]
    return set()


def imports(source: Source) -> Iterator[Import]:
    """Every import of a file, also inside functions, relative, or by a literal `import_module("…")`."""
    for node in ast.walk(source.tree):
        if isinstance(node, ast.Import):
            for alias in node.names:
                yield Import(alias.name, (), (alias.asname or alias.name.split(".")[0],))
        elif isinstance(node, ast.ImportFrom):
            names = tuple(alias.name for alias in node.names)
            bound = tuple(alias.asname or alias.name for alias in node.names)
            yield Import(absolute_module(source, node), names, bound)
        elif isinstance(node, ast.Call) and called_name(node) in {"import_module", "__import__"}:
            yield from (Import(str(arg.value), (), ()) for arg in node.args[:1] if isinstance(arg, ast.Constant))


def absolute_module(source: Source, node: ast.ImportFrom) -> str:
    if node.level == 0:
        return node.module or ""
    folders = source.path.split("/")[: -node.level]
    return ".".join([*folders, node.module] if node.module else folders)


def called_name(node: ast.Call) -> str:
    if isinstance(node.func, ast.Attribute):
        return node.func.attr
    return node.func.id if isinstance(node.func, ast.Name) else ""


def taichi_names(source: Source) -> set[str]:
    """Names that stand for Taichi's module in a file: `ti` from `import taichi as ti` or from the backend."""
    names: set[str] = set()
    for imported in imports(source):
        if imported.top == "taichi" and not imported.names:
            names.update(imported.aliases)
        if imported.module == "solver.backend":
            pairs = zip(imported.names, imported.aliases, strict=True)
            names.update(alias for name, alias in pairs if name in {"ti", "taichi"})
    return names


def uses_taichi(source: Source) -> bool:
    return bool(taichi_names(source)) or any(imported.top == "taichi" for imported in imports(source))


def imports_follow_the_arrows(source: Source) -> list[str]:
    allowed = MAY_IMPORT[source.package]
    wrong = {one.top for one in imports(source) if one.top in {*PACKAGES, "tests"} - allowed}
    return [f"{source.path}: {source.package} may not import {top}" for top in sorted(wrong)]


def third_party_stays_home(source: Source) -> list[str]:
    tops = {one.top for one in imports(source)}
    strays = [
        f"{source.path}: {top} may be imported only in {', '.join(homes)}"
        for top, homes in THIRD_PARTY_HOMES.items()
        if top in tops and not source.path.startswith(homes)
    ]
    if source.package != "solver" and taichi_names(source) and "taichi" not in tops:
        strays.append(f"{source.path}: Taichi, also through the backend, stays in solver")
    return strays


def only_the_backend_starts_taichi(source: Source) -> list[str]:
    if source.path == TI_INIT_HOME:
        return []
    modules = taichi_names(source)
    calls = [
        node.lineno
        for node in ast.walk(source.tree)
        if isinstance(node, ast.Attribute)
        and node.attr == "init"
        and isinstance(node.value, ast.Name)
        and node.value.id in modules
    ]
    taken = [one for one in imports(source) if one.top == "taichi" and "init" in one.names]
    return [f"{source.path}: ti.init belongs in {TI_INIT_HOME} only"] if calls or taken else []


def no_future_annotations_beside_taichi(source: Source) -> list[str]:
    future = any(one.module == "__future__" and "annotations" in one.names for one in imports(source))
    if future and uses_taichi(source):
        return [f"{source.path}: `from __future__ import annotations` breaks Taichi kernels"]
    return []


def doe_uses_public_solver_names(source: Source) -> list[str]:
    if source.package != "doe":
        return []
    used = [one for one in imports(source) if one.top == "solver"]
    if used and not source.path.startswith(tuple(DOE_PARTS_THAT_MAY_USE_THE_SOLVER)):
        return [f"{source.path}: only {', '.join(DOE_PARTS_THAT_MAY_USE_THE_SOLVER)} may import solver"]
    deep = [one.module for one in used if one.module != "solver" or not one.names]
    public = public_solver_names()
    private = [name for one in used for name in one.names if one.module == "solver" and name not in public]
    return [f"{source.path}: write `from solver import …`, not `{module}`" for module in deep] + [
        f"{source.path}: {name} is not in solver.__all__" for name in private
    ]


def diagnosis_flows_one_way(source: Source) -> list[str]:
    path = Path(source.path)
    if path.parent.as_posix() != "doe/diagnose" or path.stem not in DIAGNOSIS_FILES:
        return []
    later = DIAGNOSIS_FILES[DIAGNOSIS_FILES.index(path.stem) + 1 :]
    used = {one.module.split(".")[2] for one in imports(source) if one.module.startswith("doe.diagnose.")}
    return [f"{source.path}: {path.stem} comes before {name}" for name in later if name in used]


def a_laboratory_shares_no_code_with_the_diagnosis(source: Source) -> list[str]:
    if source.path not in LABORATORY_FILES:
        return []
    forbidden = ("doe.diagnose", "doe.measurement.features", "doe.measurement.scans", "doe.measurement.piles")
    used = {one.module for one in imports(source) if one.module.startswith(forbidden)}
    return [f"{source.path}: a laboratory may not import {module}" for module in sorted(used)]


def no_truth_within_reach_of_the_diagnosis(source: Source) -> list[str]:
    if not source.path.startswith(("doe/diagnose/", "doe/declared/")):
        return []
    used = {one.module for one in imports(source) if one.module.startswith("doe.validation")}
    return [f"{source.path}: the diagnosis may not import {module}, which knows the truths" for module in sorted(used)]


def files_stay_short(source: Source) -> list[str]:
    lines = len(source.text.splitlines())
    return [f"{source.path}: {lines} lines, more than {MAX_LINES}; split by concept"] if lines > MAX_LINES else []


def importers(sources: list[Source]) -> dict[str, set[str]]:
    """Path → paths of the files that import it, for types alone or when they are called included."""
    paths = {
        source.path.removesuffix(".py").removesuffix("/__init__").replace("/", "."): source.path for source in sources
    }
    found: dict[str, set[str]] = {source.path: set() for source in sources}
    for source in sources:
        for one in imports(source):
            files = {f"{one.module}.{name}" for name in one.names} & paths.keys()
            # A package of which files alone are taken is not itself asked.
            for module in files if len(files) == len(one.names) > 0 else files | ({one.module} & paths.keys()):
                if paths[module] != source.path:
                    found[paths[module]].add(source.path)
    return found


def pieces_of_a_neighbour(sources: list[Source]) -> list[str]:
    """Short files whose only importer is a file beside them; what a package lists in its `__init__` is a plug-in."""
    lines = {source.path: len(source.text.splitlines()) for source in sources}
    return sorted(
        f"{path}: a piece of {next(iter(users))}"
        for path, users in importers(sources).items()
        if len(users) == 1
        and Path(path).name != "__init__.py"
        and lines[path] < FEW_LINES
        and Path(next(iter(users))).parent == Path(path).parent
        and Path(next(iter(users))).name != "__init__.py"
    )


def circles_of_imports(sources: list[Source]) -> list[list[str]]:
    """Files that import each other in a loop."""
    users = importers(sources)
    paths = sorted(users)
    matrix = np.array([[user in users[path] for user in paths] for path in paths])
    _, numbers = connected_components(matrix, directed=True, connection="strong")
    found = [[path for path, one in zip(paths, numbers, strict=True) if one == number] for number in set(numbers)]
    return sorted(circle for circle in found if len(circle) > 1)


def names_say_something(source: Source) -> list[str]:
    parts = set(source.path.removesuffix(".py").lower().split("/"))
    return [f"{source.path}: {part} says nothing about what is inside" for part in parts & EMPTY_NAMES]


Rule = Callable[[Source], list[str]]

PACKAGE_RULES: tuple[Rule, ...] = (
    imports_follow_the_arrows,
    third_party_stays_home,
    only_the_backend_starts_taichi,
    no_future_annotations_beside_taichi,
    doe_uses_public_solver_names,
    diagnosis_flows_one_way,
    a_laboratory_shares_no_code_with_the_diagnosis,
    no_truth_within_reach_of_the_diagnosis,
)
EVERYWHERE_RULES: tuple[Rule, ...] = (files_stay_short, names_say_something)

VIOLATIONS: tuple[tuple[Rule, str, str], ...] = (
    (imports_follow_the_arrows, "solver/engine/world.py", "import doe"),
    (imports_follow_the_arrows, "solver/engine/world.py", "def f():\n    from explorer.live.session import Session"),
    (imports_follow_the_arrows, "doe/studies/campaign.py", "from explorer import cli"),
    (imports_follow_the_arrows, "doe/store.py", "import importlib\nimportlib.import_module('explorer.recordings')"),
    (imports_follow_the_arrows, "solver/rigs/funnel.py", "from ...doe import factors"),
    (imports_follow_the_arrows, "explorer/live/session.py", "from tests import conftest"),
    (third_party_stays_home, "explorer/live/session.py", "import viser.transforms as tf"),
    (third_party_stays_home, "explorer/viewer/app.py", "import rerun as rr"),
    (third_party_stays_home, "explorer/report/html.py", "from typer import echo"),
    (third_party_stays_home, "explorer/live/session.py", "import taichi as ti"),
    (third_party_stays_home, "doe/pour_runner.py", "from taichi.lang import field"),
    (third_party_stays_home, "solver/engine/world.py", "import taichi as ti"),
    (third_party_stays_home, "explorer/live/session.py", "from solver.backend import ti"),
    (only_the_backend_starts_taichi, "solver/engine/world.py", "import taichi as ti\nti.init(arch=ti.cpu)"),
    (only_the_backend_starts_taichi, "solver/engine/world.py", "from solver.backend import ti\nti.init()"),
    (only_the_backend_starts_taichi, "solver/engine/world.py", "from ..backend import ti as t\nstart = t.init"),
    (only_the_backend_starts_taichi, "tests/solver/test_world.py", "from taichi import init\ninit()"),
    (
        no_future_annotations_beside_taichi,
        "solver/engine/world.py",
        "from __future__ import annotations\nimport taichi as ti",
    ),
    (
        no_future_annotations_beside_taichi,
        "solver/laws/linear.py",
        "from __future__ import annotations\nfrom ..backend import ti",
    ),
    (doe_uses_public_solver_names, "doe/studies/campaign.py", "from solver import __all__"),
    (doe_uses_public_solver_names, "doe/pour_runner.py", "from solver.engine.world import World"),
    (doe_uses_public_solver_names, "doe/pour_runner.py", "import solver"),
    (doe_uses_public_solver_names, "doe/pour_runner.py", "from solver import _not_a_public_name"),
    (diagnosis_flows_one_way, "doe/diagnose/emulator.py", "from doe.diagnose.verdict import answer"),
    (
        a_laboratory_shares_no_code_with_the_diagnosis,
        "doe/validation/scanner.py",
        "from doe.measurement.features import features_of_record",
    ),
    (no_truth_within_reach_of_the_diagnosis, "doe/diagnose/diagnosis.py", "from doe.validation.truth import Truth"),
    (files_stay_short, "doe/anova.py", "x = 1\n" * (MAX_LINES + 1)),
    (names_say_something, "solver/utils.py", ""),
    (names_say_something, "tests/doe/helpers.py", ""),
    (names_say_something, "explorer/manager/__init__.py", ""),
)

ALLOWED: tuple[tuple[Rule, str, str], ...] = (
    (imports_follow_the_arrows, "explorer/live/session.py", "import doe\nimport solver\nimport numpy"),
    (imports_follow_the_arrows, "solver/rigs/funnel.py", "from ..shape import Shape"),
    (imports_follow_the_arrows, "doe/analysis/surface.py", "import solverlike"),
    (third_party_stays_home, "explorer/viewer/app.py", "import viser"),
    (third_party_stays_home, "explorer/cli.py", "import typer"),
    (third_party_stays_home, "solver/backend.py", "import taichi as ti"),
    (third_party_stays_home, "solver/engine/world.py", "from solver.backend import ti"),
    (only_the_backend_starts_taichi, TI_INIT_HOME, "import taichi as ti\nti.init()"),
    (only_the_backend_starts_taichi, "solver/engine/world.py", "from solver import backend\nbackend.init()"),
    (
        no_future_annotations_beside_taichi,
        "solver/scenes/scene.py",
        "from __future__ import annotations\nimport numpy",
    ),
    (doe_uses_public_solver_names, "explorer/live/session.py", "from solver.engine.world import World"),
    (diagnosis_flows_one_way, "doe/diagnose/verdict.py", "from doe.diagnose.posterior import Fit"),
    (
        a_laboratory_shares_no_code_with_the_diagnosis,
        "doe/validation/campaign.py",
        "from doe.diagnose.verdict import verdict_of",
    ),
    (no_truth_within_reach_of_the_diagnosis, "explorer/diagnosis/run.py", "from doe.validation.truth import Truth"),
    (files_stay_short, "doe/anova.py", "x = 1\n" * MAX_LINES),
    (names_say_something, "solver/shapes/solid.py", ""),
)


@pytest.mark.parametrize("rule", PACKAGE_RULES, ids=lambda rule: rule.__name__)
def test_packages_keep_the_rule(rule):
    assert [line for source in repository_sources(*PACKAGES) for line in rule(source)] == []


@pytest.mark.parametrize("rule", EVERYWHERE_RULES, ids=lambda rule: rule.__name__)
def test_all_files_keep_the_rule(rule):
    assert [line for source in repository_sources(*PACKAGES, "tests") for line in rule(source)] == []


def test_no_more_files_are_pieces_of_their_only_neighbour():
    found = pieces_of_a_neighbour(repository_sources(*PACKAGES))
    assert len(found) == MOST_PIECES, f"now {len(found)}; fewer: write that number down here; more:\n" + "\n".join(
        found
    )


def test_a_piece_of_a_neighbour_is_found_and_a_plug_in_is_not():
    sources = [
        Source("doe/fit.py", "from doe.fit_text import line"),
        Source("doe/fit_text.py", "line = 1"),
        Source("doe/shared.py", "x = 1"),
        Source("doe/one.py", "from doe import shared"),
        Source("doe/two.py", "import doe.shared"),
        Source("doe/designs/__init__.py", "from doe.designs import box_behnken"),
        Source("doe/designs/box_behnken.py", "x = 1"),
        Source("doe/method.py", "x = 1\n" * FEW_LINES),
        Source("doe/caller.py", "from doe.method import x"),
    ]
    assert pieces_of_a_neighbour(sources) == ["doe/fit_text.py: a piece of doe/fit.py"]


def test_only_a_protocol_and_those_who_keep_it_import_each_other():
    circles = circles_of_imports(repository_sources(*PACKAGES))
    others = [circle for circle in circles if not CIRCLES_AROUND.keys() & set(circle)]
    assert others == [], "data flow one way: move what both need to the file that stands below"
    assert CIRCLES_AROUND.keys() <= {path for circle in circles for path in circle}, "one less: strike it from the list"


def test_a_circle_through_types_and_calls_is_found():
    sources = [
        Source("doe/report.py", "from doe.run import Run"),
        Source("doe/run.py", "def run():\n    from doe.text import words"),
        Source("doe/text.py", "if TYPE_CHECKING:\n    from doe.report import Report"),
        Source("doe/command.py", "from doe.run import run"),
    ]
    assert circles_of_imports(sources) == [["doe/report.py", "doe/run.py", "doe/text.py"]]


def test_text_names_only_files_that_there_are():
    """A document or docstring that names a file of the packages, by its name or its path from any folder."""
    paths = [
        path.relative_to(ROOT).as_posix()
        for folder in (*PACKAGES, "tests", "examples")
        for path in (ROOT / folder).rglob("*.py")
    ]
    ends = {"/".join(parts[k:]) for path in paths for parts in [path.split("/")] for k in range(len(parts))}
    documents = [*ROOT.glob("*.md"), *(path for f in (*PACKAGES, "docs") for path in (ROOT / f).rglob("*.md"))]
    texts = {path.relative_to(ROOT).as_posix(): path.read_text(encoding="utf-8") for path in documents}
    texts |= {source.path: source.text for source in repository_sources(*PACKAGES)}
    named = {(path, name) for path, text in texts.items() for name in re.findall(r"(?<![\w/.*}])[\w/]+\.py\b", text)}
    assert sorted((path, name) for path, name in named if name not in ends | {"solver.py"}) == []


def test_tests_start_taichi_only_through_the_backend():
    sources = repository_sources("tests")
    assert [line for source in sources for line in only_the_backend_starts_taichi(source)] == []


@pytest.mark.parametrize(("rule", "path", "text"), VIOLATIONS)
def test_rule_reports_a_violation(rule, path, text):
    found = rule(Source(path, text))
    assert found
    assert all(line.startswith(path) for line in found)


@pytest.mark.parametrize(("rule", "path", "text"), ALLOWED)
def test_rule_accepts_what_is_allowed(rule, path, text):
    assert rule(Source(path, text)) == []


def test_every_rule_has_a_violation_to_catch():
    assert {rule for rule, _, _ in VIOLATIONS} == {*PACKAGE_RULES, *EVERYWHERE_RULES}


def test_the_walk_finds_every_package():
    assert {source.package for source in repository_sources(*PACKAGES)} == set(PACKAGES)


def test_public_names_are_read_in_both_spellings():
    assert public_solver_names('__all__ = ["World"]') == {"World"}
    assert public_solver_names('__all__: list[str] = ["Scene"]') == {"Scene"}
    assert public_solver_names("") == set()


def test_parts_that_may_use_the_solver_exist():
    missing = [path for path in DOE_PARTS_THAT_MAY_USE_THE_SOLVER if not (ROOT / path).exists()]
    assert missing == []


def test_every_declared_dependency_is_used():
    """One that nothing imports is installed by every user for nothing."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    extras = [name for extra, names in project["optional-dependencies"].items() if extra != "test" for name in names]
    declared = {re.match(r"[\w-]+", line)[0] for line in (*project["dependencies"], *extras)}
    modules = {"pillow": "PIL", "rerun-sdk": "rerun"}
    used = {found.top for source in repository_sources(*PACKAGES) for found in imports(source)}
    # pandas loads it by its name.
    used |= {"openpyxl"} if 'engine="openpyxl"' in (ROOT / "doe/table_file.py").read_text() else set()
    assert {name for name in declared if modules.get(name, name) not in used} == set()
