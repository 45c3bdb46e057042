"""What all tests share: one Taichi runtime per session, and the rule for tests that need an installed program."""

import os
import shutil

import pytest

from explorer.installation import CHROMIUM_NAMES

REQUIRE = {"liggghts": "REPOSE_REQUIRE_LIGGGHTS", "yade": "REPOSE_REQUIRE_YADE"}
"""Engines that `@pytest.mark.peers(engine)` may name, and the variables that make a missing one a failure."""
NO_CHROMIUM = f"no Chromium found (looked for {', '.join(CHROMIUM_NAMES)} on PATH)"


def find_chromium() -> str | None:
    """Path of the first installed Chromium, or None."""
    return next(filter(None, map(shutil.which, CHROMIUM_NAMES)), None)


def pytest_runtest_setup(item: pytest.Item) -> None:
    """Skip what needs a program that is not installed; fail it instead if REPOSE_REQUIRE_<PROGRAM> is set (CI)."""
    if item.get_closest_marker("browser") is not None and find_chromium() is None:
        skip_or_fail(NO_CHROMIUM, "REPOSE_REQUIRE_BROWSER")
    for marker in item.iter_markers("peers"):
        for engine in marker.args:
            if shutil.which(engine) is None:
                skip_or_fail(f"no {engine} found on PATH (Debian: apt install {engine})", REQUIRE[engine])


def skip_or_fail(reason: str, variable: str) -> None:
    """Fail with ``reason`` if the environment has ``variable``, skip otherwise."""
    if os.environ.get(variable):
        pytest.fail(f"{reason} and {variable} is set", pytrace=False)
    pytest.skip(reason)


@pytest.fixture(scope="session")
def taichi() -> None:
    """The session's one Taichi runtime: a second `ti.init` would kill the fields of the first."""
    # Imported here, so that tests of pure NumPy parts never load Taichi.
    from solver import backend

    # Two threads: results may not depend on the number, and one would hide an order that depends on it.
    backend.init(threads=2)


@pytest.fixture(scope="session")
def chromium() -> str:
    """Path of Chromium for tests marked `browser`; as root it needs `--no-sandbox`."""
    path = find_chromium()
    if path is None:
        pytest.fail(f"{NO_CHROMIUM}; mark the test `browser`, so that it is skipped", pytrace=False)
    return path
