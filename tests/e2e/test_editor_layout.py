"""The page in windows of all sizes: the drawing has room, tabs their names, and STOP stays where it is."""

from __future__ import annotations

import contextlib
import re
from collections.abc import Iterator
from pathlib import Path

import pytest
from playwright.sync_api import Browser, expect

from tests.support.browser import Box, EditorPage, editor_page
from tests.support.editor import DOCUMENT, Editor, editor
from tests.support.monitor import DOCUMENT as RUNNING
from tests.support.monitor import comes_true, monitor_page, run
from tests.support.plugins import OF_THE_WHOLE
from tests.support.soak import cases
from tests.support.waiting import until

SIZES = cases(
    [(1440, 900), (1024, 768), (390, 844)],
    [pytest.param(1100, 800), pytest.param(768, 1024), pytest.param(683, 700)],
)
SHEET = 720
"""Pixels of a window's width up to which the panel is below the drawing."""
COVERED = """() => {
  const stop = document.querySelector(".stop-button");
  const {left, top, width, height} = stop.getBoundingClientRect();
  return !stop.contains(document.elementFromPoint(left + width / 2, top + height / 2));
}"""

HANGS_OUT = """() => {
  const {scrollHeight, clientHeight, scrollWidth, clientWidth, scrollTop} = document.scrollingElement;
  return [scrollHeight - clientHeight, scrollWidth - clientWidth, scrollTop];
}"""
"""By how much the page could be scrolled down and to the right, and by how much it is."""

AS_AT_FIRST = """() => {
  const app = document.querySelector("hfsm-app");
  for (const name of ["--left", "--side", "--bottom"]) document.documentElement.style.removeProperty(name);
  app.showSide("");
  app.showBottom("");
}"""

WITH_TREE, WITHOUT_TREE = 0.45, 0.55
"""Parts of the window that the drawing keeps."""
COVERS = """() => {
  const canvas = document.querySelector("hfsm-canvas");
  const {left, top, width, height} = canvas.getBoundingClientRect();
  const found = new Set();
  for (let x = 0.02; x < 1; x += 0.04)
    for (let y = 0.02; y < 1; y += 0.04) {
      const seen = document.elementFromPoint(left + x * width, top + y * height);
      if (!canvas.contains(seen) && !seen.closest(".drawing > .toolbar")) found.add(seen.outerHTML.slice(0, 80));
    }
  return [...found];
}"""
"""What lies over the drawing, but for the buttons in its corner."""
SMALL_TARGETS = """() => [...document.querySelectorAll("button:not(.link), select, input, [role=tab], .branch")]
  .filter((each) => each.checkVisibility({opacityProperty: true}) && !each.closest("label"))
  .filter((each) => Math.min(each.offsetWidth, each.offsetHeight) < 44)
  .map((each) => `${each.className} ${each.ariaLabel || each.textContent}`)"""
"""What fingers press and is smaller than 44 pixels."""
SMALL_NAMES = """() => [...document.querySelectorAll("hfsm-canvas .state .name")]
  .filter((each) => each.getScreenCTM().a * parseFloat(getComputedStyle(each).fontSize) < 11)
  .map((each) => each.textContent)"""
"""Names in the drawing whose letters are smaller than 11 pixels."""

IN_PART = """() => {
  const list = document.querySelector("hfsm-tabs [role=tablist]").getBoundingClientRect();
  const boxes = [...document.querySelectorAll(".tab")].map((each) => [each, each.getBoundingClientRect()]);
  const seen = boxes.filter(([, {left, right, top, bottom}]) =>
    right > list.left + 1 && left < list.right - 1 && bottom > list.top + 1 && top < list.bottom - 1);
  const beyond = ({left, right, top, bottom}, place) =>
    left < place.left - 1 || right > place.right + 1 || top < place.top - 1 || bottom > place.bottom + 1;
  return seen.filter(([each, box]) => {
    const [text, end] = [".text", ".name-end"].map((name) => each.querySelector(name).getBoundingClientRect());
    return beyond(box, list) || beyond(end, text);
  }).map(([{textContent}]) => textContent.trim());
}"""
"""The tabs of documents of which only a part is seen, or whose names are cut without a sign of it."""

