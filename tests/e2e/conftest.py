"""What the tests of the editor's page share."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from playwright.sync_api import Browser

from tests.support.browser import EditorPage, chromium_on_demand, editor_page
from tests.support.editor import DOCUMENT, editor, shared_checks
from tests.support.expecting import awaited_elements


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


@pytest.fixture(scope="package", autouse=True)
def patience() -> Iterator[None]:
    """Expectations of elements that are awaited first."""
    with awaited_elements():
        yield


@pytest.fixture(scope="module")
def browser(open_browser: Callable[[], Browser]) -> Browser:
    """Chromium."""
    return open_browser()


@pytest.fixture
def shown(browser: Browser, tmp_path: Path) -> Iterator[EditorPage]:
    """The page with a document of two states, `wait` and `go`; other files show others."""
    root = tmp_path / "root"
    root.mkdir()
    file = root / "walk.xml"
    file.write_text(DOCUMENT, "utf-8")
    with editor(root, file) as running, editor_page(browser, running) as shown:
        shown.expect_states("wait", "go")
        yield shown
