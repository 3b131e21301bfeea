"""Problems, search, output and undo steps below the canvas, through the real server."""

from __future__ import annotations

import re
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from playwright.sync_api import Browser, expect

from tests.support.browser import EditorPage, editor_page
from tests.support.editor import NoCodeHelp, editor, parts
from tests.support.limits import CALL_LIMIT, FOREVER, PAGE_LIMIT, RUN_LIMIT
from tests.support.panels import DOCUMENT, edit, panel_violations, undo_names
from tests.support.processes import free_endpoint
from visualhfsm._processes.components import StartedComponents
from visualhfsm.project._code_help.service import CodeHelp
from zenoh_ice import Settings


@pytest.fixture
def document() -> str:
    return DOCUMENT


def test_problems_lead_to_their_lines(shown: EditorPage) -> None:
    shown.press("Control+m")
    rows = shown.page.get_by_role("list", name="Problems").locator("button.row")
    warning = rows.filter(has_text="color")
    expect(warning).to_have_count(1)
    warnings = shown.page.get_by_role("button", name="1 Warning", exact=True)
    warnings.click()
    expect(warning).to_have_count(0)
    warnings.click()
    expect(warning).to_have_count(1)

    code = "first = 1\nsecond = 2\nif count\nthird = 3"
    place = {"kind": "state", "automaton": 2, "id": 1, "part": "exit"}
    shown.editor.do({"command": "setText", "place": place, "text": code})
    problem = shown.page.get_by_role("button", name=re.compile("^error: .*not valid Python"))
    expect(problem).to_contain_text("wait › look › exit code › line 3")
    expect(shown.page.get_by_role("button", name="1 Error", exact=True)).to_have_attribute(
        "aria-pressed", "true"
    )
    problem.focus()
    shown.press("Enter")
    expect(shown.state("look")).to_have_attribute("aria-pressed", "true")
    field = shown.page.get_by_role("textbox", name="Exit code of the state look")
    expect(field).to_be_focused()
    shown.type("0")
    expect(field.locator(".cm-line").nth(2)).to_contain_text("0")

    # A run of a document with errors leads to the first one.
    shown.press("Escape", "F5")
    error = shown.page.get_by_role("button", name=re.compile("^error: .*not valid Python"))
    expect(error).to_be_focused()
    shown.press("Enter")
    expect(field).to_be_focused()


def test_problems_are_counted_beyond_the_list_and_say_what_they_assume(shown: EditorPage) -> None:
    nobody = "\n".join(f"self.log.info(nobody{number})" for number in range(1010))
    trigger = {"kind": "transition", "automaton": 1, "id": 1, "part": "trigger"}
    code = {"kind": "state", "automaton": 2, "id": 1, "part": "code"}
    shown.editor.do(
        {"command": "setText", "place": trigger, "text": "False"},
        {"command": "setText", "place": code, "text": nobody},
        {"command": "addState", "automaton": 2, "name": "last", "x": 300, "y": 150},
    )
    shown.press("Control+m")
    counts = shown.page.get_by_role("group", name="Shown problems")  # to name all 1,000 buttons takes seconds
    expect(counts.get_by_role("button", name="1013 Warnings", exact=True)).to_be_visible()
    expect(shown.page.get_by_role("list", name="Problems").locator("button.row")).to_have_count(1000)
    expect(shown.page.get_by_text("1000 of 1014 are listed")).to_be_visible()
    expect(shown.page.get_by_role("treeitem", name="last, warning")).to_be_visible()
    expect(shown.page.locator("hfsm-problems code").first).to_have_text("enough")
    expect(shown.page.locator("hfsm-problems")).not_to_contain_text("`")
    expect(shown.page.get_by_text(re.compile("hold as long as cycles begin"))).to_have_count(1)