CUT = "each => each.scrollWidth > each.clientWidth"
"""Whether a text is longer than its place."""


@pytest.fixture(scope="class")
def walking(browser: Browser, robot_editor: Editor, shared_root: Path) -> Iterator[EditorPage]:
    """A component that runs on a robot, which is shown, too; it ends before the other tests."""
    path = shared_root / "walk.xml"
    path.write_text(RUNNING)
    with robot_editor.opened(path), monitor_page(browser, robot_editor) as shown:
        run(shown)
        shown.button("See the robot").click()
        comes_true(shown, "() => document.querySelector('hfsm-robot-view')?.drawing?.body")
        yield shown


@pytest.fixture
def live(walking: EditorPage) -> EditorPage:
    """The same, without panels."""
    walking.page.evaluate("document.querySelector('hfsm-app').showSide('')")
    walking.page.evaluate("document.querySelector('hfsm-app').showBottom('')")
    walking.page.evaluate("document.querySelector('hfsm-app').tree = ''")
    return walking


@pytest.fixture(scope="module")
def eleven(browser: Browser, tmp_path_factory: pytest.TempPathFactory) -> Iterator[EditorPage]:
    """The page with eleven documents, two of which have the same name in folders of the same name."""
    root = tmp_path_factory.mktemp("eleven") / "root"
    paths = [root / f"{name}.xml" for name in ("walk", "a/parts/walk", "b/parts/walk")]
    paths += [root / f"follow_and_dance_{number}.xml" for number in range(8)]
    for path in paths:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(DOCUMENT, "utf-8")
    with editor(root, *paths) as running, editor_page(browser, running) as shown:
        shown.state("wait").wait_for()
        yield shown


@pytest.fixture
def shown(eleven: EditorPage) -> EditorPage:
    """The same with its first document as it was, without panels and notices."""
    eleven.page.evaluate(AS_AT_FIRST)
    eleven.dismiss(eleven.page.locator(".notice"))
    eleven.page.emulate_media(forced_colors="null")
    eleven.resize(1280, 800)
    eleven.page.get_by_role("tab", name="walk", exact=True).click()
    eleven.press("f")
    return eleven


