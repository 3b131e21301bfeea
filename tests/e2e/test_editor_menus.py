"""The menus of the header, the tools on the canvas, and the room that the page needs."""

from __future__ import annotations

import re

from playwright.sync_api import Locator, expect

from tests.support.browser import EditorPage

WIDTHS = (320, 390, 560, 561, 720, 721, 765, 860, 861, 1100, 1101, 1280, 1920)
OUTSIDE = """() => [...document.querySelectorAll("hfsm-app *")]
    .filter((each) => !each.closest("svg, hfsm-breadcrumbs, .cm-editor") && each.checkVisibility())
    .filter((each) => innerWidth >= 390 || !each.closest(".second-row > *")) // it scrolls
    .filter((each) => each.getBoundingClientRect().right > innerWidth + 0.5)
    .map((each) => `${innerWidth}: ${each.localName} ${each.className}`)"""
# Without the pictures of the shelf, whose rows have one each.
ICONS = """() => [...document.querySelectorAll("svg.icon:not(.ready *)")]
    .filter((each) => each.checkVisibility() && each.getBoundingClientRect().width).length"""
MOST_ICONS = 25


def title(shown: EditorPage, name: str) -> Locator:
    """The title of a menu in the header."""
    return shown.page.get_by_role("menubar").get_by_role("menuitem", name=name)


def item(shown: EditorPage, name: str) -> Locator:
    """An item of the open menu."""
    return shown.page.get_by_role("menu").get_by_role("menuitem", name=name)


def test_the_menus_and_the_tools_are_used_with_mouse_and_keys(shown: EditorPage) -> None:
    # The menus are used with keys alone.
    title(shown, "File").focus()
    shown.press("ArrowRight")
    expect(title(shown, "Edit")).to_be_focused()
    shown.press("ArrowDown")
    expect(item(shown, "Undo")).to_be_focused()
    expect(title(shown, "Edit")).to_have_attribute("aria-expanded", "true")
    shown.press("ArrowLeft")
    expect(item(shown, "New")).to_be_focused()
    assert shown.violations("header", ".menu") == []
    shown.press("Escape")
    expect(title(shown, "File")).to_be_focused()
    expect(shown.page.get_by_role("menu")).to_have_count(0)
    shown.press("Enter")
    expect(item(shown, "New")).to_be_focused()
    shown.press("ArrowRight", "ArrowRight")
    expect(item(shown, "Interfaces")).to_be_focused()
    shown.press("Enter")
    expect(shown.button("Add an interface")).to_be_focused()

    # A title that is clicked again closes its menu.
    title(shown, "View").click()
    expect(item(shown, "Problems")).to_be_visible()
    title(shown, "Help").hover()
    expect(item(shown, "Guided tour")).to_be_visible()
    title(shown, "Help").click()
    expect(shown.page.get_by_role("menu")).to_have_count(0)

    # The tools stay in their places, and show which is in use.
    tools = shown.page.get_by_role("group", name="Drawing tools").get_by_role("button")
    names = ["SelectV", "StateS", "TransitionT", "NoteN", "Actions"]  # each with its key
    expect(tools).to_have_text(names)
    places = [tool.bounding_box() for tool in tools.all()]
    shown.state("wait").click()
    expect(shown.button("Select")).to_have_attribute("aria-pressed", "true")
    shown.button("Transition").click()
    expect(shown.button("Transition")).to_have_attribute("aria-pressed", "true")
    expect(shown.button("Select")).to_have_attribute("aria-pressed", "false")
    expect(tools).to_have_text(names)
    assert [tool.bounding_box() for tool in tools.all()] == places
    shown.press("v")
    expect(shown.button("Transition")).to_have_attribute("aria-pressed", "false")
    expect(shown.state("wait")).to_be_focused()


# Safari gives a button no focus when it is clicked.
AS_SAFARI = """() => addEventListener("mousedown", (event) => {
    if (!event.target.closest("button")) return;
    event.preventDefault();
    document.activeElement.blur();
  }, true)"""


