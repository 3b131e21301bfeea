"""Run a component against a recording, in the recorded order, in virtual time."""

from __future__ import annotations

import time
from collections.abc import Callable
from contextlib import ExitStack, suppress
from functools import partial
from typing import Any, Final, Self

from hfsm_runtime.recording_file.messages import Action, Change, Cycle, Gap, Message, Overlap, Reading, Result
from hfsm_runtime.recording_file.writer import Entry

from ..component import Component
from ..cycle import run_cycle
from ..errors import OnError, OnRefused
from ..recording.recorder import Recorder, automaton_context
from ..recording.run import MONITOR, START, restore_random
from ..timeline import slot_after, slot_from
from ..tree import ChangeKind, Run
from .comparison import Comparison
from .host import Host, act
from .script import Record, Recording, ReplayError, Script, context_of
from .threads import Answers, ReplayThread, ReplayThreads

_SECOND: Final = 1_000_000_000
_PROGRESS: Final = 1.0
"""Wall seconds between reports of progress."""
_MOST_OVERLAPS: Final = 20


class Replay:
    """One replay of one component, which is made here. Use it in a `with` block; `run` it once.

    `until` is a component time in ns. `make` returns the component, and `edited` another version of it that
    takes its place at the time `since`: silently, as a reload does, with states, timers and variables kept.
    """

    def __init__(
        self,
        recording: Recording,
        make: Callable[[], Component],
        until: int,
        *,
        edited: Callable[[], Component] | None = None,
        since: int = 0,
        progress: Callable[[float], None] = lambda _seconds: None,
    ) -> None:
        self.recording = recording
        self.notes: list[str] = []
        self._make = make
        self._edited = edited
        self._since = since
        self._progress = progress
        self._reported_at = time.monotonic()
        self._threads = ReplayThreads()
        self._script = Script(recording, until, self._passed)
        self._answers = Answers(self._script, self._threads)
        self.now: Final = self._answers.now
        self.comparison: Final = self._answers.comparison
        self.guesses: Final = self._answers.latest.guesses
        """Number of requests without a recorded answer that got an older one, by request."""
        recorder = Recorder(self._compare, 0, lambda: self._threads.context)
        recorder.component_time = self.now
        self._begun: set[str] = set()
        """The contexts of automata in the middle of a recorded cycle."""
        self._recorded_active: set[int] = set()
        self._periods: dict[int, int] = {}
        self._next_slots: dict[int, int] = {}
        self._on_error: OnError | None = None
        self._on_refused: OnRefused | None = None
        self._stack = ExitStack()
        self._stack.callback(self._threads.close)
        self._host = Host(recording, self._answers, recorder, self._stack)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._stack.close()

    def run(self) -> Comparison:
        """Replay to the end; raises ReplayError."""
        if "random" in self.recording.metadata:
            try:
                restore_random(self.recording.metadata["random"])
            except ValueError as error:
                raise ReplayError(str(error)) from error
        self._begin()
        while (record := self._script.peek_input()) is not None:
            self._run_unrecorded(record.time)
            if self._edited is not None and record.time >= self._since and self._host.resting:
                self._exchange(self._edited)
                self._edited = None
            self._step(record)
            if time.monotonic() - self._reported_at >= _PROGRESS:
                self._reported_at = time.monotonic()
                self._progress(self.now() / _SECOND)
            if self._answers.fatal is not None:
                raise self._answers.fatal
        self._run_unrecorded(self._script.time)
        self.comparison.finish()
        return self.comparison

    def _begin(self) -> None:
        """Make the component, on a thread of the replay, because its variables may read anything."""
        thread = self._threads[START]
        thread.run(partial(self._host.make, self._make))
        while not thread.idle:
            record = self._script.peek_input()
            fits = record is not None and context_of(record.message) == START
            self._answer(thread, record if fits else None)
        if thread.failure is not None:
            raise thread.failure
        if self._answers.fatal is not None:
            raise self._answers.fatal
        self._note_document()

    def _note_document(self) -> None:
        """Note when the document is not the recorded one, judging by its name."""
        recorded, here = self.recording.metadata.get("document"), self._host.component._hfsm_document
        if recorded and here != recorded:
            self.notes.append(f"the recording is of {recorded}, and {here} is compared with it")

    def _exchange(self, make: Callable[[], Component]) -> None:
        """Continue with another version of the component."""
        at = self._answers.own_time = self.now()
        thread = self._threads["exchange"]
        not_kept: list[str] = []
        try:
            thread.run(lambda: not_kept.extend(self._host.exchange(make, at)))
        finally:
            self._answers.own_time = None
        if thread.failure is not None:
            raise thread.failure
        self.notes.append(f"the edited document took over at {at / _SECOND:.3f} s")
        self.notes += [f"it could not keep: {text}" for text in not_kept]
        self._note_document()

    # Driving the code.

    def _step(self, record: Record) -> None:
        message = record.message
        context = context_of(message)
        if isinstance(message, Action):
            self._script.advance()
            self._act(message)
        elif isinstance(message, Gap):
            self.notes.append(
                f"the recording has a gap at {record.time / _SECOND:.3f} s, where {message.lost} messages "
                "were lost: the replay ends there"
            )
            self._script.stop()
        elif isinstance(message, Overlap):
            self._script.advance()
            if len(self.notes) < _MOST_OVERLAPS:
                self.notes.append(
                    f"the code of {message.beside} blocked at {self.now() / _SECOND:.3f} s, and "
                    f"{message.context} ran beside it: in which order is not known"
                )
        elif isinstance(message, Cycle) and not message.begins:
            self._end_cycle(message)
            self._script.advance()
        elif isinstance(message, Cycle | Reading | Result) and context:
            self._drive(record, context)
        else:
            self._script.advance()

    def _drive(self, record: Record, context: str) -> None:
        """Give a record to the code of its context, which may have to begin its cycle, or skip the record."""
        thread = self._threads[context]
        automaton = context.startswith("automaton ")
        if automaton and context not in self._begun:
            self._begin_cycle(thread, context)
            if self._script.peek() is record and thread.idle:
                self._script.advance()  # this cycle does not take place here
        elif isinstance(record.message, Result) and record.message.kind in ("async", "sample"):
            self._script.advance()
            self._deliver(thread, record, context)
            if record.message.kind == "async" and thread.idle:
                self._threads.pop(context).close()  # no more results arrive there
        elif isinstance(record.message, Cycle) or thread.idle:
            self._script.advance()
        else:
            self._answer(thread, record)

    def _begin_cycle(self, thread: ReplayThread, context: str) -> None:
        cycle = self._script.cycle_ahead(context)
        self._begun.add(context)
        run = self._host.tree.run(cycle.automaton) if cycle is not None else None
        if cycle is not None and run is not None and not self._is_unrecorded(run):
            self._run_cycle(thread, run, cycle.at)

    def _run_cycle(self, thread: ReplayThread, run: Run, at: int) -> None:
        self._answers.guesses_in_cycle = 0
        self._answers.latest.begin_cycle(thread.context)
        if self._host.ended.is_set() or not self._host.started:
            return
        self._next_slots[run.automaton.id] = slot_after(at, run.automaton.interval)
        run.stepping = self._host.tree.held
        thread.run(partial(run_cycle, self._host.tree, run, at, self._host.supervision))
        self._look_after(thread)

    def _end_cycle(self, message: Cycle) -> None:
        """Let a cycle end that takes longer in the replay than in the recording."""
        context = automaton_context(message.automaton)
        thread = self._threads[context]
        while not thread.idle and self._answers.fatal is None:
            self._answer(thread, None)
        self._begun.discard(context)

    def _answer(self, thread: ReplayThread, record: Record | None) -> None:
        """Answer waiting code: with this record, a later one, or nothing."""
        want = thread.want
        assert want is not None
        if record is not None and want.fits(record):
            self._script.advance()
            found: Record | None = record
        else:
            found = self._script.find(thread.context, want)
        if want.kind == "handover" and found is None:
            self._end_cycles_below(thread)
        thread.resume(found)
        self._look_after(thread)

    def _end_cycles_below(self, thread: ReplayThread) -> None:
        """End the cycles of automata whose parent waits for that, where the recording does not say how."""
        for run in self._host.tree.runs:
            below = self._threads[automaton_context(run.automaton.id)]
            while below is not thread and run.in_cycle and not run.active and not below.idle:
                self._answer(below, None)

    def _deliver(self, thread: ReplayThread, record: Record, context: str) -> None:
        deliver = self._answers.expected.get(context)
        if deliver is None or not thread.idle:
            return
        if isinstance(record.message, Result) and record.message.kind == "async":
            self._answers.expected.pop(context)
        thread.run(partial(deliver, record))
        self._look_after(thread)

    def _look_after(self, thread: ReplayThread) -> None:
        failure = thread.failure
        if not thread.idle or failure is None:
            return
        thread.failure = None
        if isinstance(failure, SystemExit):
            self.notes.append(
                f"the code of {thread.context} ended the component at {self.now() / _SECOND:.3f} s"
            )
            self._host.ended.set()
        elif isinstance(failure, Exception) and not thread.context.startswith("automaton "):
            self.notes.append(f"a callback failed: {type(failure).__name__}: {failure}")
        elif isinstance(failure, ReplayError):
            raise failure
        else:
            problem = f"{type(failure).__name__}: {failure}"
            raise ReplayError(f"{thread.context} cannot be replayed: {problem}") from failure

    def _act(self, action: Action) -> None:
        if action.kind == "made":
            self._take_settings(action.arguments)
        elif action.kind == "begin_at":
            self._host.begin_at(action.arguments)
        elif action.kind == "start":
            self._host.start(self._on_error, self._on_refused)
        elif self._host.started:
            thread = self._threads[MONITOR]
            thread.run(partial(act, self._host, action, self.now()))
            self._look_after(thread)

    def _take_settings(self, arguments: dict[str, Any]) -> None:
        """Take the settings of the component: its policies, and the periods of its automata."""
        with suppress(ValueError):  # then the document's policy applies
            self._on_error = OnError(arguments.get("on_error", ""))
        with suppress(ValueError):
            self._on_refused = OnRefused(arguments.get("on_refused", ""))
        periods = arguments.get("periods")
        if isinstance(periods, dict):
            self._periods = {int(key): value for key, value in periods.items() if str(key).isdecimal()}

    # Automata that run in the replay and did not in the recording.

    def _is_unrecorded(self, run: Run) -> bool:
        """Return whether an automaton runs cycles that the recording does not have."""
        automaton = run.automaton
        recorded_period = self._periods.get(automaton.id, 0)
        return automaton.id not in self._recorded_active or recorded_period != automaton.interval

    def _run_unrecorded(self, now: int) -> None:
        """Run the cycles that the recording does not have up to a time, ancestors first."""
        if not self._host.started:
            return
        while not self._host.ended.is_set() and not self._host.tree.held and self._answers.fatal is None:
            due: list[tuple[int, int, Run]] = []
            for index, run in enumerate(self._host.tree.runs):
                if run.active and not run.finished and self._is_unrecorded(run) and not run.in_cycle:
                    slot = slot_from(run.activated, run.automaton.interval)
                    slot = max(slot, self._next_slots.get(run.automaton.id, 0))
                    if slot < now:
                        due.append((slot, index, run))
            if not due:
                return
            slot, _, run = min(due)
            thread = self._threads[automaton_context(run.automaton.id)]
            if not thread.idle:
                return
            self._answers.own_time = slot
            try:
                self._run_cycle(thread, run, slot)
            finally:
                self._answers.own_time = None

    # The records.

    def _passed(self, record: Record) -> None:
        self._answers.latest.learn(record)
        self.comparison.recorded(record)
        message = record.message
        if isinstance(message, Change):
            if message.kind in (ChangeKind.GHOST.value, ChangeKind.FINISHED.value):
                self._recorded_active.discard(message.automaton)
            else:
                self._recorded_active.add(message.automaton)

    def _compare(self, entry: Entry) -> None:
        message = entry.message if isinstance(entry.message, Message) else entry.message()
        self.comparison.replayed(entry.time, message)