class TestBesideARobot:
    def test_the_drawing_keeps_half_of_the_window_beside_code_robot_and_timeline(
        self, live: EditorPage
    ) -> None:
        page = live.page
        live.resize(1280, 800)
        scale = live.radius_of("go")
        live.state("go").click()
        live.edit_code()
        for part in (
            ".dock .stage canvas",
            ".side hfsm-code-panel",
            "main > hfsm-monitor-timeline .timeline",
        ):
            expect(page.locator(part)).to_be_visible()
        drawing = page.locator("hfsm-canvas")
        assert Box.of(drawing).area >= WITH_TREE * 1280 * 800
        assert page.evaluate(COVERS) == []
        assert live.radius_of("go") == scale
        live.choose_in("View", "Tree of automata")
        assert Box.of(drawing).area >= WITHOUT_TREE * 1280 * 800
        assert live.radius_of("go") == scale

    def test_what_a_run_says_takes_what_the_second_row_has_free(self, live: EditorPage) -> None:
        status = live.page.locator(".live-status")
        words = status.evaluate_handle("status => status.lastChild")  # as long as what an error may say
        words.evaluate("words => words.textContent = words.textContent.repeat(30)")
        for width in (1440, 1280, 1101, 901, 683, 390):
            live.resize(width, 800)
            second_row = live.page.get_by_role("region", name="Run and draw")
            assert second_row.evaluate("row => row.scrollWidth - row.clientWidth") == 0
            buttons = second_row.get_by_role("button").filter(visible=True).all()
            assert len(buttons) >= 9
            assert all(Box.of(button).is_within(Box.of(second_row)) for button in buttons)
            assert Box.of(status).height < 1.5 * Box.of(live.button("Pause")).height
            assert live.page.evaluate(HANGS_OUT) == [0, 0, 0]
        live.page.evaluate("document.querySelector('hfsm-monitor-bar').requestUpdate()")

    def test_a_click_on_what_a_run_says_shows_the_rest(self, live: EditorPage) -> None:
        live.resize(390, 800)
        whole = live.page.locator("#status-words")
        expect(whole).to_be_hidden()
        live.page.locator(".live-status").click()
        expect(whole).to_be_visible()
        assert not live.page.evaluate(COVERED)
        live.press("Escape")
        expect(whole).to_be_hidden()

    @pytest.mark.parametrize(("width", "height"), SIZES)
    def test_the_drawing_has_most_of_the_window_beside_a_panel(
        self, live: EditorPage, width: int, height: int
    ) -> None:
        page = live.page
        live.resize(width, height)
        page.evaluate("document.querySelector('hfsm-app').showLive('variables')")
        expect(page.get_by_role("tab", name="Variables")).to_be_visible()
        beside, canvas = page.locator(".side"), page.locator("hfsm-canvas")
        is_sheet = width <= SHEET or height > width
        if is_sheet:  # its last pixels may still be on their way
            until(lambda: Box.of(canvas).y + Box.of(canvas).height <= Box.of(beside).y)
        panel, drawing = Box.of(beside), Box.of(canvas)
        if is_sheet:
            assert drawing.height >= panel.height
            assert drawing.width >= width - 1
        elif width <= 1100:
            assert panel.width <= 0.4 * width + 1
        live.press("f")
        for name in ("wait", "go"):
            state = Box.of(live.state(name).locator(".body"))
            assert state.width > 30
            assert drawing.x < state.x < drawing.x + drawing.width
        assert not page.evaluate(COVERED)
        page.evaluate("document.querySelector('hfsm-app').showLive('view')")
        expect(page.locator(".side .stage canvas")).to_be_visible()
        assert Box.of(page.locator(".side .stage")).height > 100
        if width <= SHEET:
            assert not Box.of(page.locator(".side .view-tools")).overlaps(
                Box.of(page.locator(".side .stage"))
            )
        assert page.evaluate("document.documentElement.scrollWidth") <= width
        if (width, height) in {(1440, 900), (390, 844)}:
            assert live.violations() == []

    def test_on_a_phone_the_fields_of_a_transition_have_the_panel(self, live: EditorPage) -> None:
        live.resize(390, 844)
        live.transition("late").locator(".knob").click()
        live.edit_code()
        fields = live.page.locator(".code-panel > .sections")
        assert fields.evaluate("each => each.scrollHeight === each.clientHeight")
        event = live.page.locator("label", has=live.page.get_by_role("radio", name="Event"))
        event.scroll_into_view_if_needed()
        assert Box.of(event).is_within(Box.of(live.page.locator(".side > .content")))

    @OF_THE_WHOLE
    def test_the_page_itself_never_scrolls_whatever_panels_it_shows(self, live: EditorPage) -> None:
        page = live.page
        page.locator("body > [role=status]").wait_for(state="attached")  # what says aloud what the run does
        found: dict[str, list[float]] = {}
        for width, height in ((1440, 900), (1024, 768), (683, 600)):
            live.resize(width, height)
            for where, region in (("bottom", "Panel below the canvas"), ("side", "Panel beside the canvas")):
                show = f"(tag) => document.querySelector('hfsm-app').show{where.title()}(tag)"
                page.evaluate(show, "hfsm-problems" if where == "bottom" else "hfsm-code-panel")
                tabs = page.get_by_role("region", name=region).locator(".panel-tabs").get_by_role("tab")
                for index in range(tabs.count()):
                    tabs.nth(index).click()
                    expect(tabs.nth(index)).to_have_attribute("aria-selected", "true")
                    found[f"{tabs.nth(index).inner_text()} at {width} × {height}"] = page.evaluate(HANGS_OUT)
                page.evaluate(show, "")
        assert len(found) == 3 * 10
        assert {name: sizes for name, sizes in found.items() if any(sizes)} == {}


