"""One browser window: messages that wait for it.

Nothing grows here while a window is slow: only the newest value of each thing waits, and it is encoded when
it can be sent. Answers wait in order; while many do, no further requests of the window are read.

Output of components comes last, and one message at a time: the next one waits until the page has shown the
former. Otherwise a component that prints without end would fill all buffers up to the page with lines, and
the page would learn seconds late that the component was stopped. Of the lines that wait, the oldest are
dropped and counted.
"""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable, Hashable
from itertools import count
from typing import Any, Final

from codegen.hfsm.document import Document
from visualhfsm._base.languages import ENGLISH, encoder
from visualhfsm._document.views import view
from visualhfsm._monitor.messages import (
    Output,
    Push,
    RecentLines,
    Snapshot,
    Stale,
    StartedPush,
    Stopper,
    Structure,
)

from .protocol import Answer, Closed, DocumentPush, ErrorAnswer, UndoStep
from .tab import Tab

_SHOWN: Final = 1.0
"""Seconds after which output counts as shown: a hidden page may be asleep."""

_NUMBERS: Final = count(1)


class Window:
    """Gets the changes of all tabs after `greet`. Used on the event loop only."""

    def __init__(
        self,
        make_output: Callable[[], RecentLines],
        key: bytes = b"",
        *,
        is_viewer: bool = False,
        patience: float = _SHOWN,
    ) -> None:
        """Make a window; one that says nothing for `patience` s has shown its output."""
        self.greeted = False
        self.is_viewer: Final = is_viewer
        """True if it only looks on."""
        self.number: Final = next(_NUMBERS)
        """What its steps are known by, which may outlive it."""
        self.kind: Final[Stopper] = "viewer" if is_viewer else "window"
        """The word for it that others read when it stops a run."""
        self.key: Final = key
        """The key by which its page is let in again after a restart of the editor."""
        self.language = ENGLISH
        """The language of its page, one of LANGUAGES."""
        self.clipboard = ""
        """The states that were copied in it."""
        self._answers: list[bytes] = []
        self._pushes: dict[tuple[Hashable, object], Push | Tab] = {}
        self._make_output = make_output
        self._output: dict[int, RecentLines] = {}
        self._whole: set[int] = set()
        self._patience = patience
        self._showing: asyncio.TimerHandle | None = None
        """Set while the window shows output: the end of our patience."""
        self._filled = asyncio.Event()
        self._answered = asyncio.Event()

    def greet(self, language: str = ENGLISH) -> None:
        """Send everything from now on, in one of LANGUAGES."""
        self.greeted = True
        self.language = language

    def answer(self, answer: Answer | ErrorAnswer) -> None:
        """Send an answer; everything that was pushed before goes first."""
        self._answers.append(encoder(self.language).encode(answer))
        self._filled.set()

    async def room(self, most: int) -> None:
        """Wait while more answers than that wait to be sent."""
        while len(self._answers) > most:
            self._answered.clear()
            await self._answered.wait()

    def push(self, push: Push) -> None:
        """Send a message; it replaces an older value of the same thing that still waits."""
        if not self.greeted:
            return
        if isinstance(push, Output):
            self._add_output(push)
        else:
            if isinstance(push, StartedPush) and push.status == "generating":
                # What waits is of the former run.
                self._add_output(Output(tab=push.tab, lines=[], whole=True))
            kind: Hashable = type(push)
            about: object = getattr(push, "tab", None)
            if isinstance(push, Snapshot | Structure | Stale):
                about = push.component
            elif isinstance(push, StartedPush):
                kind = kind, push.status  # an end that was not requested is told, another one is not
            if isinstance(push, Snapshot | Structure | Stale | StartedPush):
                self._pushes.pop((kind, about), None)  # a moment after a silence ends it
            self._pushes[kind, about] = push
        self._filled.set()

    def show(self, tab: Tab) -> None:
        """Send the document of a tab."""
        if self.greeted:
            self._pushes[DocumentPush, tab.id] = tab
            self._filled.set()

    def close(self, tab: int) -> None:
        """Announce that a tab is closed, and send no more of it."""
        self._output.pop(tab, None)
        for key in [key for key in self._pushes if key[1] == tab]:
            del self._pushes[key]
        self.push(Closed(tab=tab))

    def output_shown(self) -> None:
        """Note that the window has shown the last output, and can take more."""
        if self._showing is not None:
            self._showing.cancel()
            self._showing = None
            self._filled.set()

    async def write(self, send: Callable[[str], Awaitable[None]]) -> None:
        """Send waiting messages as soon as there are any, until cancelled: pushes, answers, then output."""
        try:
            while True:
                await self._filled.wait()
                self._filled.clear()
                for message in self._news():
                    await send(message.decode())
                self._answered.set()
                if self._output and self._showing is None and not self._filled.is_set():
                    output = encoder(self.language).encode(self._take_output(next(iter(self._output))))
                    self._showing = asyncio.get_running_loop().call_later(self._patience, self.output_shown)
                    await send(output.decode())
        finally:
            if self._showing is not None:
                self._showing.cancel()

    def _news(self) -> list[bytes]:
        """Return everything that waits, encoded, but output."""
        answers, self._answers = self._answers, []
        pushes, self._pushes = self._pushes, {}
        messages: list[Push] = []
        for news in pushes.values():
            if isinstance(news, StartedPush) and news.status == "ended" and news.tab in self._output:
                messages.append(self._take_output(news.tab))  # its last lines say why it ended
            messages.append(self._document(news) if isinstance(news, Tab) else news)
        return [*map(encoder(self.language).encode, messages), *answers]

    def _take_output(self, tab: int) -> Output:
        output = self._output.pop(tab)
        whole = tab in self._whole
        self._whole.discard(tab)
        return Output(tab=tab, lines=list(output.lines), dropped=output.dropped, whole=whole)

    def _add_output(self, push: Output) -> None:
        """Keep lines of output; a whole output replaces the lines that wait."""
        if push.whole:
            self._whole.add(push.tab)
            self._output.pop(push.tab, None)
        self._output.setdefault(push.tab, self._make_output()).add(push.lines, push.dropped)

    def _document(self, tab: Tab) -> DocumentPush:
        # Created when it is sent: a slow window gets the newest one.
        shown = tab.shown
        return DocumentPush(
            tab=tab.id,
            revision=shown.revision,
            undo=tuple(UndoStep(name=each.name, revision=each.revision) for each in shown.undo),
            redo=tuple(UndoStep(name=each.name, revision=each.revision) for each in shown.redo),
            dirty=shown.dirty,
            full=full(shown.document, shown.title),
        )


def full(document: Document, name: str) -> dict[str, Any]:
    """Return what the page gets of a document: its `name`, its own fields, and its `automata`."""
    return {"name": name, **view(document), "automata": [view(each) for each in document.automata]}
