"""Errors of a run stay where they happened: in the code, on the canvas, among the problems and in the bar."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from playwright.sync_api import expect

from tests.support.browser import Box, EditorPage, open_alone, saved
from tests.support.editor import Editor
from tests.support.monitor import DOCUMENT, status

ZERO = DOCUMENT.replace("count += 1\n", "count += 1\nif count &gt; 3:\n    count = 0.5 / (count - 4)\n")
GUARD = DOCUMENT.replace("count &gt; 1000000", "count &gt; 3 and missing.x &gt; 0")
AT_ONCE = DOCUMENT.replace("count += 1\n", "count += unknown\n")


@pytest.fixture(scope="module")
def running(robot_editor: Editor) -> Editor:
    return robot_editor


@pytest.fixture
def path(shared_root: Path, request: pytest.FixtureRequest) -> Path:
    """A document in a folder of its own: the page knows how the last run of a file has ended."""
    path = shared_root / str(request.node.name) / "walk.xml"
    path.parent.mkdir()
    return path


@pytest.fixture
def shown(
    next_page: Callable[[], EditorPage], path: Path, request: pytest.FixtureRequest
) -> Iterator[EditorPage]:
    """The page with the document of the test alone."""
    path.write_text(request.param)
    shown = next_page()
    with open_alone(shown, path):
        yield shown


@pytest.mark.parametrize("shown", [ZERO], indirect=True)
def test_an_error_stays_where_it_happened_until_the_code_changes(shown: EditorPage) -> None:
    page = shown.page
    shown.press("F5")
    expect(status(shown)).to_have_text("Ended: float division by zero in wait")
    expect(shown.state("wait")).to_have_class(re.compile(r"\bfailed\b"))
    expect(shown.state("wait")).to_have_attribute("aria-label", re.compile("error: ZeroDivisionError"))
    expect(shown.button("1 error")).to_be_visible()
    expect(page.locator("hfsm-canvas [aria-live]")).to_have_text(
        "walk ended: float division by zero in wait."
    )
    notice = page.locator(".notice.error")
    expect(notice).to_have_count(0)  # nothing is said twice

    at_line = page.locator(".live-bar").get_by_role("button", name="line 3")
    at_line.click()
    message = page.locator(".cm-failed")
    expect(message).to_have_text(re.compile("ZeroDivisionError: float division by zero$"))
    expect(page.locator(".cm-failedLine")).to_have_text("    count = 0.5 / (count - 4)")
    assert not shown.violations(".live-bar", "hfsm-code-panel", ".notices")

    shown.button("1 error").click()
    problem = page.get_by_role("list", name="Problems").get_by_role("button").first
    expect(problem).to_contain_text(re.compile(r"ZeroDivisionError: float division by zero.*last run"))
    assert not shown.violations("hfsm-problems")

    # It is about code that has not changed since.
    shown.edit_code()
    shown.press("Control+Home")
    shown.type("# why\n")
    expect(message).to_have_count(0)
    expect(shown.state("wait")).not_to_have_class(re.compile(r"\bfailed\b"))
    expect(at_line).to_have_count(0)
    expect(status(shown)).not_to_have_class(re.compile(r"\bfailed\b"))
    shown.press("Control+z")
    expect(message).to_be_visible()
    expect(at_line).to_be_visible()

    # The next run is another one.
    shown.press("F5")
    expect(page.locator(".cm-failed")).to_have_count(0)
    expect(status(shown)).to_have_text("Ended: float division by zero in wait")
    expect(notice).to_have_count(0)


@pytest.mark.parametrize("shown", [GUARD], indirect=True)
def test_an_error_in_a_condition_is_on_its_arc(shown: EditorPage) -> None:
    shown.press("F5")
    expect(status(shown)).to_contain_text("name 'missing' is not defined in many (wait → go)")
    expect(shown.transition("many")).to_have_class(re.compile(r"\bfailed\b"))
    expect(shown.state("wait")).not_to_have_class(re.compile(r"\bfailed\b"))


@pytest.mark.parametrize("shown", [AT_ONCE], indirect=True)
def test_a_run_that_fails_before_it_is_followed_says_so_in_the_bar(shown: EditorPage) -> None:
    shown.press("F5")
    expect(status(shown)).to_have_text("Ended: name 'unknown' is not defined in wait")
    shown.page.locator(".live-bar").get_by_role("button", name="line 1").click()
    expect(shown.page.locator(".cm-failed")).to_be_visible()


@pytest.mark.parametrize("shown", [DOCUMENT], indirect=True)
def test_a_refusal_is_over_when_what_was_refused_succeeds(shown: EditorPage) -> None:
    shown.state("wait").click()
    shown.edit_code()
    shown.press("Control+Home")
    shown.type("(")
    shown.press("F5")
    refused = shown.page.locator(".notice.error").filter(has_text="not valid Python")
    expect(refused).to_be_visible()
    shown.button("Start page").click()
    expect(refused).to_be_hidden()  # it is about the other document
    shown.page.get_by_role("tab", name="walk").click()
    expect(refused).to_be_visible()
    shown.page.get_by_role("textbox", name="Code of the state wait").click()
    shown.press("Control+Home", "Delete", "F5")
    expect(status(shown)).to_have_text("Running")
    expect(refused).to_have_count(0)


BELOW = DOCUMENT.replace("<name>look</name>", "<name>look</name><code>count += 1\nprint(f'{count}')</code>")


@pytest.mark.parametrize("shown", [BELOW], indirect=True)
def test_a_variable_of_the_automaton_above_is_explained_and_shared_by_a_click(shown: EditorPage) -> None:
    page = shown.page
    shown.press("F5")
    expect(status(shown)).to_have_text("Ended: count is a variable of walk, and wait has its own, in look")
    expect(shown.state("wait")).to_have_class(re.compile(r"\bfailed\b"))
    expect(shown.state("wait")).to_have_attribute("aria-label", re.compile("error: In look: "))
    page.locator(".live-bar").get_by_role("button", name="line 1").click()
    expect(page.locator(".cm-failed")).to_contain_text("write self.count in both")
    field = page.get_by_role("textbox", name="Code of the state look")
    write = page.locator(".cm-tooltip").get_by_role("button", name="Write self.count in both")
    shown.hover(field.locator(".cm-lintRange").first, shows=write)
    write.click()
    expect(field.locator(".cm-line").first).to_have_text("self.count += 1")
    expect(page.locator(".cm-failed")).to_have_count(0)
    shown.press("F5")
    expect(status(shown)).to_have_text("Running")


@pytest.mark.parametrize("shown", [DOCUMENT], indirect=True)
def test_a_run_belongs_to_its_document_also_when_that_is_saved_under_another_name(shown: EditorPage) -> None:
    shown.press("F5")
    expect(status(shown)).to_have_text("Running")
    shown.press("Shift+F5")
    expect(status(shown)).to_have_text("Ended: stopped")
    shown.press("Control+Shift+s")
    name = shown.page.get_by_role("dialog").get_by_label("Name")
    name.fill("class demo")
    name.press("Enter")
    expect(shown.page.get_by_role("tab", name="class demo")).to_be_visible()
    expect(status(shown)).to_have_text("Ended: stopped")
    expect(shown.page.locator(".live-bar").get_by_role("button", name="Open")).to_have_count(0)


MISSPELT = DOCUMENT.replace(
    "<name>look</name>",
    "<name>look</name><entry>pose = 1.0\nself.Head.setPosse(pose, pose)</entry>"
    "<code>self.Head.setPosse(0.0, 1.0)</code>",
).replace(
    "</VisualHFSM>",
    "<config><iceinterface><nameinterface>Head</nameinterface><interface>PoseHead</interface></iceinterface></config>"
    "</VisualHFSM>",
)


@pytest.mark.parametrize("shown", [MISSPELT], indirect=True)
def test_a_misspelt_operation_is_corrected_in_the_code_and_in_the_list(shown: EditorPage) -> None:
    page = shown.page
    shown.press("Control+m")
    problems = page.get_by_role("list", name="Problems")
    rows = problems.locator(":scope > li").filter(has_text="did you mean setPose?")
    expect(rows).to_have_count(2)
    assert shown.violations("hfsm-problems") == []
    rows.filter(has_text="› code").get_by_role("button").first.click()
    field = page.get_by_role("textbox", name="Code of the state look")
    expect(field.locator(".cm-lintRange")).to_have_text("setPosse")
    field.click()
    shown.press("Control+.")
    expect(field).to_have_text("self.Head.setPose(0.0, 1.0)")
    expect(rows).to_have_count(1)
    shown.press("Control+z")
    expect(field).to_have_text("self.Head.setPosse(0.0, 1.0)")
    expect(rows).to_have_count(2)

    rows.first.get_by_role("button", name="Write setPose in all 2 places").click()
    expect(rows).to_have_count(0)
    expect(field).to_have_text("self.Head.setPose(0.0, 1.0)")
    shown.press("Control+z")
    expect(rows).to_have_count(2)
    write = page.locator(".cm-tooltip").get_by_role("button", name="Write setPose").first
    shown.hover(field.locator(".cm-lintRange"), shows=write)
    write.click()
    expect(rows).to_have_count(1)
    rows.get_by_role("button", name="Write setPose").click()
    expect(rows).to_have_count(0)


LACKING = DOCUMENT.replace(
    "<name>look</name>", "<name>look</name><entry>print(math.pi)</entry><code>print(math.tau)</code>"
)


@pytest.mark.parametrize("shown", [LACKING], indirect=True)
def test_a_library_is_imported_by_the_fix_of_the_name_that_it_defines(shown: EditorPage, path: Path) -> None:
    page = shown.page
    shown.press("Control+m")
    row = (
        page.get_by_role("list", name="Problems")
        .locator(":scope > li")
        .filter(has_text="math is not defined")
    )
    expect(row).to_have_count(1)
    expect(row.get_by_role("button", name="Import math")).to_be_visible()
    assert shown.violations("hfsm-problems") == []
    row.get_by_text("in 1 other place").click()
    row.get_by_role("button", name="› code").last.click()
    field = page.get_by_role("textbox", name="Code of the state look")
    field.click()
    shown.press("Control+.")
    expect(row).to_have_count(0)
    assert [each.name.text for each in saved(shown, path).libraries] == ["math"]


TWO_LINES = DOCUMENT.replace("<name>look</name>", "<name>look</name><code>a = 1\nb =</code>")


@pytest.mark.parametrize("shown", [TWO_LINES], indirect=True)
def test_a_bubble_over_the_line_in_which_one_types_goes_away(shown: EditorPage) -> None:
    page = shown.page
    shown.press("Control+m")
    page.locator("hfsm-problems .rows button").first.click()
    field = page.get_by_role("textbox", name="Code of the state look")
    bubble = page.locator(".cm-tooltip-lint")
    shown.press("Control+Home")
    shown.hover(field.locator(".cm-lintRange"), shows=bubble)
    line = Box.of(field.locator(".cm-line").first)
    assert Box.of(bubble).y < line.y + line.height
    shown.type("2")
    expect(field.locator(".cm-line").first).to_have_text("2a = 1")
    assert bubble.count() == 0  # at once


IMPORTING = DOCUMENT.replace('<trans type="time">240000', '<trans type="time">24000000')
IMPORTING = IMPORTING[: IMPORTING.index('<SubAutomata id="2"')] + (
    '<SubAutomata id="2" idFather="1"><import>parts/look.xml</import></SubAutomata></VisualHFSM>'
)
IMPORTED = """<VisualHFSM><SubAutomata id="1" idFather="0"><state id="1" initial="true"><posx>9</posx><posy>9</posy>
<name>look</name><code>pass
1 / 0</code></state></SubAutomata></VisualHFSM>"""


FIXED = """<VisualHFSM><SubAutomata id="1" idFather="0">
<state id="1" initial="true"><posx>60</posx><posy>90</posy><name>top</name><idSubautomataSon>2</idSubautomataSon>
<code>self.log.info(“Hola – {}”,\u00a0count)</code></state>
<variables>count = 3\nother = 2</variables></SubAutomata>
<SubAutomata id="2" idFather="1"><import>serach.xml</import></SubAutomata></VisualHFSM>"""


@pytest.mark.parametrize("shown", [FIXED], indirect=True)
def test_what_is_wrong_is_fixed_by_a_button_or_a_key(shown: EditorPage, path: Path) -> None:
    page = shown.page
    (path.parent / "parts").mkdir()
    for name in ("search.xml", "parts/look.xml"):
        (path.parent / name).write_text(IMPORTED)
    shown.press("Control+m")
    rows = page.get_by_role("list", name="Problems").locator(":scope > li")
    expect(rows.filter(has_text="not checked without serach.xml")).to_have_count(1)
    missing = rows.filter(has_text="serach.xml is not found")
    assert shown.violations("hfsm-problems") == []

    rows.filter(has_text="not valid Python").get_by_role("button").first.click()
    field = page.get_by_role("textbox", name="Code of the state top")
    expect(field.locator(".cm-lintRange")).to_be_visible()
    field.click()
    shown.press("Control+.")
    expect(field).to_have_text('self.log.info("Hola – {}", count)')
    expect(missing.get_by_role("button", name="Write search.xml")).to_be_visible()

    missing.get_by_role("button", name="Choose the file…").click()
    dialog = page.get_by_role("dialog")
    dialog.get_by_role("option", name="parts/look.xml").dblclick()
    expect(rows.filter(has_text="not found")).to_have_count(0)
    below = saved(shown, path).automata[1]
    assert below.imported is not None
    assert below.imported.file.text == "parts/look.xml"


def look_at(folder: Path, text: str = IMPORTED) -> None:
    (folder / "parts").mkdir(exist_ok=True)
    (folder / "parts" / "look.xml").write_text(text)


@pytest.mark.parametrize("shown", [IMPORTING], indirect=True)
def test_an_error_in_an_imported_automaton_marks_its_state_and_leads_to_its_file(
    shown: EditorPage, path: Path
) -> None:
    page = shown.page
    look_at(path.parent)
    shown.press("F5")
    expect(shown.state("wait")).to_have_class(re.compile(r"\bfailed\b"))
    expect(shown.state("wait")).to_have_attribute(
        "aria-label", re.compile("error: In parts/look.xml, code of look, line 2: ZeroDivisionError")
    )
    shown.press("Control+m")
    problem = page.get_by_role("list", name="Problems").get_by_role("button", name="ZeroDivisionError")
    expect(problem).to_contain_text(
        re.compile("division by zero.*parts/look.xml › code of look, line 2", re.DOTALL)
    )
    problem.click()
    expect(page.get_by_role("tab", name="look", selected=True)).to_be_visible()
    expect(page.get_by_role("textbox", name="Code of the state look")).to_be_focused()


@pytest.mark.parametrize("shown", [IMPORTING], indirect=True)
def test_the_end_of_a_run_in_imported_code_shows_that_code_until_its_file_changes(
    shown: EditorPage, path: Path
) -> None:
    page = shown.page
    look_at(path.parent)
    shown.press("F5")
    expect(status(shown)).to_have_text("Ended: division by zero in look")
    page.locator(".live-bar").get_by_role("button", name="line 2").click()
    field = page.get_by_role("textbox", name="Code of the state look")
    expect(field).to_have_attribute("aria-readonly", "true")
    expect(page.locator(".cm-failed")).to_have_text(re.compile("ZeroDivisionError: division by zero$"))
    expect(page.locator(".cm-failedLine")).to_have_text("1 / 0")
    expect(shown.state("look")).to_have_class(re.compile(r"\bfailed\b"))
    expect(page.get_by_role("tab", name="walk", selected=True)).to_be_visible()
    assert not shown.violations("hfsm-code-panel")

    look_at(path.parent, IMPORTED.replace("1 / 0", "1 / 1"))
    expect(page.locator(".cm-failed")).to_have_count(0)
    expect(field).to_have_text(re.compile("1 / 1"))
    expect(shown.state("look")).not_to_have_class(re.compile(r"\bfailed\b"))


@pytest.mark.parametrize("shown", [IMPORTING], indirect=True)
def test_what_checks_find_in_an_imported_file_marks_its_state_its_code_and_leads_to_its_file(
    shown: EditorPage, path: Path
) -> None:
    page = shown.page
    look_at(path.parent, IMPORTED.replace("1 / 0", "print(unknown)"))
    words = "In parts/look.xml, code of look, line 2: unknown is not defined"
    expect(shown.state("wait")).to_have_attribute("aria-label", re.compile(f"warning: {words}"))
    shown.state("wait").click()
    shown.edit_code()
    expect(page.locator("hfsm-code-panel")).to_contain_text(words)
    shown.press("Escape", "Enter")
    shown.state("look").click()
    expect(shown.state("look")).to_have_attribute("aria-label", re.compile("warning: unknown is not defined"))
    shown.edit_code()
    expect(page.locator(".cm-lintRange-warning")).to_have_text("unknown")
    shown.press("Control+m")
    problems = page.get_by_role("list", name="Problems").get_by_role("button", name="unknown is not defined")
    expect(problems).to_have_count(1)
    problems.focus()
    shown.press("Enter")
    expect(page.get_by_role("tab", name="look", selected=True)).to_be_visible()
    field = page.get_by_role("textbox", name="Code of the state look")
    expect(field).to_be_focused()
    expect(field).not_to_have_attribute("aria-readonly", "true")


@pytest.mark.parametrize("shown", [IMPORTING], indirect=True)
def test_an_import_that_cannot_be_read_is_said_once_and_leads_to_what_is_wrong(
    shown: EditorPage, path: Path
) -> None:
    page = shown.page
    shown.press("Control+m")
    problems = page.get_by_role("list", name="Problems").locator("button.row")
    missing = problems.filter(has_text="parts/look.xml is not found")
    expect(missing).to_have_count(1)
    missing.click()
    expect(page.get_by_role("textbox", name="File")).to_be_focused()

    look_at(path.parent, "<VisualHFSM>\n<SubAutomata")
    broken = problems.filter(has_text="parts/look.xml › line 2")
    expect(broken).to_have_count(1)
    expect(missing).to_have_count(0)
    broken.click()
    expect(page.locator(".notice.error")).to_contain_text("Cannot open look.xml: line 2")
    expect(shown.state("wait")).to_have_attribute(
        "aria-label", re.compile("error: In parts/look.xml, line 2: malformed XML")
    )
    look_at(path.parent)
    expect(broken).to_have_count(0)
    expect(shown.state("wait")).not_to_have_attribute("aria-label", re.compile("error"))


PAUSING = IMPORTED.replace("</state>", """</state><state id="2"><posx>200</posx><posy>9</posy><name>rest</name>
<code>pass</code></state><transition id="1"><origin>1</origin><destiny>2</destiny><name>late</name>
<trans type="time">300</trans></transition>""").replace("1 / 0", "")  # fmt: skip


@pytest.mark.parametrize("shown", [IMPORTING], indirect=True)
def test_a_breakpoint_in_an_imported_automaton_halts_there(shown: EditorPage, path: Path) -> None:
    page = shown.page
    look_at(path.parent, PAUSING)
    shown.state("wait").click()
    shown.press("Enter")
    shown.state("rest").click()
    shown.press("b", "Backspace", "F5")
    expect(status(shown)).to_have_text("At a breakpoint")
    page.locator(".live-bar").get_by_role("button", name="State rest").click()
    shown.state("rest").click()
    shown.edit_code()
    expect(page.get_by_role("textbox", name="Code of the state rest")).to_have_attribute(
        "aria-readonly", "true"
    )
