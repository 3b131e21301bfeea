"""Record what automata do: an observer, and the bookkeeping that all recorders share."""

from __future__ import annotations

import logging
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager, nullcontext
from typing import Any, Final

import msgspec

from hfsm_runtime.recording_file import messages
from hfsm_runtime.recording_file.writer import Entry
from interfaces.hfsm import ComponentSnapshot

from .._automaton import Automaton, Event, Transition
from .._variables import cells_of
from ..errors import describe
from ..observer import Observer
from ..tree import Actor, ChangeKind, Tree
from .values import readable, without_addresses

_LONGEST_MESSAGE: Final = 4000
TURN_LIMIT: Final = 0.1
"""Wall seconds that a thread waits for the lock: code that blocks unseen must not hold up the others."""


def automaton_context(id: int) -> str:
    """Return the context of an automaton's cycles."""
    return f"automaton {id}"


class CodeLock:
    """Let the threads of a component run user code one at a time, so that their order can be recorded.

    A thread holds the lock from the beginning of a cycle to its end, except while it waits: for a servant,
    for a time, or for the automata below. What it does in between is atomic for other threads, so a replay
    needs only the order of the holders.

    A thread that waits for more than `patience` wall seconds takes the lock from its holder, whose
    code blocks unseen; both run side by side then, and `overlap` is called with the two contexts.
    """

    def __init__(self, overlap: Callable[[str, str], None], patience: float = TURN_LIMIT) -> None:
        self._overlap = overlap
        self._patience = patience
        self._released = threading.Condition(threading.Lock())
        self._holder: str | None = None
        self._here = threading.local()

    @property
    def context(self) -> str | None:
        """The context whose code this thread runs; None outside the runtime's threads and calls."""
        found: str | None = getattr(self._here, "context", None)
        return found

    def acquire(self, context: str) -> None:
        """Take the lock for code of this thread."""
        with self._released:
            if not self._released.wait_for(lambda: self._holder is None, self._patience):
                self._overlap(context, self._holder or "")
            self._holder = context
        self._here.context = context

    def release(self) -> None:
        """Give the lock back; without effect on a thread that does not hold it."""
        context, self._here.context = self.context, None
        if context is None:
            return
        with self._released:
            if self._holder == context:
                self._holder = None
                self._released.notify()

    @contextmanager
    def held(self, context: str) -> Iterator[None]:
        """Hold the lock in a `with` block; if this thread holds it already, its context does not change."""
        if self.context is not None:
            yield
            return
        self.acquire(context)
        try:
            yield
        finally:
            self.release()

    @contextmanager
    def released(self) -> Iterator[None]:
        """Let other threads run code in a `with` block that waits; its readings belong to no context."""
        context = self.context
        if context is None:
            yield
            return
        self.release()
        try:
            yield
        finally:
            self.acquire(context)