@pytest.mark.parametrize(
    ("width", "height"), cases([(1024, 600), (683, 600)], [pytest.param(760, 600), pytest.param(768, 1024)])
)
def test_panels_on_all_sides_leave_two_fifths_to_the_drawing(
    shown: EditorPage, width: int, height: int
) -> None:
    page = shown.page
    shown.resize(width, height)
    shown.state("wait").click()
    shown.edit_code()
    page.evaluate(
        """() => {
          const app = document.querySelector("hfsm-app");
          app.tree = "with-tree";
          for (const name of ["--left", "--side", "--bottom"])
            document.documentElement.style.setProperty(name, "470px");
          return app.showBottom("hfsm-output");
        }"""
    )
    below = page.get_by_role("region", name="Panel below the canvas")
    expect(below).to_be_visible()
    expect(page.locator(".left")).to_be_visible()
    drawing = Box.of(page.locator("hfsm-canvas"))
    assert drawing.width >= 0.4 * width - 1
    assert drawing.height >= 0.4 * height - 1
    assert Box.of(page.locator(".side")).width >= 200
    assert Box.of(page.locator(".side")).height >= 125
    assert not Box.of(page.locator(".side")).overlaps(Box.of(below))
    assert Box.of(below).y + Box.of(below).height <= Box.of(page.locator("footer")).y
    assert page.evaluate("document.documentElement.scrollWidth") <= width
    assert not page.evaluate(COVERED)


@pytest.mark.parametrize(
    ("width", "height"),
    cases(
        [(1440, 900), (390, 844)],
        [pytest.param(1100, 800), pytest.param(1024, 768), pytest.param(768, 1024), pytest.param(683, 700)],
    ),
)
def test_a_notice_covers_nothing_of_the_panel_below_the_canvas(
    shown: EditorPage, width: int, height: int
) -> None:
    page = shown.page
    shown.resize(width, height)
    page.evaluate("document.querySelector('hfsm-app').showBottom('hfsm-output')")
    panel = page.get_by_role("region", name="Panel below the canvas")
    expect(panel).to_be_visible()
    shown.press("Control+s")
    notice = page.locator(".notice").filter(has_text="Saved")
    assert not Box.of(notice).overlaps(Box.of(panel))
    assert not page.evaluate(COVERED)


def test_a_layout_is_as_it_was_left(shown: EditorPage) -> None:
    page = shown.page
    code = page.locator(".side hfsm-code-panel")
    shown.choose_in("View", "Draw")
    expect(code).to_be_visible()
    page.evaluate("document.querySelector('hfsm-app').showBottom('hfsm-output')")
    output = page.locator(".bottom hfsm-output")
    expect(output).to_be_visible()
    shown.choose_in("View", "Run and watch")
    expect(code).to_have_count(0)
    expect(output).to_have_count(0)
    page.reload()
    shown.state("wait").wait_for()
    expect(code).to_have_count(0)
    shown.choose_in("View", "Draw")
    expect(code).to_be_visible()
    expect(output).to_be_visible()
    page.evaluate("localStorage.clear()")


@pytest.fixture
def document() -> str:
    return RUNNING


@contextlib.contextmanager
def on_a_phone(browser: Browser, running: Editor, locale: str = "en") -> Iterator[EditorPage]:
    """Show an editor on a phone."""
    phone = browser.new_context(
        viewport={"width": 390, "height": 844}, has_touch=True, is_mobile=True, locale=locale
    )
    with contextlib.closing(phone) as context:
        shown = EditorPage(context.new_page(), running)
        expect(shown.page.locator("hfsm-canvas .state")).to_have_count(2)
        yield shown


def test_a_finger_reads_how_a_run_is_on_a_phone_in_spanish(browser: Browser, followed: Editor) -> None:
    with on_a_phone(browser, followed, "es") as shown:
        status, row = shown.page.locator(".live-status"), shown.page.locator(".second-row")
        expect(row.locator("li")).to_have_css("clip-path", "inset(50%)")  # the tab has the name
        for key, words in (("F5", "En marcha"), ("F8", "En pausa")):
            shown.press(key)
            expect(status).to_have_text(words)
            assert not status.evaluate(CUT)
            assert not row.evaluate(CUT)


