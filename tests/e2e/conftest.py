"""What the tests of the editor's page share."""

from __future__ import annotations

import shutil
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from playwright.sync_api import Browser

from tests.support.browser import EditorPage, chromium_on_demand, editor_page
from tests.support.editor import DOCUMENT, Editor, editor, shared_checks
from tests.support.expecting import awaited_elements
from tests.support.processes import REPOSITORY
from visualhfsm.project._editing.edited_document import MERGE_WITHIN


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
def root(tmp_path: Path) -> Path:
    """The folder in which the editor opens and saves files."""
    root = tmp_path / "root"
    root.mkdir()
    return root


@pytest.fixture
def path(root: Path) -> Path:
    """The document that is open, with two states, `wait` and `go`; other files open others."""
    path = root / "walk.xml"
    path.write_text(DOCUMENT, "utf-8")
    return path


@pytest.fixture
def merge_within() -> float:
    """Within how many seconds like changes are one step; tests that count steps say it."""
    return MERGE_WITHIN


@pytest.fixture
def running(root: Path, path: Path, merge_within: float) -> Iterator[Editor]:
    """An editor with the document."""
    with editor(root, path, merge_within=merge_within) as running:
        yield running


@pytest.fixture
def shown(browser: Browser, running: Editor) -> Iterator[EditorPage]:
    """The page, once it shows the document."""
    with editor_page(browser, running) as shown:
        shown.page.locator("hfsm-canvas .state").first.wait_for()
        yield shown


@pytest.fixture(scope="module")
def shared_root(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of the documents of tests that share a page."""
    root = tmp_path_factory.mktemp("shared") / "root"
    root.mkdir()
    return root


@pytest.fixture(scope="module")
def opened(browser: Browser, shared_root: Path) -> Iterator[EditorPage]:
    """The page that tests of a file share, which shows the document of one after the other: see `open_alone`."""
    with editor(shared_root) as running, editor_page(browser, running) as opened:
        yield opened


@pytest.fixture
def behaviors(root: Path) -> Path:
    """The folder of the editor with the behaviors of the paper."""
    for name in ("dance_and_follow", "dance", "follow_ball"):
        shutil.copy(REPOSITORY / "behaviors" / f"{name}.xml", root)
    return root


@pytest.fixture
def start_page(browser: Browser, behaviors: Path, merge_within: float) -> Iterator[EditorPage]:
    """The start page of an editor that has the behaviors of the paper in its folder."""
    with editor(behaviors, merge_within=merge_within) as running, editor_page(browser, running) as shown:
        shown.page.get_by_role("heading", name="Draw what your robot does").wait_for()
        yield shown
