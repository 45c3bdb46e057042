"""What browser tests share."""

import pytest

from tests.browser.pages import FLAGS


@pytest.fixture(scope="module")
def browser(chromium):
    """Headless Chromium; every test opens pages of its own in it."""
    from playwright.sync_api import sync_playwright

    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=chromium, args=FLAGS)
        yield browser
        browser.close()
