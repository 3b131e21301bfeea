"""What the tests of the editor's page share."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import pytest
from playwright.sync_api import Browser

from tests.support.browser import chromium_on_demand
from tests.support.editor import shared_checks


@pytest.fixture(scope="package", autouse=True)
def open_browser() -> Iterator[Callable[[], Browser]]:
    """The browser of all tests in this folder, which is started once."""
    # Opened before the checks of each file for leaks, and closed before tests that run an event loop themselves.
    with chromium_on_demand() as open_browser:
        yield open_browser


@pytest.fixture(scope="package", autouse=True)
def checks() -> Iterator[None]:
    """The process in which all editors of this folder check their documents."""
    with shared_checks():
        yield


@pytest.fixture(scope="module")
def browser(open_browser: Callable[[], Browser]) -> Browser:
    """Chromium."""
    return open_browser()