def test_search_finds_names_and_all_code_and_replaces_in_one_step(shown: EditorPage) -> None:
    shown.press("Control+f")
    expect(shown.page.get_by_role("searchbox")).to_be_focused()
    shown.type("COUNT")
    rows = shown.page.get_by_role("list", name="Found").locator("button.row")
    expect(rows).to_have_count(3)
    shown.page.get_by_role("searchbox").fill("leaving")
    expect(rows).to_have_count(1)
    expect(rows).to_contain_text("walk › wait › exit code")
    expect(rows.locator("mark")).to_have_text("leaving")
    shown.press("ArrowDown", "Enter")
    expect(shown.page.get_by_role("textbox", name="Exit code of the state wait")).to_be_focused()

    # It follows what is typed; a line with two hits is listed once, with both marked.
    shown.choose_in("Edit", "Search")
    search = shown.page.get_by_role("searchbox")
    expect(search).to_be_focused()
    search.fill("needle")
    shown.page.get_by_text("No matches for “needle”.").wait_for()
    edit(shown, "go")
    shown.insert("needle = needle + 1")
    expect(rows).to_have_count(1)
    expect(rows.locator("mark")).to_have_count(2)
    expect(rows.locator("code")).to_have_text("needle = needle + 1")
    expect(shown.page.get_by_text("2 found")).to_be_visible()

    # What is found is replaced in one line, and in all code as one step.
    shown.press("Control+a")
    shown.insert("Count = count\ncounts = count")
    search.fill("count")
    shown.page.get_by_role("checkbox", name="Whole word, same case").check()
    shown.spent = True  # the panel keeps what was searched
    shown.page.get_by_role("textbox", name="Replace by").fill("n")
    expect(rows).to_have_count(5)
    shown.page.get_by_role("button", name="Replace in walk › go › code:2").click()
    code = shown.page.get_by_role("textbox", name="Code of the state go").locator(".cm-line")
    expect(code).to_have_text(["Count = count", "counts = n"])
    expect(
        shown.page.get_by_role("status").filter(has_text="Replace “count” by “n” (once): done.")
    ).to_be_visible()
    shown.button("Replace 4 in code").click()
    expect(code).to_have_text(["Count = n", "counts = n"])
    expect(rows).to_have_count(0)
    assert undo_names(shown)[0] == "Replace “count” by “n” (4 times)"
    shown.press("Control+z")
    expect(rows).to_have_count(4)
    assert panel_violations(shown) == []


def test_enter_in_the_search_shows_hit_after_hit_and_the_focus_stays(shown: EditorPage) -> None:
    page = shown.page
    page.locator("hfsm-canvas .surface").focus()
    shown.press("f", *["-"] * 12)
    expect(page.locator("hfsm-canvas.tiny")).to_be_attached()
    shown.press("Control+f")
    search = page.get_by_role("searchbox")
    expect(search).to_be_focused()
    # Enter waits for what is searched; what is shown is large enough to be read.
    shown.type("count")
    shown.press("Enter")
    status = page.get_by_role("search").get_by_role("status")
    current = page.get_by_role("list", name="Found").locator("[aria-current]")
    expect(status).to_have_text("1 of 3")
    expect(current).to_contain_text("walk › wait › code:1")
    expect(shown.state("wait")).to_have_attribute("aria-pressed", "true")
    code = page.get_by_role("textbox", name="Code of the state wait")
    expect(code).to_be_visible()
    code.locator(".cm-activeLine").wait_for()
    expect(shown.state("wait").locator(".name")).to_be_in_viewport(ratio=1)
    assert shown.radius_of("wait") > 25
    expect(search).to_be_focused()
    shown.press("Enter")
    expect(status).to_have_text("2 of 3")
    expect(shown.transition("enough")).to_have_attribute("aria-pressed", "true")
    shown.press("Enter")
    expect(status).to_have_text("3 of 3")
    expect(current).to_contain_text("walk › variables:1")
    expect(page.get_by_role("textbox", name="Variables")).to_be_visible()
    expect(search).to_be_focused()
    assert panel_violations(shown) == []
    # The first follows the last, and Shift goes back.
    shown.press("Enter")
    expect(status).to_have_text("1 of 3")
    shown.press("Shift+Enter", "Shift+Enter")
    expect(status).to_have_text("2 of 3")
    expect(current).to_contain_text("walk › enough")
    expect(search).to_be_focused()
    # From a hit that is gone, the next one follows.
    shown.press("Alt+v")
    expect(page.get_by_role("textbox", name="Variables")).to_be_focused()
    shown.press("Control+Home")
    shown.insert("counter = 0\n")
    expect(status).to_have_text("2 of 4")
    shown.choose_in("Edit", "Search")
    expect(search).to_be_focused()
    shown.press("Enter")
    expect(status).to_have_text("3 of 4")
    # Another text is searched from its first hit on.
    search.fill("leaving")
    expect(status).to_have_text("1 found")
    shown.press("Shift+Enter")
    expect(status).to_have_text("1 of 1")
    expect(page.get_by_role("textbox", name="Exit code of the state wait")).to_be_visible()
    expect(search).to_be_focused()


