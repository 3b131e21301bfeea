"""One browser window: what waits to be sent to it, and what it was sent already.

Nothing grows here while a window is slow: of each thing only the newest value waits, and it is made when it
can be sent. Answers wait in order; there are never more of them than requests under way. Output of components
is kept line by line, and the oldest lines are dropped first.
"""

from __future__ import annotations

import asyncio
from collections import deque
from collections.abc import Callable, Hashable

import msgspec

from visualhfsm.services import Output, OutputLine, Push, Snapshot, Stale, Structure

from .protocol import Answer, Closed, DocumentPush, ErrorAnswer, encode
from .rendering import Version, full, patch
from .tab import Tab

__all__ = ["Window"]


class Window:
    """Gets the changes of all tabs from the moment it is `greeted`. Used on the event loop only."""

    def __init__(self, output_lines: int) -> None:
        self.greeted = False
        self._sent: dict[int, Version] = {}  # the documents as the window has them, by tab
        self._answers: list[bytes] = []
        self._pushes: dict[tuple[Hashable, object], Callable[[], bytes]] = {}
        self._output: dict[int, deque[OutputLine]] = {}
        self._dropped: dict[int, int] = {}
        self._whole: set[int] = set()
        self._output_lines = output_lines
        self._filled = asyncio.Event()

    def greet(self) -> None:
        """Send everything from now on; the window knows nothing yet."""
        self.greeted = True
        self._sent.clear()

    def answer(self, answer: Answer | ErrorAnswer) -> None:
        """Send an answer; everything that was pushed before goes first."""
        self._answers.append(encode(answer))
        self._filled.set()

    def push(self, push: Push) -> None:
        """Send a message; it replaces an older value of the same thing that still waits."""
        if not self.greeted:
            return
        if isinstance(push, Output):
            self._add_output(push)
        else:
            about = (
                push.component
                if isinstance(push, Snapshot | Structure | Stale)
                else getattr(push, "tab", None)
            )
            self._pushes[type(push), about] = lambda: encode(push)
        self._filled.set()

    def show(self, tab: Tab) -> None:
        """Send what is new in the document of a tab."""
        if self.greeted:
            self._pushes[DocumentPush, tab.id] = lambda: self._document(tab)
            self._filled.set()

    def close(self, tab: int) -> None:
        """Send that a tab is closed, and nothing of it any more."""
        self._sent.pop(tab, None)
        for key in [key for key in self._pushes if key[1] == tab]:
            del self._pushes[key]
        self.push(Closed(tab=tab))

    async def next(self) -> list[bytes]:
        """Wait until there is something to send and return it: first what was pushed, then the answers."""
        await self._filled.wait()
        self._filled.clear()
        answers, self._answers = self._answers, []
        pushes, self._pushes = self._pushes, {}
        output, self._output = self._output, {}
        dropped, self._dropped = self._dropped, {}
        whole, self._whole = self._whole, set()
        # Output first: what a component wrote comes before the news that it ended.
        messages = [
            encode(Output(tab=tab, lines=list(lines), dropped=dropped[tab], whole=tab in whole))
            for tab, lines in output.items()
        ]
        return messages + [make() for make in pushes.values()] + answers

    def _add_output(self, push: Output) -> None:
        """Keep lines of output; those that are the whole replace those that wait."""
        if push.whole:
            self._whole.add(push.tab)
            self._output.pop(push.tab, None)
            self._dropped.pop(push.tab, None)
        lines = self._output.setdefault(push.tab, deque())
        lines.extend(push.lines)
        excess = max(0, len(lines) - self._output_lines)
        for _ in range(excess):
            lines.popleft()
        self._dropped[push.tab] = self._dropped.get(push.tab, 0) + excess + push.dropped

    def _document(self, tab: Tab) -> bytes:
        # Made when it is sent: a window that is slow gets one patch over all that happened meanwhile.
        shown = tab.shown
        known = self._sent.get(tab.id)
        version = self._sent[tab.id] = Version(shown.document, shown.name)
        change = None if known is None else patch(known, version)
        return encode(
            DocumentPush(
                tab=tab.id,
                revision=shown.revision,
                undo=shown.undo,
                redo=shown.redo,
                dirty=shown.dirty,
                full=full(version) if change is None else msgspec.UNSET,
                patch=msgspec.UNSET if change is None else change,
            )
        )
