"""What the tests of the editor's page share."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import pytest
from playwright.sync_api import Browser

from tests.support.browser import browsers


@pytest.fixture(scope="package", autouse=True)
def open_browser() -> Iterator[Callable[[str], Browser]]:
    """The browsers of all tests in this folder, by name; each is started once."""
    # Opened before the checks of each file for leaks, and closed before tests that run an event loop themselves.
    with browsers() as open_browser:
        yield open_browser


@pytest.fixture(scope="module")
def browser(open_browser: Callable[[str], Browser], request: pytest.FixtureRequest) -> Browser:
    """A browser: Chromium, unless the tests are marked with `IN_EACH_BROWSER`."""
    return open_browser(getattr(request, "param", "chromium"))