class Recorder(Observer):
    """The common path of all recording: it determines the order of messages, their time and their context.

    `write` takes a message and never waits, and `start` is the wall time of the start in ns. `context` says
    whose code this thread runs, by default the holder of the lock.
    """

    def __init__(
        self, write: Callable[[Entry], object], start: int, context: Callable[[], str | None] | None = None
    ) -> None:
        self._write = write
        self.lock = CodeLock(self._overlap)
        self.takes_images: Callable[[], bool] = lambda: False
        """Returns whether images are recorded now."""
        self.images_left_out: Callable[[str], object] = lambda _attribute: None
        """Called when an image of a proxy is not recorded."""
        self._context = context or (lambda: self.lock.context)
        self.component_time: Callable[[], int] = lambda: 0
        """Returns the component time in ns; set as soon as there is one."""
        self._start = start
        self._variables = VariableWatch()
        self._topics: dict[int, str] = {}

    def watch(self, tree: Tree) -> None:
        """Record what the automata of a tree do."""
        self._topics = topics_of(tree)
        tree.observers.append(self)

    def now(self) -> int:
        """Return the time of a message in ns since the epoch."""
        return self._start + self.component_time()

    def put(
        self, topic: str, message: messages.Message | Callable[[], messages.Message], size: int = 200
    ) -> None:
        """Record a message that belongs to this moment."""
        self._write(Entry(topic, self.now(), message, size))

    def reading(self, kind: str, value: object) -> None:
        """Record a reading by user code; outside user code do nothing."""
        context = self._context()
        if context is not None:
            self.put("/readings", messages.Reading(context, kind, value))

    def ask(self, kind: str, read: Callable[[], Any], waits: Callable[[], float] | None) -> Any:  # noqa: ANN401
        """Return a reading of a clock and record it; while it waits, other threads run code."""
        with nullcontext() if waits is None else self.lock.released():
            value = read()
        self.reading(kind, value)
        return value

    def action(self, kind: str, **arguments: Any) -> None:  # noqa: ANN401 - JSON
        """Record a control command of the component."""
        self.put("/actions", messages.Action(kind, arguments))

    def snapshot(self, component: ComponentSnapshot) -> None:
        """Record what the monitor shows, for viewers."""
        shown = messages.Snapshot.of(component)
        self.put("/snapshots", shown, len(bytes(shown.component)))

    # The observer.

    def cycle_began(self, actor: Actor, at: int) -> None:
        """Record the beginning of a cycle."""
        self._put(actor, "/cycles", messages.Cycle(actor.automaton.id, actor.automaton.name, True, at))

    def guard_evaluated(self, actor: Actor, transition: Transition, value: bool, at: int) -> None:  # noqa: ARG002
        """Record the value of a guard."""
        automaton = actor.automaton
        self._put(
            actor,
            "/guards",
            messages.Guard(automaton.id, automaton.name, transition.id, transition.name, value),
        )

    def fired(self, actor: Actor, transition: Transition, at: int) -> None:  # noqa: ARG002
        """Record that a transition fires."""
        automaton = actor.automaton
        names = (automaton.state(each).name for each in (transition.origin, transition.destination))
        firing = messages.Firing(automaton.id, automaton.name, transition.id, transition.name, *names)
        self._put(actor, "/transitions", firing)

    def cycle_ended(self, actor: Actor, at: int) -> None:
        """Record the variables that the cycle changed, and its end."""
        values, gone = self._variables.changes(actor.automaton)
        if values or gone:
            changed = messages.Variables(actor.automaton.id, actor.automaton.name, values, gone)
            self._put(actor, "/variables", changed)
        self._put(actor, "/cycles", messages.Cycle(actor.automaton.id, actor.automaton.name, False, at))

    def changed(self, now: int, actor: Actor, kind: ChangeKind) -> None:
        """Record a change of state."""
        automaton, state = actor.automaton, actor.current
        change = messages.Change(automaton.id, automaton.name, state.id, state.name, kind.value, now)
        self._put(actor, "/automata", change)

    def event_sent(self, event: Event, now: int) -> None:  # noqa: ARG002
        """Record an event."""
        self.put("/events", messages.EventSent(event.name, readable(event.data), self._context() or ""))

    def code_failed(self, actor: Actor, error: Exception) -> None:
        """Record an exception of user code."""
        name, state = actor.automaton.name, actor.current.name
        self.put("/errors", messages.Failure(actor.automaton.id, name, state, describe_error(error)))

    def proof_failed(self, actor: Actor | None, message: str) -> None:
        """Record what a proof relies on and is not so in a cycle: elsewhere its order is not known."""
        if actor is not None:
            name, state = actor.automaton.name, actor.current.name
            self.put("/errors", messages.Failure(actor.automaton.id, name, state, message))

    def _put(self, actor: Actor, kind: str, message: messages.Message) -> None:
        self.put(f"{kind}/{self._topics.get(actor.automaton.id, actor.automaton.id)}", message)

    def _overlap(self, context: str, beside: str) -> None:
        self.put("/overlaps", messages.Overlap(context, beside))


class VariableWatch:
    """Find the variables of automata that have changed since the last time."""

    def __init__(self) -> None:
        self._known: dict[int, dict[str, bytes]] = {}
        self._cells: dict[int, tuple[Automaton, dict[str, Any]]] = {}

    def changes(self, automaton: Automaton) -> tuple[dict[str, Any], list[str]]:
        """Return the variables with new values, and the names of those without a value."""
        owner, cells = self._cells.get(automaton.id, (None, {}))
        if owner is not automaton:
            cells = dict(sorted(cells_of(automaton).items()))
            self._cells[automaton.id] = automaton, cells
        known = self._known.setdefault(automaton.id, {})
        changed: dict[str, Any] = {}
        gone: list[str] = []
        for name, cell in cells.items():
            try:
                value = cell.cell_contents
            except ValueError:  # nothing has been assigned
                if known.pop(name, None) is not None:
                    gone.append(name)
                continue
            if callable(value) or type(value).__name__ == "module":
                continue
            shown = readable(value)
            encoded = msgspec.json.encode(shown)  # 1, 1.0 and true are equal, but not the same
            if known.get(name) != encoded:
                known[name], changed[name] = encoded, shown
        return changed, gone


class LogRecorder(logging.Handler):
    """Record the lines that a component logs."""

    def __init__(self, recorder: Recorder) -> None:
        super().__init__()
        self._recorder = recorder

    def emit(self, record: logging.LogRecord) -> None:
        """Record a line."""
        try:
            text = record.getMessage()[:_LONGEST_MESSAGE]
        except Exception:  # noqa: BLE001 - its arguments are the user's own
            text = str(record.msg)[:_LONGEST_MESSAGE]
        level = min(max(record.levelno // 10, 1), 5)  # of foxglove.Log: from 1, debug, to 5, fatal
        stamp = messages.Stamp.of(self._recorder.now())
        self._recorder.put(
            "/log", messages.LogLine(stamp, level, text, record.name, record.filename, record.lineno)
        )


def describe_error(error: BaseException) -> str:
    """Return name and text of an exception, without what differs from process to process."""
    return without_addresses(describe(error)).encode("utf-8", "backslashreplace").decode()


def topics_of(tree: Tree) -> dict[int, str]:
    """Return a part of a topic for each automaton, by id: the names from the root down, made unique."""
    topics: dict[int, str] = {}
    for actor in tree.actors:
        above = f"{topics[actor.parent.automaton.id]}/" if actor.parent else ""
        name = "".join(c if c.isalnum() or c in "_-." else "_" for c in actor.automaton.name)
        topic = above + (name or "_")
        topics[actor.automaton.id] = (
            topic if topic not in topics.values() else f"{topic}.{actor.automaton.id}"
        )
    return topics
