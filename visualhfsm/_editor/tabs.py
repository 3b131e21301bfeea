"""The open documents, by the numbers that the windows know."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import count
from pathlib import Path

from codegen.messages import Message
from visualhfsm._base.errors import EditError, MissingError
from visualhfsm.project._document import OpenDocument

from .tab import Tab


class Tabs:
    """The tabs in the order in which they were opened."""

    def __init__(self) -> None:
        self._tabs: dict[int, Tab] = {}
        self._numbers = count(1)

    def __iter__(self) -> Iterator[Tab]:
        return iter([*self._tabs.values()])

    def __len__(self) -> int:
        return len(self._tabs)

    def __contains__(self, number: object) -> bool:
        return number in self._tabs

    def next_number(self) -> int:
        """Return the number of a new tab."""
        return next(self._numbers)

    def add(self, tab: Tab) -> None:
        """Add a tab."""
        self._tabs[tab.id] = tab

    def remove(self, tab: Tab) -> None:
        """Remove a tab, whose document is closed."""
        del self._tabs[tab.id]

    def get(self, number: int) -> Tab:
        """Return a tab; raises MissingError."""
        if number not in self._tabs:
            raise MissingError.because("tab {number} is not open", number=number)
        return self._tabs[number]

    def editable(self, number: int) -> Tab:
        """Return a tab to change its document; raises MissingError, or EditError for that of a recording."""
        tab = self.get(number)
        if tab.recording is not None:
            raise EditError(
                Message("{title} cannot be changed", title=tab.shown.title),
                "a recording contains it as it ran",
                "make a copy with `Save as`, which can be changed",
            )
        return tab

    def of_document(self, document: OpenDocument) -> Tab | None:
        """Return the tab of an open document."""
        return next((tab for tab in self if tab.document is document), None)

    def of_file(self, path: Path) -> Tab | None:
        """Return the tab of a file."""
        return next((tab for tab in self if tab.shown.path == path), None)

    def of_component(self, component: str) -> Tab | None:
        """Return the tab of a component, preferably the one that runs it."""
        tabs = sorted(self, key=lambda tab: not tab.is_started)
        return next((tab for tab in tabs if tab.component == component), None)
