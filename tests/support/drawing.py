"""Draw a document in the editor like a person: click, drag, and enter texts, of which the longer ones are pasted."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import Final

from playwright.sync_api import Locator, expect

from codegen.hfsm.document import Automaton, Document, Import, State, Transition
from tests.support.browser import EditorPage
from tests.support.panels import add, show_list

__all__ = ["Draftsman"]

_ROW: Final = (0.25, 0.75)  # parts of the canvas, across
_HEIGHT: Final = 0.5


class Draftsman:
    """Draws the content of a document into a window with an empty document."""

    def __init__(self, shown: EditorPage, document: Document) -> None:
        self.shown = shown
        self.document = document
        shown.page.context.grant_permissions(["clipboard-read", "clipboard-write"])

    def states(self, states: Sequence[State]) -> None:
        """Draw the states of an automaton in a row; the first one automatically becomes the initial state."""
        box = self.shown.page.locator("hfsm-canvas").bounding_box()
        assert box is not None
        for state, part in zip(states, _ROW, strict=False):
            self.shown.button("State").click()
            self.shown.page.mouse.click(box["x"] + part * box["width"], box["y"] + _HEIGHT * box["height"])
            self.shown.name(state.name)
            expect(self.shown.state(state.name)).to_have_count(1)
        self.shown.button("Fit").click()

    def transitions(self, automaton: Automaton) -> None:
        """Drag from state to state, name each transition, and set its trigger and its code."""
        names = {state.id: state.name for state in automaton.states}
        for transition in automaton.transitions:
            before = len(self.shown.arcs())
            self.shown.connect(names[transition.origin], names[transition.destination])
            expect(self.shown.page.locator(".transition[data-key]")).to_have_count(before + 1)
            self.shown.name(transition.name)
            self._fires(transition)

    def _fires(self, transition: Transition) -> None:
        expect(self.shown.page.locator(".transition.selected")).to_have_count(1)
        self.shown.edit_code()
        name = self.shown.page.get_by_role("textbox", name="Name of the transition")
        expect(name).to_have_value(transition.name)
        if transition.type == "time":
            self.shown.choose("Time")
            self.shown.page.get_by_label("After", exact=True).fill(transition.trigger.text)
        else:
            self.code(f"Condition of {transition.name}", transition.trigger.text)
        self.code(f"Code of the transition {transition.name}", transition.code.text)
        self.shown.press("Escape")

    def import_file(self, imported: Import) -> None:
        """Import the content of the shown automaton from another document."""
        self._timing()
        self.shown.page.get_by_label("File", exact=True).fill(imported.file.text)
        self.shown.press("Tab")

    def arguments(self, state: State) -> None:
        """Set the arguments of a state for its automaton."""
        self.shown.state(state.name).click()
        self.shown.edit_code()
        self.shown.page.get_by_role("tab", name="Arguments").click()
        for argument in state.arguments:
            self.code(f"Argument {argument.name}", argument.value.text)
        self.shown.press("Escape")

    def code_of(self, state: State) -> None:
        """Open the code of a state next to the canvas and enter it."""
        if not state.code.text:
            return
        self.shown.state(state.name).click()
        self.shown.edit_code()
        self.code(f"Code of the state {state.name}", state.code.text)
        self.shown.press("Escape")

    def code(self, label: str, text: str) -> None:
        """Enter a text into a code field: one line at once, which is less work than to type it; more lines are pasted."""
        if not text:
            return
        field = self.shown.page.get_by_role("textbox", name=label, exact=True)
        field.click()
        self.shown.press("Control+a")
        if "\n" in text:
            self.paste(text)
        else:
            self.shown.insert(text)
        if self.shown.page.locator(".cm-tooltip").count():
            self.shown.press("Escape")
        expect(field).to_have_text(re.compile(re.escape(text.split("\n", 1)[0])))

    def paste(self, text: str) -> None:
        """Copy a text elsewhere and paste it."""
        self.shown.page.evaluate("text => navigator.clipboard.writeText(text)", text)
        self.shown.press("Control+v")

    def enter(self, state: str) -> None:
        """Open the automaton of a state; it is created if the state has none."""
        self.shown.state(state).click()
        self.shown.press("Control+Enter")
        expect(self.shown.page.locator("hfsm-breadcrumbs [aria-current]")).to_have_text(state)

    def leave(self) -> None:
        """Go to the automaton above."""
        depth = self.shown.page.locator("hfsm-breadcrumbs li").count()
        self.shown.button("Up").click()
        expect(self.shown.page.locator("hfsm-breadcrumbs li")).to_have_count(depth - 1)

    def automaton_data(self, automaton: Automaton) -> None:
        """Set the period, the variables and the functions of the shown automaton."""
        self._timing().fill(automaton.iteration_time.text)
        if automaton.variables.text:
            self.shown.press("Alt+v")
            self.code("Variables", automaton.variables.text)
        if automaton.functions.text:
            self.shown.press("Alt+f")
            self.code("Functions", automaton.functions.text)

    def _timing(self) -> Locator:
        """Show the data of the automaton, and wait until it has the focus, a moment later."""
        self.shown.press("Alt+t")
        period = self.shown.page.get_by_label("Period", exact=True)
        expect(period).to_be_focused()
        return period

    def component_data(self) -> None:
        """Enter the description of the component, and what it uses."""
        show_list(self.shown, "Alt+i", "interface")
        self.shown.page.get_by_label("Description", exact=True).fill(self.document.description.text)
        for library in self.document.libraries:
            self.entry("library", library.name.text, {})
        for interface in self.document.interfaces:
            self.entry(
                "interface",
                interface.name,
                {"Interface": interface.type, "On the robot": interface.identity},
            )

    def entry(self, noun: str, name: str, fields: dict[str, str]) -> Locator:
        """Add an entry to a list of the component."""
        entry = add(self.shown, noun, name)
        for label, text in fields.items():
            entry.get_by_label(label, exact=True).fill(text)
        return entry
