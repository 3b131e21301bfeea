"""The task of an exercise beside the drawing, and handing in what was drawn for it."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from pathlib import Path

import pytest
from playwright.sync_api import Browser, Locator, expect

from tests.support.browser import Box, EditorPage, editor_page
from tests.support.editor import Editor
from tests.support.limits import PAGE_LIMIT
from tests.support.places import ROOT
from tests.support.waiting import until
from visualhfsm_classes import read_exercise
from visualhfsm_classes._handout import handout

MARKS = (
    "**7 of 10**\n\n| Asked | What happened |\n|---|---|\n| to the left | <img src=x onerror=alert(1)> |\n"
)


@pytest.fixture
def path(root: Path) -> Path:
    """The document of a pupil who got an exercise."""
    folder = root / "look"
    folder.mkdir()
    for name, content in handout(read_exercise(ROOT / "exercises/look"), "en").items():
        (folder / name).write_bytes(content)
    return folder / "look.xml"


@pytest.fixture
def shown(browser: Browser, opened: Editor) -> Iterator[EditorPage]:
    """A page that has just been loaded: the task opens by itself in it, and the focus has no place yet."""
    with editor_page(browser, opened) as shown:
        shown.state("left").wait_for()
        yield shown


def task(shown: EditorPage) -> Locator:
    return shown.page.get_by_role("article", name="Task")


def test_the_task_opens_once_by_itself_and_folds(shown: EditorPage) -> None:
    page = shown.page
    expect(task(shown)).to_contain_text("Draw a transition from left to right. Give it the kind Time")
    expect(task(shown).get_by_role("row", name="Then it looks to the right 3")).to_be_visible()
    assert shown.violations(".task") == []
    shown.press("Alt+k")
    expect(page.locator(".side")).to_have_count(0)
    expect(shown.state("left")).to_be_focused()
    page.reload()
    expect(shown.state("left")).to_be_visible()
    expect(page.locator(".side")).to_have_count(0)
    shown.choose_in("View", "Task")
    expect(task(shown)).to_be_focused()


def test_the_task_is_in_the_language_of_the_page_on_a_phone_too(browser: Browser, opened: Editor) -> None:
    with editor_page(browser, opened, width=390, height=844, language="es") as shown:
        words = shown.page.get_by_role("article", name="Tarea")
        expect(words).to_contain_text("Que sea de tipo Tiempo, con 2000 milisegundos.")
        drawing = Box.of(shown.page.locator("hfsm-canvas"))
        assert not drawing.overlaps(Box.of(words))
        assert drawing.height > Box.of(words).height / 2


def test_marks_and_pictures_that_lie_beside_it_are_shown_and_nothing_else(
    shown: EditorPage, path: Path
) -> None:
    shutil.copy(ROOT / "docs/pictures/editor/start.png", path.with_name("robot.png"))
    shutil.copy(path.with_name("robot.png"), path.parents[1] / "other.png")
    text = "# Draw\n![a robot](robot.png) ![another](../other.png) [bad](javascript:alert(1)) [web](https://a.example)"
    path.with_name("task.md").write_text(text)
    path.with_name("marks.md").write_text(MARKS)
    expect(task(shown)).to_be_visible()  # it opens by itself; opened again, it shows what lies there by now
    shown.press("Alt+k", "Alt+k")
    expect(task(shown)).to_contain_text("Your marks")
    expect(task(shown)).to_contain_text("<img src=x onerror=alert(1)>")
    picture = task(shown).get_by_role("img")
    expect(picture).to_have_count(1)
    assert picture.evaluate("async (img) => (await img.decode(), img.naturalWidth)") > 0
    expect(task(shown).get_by_role("link")).to_have_attribute("rel", "noopener noreferrer")


def test_a_document_is_handed_in_where_it_is_collected_and_again_only_after_a_question(
    shown: EditorPage, root: Path
) -> None:
    (root / "hand-in").mkdir()
    copy = root / "hand-in/look.xml"
    shown.state("left").click()
    shown.press("F2")
    shown.page.locator(".rename").wait_for()
    shown.insert("first")
    shown.press("Enter")
    expect(shown.state("first")).to_be_visible()
    shown.choose_in("File", "Hand in")
    expect(shown.page.locator(".notice", has_text="your teacher collects hand-in/look.xml")).to_be_visible()
    assert "<name>first</name>" in copy.read_text()
    expect(shown.page.locator(".task [role=status]")).to_contain_text("Handed in on")
    copy.write_text("earlier")
    shown.page.locator(".task").get_by_role("button", name="Hand in").click()
    expect(shown.page.get_by_role("dialog", name="Hand in again?")).to_be_visible()
    assert copy.read_text() == "earlier"
    shown.button("Hand in again").click()
    until(lambda: "<name>first</name>" in copy.read_text(), PAGE_LIMIT)


def test_where_nobody_collects_it_is_said_what_to_do(shown: EditorPage, path: Path) -> None:
    shown.page.locator(".task").get_by_role("button", name="Hand in").click()
    dialog = shown.page.get_by_role("dialog", name="Give it to your teacher")
    expect(dialog).to_contain_text("look/look.xml")
    with shown.page.expect_download() as found:
        shown.button("Download it").click()
    assert found.value.suggested_filename == "look.xml"
    assert Path(found.value.path()).read_bytes() == path.read_bytes()


def test_a_state_opens_on_the_first_code_that_it_has(shown: EditorPage) -> None:
    shown.state("left").locator(".body").dblclick()
    expect(shown.page.get_by_role("tab", name="Entry")).to_have_attribute("aria-selected", "true")
    expect(shown.page.get_by_role("textbox", name="Entry code of the state left")).to_be_focused()


def test_the_keyboard_comes_to_the_first_state_by_one_link(shown: EditorPage) -> None:
    expect(shown.state("left")).to_be_visible()
    shown.press("Tab")
    expect(shown.button("Skip to the drawing")).to_be_focused()
    shown.press("Enter")
    expect(shown.state("left")).to_be_focused()
