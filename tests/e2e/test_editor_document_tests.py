"""The panel *Tests* in the page: real tests in their own process, in Chromium."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

import pytest
from playwright.sync_api import Browser, Locator, expect

from tests.support.browser import EditorPage, editor_page
from tests.support.editor import Editor
from tests.support.limits import RUN_LIMIT
from tests.support.waiting_trials import WAITS

ENDED = RUN_LIMIT * 1000
BRANCHES = """if self.waited == 0:
    self.waited = 0.5
    if self.patience > 9:
        self.late = True
    1 / self.patience"""
PASSED, MISSED, FAILED = "Tests passed this line", "No test passed this line", "A test failed here"


LINES = WAITS.replace("self.waited += 0.5", BRANCHES)


@pytest.fixture
def unmeasured(monkeypatch: pytest.MonkeyPatch) -> None:
    """Tests in a process that is not measured already, by the tests of this project."""
    monkeypatch.delenv("COVERAGE_PROCESS_CONFIG", raising=False)


@pytest.fixture
def document() -> str:
    """The document that is open, which waits a while; other tests say another one."""
    return WAITS


@pytest.fixture
def path(root: Path, document: str) -> Path:
    path = root / "waits.xml"
    path.write_text(document)
    return path


@pytest.fixture
def shown(browser: Browser, robotless_editor: Editor, path: Path) -> Iterator[EditorPage]:
    with robotless_editor.opened(path), editor_page(browser, robotless_editor) as shown:
        shown.page.locator("hfsm-canvas .state").first.wait_for()
        yield shown


def below(shown: EditorPage) -> Locator:
    return shown.page.get_by_role("region", name="Panel below the canvas")


def open_tests(shown: EditorPage) -> Locator:
    """Show the panel of tests."""
    shown.page.locator("hfsm-canvas .state").first.wait_for()
    shown.press("Alt+x")
    return below(shown)


@pytest.mark.usefixtures("unmeasured")
def test_tests_run_beside_the_document_and_mark_what_they_pass(shown: EditorPage, path: Path) -> None:
    path.with_name("test_waits.py").write_text(
        'def test_it_waits(behavior):\n    behavior("waits.xml").advance(0.1)\n\n\n'
        'def test_it_is_done_at_once(behavior):\n    behavior("waits.xml").run_until("done", limit=0.2)\n'
    )
    panel = open_tests(shown)
    expect(panel).to_contain_text("2 tests, not run yet")
    panel.get_by_role("button", name="Run all tests").click()
    expect(panel).to_contain_text("1 passed, 1 failed", timeout=ENDED)
    expect(panel).to_contain_text("done was not reached")
    expect(panel).to_contain_text("1 of 2 states, 0 of 1 transitions, 3 of 3 lines passed")
    first = shown.page.locator("hfsm-canvas .state").first
    expect(first).to_have_attribute("aria-label", re.compile("by tests, a test failed here"))
    assert shown.violations(".bottom") == []
    panel.get_by_label("On canvas and code").uncheck()
    expect(first).not_to_have_attribute("aria-label", re.compile("tests"))
    path.write_text(WAITS.replace("+= 0.5", "+= 5"))  # by another program: the page follows
    expect(panel).to_contain_text("The document has changed since these tests ran")
    panel.get_by_role("button", name="Run it is done at once").click()
    expect(panel).to_contain_text("2 passed", timeout=ENDED)


def test_an_open_panel_shows_files_of_tests_that_come_and_go(shown: EditorPage, path: Path) -> None:
    panel = open_tests(shown)
    expect(panel).to_contain_text("No test names waits.xml yet")
    file = path.with_name("test_waits.py")
    file.write_text('def test_it_waits(behavior):\n    behavior("waits.xml").advance(0.1)\n')
    expect(panel).to_contain_text("1 test, not run yet")
    expect(panel).to_contain_text("it waits")
    file.unlink()
    expect(panel).to_contain_text("No test names waits.xml yet")


@pytest.mark.usefixtures("unmeasured")
@pytest.mark.parametrize("document", [LINES], ids=["with branches"])
def test_lines_that_tests_passed_are_marked_beside_the_code(shown: EditorPage, path: Path) -> None:
    page = shown.page
    path.with_name("test_waits.py").write_text(
        'def test_it_waits(behavior):\n    behavior("waits.xml").advance(0.1)\n\n\n'
        'def test_it_breaks(behavior):\n    behavior("waits.xml", parameters={"patience": 0}).advance(1)\n'
    )
    panel = open_tests(shown)
    panel.get_by_role("button", name="Run all tests").click()
    expect(panel).to_contain_text("1 passed, 1 failed", timeout=ENDED)
    gaps = panel.get_by_role("list", name="Not passed yet")
    expect(gaps.get_by_role("button")).to_have_text(
        [
            re.compile("waiting 3 of 5 lines passed; a test failed in its code"),
            re.compile("done never entered"),
            re.compile("enough never fired: its condition was evaluated [0-9]+ times, and was never true"),
        ]
    )
    gaps.get_by_role("button", name=re.compile("waiting")).click()
    code = page.get_by_role("textbox", name="Code of the state waiting")
    expect(code).to_be_focused()
    expect(page.locator(".cm-activeLine")).to_contain_text("1 / self.patience")
    marks = page.locator(".cm-tested")
    expect(marks).to_have_count(5)
    said = [each.get_attribute("title") for each in marks.all()]
    assert said == [PASSED, PASSED, PASSED, MISSED, FAILED]
    lines = "3 of 5 lines, not line 4, and failed in line 5"
    expect(code).to_have_attribute("aria-description", re.compile(lines))
    assert shown.violations(".bottom") == []
    shown.press("End")
    page.keyboard.insert_text("  # once")  # one step to undo, however slow the machine
    expect(marks).to_have_count(0)  # they are about another text
    expect(code).not_to_have_attribute("aria-description", re.compile("lines"))
    shown.press("Control+z")
    expect(marks).to_have_count(5)
    shown.press("x", "Backspace")  # before the server has heard of it
    expect(marks).to_have_count(5)
    panel.get_by_label("On canvas and code").uncheck()
    expect(marks).to_have_count(0)


IMPORTING = """<VisualHFSM><SubAutomata id="1" idFather="0"><state id="1" initial="true"><posx>100</posx><posy>100</posy>
<name>top</name><idSubautomataSon>2</idSubautomataSon></state></SubAutomata>
<SubAutomata id="2" idFather="1"><import>parts/waits.xml</import></SubAutomata></VisualHFSM>"""


@pytest.mark.usefixtures("unmeasured")
@pytest.mark.parametrize("document", [IMPORTING], ids=["importing"])
def test_lines_that_tests_passed_are_marked_beside_imported_code(shown: EditorPage, path: Path) -> None:
    page = shown.page
    imported = path.parent / "parts" / "waits.xml"
    imported.parent.mkdir()
    imported.write_text(LINES)
    path.with_name("test_top.py").write_text(
        'def test_it_waits(behavior):\n    behavior("waits.xml").advance(0.1)\n'
    )
    panel = open_tests(shown)
    panel.get_by_role("button", name="Run all tests").click()
    expect(panel).to_contain_text("1 passed", timeout=ENDED)
    gaps = panel.get_by_role("list", name="Not passed yet")
    gaps.get_by_role("button", name=re.compile("waiting")).click()
    code = page.get_by_role("textbox", name="Code of the state waiting")
    expect(code).to_be_focused()
    expect(code).to_have_attribute("aria-readonly", "true")
    expect(page.locator(".cm-tested.missed")).to_have_count(1)
    expect(page.locator(".cm-tested.passed")).to_have_count(4)
    imported.write_text(WAITS)  # other code
    expect(page.locator(".cm-tested")).to_have_count(0)