def test_a_click_on_its_button_or_elsewhere_closes_a_menu_also_where_clicks_give_no_focus(
    shown: EditorPage,
) -> None:
    page = shown.page
    page.evaluate(AS_SAFARI)
    menus = page.get_by_role("menu").or_(page.get_by_role("dialog", name="Robot"))
    buttons = [title(shown, "File"), *map(shown.button, ("Actions", "Other ways to run", "Robot"))]
    for end in (None, page.locator("hfsm-status .about")):
        for button in buttons:
            button.click()
            expect(menus).to_be_visible()
            (end or button).click()
            expect(menus).to_have_count(0)


def test_the_menu_of_the_selection_opens_by_keys_without_an_event_of_the_browser(shown: EditorPage) -> None:
    shown.page.evaluate("addEventListener('contextmenu', (event) => event.stopImmediatePropagation(), true)")
    on_canvas, in_tree = shown.state("wait"), shown.page.get_by_role("treeitem", name="go")
    for key in ("Shift+F10", "ContextMenu"):
        for place, name in ((on_canvas, "State wait"), (in_tree, "State go")):
            place.click()
            shown.press(key)
            expect(shown.page.get_by_role("menu", name=name)).to_be_visible()
            shown.press("Escape")
            expect(shown.page.get_by_role("menu")).to_have_count(0)
    expect(shown.state("go")).to_be_focused()


def test_the_page_fits_into_every_width_and_has_few_icons(shown: EditorPage) -> None:
    shown.state("wait").click()
    shown.press("Shift+Enter")
    expect(shown.page.get_by_role("textbox", name="Code of the state wait")).to_be_focused()
    assert 0 < shown.page.evaluate(ICONS) <= MOST_ICONS
    outside: list[str] = []
    for width in WIDTHS:
        shown.resize(width, 800)
        outside += shown.page.evaluate(OUTSIDE)
    shown.resize(320, 800)
    shown.button("Menus").click()
    item(shown, "View").click()
    shown.page.get_by_role("menuitemcheckbox", name="Tree of automata").click()
    expect(shown.page.get_by_role("tree")).to_be_visible()
    outside += shown.page.evaluate(OUTSIDE)
    assert outside == []


def test_the_newest_errors_are_shown_until_they_are_dismissed_and_the_others_counted(
    shown: EditorPage,
) -> None:
    shown.page.clock.install()
    shown.page.evaluate(
        """async () => {
            const path = document.querySelector("script[src$='/app.js']").src.replace("shell/app.js", "kit/notices.js");
            const {notify} = await import(path);
            for (let each = 1; each <= 5; each++) notify(`Error ${each}`, "error");
            notify("Done");
        }"""
    )
    # An error stays until it is dismissed, unlike what was done.
    expect(shown.page.locator(".notice.info")).to_have_text(re.compile("^Done"))
    shown.page.clock.fast_forward("10:00")
    expect(shown.page.locator(".notice.info")).to_have_count(0)
    expect(shown.page.locator(".notice.error")).to_have_count(5)
    errors = shown.page.locator(".notice:visible")
    expect(errors).to_contain_text(["Error 3", "Error 4", "Error 5"])
    shown.button("2 older errors").click()
    expect(errors).to_have_count(5)
    shown.button("Fewer").click()
    expect(errors).to_have_count(3)
    errors.last.get_by_role("button", name="Dismiss").click()
    expect(errors).to_contain_text(["Error 2", "Error 3", "Error 4"])
    expect(shown.button("1 older error")).to_be_visible()
    shown.button("Dismiss all").click()
    expect(errors).to_have_count(0)
    expect(shown.button("Dismiss all")).to_have_count(0)
    shown.spent = True  # its clock is not the usual one any more


def test_the_palette_leads_to_a_part_of_a_panel_by_what_people_call_it(shown: EditorPage) -> None:
    for words, button in (
        ("import", "Add a library"),
        ("topic", "Add a topic"),
        ("prove", "Add a property"),
    ):
        shown.press("Control+k")
        field = shown.page.get_by_role("combobox", name="What to do")
        field.fill(words)
        field.press("Enter")
        expect(shown.button(button)).to_be_focused()
