"""The paper's third experiment, drawn with mouse and keyboard."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest
from playwright.sync_api import Browser, expect

from codegen.diagnostics import Diagnostics
from codegen.hfsm import read_document
from codegen.hfsm.document import Automaton, Document
from tests.support.browser import EditorPage, editor_page
from tests.support.drawing import Draftsman
from tests.support.editor import editor
from tests.support.places import ROOT
from tests.support.screenshots import picture

pytestmark = pytest.mark.slow


def read(path: Path) -> Document:
    document = read_document(path, Diagnostics())
    assert document is not None
    return document


def content(document: Document) -> object:
    """The content of a document, without positions and ids."""

    def of(automaton: Automaton) -> object:
        names = {state.id: state.name for state in automaton.states}
        children = {child.id: child for child in document.automata}
        return (
            automaton.iteration_time.text,
            automaton.variables.text.strip(),
            automaton.functions.text.strip(),
            automaton.imported and automaton.imported.file.text,
            {
                state.name: (
                    state.initial,
                    state.code.text,
                    [(each.name, each.value.text) for each in state.arguments],
                    [of(children[each]) for each in state.children],
                )
                for state in automaton.states
            },
            {
                (names[each.origin], names[each.destination], each.name): (
                    each.type,
                    each.trigger.text,
                    each.code.text,
                )
                for each in automaton.transitions
            },
        )

    assert document.root is not None
    return (
        document.description.text,
        [library.name.text for library in document.libraries],
        [(each.name, each.type, each.identity) for each in document.interfaces],
        of(document.root),
    )


@pytest.fixture
def shown(browser: Browser, root: Path) -> Iterator[EditorPage]:
    (root / "follow_ball.xml").write_bytes((ROOT / "behaviors" / "follow_ball.xml").read_bytes())
    with editor(root) as running, editor_page(browser, running) as shown:
        yield shown


def test_the_third_experiment_is_drawn(shown: EditorPage, root: Path) -> None:
    wanted = read(ROOT / "behaviors" / "dance_and_follow.xml")
    path = root / "dance_and_follow.xml"
    draw(shown, wanted, path)
    save(shown, path)
    assert content(read(path)) == content(wanted)


def draw(shown: EditorPage, wanted: Document, path: Path) -> None:
    """Draw a document after the model of another one; `green` is a copy of `red` with another color.

    It is saved on the way, since imports are relative to its file.
    """
    shown.page.get_by_role("heading", name="Draw what your robot does").wait_for()
    picture(shown.page, "start")
    shown.page.get_by_role("button", name="Empty").click()
    expect(shown.page.locator("hfsm-canvas .empty")).to_be_visible()
    hand = Draftsman(shown, wanted)
    root, follow, red, green, dance = wanted.automata
    assert red.imported is not None
    assert green.imported == red.imported

    hand.component_data()
    shown.press("Alt+i")
    expect(shown.page.locator(".field-problems")).to_have_count(0)
    picture(shown.page, "data")
    hand.automaton_data(root)
    hand.states(root.states)
    hand.transitions(root)
    save_as(shown, path)

    hand.enter("followBall")
    hand.states(follow.states[:1])
    hand.automaton_data(follow)
    hand.enter("red")
    hand.import_file(red.imported)
    shown.expect_states("follow", "search")
    hand.leave()
    hand.arguments(follow.states[0])
    expect(shown.page.locator("hfsm-status")).to_contain_text("No problems")

    shown.state("red").click()
    shown.press("Control+c", "Control+v")
    expect(shown.page.locator(".state")).to_have_count(2)
    expect(shown.state("red 2")).to_be_focused()  # selected, which it is a little later than drawn
    expect(shown.page.locator(".state.selected")).to_have_count(1)
    shown.press("F2")
    shown.name("green")
    shown.expect_states("red", "green")
    x, y = shown.middle_of("green")
    shown.drag((x, y), (x + 220, y - 40))
    expect(shown.page.locator(".last-step")).to_have_text("Move “green”")
    shown.button("Fit").click()
    hand.transitions(follow)
    hand.arguments(follow.states[1])
    hand.leave()

    hand.enter("dance")
    hand.automaton_data(dance)
    hand.states(dance.states)
    for state in dance.states:
        hand.code_of(state)
    picture(shown.page, "code")
    hand.transitions(dance)
    hand.leave()
    status = shown.page.locator("hfsm-status")
    shown.press("Shift+L")
    expect(status).to_contain_text("Arrange all automata")
    shown.button("Fit").click()
    expect(status).to_contain_text("No problems")
    picture(shown.page, "drawn")


def save_as(shown: EditorPage, path: Path) -> None:
    shown.press("Control+Shift+S")
    expect(shown.page.get_by_role("textbox", name="Name", exact=True)).to_be_focused()
    shown.type(path.stem)
    shown.press("Enter")
    expect(shown.page.get_by_role("status").filter(has_text=f"Saved {path.name}")).to_be_visible()


def save(shown: EditorPage, path: Path) -> None:
    shown.press("Control+s")
    expect(shown.page.locator(".dirty")).to_have_count(0)
    expect(shown.page.locator("hfsm-status")).to_contain_text("No problems")
