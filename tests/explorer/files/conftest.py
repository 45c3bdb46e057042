"""What the tests of files from a browser share."""

import pytest


@pytest.fixture
def own_cache(tmp_path_factory, monkeypatch):
    """Fitted spheres are kept apart from those of other tests."""
    monkeypatch.setenv("REPOSE_CACHE", str(tmp_path_factory.mktemp("clumps")))