def test_a_phone_shows_the_whole_robot_and_gives_half_of_the_room_to_the_panel_below(
    browser: Browser, followed: Editor
) -> None:
    with on_a_phone(browser, followed) as shown:
        page = shown.page
        comes_true(shown, "() => document.querySelector('hfsm-robot-view')?.drawing?.body")
        expect(page.locator(".dock .stage canvas")).to_be_visible()
        expect(page.locator(".dock .view-tools")).to_be_hidden()  # a finger has no buttons on it
        run(shown)
        content = page.locator(".bottom > .content")
        page.evaluate("document.querySelector('hfsm-app').showBottom('hfsm-problems')")
        ready = page.get_by_role("button", name="Is it ready?")
        expect(ready).to_be_visible()
        assert Box.of(ready).is_within(Box.of(content))
        assert Box.of(content).height >= 200
        assert Box.of(page.locator("hfsm-canvas")).height >= 200
        page.evaluate("document.querySelector('hfsm-app').showSide('hfsm-code-panel')")
        expect(page.locator("hfsm-canvas")).to_be_hidden()
        assert min(Box.of(content).height, Box.of(page.locator(".side > .content")).height) >= 200
        page.evaluate("document.querySelector('hfsm-app').showSide('')")
        expect(shown.state("go")).to_be_in_viewport()
        page.evaluate("document.querySelector('hfsm-app').showSide('hfsm-code-panel')")
        page.locator(".stop-button").tap()
        expect(page.locator(".drawing > .banner")).to_be_visible()


def test_a_finger_meets_large_targets_and_names_that_can_be_read(browser: Browser, opened: Editor) -> None:
    with on_a_phone(browser, opened) as shown:
        page = shown.page
        page.evaluate("document.querySelector('hfsm-canvas').viewport.zoom(0.5)")
        assert page.evaluate(SMALL_NAMES) == []
        assert not page.get_by_role("tab", name="walk").locator(".name-end").evaluate(CUT)
        expect(page.locator(".all-tabs")).to_have_count(0)
        for panel in ("showSide('hfsm-data-panel')", "showBottom('hfsm-problems')"):
            page.evaluate(f"document.querySelector('hfsm-app').{panel}")
            assert page.evaluate(SMALL_TARGETS) == []


def test_eleven_documents_keep_their_names_and_a_menu_has_them_all(shown: EditorPage) -> None:
    page = shown.page
    tabs = page.get_by_role("tablist", name="Open documents").get_by_role("tab")
    expect(tabs).to_have_count(11)
    for width in (1440, 683, 390):
        shown.resize(width, 800)
        assert min(tabs.evaluate_all("all => all.map((each) => each.closest('.tab').offsetWidth)")) >= 90
        menu = page.get_by_role("button", name="All 11 documents")
        expect(menu).to_be_visible()
    menu.click()
    page.get_by_role("menuitemcheckbox", name="walk (b/parts)").click()
    chosen = page.get_by_role("tab", selected=True)
    expect(chosen).to_have_text("walk b/parts")
    expect(chosen).to_be_in_viewport()
    shown.resize(1440, 800)
    expect(chosen).to_be_in_viewport()
    assert shown.violations("header") == []


@pytest.mark.parametrize(("width", "height", "axis"), [(1280, 800, "x"), (390, 844, "y")])
def test_states_are_arranged_in_the_direction_in_which_all_are_larger(
    browser: Browser, root: Path, width: int, height: int, axis: str
) -> None:
    numbers = range(1, 9)
    states = "".join(f'<state id="{each}"><name>step {each}</name></state>' for each in numbers)
    arcs = "".join(
        f'<transition id="{each}"><origin>{each}</origin><destiny>{each + 1}</destiny><name>go on</name>'
        f'<trans type="time">1</trans></transition>'
        for each in numbers[:-1]
    )
    path = root / "chain.xml"
    path.write_text(f'<VisualHFSM><SubAutomata id="1" idFather="0">{states}{arcs}</SubAutomata></VisualHFSM>')
    with editor(root, path) as running, editor_page(browser, running) as shown:
        shown.resize(width, height)
        shown.state("step 1").wait_for()
        shown.press("l")
        expect(shown.button("Undo")).to_be_enabled()
        drawing = Box.of(shown.page.locator("hfsm-canvas"))
        steps = [shown.state(f"step {each}").locator(".body") for each in numbers]
        until(lambda: all(Box.of(each).is_within(drawing) for each in steps))
        places = [getattr(Box.of(each), axis) for each in steps]
        assert places == sorted(set(places))


