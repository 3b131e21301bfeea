"""Run a component against a recording, in the recorded order, in virtual time."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from contextlib import ExitStack, suppress
from functools import partial
from typing import Any, Final, NoReturn

import msgspec

from ..automaton import Transition
from ..carrying import take_attributes
from ..component import Component, make_automata, parameters_of, source_of
from ..cycle import run_cycle
from ..errors import ComponentError, ComponentStoppedError, CycleCutError
from ..events import make_event
from ..recording.clocks import replaced_time
from ..recording.messages import Action, Change, Cycle, Gap, Overlap, Reading, Result
from ..recording.recorder import Recorder, automaton_context
from ..recording.run import MONITOR, START, seed_random
from ..recording.turns import Turns
from ..recording.values import readable
from ..recording.writer import Entry
from ..replacement import Replacement, first_values_of
from ..schedule import slot_after, slot_from
from ..supervision import OnError, Supervision
from ..tree import ChangeKind, Run, Tree
from ..variables import assign
from .comparison import Comparison
from .errors import ReplayEndedError, ReplayError
from .knowledge import Knowledge
from .reader import Record, Recording
from .script import Script, Want, context_of
from .stand_ins import ReplayClock, ReplayedSample, ReplayTimeline, connect, time_function
from .strands import Strand, Strands

__all__ = ["Replay"]

_SECOND: Final = 1_000_000_000
_PROGRESS: Final = 1.0
"""Wall seconds between words of how far it is."""
_MOST_GUESSES: Final = 100_000
"""Answers without a record in one cycle: code that asks for more does not end."""


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
        self.comparison = Comparison()
        self.knowledge = Knowledge()
        self.newest_samples: dict[tuple[str, str], ReplayedSample[Any]] = {}
        self.notes: list[str] = []
        self.ended = threading.Event()
        self._make = make
        self._edited = edited
        self._since = since
        self._progress = progress
        self._told_at = time.monotonic()
        self._script = Script(recording, until, self._passed)
        self._strands = Strands()
        self._stack = ExitStack()
        self._stack.callback(self._strands.close)
        self._recorder = Recorder(_Sink(self), 0, _Here(self._strands))
        self._recorder.component_time = self.now
        self._fatal: ReplayError | None = None
        self._expected: dict[str, Callable[[Record], object]] = {}
        self._begun: set[str] = set()
        self._own_time: int | None = None
        self._guesses_in_cycle = 0
        self._recorded_active: set[int] = set()
        self._periods: dict[int, int] = {}
        self._next_slots: dict[int, int] = {}
        self._on_error: OnError | None = None

    def __enter__(self) -> Replay:
        return self

    def __exit__(self, *_: object) -> None:
        self._stack.close()

    def now(self) -> int:
        """Return the component time in ns at which the replay is."""
        return self._script.time if self._own_time is None else self._own_time

    def run(self) -> Comparison:
        """Replay to the end; raises ReplayError."""
        seed_random(self.recording.number("seed", 0))
        self._begin()
        while (record := self._script.peek_input()) is not None:
            self._run_unrecorded(record.time)
            if self._edited is not None and record.time >= self._since and self._resting:
                self._exchange(self._edited)
                self._edited = None
            self._step(record)
            self._tell_progress()
            if self._fatal is not None:
                raise self._fatal
        self._run_unrecorded(self._script.time)
        self.comparison.finish()
        return self.comparison

    def _tell_progress(self) -> None:
        now = time.monotonic()
        if now - self._told_at >= _PROGRESS:
            self._told_at = now
            self._progress(self.now() / _SECOND)

    # What stand-ins ask for.

    def take(self, want: Want, arguments: tuple[object, ...] | None = None) -> Record | None:
        """Return what the recording has in answer to code that asks; None where it has nothing."""
        strand = self._strands.current
        if strand is None:
            return None
        if self._own_time is not None:
            record = None
        else:
            following = self._script.peek_input()
            fits = following is not None and context_of(following.message) == strand.context
            if fits and following is not None and want.fits(following):
                self._script.advance()
                record = following
            else:
                record = self._park(strand, want)
        if record is None:
            self._guesses_in_cycle += 1
            if self._guesses_in_cycle > _MOST_GUESSES:
                self.give_up(ReplayError(f"a cycle of {strand.context} does not end: it asks for {want}"))
        elif arguments is not None and isinstance(record.message, Result):
            message = record.message
            shown = readable(arguments)
            what = f"{want.attribute}.{want.operation}"
            self.comparison.called(self.now(), strand.context, what, message.arguments, shown)
        return record

    def read(self, kind: str, waits: float = 0.0) -> Any:  # noqa: ANN401 - what the recording says
        """Return a reading: the recorded one, or one that follows from the time."""
        want = Want(kind)
        record = self.take(want)
        if record is not None:
            assert isinstance(record.message, Reading)
            return record.message.value
        context = self._strands.context
        if context is None:
            return self.now() if kind == "component" else self.now() / _SECOND
        if waits:
            self.knowledge.wait(context, waits)
        elif kind not in ("component", "sleep", "future"):
            self.knowledge.guesses[str(want)] += 1
        return self.knowledge.reading(want, context, self.now())

    def guess(self, want: Want) -> Record | None:
        """Return the newest value that an operation had until now."""
        self.knowledge.guesses[str(want)] += 1
        return self.knowledge.newest(want)

    def pass_time(self, seconds: float) -> None:
        """Let time pass for the running code until the end of its cycle."""
        context = self._strands.context
        if context is not None:
            self.knowledge.wait(context, seconds)

    def expect(self, context: str, deliver: Callable[[Record], object] | None) -> None:
        """Call a function when what belongs to a context arrives; with None, no more."""
        if deliver is None:
            self._expected.pop(context, None)
        else:
            self._expected[context] = deliver

    def image(self, hash: str) -> bytes | None:
        """Return bytes that were recorded, or None."""
        return self.recording.image(hash)

    def give_up(self, error: ReplayError) -> NoReturn:
        """End the replay from within user code, which must not catch that."""
        self._fatal = self._fatal or error
        raise ReplayEndedError

    # The component.

    def _begin(self) -> None:
        """Make the component, on a strand, since its variables may read whatever they like."""
        strand = self._strands[START]
        strand.run(self._make_component)
        while not strand.idle:
            record = self._script.peek_input()
            fits = record is not None and context_of(record.message) == START
            self._answer(strand, record if fits else None)
        if strand.failure is not None:
            raise strand.failure
        if self._fatal is not None:
            raise self._fatal

    def _make_component(self) -> None:
        component = self._make()
        self.component = component
        self._equip(component)
        self.tree = ReplayTree(make_automata(component), self)
        self._recorder.watch(self.tree)
        self.tree.on_change.append(self._changed)
        self._first = first_values_of(self.tree.runs)
        self._timeline = ReplayTimeline(self)

    def _start(self) -> None:
        component = self.component
        self._supervision = Supervision(
            self.tree,
            self._timeline,
            component.log,
            on_error=self._on_error or component._hfsm_on_error,
            file=source_of(component),
            document=component._hfsm_document,
            halt=self.ended.set,
            entered=self._entered,
        )
        self.tree.start(0)

    @property
    def _resting(self) -> bool:
        """Whether no code is under way: the moment to exchange it."""
        started = hasattr(self, "tree") and self.tree.root.entered is not None
        return started and not any(run.in_cycle for run in self.tree.runs)

    def _exchange(self, make: Callable[[], Component]) -> None:
        """Let another version of the component take the place of this one."""
        at = self._own_time = self.now()
        strand = self._strands["exchange"]
        try:
            strand.run(partial(self._exchange_now, make, at))
        finally:
            self._own_time = None
        if strand.failure is not None:
            raise strand.failure

    def _exchange_now(self, make: Callable[[], Component], at: int) -> None:
        former, component = self.component, make()
        told = take_attributes(former, component)
        self._equip(component)
        replacement = Replacement(component, tuple(told))
        with self.tree.lock:
            replacement.apply(self.tree, former, self._first, at)
        self.component = component
        self._supervision.turn_to(
            component.log,
            on_error=self._on_error or component._hfsm_on_error,
            file=source_of(component),
            document=component._hfsm_document,
        )
        self.notes.append(f"the edited document took over at {at / _SECOND:.3f} s")
        self.notes += [f"it could not keep: {text}" for text in replacement.not_kept]

    def _equip(self, component: Component) -> None:
        """Give a component what it sees of the world."""
        _set_parameters(component, self.recording)
        connect(component, self)
        self._stack.enter_context(replaced_time(type(component), partial(time_function, self)))
        component.clock = ReplayClock(self)
        vars(component)["sleep"] = self._sleep
        vars(component)["send"] = self._send

    def _sleep(self, seconds: float) -> None:
        ending = self.read("sleep", waits=seconds)
        if ending == "stopped":
            raise ComponentStoppedError
        if ending == "cut":
            raise CycleCutError

    def _send(self, name: str, data: object = None) -> None:
        self.tree.send(make_event(name, data), self._timeline.now())

    def _changed(self, _now: int, run: Run, kind: ChangeKind) -> None:
        if kind is ChangeKind.FINISHED and run is self.tree.root:
            self.ended.set()

    def _entered(self, _run: Run, _transition: Transition | None) -> bool:
        """Stop where a breakpoint stopped the recorded component."""
        record = self._script.peek_input() if self._own_time is None else None
        if record is None or context_of(record.message) != self._strands.context:
            return False
        if not Want("break").fits(record):
            return False
        self._script.advance()
        self.tree.held = True
        return True

    # The drive.

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
            self._note_overlap(message)
        elif isinstance(message, Cycle) and not message.begins:
            self._end_cycle(message)
            self._script.advance()
        elif isinstance(message, Cycle | Reading | Result) and context:
            self._drive(record, context)
        else:
            self._script.advance()

    def _drive(self, record: Record, context: str) -> None:
        """Let the code of a context go on with what belongs to it, or leave that behind."""
        strand = self._strands[context]
        automaton = context.startswith("automaton ")
        if automaton and context not in self._begun:
            self._begin_cycle(strand, context)
            if self._script.peek() is record and strand.idle:
                self._script.advance()  # this cycle does not take place here
        elif isinstance(record.message, Result) and record.message.kind in ("async", "sample"):
            self._script.advance()
            self._deliver(strand, record, context)
        elif isinstance(record.message, Cycle) or strand.idle:
            self._script.advance()
        else:
            self._answer(strand, record)

    def _begin_cycle(self, strand: Strand, context: str) -> None:
        cycle = self._script.cycle_ahead(context)
        self._begun.add(context)
        run = self.tree.run(cycle.automaton) if cycle is not None else None
        if cycle is not None and run is not None and not self._is_unrecorded(run):
            self._run_cycle(strand, run, cycle.at)

    def _run_cycle(self, strand: Strand, run: Run, at: int) -> None:
        self._guesses_in_cycle = 0
        self.knowledge.begin_cycle(strand.context)
        if self.ended.is_set():
            return
        self._next_slots[run.automaton.id] = slot_after(at, run.automaton.interval)
        run.stepping = self.tree.held
        strand.run(partial(run_cycle, self.tree, run, at, self._supervision))
        self._look_after(strand)

    def _end_cycle(self, message: Cycle) -> None:
        """Let a cycle that takes longer here than it took come to its end."""
        context = automaton_context(message.automaton)
        strand = self._strands[context]
        while not strand.idle and self._fatal is None:
            self._answer(strand, None)
        self._begun.discard(context)

    def _answer(self, strand: Strand, record: Record | None) -> None:
        """Give waiting code what it wants: this record, one further on, or nothing."""
        want = strand.want
        assert isinstance(want, Want)
        if record is not None and want.fits(record):
            self._script.advance()
            found: Record | None = record
        else:
            found = self._script.find(strand.context, want)
        if want.kind == "handover" and found is None:
            self._end_cycles_below(strand)
        strand.resume(found)
        self._look_after(strand)

    def _end_cycles_below(self, strand: Strand) -> None:
        """Let automata end their cycles whose parent waits for that, where the recording does not say how."""
        for run in self.tree.runs:
            below = self._strands[automaton_context(run.automaton.id)]
            while below is not strand and run.in_cycle and not run.active and not below.idle:
                self._answer(below, None)

    def _deliver(self, strand: Strand, record: Record, context: str) -> None:
        deliver = self._expected.get(context)
        if deliver is None or not strand.idle:
            return
        if isinstance(record.message, Result) and record.message.kind == "async":
            self._expected.pop(context)
        strand.run(partial(deliver, record))
        self._look_after(strand)

    def _look_after(self, strand: Strand) -> None:
        failure = strand.failure
        if not strand.idle or failure is None:
            return
        strand.failure = None
        if isinstance(failure, SystemExit):
            self.notes.append(
                f"the code of {strand.context} ended the component at {self.now() / _SECOND:.3f} s"
            )
            self.ended.set()
        elif isinstance(failure, Exception) and not strand.context.startswith("automaton "):
            self.notes.append(f"a callback failed: {type(failure).__name__}: {failure}")
        else:
            raise failure

    def _park(self, strand: Strand, want: Want) -> Record | None:
        answer = strand.wait(want)
        assert answer is None or isinstance(answer, Record)
        return answer

    def _act(self, action: Action) -> None:
        """Do to the component what somebody did to it."""
        arguments = action.arguments
        if action.kind == "made":
            with suppress(ValueError, TypeError, AttributeError):
                self._on_error = OnError(str(arguments.get("on_error")))
                self._periods = {int(key): int(value) for key, value in arguments["periods"].items()}
        elif action.kind == "start":
            self._start()
        elif action.kind == "pause":
            self.tree.held = True
        elif action.kind == "resume":
            self.tree.held = False
        elif action.kind == "force":
            run = self.tree.run(arguments.get("automaton", 0))
            for transition in run.automaton.outgoing(run.current) if run is not None else ():
                if run is not None and transition.id == arguments.get("transition"):
                    run.forced = transition
        elif action.kind == "set":
            self._set(arguments)
        elif action.kind == "send":
            strand = self._strands[MONITOR]
            strand.run(partial(self._send_recorded, arguments))
            while not strand.idle:
                self._answer(strand, self._script.peek())
        elif action.kind == "reload":
            self.notes.append("the component was reloaded here: the replay ends")
            self._script.stop()

    def _send_recorded(self, arguments: dict[str, Any]) -> None:
        with suppress(ComponentError, ValueError):
            data = msgspec.json.decode(str(arguments.get("json")).encode())
            self.tree.send(make_event(arguments.get("name", ""), data), self.now())

    def _set(self, arguments: dict[str, Any]) -> None:
        with suppress(ComponentError, ValueError):
            value = msgspec.json.decode(str(arguments.get("json")).encode())
            name = str(arguments.get("name"))
            run = self.tree.run(arguments.get("automaton", 0))
            if run is not None:
                assign(run.automaton, name, value)
            elif name in parameters_of(self.component):
                setattr(self.component, name, value)

    # Automata that run in the replay and did not in the recording.

    def _is_unrecorded(self, run: Run) -> bool:
        """Return whether the cycles of an automaton are not those of the recording, but its own."""
        automaton = run.automaton
        recorded_period = self._periods.get(automaton.id, 0)
        return automaton.id not in self._recorded_active or recorded_period != automaton.interval

    def _run_unrecorded(self, now: int) -> None:
        """Run the cycles that the recording does not have up to a time, ancestors first."""
        if not hasattr(self, "tree") or self.tree.root.entered is None:
            return
        while not self.ended.is_set() and not self.tree.held and self._fatal is None:
            due: list[tuple[int, int, Run]] = []
            for index, run in enumerate(self.tree.runs):
                if run.active and not run.finished and self._is_unrecorded(run) and not run.in_cycle:
                    slot = slot_from(run.activated, run.automaton.interval)
                    slot = max(slot, self._next_slots.get(run.automaton.id, 0))
                    if slot < now:
                        due.append((slot, index, run))
            if not due:
                return
            slot, _, run = min(due)
            strand = self._strands[automaton_context(run.automaton.id)]
            if not strand.idle:
                return
            self._own_time = slot
            try:
                self._run_cycle(strand, run, slot)
            finally:
                self._own_time = None

    # The records.

    def _passed(self, record: Record) -> None:
        self.knowledge.learn(record)
        self.comparison.recorded(record)
        message = record.message
        if isinstance(message, Change):
            if message.kind in (ChangeKind.GHOST.value, ChangeKind.FINISHED.value):
                self._recorded_active.discard(message.automaton)
            else:
                self._recorded_active.add(message.automaton)

    def _note_overlap(self, message: Overlap) -> None:
        text = (
            f"the code of {message.beside} blocked at {self.now() / _SECOND:.3f} s, and "
            f"{message.context} ran beside it: in which order is not known"
        )
        if len(self.notes) < 20:
            self.notes.append(text)


class ReplayTree(Tree):
    """Automata that hand over when they did."""

    def __init__(self, root: Any, replay: Replay) -> None:  # noqa: ANN401
        super().__init__(root)
        self._replay = replay

    def wait_for_cycles(self, run: Run, timeout: float) -> list[Run]:  # noqa: ARG002
        """Wait until the automata below have ended their cycles, or had not when the wait was given up."""
        if not run.below:
            return []
        late = self._replay.read("handover")
        found = [self.run(each) for each in late] if isinstance(late, list) else []
        return [each for each in found if each is not None]


class _Sink:
    """Where what the replay does is told: to the comparison."""

    crowded: Final = True

    def __init__(self, replay: Replay) -> None:
        self._replay = replay

    def put(self, entry: Entry) -> None:
        message = entry.message if not callable(entry.message) else entry.message()
        self._replay.comparison.replayed(entry.time, message)


class _Here(Turns):
    """Turns that nobody takes: the code of a context is that on its strand."""

    def __init__(self, strands: Strands) -> None:
        super().__init__(lambda _context, _beside: None)
        self._strands = strands

    @property
    def context(self) -> str | None:
        return self._strands.context


def _set_parameters(component: Component, recording: Recording) -> None:
    with suppress(msgspec.MsgspecError, AttributeError):
        values = msgspec.json.decode(recording.metadata.get("parameters", "{}").encode())
        declared = parameters_of(component)
        for name, value in values.items():
            if name in declared and type(value) is type(declared[name].default):
                setattr(component, name, value)
