"""What all tests share: one Taichi runtime per session, and the rule for tests that need a browser."""

import os
import shutil

import pytest

CHROMIUM_NAMES = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable")
NO_CHROMIUM = f"no Chromium found (looked for {', '.join(CHROMIUM_NAMES)} on PATH)"


def find_chromium() -> str | None:
    """Path of the first installed Chromium, or None."""
    return next(filter(None, map(shutil.which, CHROMIUM_NAMES)), None)


def pytest_runtest_setup(item: pytest.Item) -> None:
    """Where there is no Chromium, skip `browser` tests; fail them if REPOSE_REQUIRE_BROWSER is set (CI)."""
    if item.get_closest_marker("browser") is None or find_chromium() is not None:
        return
    if os.environ.get("REPOSE_REQUIRE_BROWSER"):
        pytest.fail(f"{NO_CHROMIUM} and REPOSE_REQUIRE_BROWSER is set", pytrace=False)
    pytest.skip(NO_CHROMIUM)


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
