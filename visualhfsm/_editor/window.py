"""One browser window: messages that wait for it, and the documents that were sent to it.

Only the changes of documents are sent. Versions of a document share what did not change, so that two of them
are compared quickly.

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
from dataclasses import replace
from itertools import count
from typing import Any, Final, NamedTuple, TypeVar

import msgspec

from codegen.hfsm.document import Annotation, Automaton, Document, State, Transition
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

Item = TypeVar("Item", State, Transition, Annotation)


class Sent(NamedTuple):
    """What a window has of a document: its automata, and what it is called."""

    document: Document
    name: str

    def header(self) -> dict[str, Any]:
        """Return everything that the page gets of it, except its automata."""
        return {"name": self.name, **view(self.document)}


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
        self._sent: dict[int, Sent] = {}  # the documents as the window has them, by tab
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
        """Send everything from now on, in one of LANGUAGES; the window knows nothing yet."""
        self.greeted = True
        self.language = language
        self._sent.clear()

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
        """Send what is new in the document of a tab."""
        if self.greeted:
            self._pushes[DocumentPush, tab.id] = tab
            self._filled.set()

    def close(self, tab: int) -> None:
        """Announce that a tab is closed, and send no more of it."""
        self._sent.pop(tab, None)
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
        # Created when it is sent: a slow window gets one patch with all changes in between.
        shown = tab.shown
        known = self._sent.get(tab.id)
        version = self._sent[tab.id] = Sent(shown.document, shown.title)
        change = None if known is None else patch(known, version)
        return DocumentPush(
            tab=tab.id,
            revision=shown.revision,
            undo=tuple(UndoStep(name=each.name, revision=each.revision) for each in shown.undo),
            redo=tuple(UndoStep(name=each.name, revision=each.revision) for each in shown.redo),
            dirty=shown.dirty,
            full=full(version) if change is None else msgspec.UNSET,
            patch=msgspec.UNSET if change is None else change,
        )


def full(version: Sent) -> msgspec.Raw:
    """Return the JSON of a whole document: its own fields, and `automata`."""
    automata = [view(automaton) for automaton in version.document.automata]
    return msgspec.Raw(msgspec.json.encode({**version.header(), "automata": automata}))


def patch(old: Sent, new: Sent) -> msgspec.Raw | None:
    """Return the changes from one version to another as JSON, without the unchanged parts.

    `document`: its own fields, if one changed; `automata`: those that are new; `parts`: what changed in
    those that were there, see `_part`; `removed`: ids; `order`: all ids in their order, if that changed.
    None when ids of automata are not unique.
    """
    former = {automaton.id: automaton for automaton in old.document.automata}
    now = {automaton.id: automaton for automaton in new.document.automata}
    if len(former) < len(old.document.automata) or len(now) < len(new.document.automata):
        return None
    whole: list[dict[str, Any]] = []
    parts: list[dict[str, Any]] = []
    for automaton in now.values():
        known = former.get(automaton.id)
        if known is automaton:
            continue
        part = None if known is None else _part(known, automaton)
        if part is None:
            whole.append(view(automaton))
        elif part:
            parts.append({"id": automaton.id, **part})
    found: dict[str, Any] = {}
    if (header := new.header()) != old.header():
        found["document"] = header
    if whole:
        found["automata"] = whole
    if parts:
        found["parts"] = parts
    if list(former) != list(now):
        found["removed"] = [number for number in former if number not in now]
        found["order"] = list(now)
    return msgspec.Raw(msgspec.json.encode(found))


def _part(old: Automaton, new: Automaton) -> dict[str, Any] | None:
    """Return what changed in an automaton; None when ids of its items are not unique.

    `fields`: those of the automaton itself that changed; `states`, `transitions`, `annotations`: what changed
    in these.
    """
    states = _items(old.states, new.states)
    transitions = _items(old.transitions, new.transitions)
    annotations = _items(old.annotations, new.annotations)
    if states is None or transitions is None or annotations is None:
        return None
    former = view(replace(old, states=(), transitions=(), annotations=()))
    now = view(replace(new, states=(), transitions=(), annotations=()))
    fields = {name: value for name, value in now.items() if value != former[name]}
    changed = {"fields": fields, "states": states, "transitions": transitions, "annotations": annotations}
    return {name: value for name, value in changed.items() if value}


def _items(old: tuple[Item, ...], new: tuple[Item, ...]) -> dict[str, Any] | None:
    """Return what changed in a list; None when two items have the same id.

    `changed`: the items that differ, and the new ones, which stand at the end; `removed`: ids; `order`: all
    ids in their order, if that is another one then.
    """
    if old is new:
        return {}
    former = {each.id: each for each in old}
    now = {each.id: each for each in new}
    if len(former) < len(old) or len(now) < len(new):
        return None
    found: dict[str, Any] = {}
    # Most are identical: comparing them costs nothing.
    changed = [each for each in new if (known := former.get(each.id)) is not each and known != each]
    if changed:
        found["changed"] = [view(each) for each in changed]
    if removed := former.keys() - now.keys():
        found["removed"] = sorted(removed)
    kept = [number for number in former if number in now]
    order = list(now)
    if kept + [number for number in order if number not in former] != order:
        found["order"] = order
    return found
