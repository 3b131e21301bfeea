"""What the tests of the editor's page share."""

from __future__ import annotations

import shutil
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from playwright.sync_api import Browser

from naoserver.fake import FakeRobot
from tests.support.browser import EditorPage, chromium_on_demand, editor_page, open_alone, pages_in_turn
from tests.support.editor import DOCUMENT, Editor, editor, shared_checks
from tests.support.expecting import awaited_elements
from tests.support.monitor import editor_beside, editor_without_robot, monitor_page
from tests.support.processes import REPOSITORY
from tests.support.robot_server import ServedRobot, served
from visualhfsm.project._editing.undo_stack import MERGE_WITHIN


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


@pytest.fixture(scope="module")
def shared_root(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder in which the editor of a file opens and saves documents."""
    root = tmp_path_factory.mktemp("shared") / "root"
    root.mkdir()
    return root


@pytest.fixture
def root(shared_root: Path) -> Iterator[Path]:
    """The same folder, which is empty when a test begins."""
    yield shared_root
    for each in shared_root.iterdir():
        shutil.rmtree(each) if each.is_dir() and not each.is_symlink() else each.unlink()


@pytest.fixture
def document() -> str:
    """The content of the document that is open, with two states, `wait` and `go`; others say another one."""
    return DOCUMENT


@pytest.fixture
def path(root: Path, document: str) -> Path:
    """The document that is open."""
    path = root / "walk.xml"
    path.write_text(document, "utf-8")
    return path


@pytest.fixture
def behaviors(root: Path) -> Path:
    """The folder of the editor with the behaviors of the paper."""
    for name in ("dance_and_follow", "dance", "follow_ball"):
        shutil.copy(REPOSITORY / "behaviors" / f"{name}.xml", root)
    return root


@pytest.fixture(scope="module")
def running(shared_root: Path) -> Iterator[Editor]:
    """The editor of a file."""
    with editor(shared_root) as running:
        yield running


@pytest.fixture(scope="module")
def next_page(browser: Browser, running: Editor) -> Iterator[Callable[[], EditorPage]]:
    """Returns the page of the next test of a file, which is that of the others unless one of them has spent it."""
    with pages_in_turn(browser, running) as next_page:
        yield next_page


@pytest.fixture
def shown(next_page: Callable[[], EditorPage], path: Path) -> Iterator[EditorPage]:
    """The page of a file, which shows the document of the test alone."""
    shown = next_page()
    with open_alone(shown, path):
        yield shown


@pytest.fixture
def start_page(next_page: Callable[[], EditorPage], behaviors: Path) -> Iterator[EditorPage]:
    """The start page of the editor of a file, which has the behaviors of the paper in its folder."""
    shown = next_page()
    with open_alone(shown):
        yield shown


@pytest.fixture
def opened(running: Editor, path: Path) -> Iterator[Editor]:
    """The editor of a file with the document of a test, for tests that open their windows themselves."""
    with running.opened(path):
        yield running


@pytest.fixture
def merge_within() -> float:
    """Within how many seconds like changes are one step; tests that count steps say it."""
    return MERGE_WITHIN


@pytest.fixture
def own_editor(root: Path, path: Path, merge_within: float) -> Iterator[Editor]:
    """An editor of the test alone, with the document."""
    with editor(root, merge_within=merge_within) as running, running.opened(path):
        yield running


@pytest.fixture
def own(browser: Browser, own_editor: Editor) -> Iterator[EditorPage]:
    """The page of a test that needs its own one."""
    with editor_page(browser, own_editor) as own:
        own.page.locator("hfsm-canvas .state").first.wait_for()
        yield own


@pytest.fixture(scope="module")
def robot() -> Iterator[ServedRobot]:
    """The fake robot of a file."""
    with served(FakeRobot()) as robot:
        yield robot


@pytest.fixture(scope="module")
def robot_editor(shared_root: Path, robot: ServedRobot) -> Iterator[Editor]:
    """The editor of a file beside its robot, whose tests have a page each: a run leaves traces in its page."""
    with editor_beside(robot, shared_root) as running:
        yield running


@pytest.fixture(scope="module")
def robotless_editor(shared_root: Path) -> Iterator[Editor]:
    """The same in a realm without a robot."""
    with editor_without_robot(shared_root) as running:
        yield running


@pytest.fixture
def followed(robot_editor: Editor, robot: ServedRobot, path: Path) -> Iterator[Editor]:
    """The editor beside the robot with the document of a test, whose run ends with the test."""
    with robot_editor.opened(path):
        yield robot_editor
    robot.assembly.gate.reset(resume=True)


@pytest.fixture
def live_page(browser: Browser, followed: Editor) -> Iterator[EditorPage]:
    """The page beside the robot, once it shows the document of the test."""
    with monitor_page(browser, followed) as live_page:
        yield live_page
