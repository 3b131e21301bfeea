"""The page is opened as by the tests of the editor, in a browser for each file."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import pytest
from playwright.sync_api import Browser

from tests.e2e.conftest import browser, robotless_editor, root, shared_root
from tests.support.browser import chromium_on_demand
from tests.support.editor import shared_checks
from tests.support.expecting import awaited_elements

__all__ = ["browser", "robotless_editor", "root", "shared_root"]


@pytest.fixture(scope="module", autouse=True)
def open_browser() -> Iterator[Callable[[], Browser]]:
    """The browser of the tests of a file, which is started once."""
    with chromium_on_demand() as open_browser, shared_checks(), awaited_elements():
        yield open_browser
