"""The page is opened in the browser of the tests of the editor, one for each file."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import pytest
from playwright.sync_api import Browser

from tests.e2e.conftest import browser
from tests.support.browser import chromium_on_demand

__all__ = ["browser"]


@pytest.fixture(scope="module", autouse=True)
def open_browser() -> Iterator[Callable[[], Browser]]:
    """The browser of the tests of a file, which is started once."""
    with chromium_on_demand() as start:
        yield start