def test_a_name_that_is_cut_shows_where_it_differs_and_is_read_whole(shown: EditorPage) -> None:
    page = shown.page
    shown.resize(683, 800)
    for number in (3, 4):
        one = page.get_by_role("tab", name=f"follow_and_dance_{number}", exact=True)
        start, end = one.locator(".name-start"), one.locator(".name-end")
        assert start.evaluate(CUT)
        assert not end.evaluate(CUT)
        expect(end).to_have_text(re.compile(f"{number}$"))
    chosen = page.get_by_role("tab", selected=True)
    name = chosen.text_content() or ""
    expect(chosen).to_have_attribute("aria-label", " ".join(name.split()))


@pytest.mark.parametrize("width", [1280, 1024])
def test_no_tab_is_seen_in_part(shown: EditorPage, width: int) -> None:
    page = shown.page
    shown.resize(width, 800)
    for name in ("walk", "follow_and_dance_2", "follow_and_dance_7"):
        shown.page.get_by_role("tab", name=name, exact=True).evaluate("each => each.click()")
        expect(page.get_by_role("tab", name=name, exact=True, selected=True)).to_be_in_viewport(ratio=1)
        assert page.evaluate(IN_PART) == []


def test_the_middle_button_pans_and_pastes_nothing(shown: EditorPage) -> None:
    page = shown.page
    paste = """() => document.body.dispatchEvent(new ClipboardEvent("paste", {
      bubbles: true, cancelable: true, clipboardData: new DataTransfer()}))"""
    before = shown.middle_of("wait")
    page.mouse.move(before[0] + 90, before[1] + 90)
    page.evaluate(f"() => addEventListener('pointerup', {paste}, {{once: true}})")  # as X11 does
    page.mouse.down(button="middle")
    page.mouse.move(before[0] + 150, before[1] + 120, steps=3)
    page.mouse.up(button="middle")
    shown.expect_at("wait", (before[0] + 60, before[1] + 30))
    expect(page.locator(".notice")).to_have_count(0)
    page.mouse.click(before[0] + 100, before[1] + 150)
    page.evaluate(paste)
    expect(page.locator(".notice")).to_contain_text("no states were copied here")


def test_a_pinch_beside_the_canvas_does_not_zoom_the_page(shown: EditorPage) -> None:
    page = shown.page
    prevented = """selector => !document.querySelector(selector).dispatchEvent(
      new WheelEvent("wheel", {ctrlKey: true, deltaY: -40, bubbles: true, cancelable: true}))"""
    shown.state("wait").click()
    shown.edit_code()
    for selector in (".side", ".left", "header", ".stop-button", "hfsm-canvas .surface"):
        assert page.evaluate(prevented, selector), selector
    assert page.evaluate("getComputedStyle(document.documentElement).touchAction") == "pan-x pan-y"


def test_stop_is_unlike_other_buttons_where_the_system_chooses_the_colors(shown: EditorPage) -> None:
    shown.page.emulate_media(forced_colors="active")
    sign = """() => {
      const stop = document.querySelector(".stop-button");
      const {borderStyle} = getComputedStyle(stop);
      const {clipPath, width} = getComputedStyle(stop, "::before");
      return [borderStyle, clipPath.startsWith("polygon"), parseFloat(width) > 8];
    }"""
    assert shown.page.evaluate(sign) == ["double", True, True]


def test_tabs_that_fit_need_no_menu(shown: EditorPage) -> None:
    """The last one: it closes the documents."""
    page = shown.page
    menu = page.get_by_role("button", name="All 11 documents")
    expect(menu).to_be_visible()
    for count in range(10, 2, -1):
        shown.press("Alt+w")
        expect(page.get_by_role("tab")).to_have_count(count)
    expect(menu).to_have_count(0)