@pytest.mark.parametrize("merge_within", [FOREVER])
def test_undo_steps_lead_back_and_panels_that_were_hidden_show_what_changed_meanwhile(
    own: EditorPage,
) -> None:
    # A click on an undo step goes back to that point.
    edit(own, "wait")
    own.insert("\nspeed = 1")
    # Not `check`, which looks at once: what was typed comes first, and draws the box once more as it was.
    for step in ("End in “wait”", "Do not end in “wait”"):
        own.page.get_by_role("checkbox", name="Final").click()
        expect(own.page.locator("hfsm-status .last-step")).to_have_text(step)
    own.press("Alt+h")
    rows = own.page.get_by_role("list", name="Steps, the latest first").locator("button.row")
    expect(rows.locator(".message")).to_have_text(
        ["Do not end in “wait”", "End in “wait”", "Edit the code of “wait”", "As it was opened"]
    )
    rows.nth(2).click()
    expect(rows.nth(2)).to_contain_text("now")
    assert undo_names(own) == ["Edit the code of “wait”"]
    rows.nth(0).click()
    expect(rows.nth(0)).to_contain_text("now")
    assert len(undo_names(own)) == 3
    rows.nth(3).click()
    expect(own.page.get_by_role("textbox", name="Code of the state wait")).to_have_text("count += 1")
    below = own.page.get_by_role("region", name="Panel below the canvas")
    beside = own.page.get_by_role("region", name="Panel beside the canvas")
    for panel in (below, beside):
        panel.get_by_role("button", name="Close the panel").click()

    # Every panel that was hidden shows what changed meanwhile.
    page = own.page
    own.press("Control+m")
    expect(below).to_contain_text("1 Warning")
    own.press("Alt+h")
    expect(below).to_contain_text("As it was opened")
    own.press("Control+f")
    expect(page.get_by_role("searchbox")).to_be_focused()
    own.insert("novelty")
    expect(below).to_contain_text("No matches for “novelty”.")
    own.press("Alt+t")
    expect(page.get_by_label("Period")).to_have_value("100 ms")
    edit(own, "wait")
    for panel in (below, beside):
        panel.get_by_role("button", name="Close the panel").click()

    place = {"kind": "state", "automaton": 1, "id": 1, "part": "code"}
    own.editor.do(
        {"command": "setText", "place": place, "text": "if novelty"},
        {"command": "setPeriod", "automaton": 1, "period": "50"},
    )
    own.press("Control+m")
    expect(page.get_by_role("list", name="Problems")).to_contain_text("not valid Python")
    own.press("Alt+h")
    steps = page.get_by_role("list", name="Steps, the latest first").locator("button.row .message")
    expect(steps).to_have_text(["Set the period to 50 ms", "Edit the code of “wait”", "As it was opened"])
    own.press("Control+f")
    expect(page.get_by_role("list", name="Found").locator("button.row")).to_have_count(1)
    own.state("wait").click()
    own.press("Shift+Enter")
    expect(page.get_by_role("textbox", name="Code of the state wait")).to_have_text("if novelty")
    own.press("Alt+t")
    expect(page.get_by_label("Period")).to_have_value("50 ms")


@contextmanager
def helped(
    browser: Browser,
    path: Path,
    code: str,
    monkeypatch: pytest.MonkeyPatch,
    code_help: CodeHelp | NoCodeHelp | None = None,
) -> Iterator[EditorPage]:
    """Open the document with other code in its state `wait`, in an editor that can run it."""
    path.write_text(DOCUMENT.replace("<code>count += 1</code>", f"<code>{code}</code>"))
    monkeypatch.setenv("VISUALHFSM_CLOCK", "wall")  # so that the component does not wait for a robot's clock
    settings = Settings(connect=(free_endpoint(),), timeout=CALL_LIMIT)
    with (
        editor(
            path.parent,
            make_parts=lambda publish: parts(code_help, StartedComponents(publish, settings)),
        ) as running,
        running.opened(path),
        editor_page(browser, running) as shown,
    ):
        shown.state("wait").wait_for()
        yield shown


class SlowHelp(NoCodeHelp):
    """Knows nothing longer than the first word, and says so only when the second one has been typed."""

    def __init__(self, *known: str) -> None:
        self._known = known
        self.asked = threading.Event()
        self.answers = threading.Event()

    def ask(self, wanted: str, *place: object, column: int, **_: object) -> object:
        if wanted != "complete":
            return None
        if self.asked.is_set():
            return {"typed": 1, "options": [{"label": "second", "type": "variable"}]}
        self.asked.set()
        assert self.answers.wait(FOREVER)
        return {"typed": column, "options": [{"label": each, "type": "variable"} for each in self._known]}


@pytest.mark.parametrize("known", [(), ("f",)], ids=["unknown", "complete"])
def test_what_is_typed_before_an_answer_is_completed_too(
    browser: Browser, path: Path, monkeypatch: pytest.MonkeyPatch, known: tuple[str, ...]
) -> None:
    slow_help = SlowHelp(*known)
    with helped(browser, path, "pass", monkeypatch, slow_help) as shown:
        edit(shown, "wait")
        shown.press("Control+a")
        shown.type("f")
        assert slow_help.asked.wait(PAGE_LIMIT)
        shown.type(" = s")
        slow_help.answers.set()
        shown.page.get_by_role("option").filter(has_text="second").wait_for()


@pytest.mark.slow
def test_a_run_closes_what_is_offered_to_type(
    browser: Browser, path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with helped(browser, path, "pass", monkeypatch, CodeHelp(RUN_LIMIT)) as shown:
        code = edit(shown, "wait")
        shown.press("Control+a")
        shown.type("print('ran'); set")
        options = shown.page.locator(".cm-tooltip").get_by_role("option")
        options.filter(has_text="setattr").wait_for(timeout=RUN_LIMIT * 1000)
        shown.press("F5")
        expect(shown.page.get_by_role("log", name="Output of the behavior")).to_contain_text("ran")
        expect(options).to_have_count(0)
        expect(code).to_be_focused()
        shown.press("Shift+F5")
        expect(shown.page.get_by_text(re.compile("^Ended: stopped")).last).to_be_visible()


@pytest.mark.slow
def test_a_process_that_ends_at_once_leads_to_the_line_that_ended_it(
    browser: Browser, path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    code = "count += 1\nif count &gt; 2:\n    __import__('os')._exit(3)"
    with helped(browser, path, code, monkeypatch) as shown:
        shown.press("Control+m", "F5")
        end = shown.page.locator(".live-bar").filter(has_text="Ended: os._exit(3) in wait")
        expect(end).to_be_visible()
        expect(shown.page.get_by_role("tab", name="Problems", selected=True)).to_be_visible()  # it stays open
        end.get_by_role("button", name="line 3").click()
        field = shown.page.get_by_role("textbox", name="Code of the state wait")
        expect(field.locator(".cm-activeLine")).to_have_text("    __import__('os')._exit(3)")


@pytest.mark.slow
def test_a_traceback_leads_to_the_line_of_the_document(
    browser: Browser, path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    code = "count += 1\nif count &gt; 2:\n    missing()"
    with helped(browser, path, code, monkeypatch) as shown:
        shown.press("F5")
        log = shown.page.get_by_role("log", name="Output of the behavior")
        expect(log).to_contain_text("NameError: name 'missing' is not defined")
        link = log.get_by_role("button", name=re.compile("walk.xml:8"))
        expect(link).to_be_visible()
        assert panel_violations(shown) == []
        link.click()
        field = shown.page.get_by_role("textbox", name="Code of the state wait")
        expect(field).to_be_focused()
        expect(field.locator(".cm-activeLine")).to_have_text("    missing()")
        shown.press("Shift+F5")
        expect(shown.page.get_by_text("Ended: name 'missing' is not defined in wait").last).to_be_visible()
        lines = log.locator(".line").count()
        away = shown.page.get_by_role("alert").filter(has_text="No connection since")
        shown.connections.cut()
        expect(away).to_be_visible()
        shown.connections.restore()
        expect(away).to_have_count(0)
        expect(log.locator(".line")).to_have_count(lines)  # which are sent again as a whole
        shown.button("Clear").click()
        expect(log).to_be_empty()
