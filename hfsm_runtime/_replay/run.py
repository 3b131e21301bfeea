"""Run a component against a recording: in virtual time, with the recorded cycles in the recorded order."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager, suppress
from functools import partial
from typing import Any, Final, Self

import msgspec

from hfsm_runtime.recording_file.messages import Action, Change, Cycle, Gap, Message, Overlap, Reading, Result
from hfsm_runtime.recording_file.writer import Entry
from zenoh_ice.data import typed
from zenoh_ice.threads.clock import VirtualClock

from .._actor import make_event
from .._automaton import Automaton, Transition
from .._recording.clocks import InterceptedClock, InterceptedTime, InterceptedTimeline
from .._recording.recorder import Recorder, automaton_context
from .._recording.run import MONITOR, START, restore_random
from .._recording.values import readable
from .._timeline import SECOND, slot_after
from ..component import Component, parameters_of
from ..coroutine import Coroutine
from ..debugger.reload import Replacement, first_values_of
from ..errors import ComponentError, ComponentStoppedError, CycleCutError, OnError, OnRefused, describe
from ..kinds import kinds_of
from ..observer import Observer
from ..tree import Actor, ChangeKind, Tree
from ..virtual._run import VirtualRun
from .answers import Answers
from .comparison import Comparison
from .script import Recording, ReplayEndedError, ReplayError, Script, TimedMessage, context_of
from .transport import ReplayTransport, result_in

_PROGRESS_PERIOD: Final = 1.0
"""Wall seconds between reports of progress."""
_MOST_OVERLAPS: Final = 20
_LONGEST_ID: Final = 20  # digits
_MOST_AUTOMATA: Final = 10_000
"""Most contexts whose code has begun and not ended."""


class Replay(Observer):
    """One replay of one component, which is made here. Use it in a `with` block; `run` it once.

    `until` is a component time in ns. `make` returns the component, and `edited` another version of it that
    takes its place at the time `since`: silently, as a reload does, with states, timers and variables kept.

    The component is a `VirtualRun` whose clock and proxies answer from the recording. All of its code takes
    turns on the thread that calls `run`: code that waits is left where it waits, until the recording has its
    answer, since the code of other automata ran there meanwhile.
    """

    virtual: VirtualRun

    def __init__(
        self,
        recording: Recording,
        make: Callable[[], Component],
        until: int,
        *,
        edited: Callable[[], Component] | None = None,
        since: int = 0,
        progress: Callable[[float], None] = lambda _seconds: None,
        most_automata: int = _MOST_AUTOMATA,
    ) -> None:
        self.recording = recording
        self.notes: list[str] = []
        self.running = ""
        """The context of the code that runs; empty while none does."""
        self._make = make
        self._edited = edited
        self._since = since
        self._progress = progress
        self._most_automata = most_automata
        self._reported_at = time.monotonic()
        self._started = False
        self._script = Script(recording, until, self._passed)
        self.answers: Final = Answers(self._script)
        self.now: Final = self.answers.now
        self.comparison: Final = self.answers.comparison
        self.guesses: Final = self.answers.latest.guesses
        """Number of requests without a recorded answer that got an older one, by request."""
        self._recorder: Final = Recorder(self._compare, 0, lambda: self.answers.context)
        self._recorder.component_time = self.now
        self._waiting: dict[str, Coroutine] = {}
        """The code that waits, by context."""
        self._begun: set[str] = set()
        """The contexts of automata in the middle of a recorded cycle."""
        self._recorded_active: set[int] = set()
        self._periods = _periods(recording)
        self._stack = ExitStack()
        self._transport: Final = ReplayTransport(recording, self.answers)
        self._stack.enter_context(self._transport.communicator)
        self._stack.callback(self._end_code)

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
            if self._edited is not None and record.time >= self._since and self._resting:
                self._exchange(self._edited)
                self._edited = None
            self._step(record)
            if time.monotonic() - self._reported_at >= _PROGRESS_PERIOD:
                self._reported_at = time.monotonic()
                self._progress(self.now() / SECOND)
            if self.answers.fatal is not None:
                raise self.answers.fatal
        self._run_unrecorded(self._script.time)
        if self._edited is not None:
            self.notes.append("the edited document did not take over: the replay ended before it could")
        self.comparison.finish()
        return self.comparison

    # The component.

    def _begin(self) -> None:
        """Make the component and its automata, as code of the replay: variables may read anything."""
        self._go(Coroutine(START, self._make_virtual))
        while (code := self._waiting.get(START)) is not None:
            record = self._script.peek_input()
            fits = record is not None and context_of(record.message) == START
            self._go(code, self._answer_to(code, record if fits else None))
        if self.answers.fatal is not None:
            raise self.answers.fatal
        self._note_document()

    def _make_virtual(self) -> None:
        component = self._make()
        self._equip(component)
        settings = self.recording.settings
        self.virtual = VirtualRun(
            component,
            clock=_RecordedClock(VirtualClock(), self.answers.ask),
            timeline=InterceptedTimeline(VirtualClock(), self.answers.ask),
            tree=partial(_ReplayTree, answers=self.answers),
            on_error=_policy(OnError, settings.get("on_error")),
            on_refused=_policy(OnRefused, settings.get("on_refused")),
            observers=[self._recorder, self],
            kept=0,
            starts=False,
        )
        self._first = first_values_of(self.virtual.tree.actors)

    def _equip(self, component: Component) -> None:
        """Connect a component to the recorded world."""
        with suppress(msgspec.MsgspecError, AttributeError):
            values = typed.from_json(self.recording.metadata.get("parameters", "{}").encode())
            declared = parameters_of(component)
            for name, value in values.items():
                if name in declared and type(value) is type(declared[name].default):
                    setattr(component, name, value)
        self._transport.connect(component)
        for kind in kinds_of(component).values():
            kind.replayed(component, self.answers.ask, self._differs)
        self._stack.enter_context(InterceptedTime(self.answers.ask).shown_to(type(component)))

    def _differs(self, what: str, recorded: object, replayed: object) -> None:
        """Report what code sends by an endpoint and that differs from what was recorded."""
        context = self.answers.context
        if context is not None:
            self.comparison.called(self.now(), context, what, _plain(recorded), _plain(replayed))

    def _note_document(self) -> None:
        """Note when the document is not the recorded one, judging by its name."""
        recorded, here = self.recording.metadata.get("document"), self.virtual.component._hfsm_document
        if recorded and here != recorded:
            self.notes.append(f"the recording is of {recorded}, and {here} is compared with it")

    @property
    def _resting(self) -> bool:
        """Whether the component runs and no cycle does, so that it can be exchanged."""
        return self._started and not self._ended and not self.virtual.in_cycle

    def _exchange(self, make: Callable[[], Component]) -> None:
        """Continue with another version of the component."""
        not_kept: list[str] = []

        def exchange() -> None:
            virtual = self.virtual
            replacement = Replacement(virtual.component, make(), self._equip)
            virtual.replace(
                replacement.component,
                replacement.actors,
                lambda _now: replacement.apply(virtual.tree, self._first, at),
            )
            not_kept.extend(replacement.not_kept)

        at = self.now()
        with self._at(at):
            self._go(Coroutine("exchange", exchange))
        self.notes.append(f"the edited document took over at {at / SECOND:.3f} s")
        self.notes += [f"it could not keep: {text}" for text in not_kept]
        self._note_document()

    def entered(self, actor: Actor, transition: Transition | None) -> bool:  # noqa: ARG002
        """Stop where a breakpoint stopped the recorded component."""
        stops = self.answers.was_stopped()
        self.virtual.tree.held = self.virtual.tree.held or stops
        return stops

    # The code.

    def _go(self, code: Coroutine, answer: TimedMessage | None = None) -> None:
        """Let code run until it waits or ends; raises what ends it."""
        self.running = code.context
        self.answers.turns += 1
        try:
            code.go(answer)
        except ReplayEndedError:
            pass  # either the replay is over, or `fatal` says why
        finally:
            self.running = ""
            if code.ended:
                self._waiting.pop(code.context, None)
            else:
                self._waiting[code.context] = code

    def _run_code(self, code: Coroutine, answer: TimedMessage | None = None) -> None:
        """Let code run until it waits or ends, and report what ends it."""
        try:
            self._go(code, answer)
        except (ReplayError, KeyboardInterrupt):
            raise
        except Exception as error:
            if code.context.startswith("automaton "):
                raise ReplayError(f"{code.context} cannot be replayed: {describe(error)}") from error
            self.notes.append(f"a callback failed: {describe(error)}")
        except BaseException as end:  # noqa: BLE001 - as on threads, it ends the component
            self.notes.append(
                f"the code of {code.context} ended the component at {self.now() / SECOND:.3f} s: "
                f"{describe(end)}"
            )
            self.virtual.request_stop()

    def _answer_to(self, code: Coroutine, record: TimedMessage | None) -> TimedMessage | None:
        """Return what code waits for: this record, or a later one; None if there is none."""
        assert code.want is not None
        if record is not None and code.want.fits(record):
            self._script.advance()
            return record
        return self._script.find(code.context, code.want)

    def _answer(self, code: Coroutine, record: TimedMessage | None) -> None:
        """Answer waiting code: with this record, a later one, or nothing."""
        found = self._answer_to(code, record)
        if found is None and code.want is not None and code.want.kind == "handover":
            self._end_cycles_below(code)
        self._run_code(code, found)

    def _end_cycles_below(self, code: Coroutine) -> None:
        """End the cycles of automata whose parent waits for that, where the recording does not say how."""
        for actor in self.virtual.tree.actors:
            context = automaton_context(actor.automaton.id)
            while (
                actor.in_cycle and not actor.active and context in self._waiting and context != code.context
            ):
                self._answer(self._waiting[context], None)

    def _end_code(self) -> None:
        for code in self._waiting.values():
            code.close(ReplayEndedError)

    @contextmanager
    def _at(self, moment: int) -> Iterator[None]:
        """Run code that was not recorded at a component time in ns, in a `with` block."""
        self.answers.own_time = moment
        try:
            yield
        finally:
            self.answers.own_time = None

    # The recorded cycles, in their order.

    def _step(self, record: TimedMessage) -> None:
        message = record.message
        context = context_of(message)
        if isinstance(message, Action):
            self._script.advance()
            self._act(message)
        elif isinstance(message, Gap):
            self.notes.append(
                f"the recording has a gap at {record.time / SECOND:.3f} s, where {message.lost} messages "
                "were lost: the replay ends there"
            )
            self._script.stop()
        elif isinstance(message, Overlap):
            self._script.advance()
            if len(self.notes) < _MOST_OVERLAPS:
                self.notes.append(
                    f"the code of {message.beside} blocked at {self.now() / SECOND:.3f} s, and "
                    f"{message.context} ran beside it: in which order is not known"
                )
        elif isinstance(message, Cycle) and not message.begins:
            self._end_cycle(automaton_context(message.automaton))
            self._script.advance()
        elif isinstance(message, Cycle | Reading | Result) and context:
            self._drive(record, context)
        else:
            self._script.advance()

    def _drive(self, record: TimedMessage, context: str) -> None:
        """Give a record to the code of its context, which may have to begin its cycle, or skip the record."""
        if context.startswith("automaton ") and context not in self._begun:
            self._begin_cycle(context)
            if self._script.peek() is record and context not in self._waiting:
                self._script.advance()  # this cycle does not take place here
        elif isinstance(record.message, Result) and record.message.kind in ("async", "sample"):
            self._script.advance()
            self._deliver(record, context)
        elif isinstance(record.message, Cycle) or context not in self._waiting:
            self._script.advance()
        else:
            self._answer(self._waiting[context], record)

    def _begin_cycle(self, context: str) -> None:
        if len(self._begun) >= self._most_automata:
            raise ReplayError(f"the recording runs more than {self._most_automata} automata at a time")
        self._begun.add(context)
        cycle = self._script.cycle_ahead(context)
        actor = self.virtual.tree.actor(cycle.automaton) if cycle is not None else None
        if cycle is not None and actor is not None and not self._is_unrecorded(actor):
            self._run_cycle(actor, cycle.at)

    def _run_cycle(self, actor: Actor, at: int) -> None:
        context = automaton_context(actor.automaton.id)
        self.answers.guesses_in_cycle = 0
        self.answers.latest.begin_cycle(context)
        if self._started and not self._ended:
            actor.stepping = self.virtual.tree.held
            code = Coroutine(context, partial(self.virtual.run_cycle, actor, at))
            code.actor = actor
            self._run_code(code)
            actor.cycle.next_slot = max(actor.cycle.next_slot, slot_after(at, actor.automaton.interval))

    def _end_cycle(self, context: str) -> None:
        """Let a cycle end that takes longer in the replay than in the recording."""
        while context in self._waiting and self.answers.fatal is None:
            self._answer(self._waiting[context], None)
        self._begun.discard(context)

    def _deliver(self, record: TimedMessage, context: str) -> None:
        """Deliver a result, or a sample, to the code that expects it."""
        deliver = self.answers.expected.get(context)
        if deliver is None or context in self._waiting:
            return
        if result_in(record).kind == "async":
            self.answers.expected.pop(context)
        self._run_code(Coroutine(context, partial(deliver, record)))

    # The actions of clients.

    def _act(self, action: Action) -> None:
        if action.kind == "begin_at" and not self._started:
            with suppress(ComponentError):  # the state is gone
                self.virtual.begin_at(_number(action, "automaton"), _number(action, "state"))
        elif action.kind == "start" and not self._started:
            self._started = True
            self.virtual.start()
        elif self._started and MONITOR not in self._waiting:
            self._run_code(Coroutine(MONITOR, partial(self._carry_out, action, self.now())))

    def _carry_out(self, action: Action, now: int) -> None:
        """Carry out an action at a component time in ns; one that was refused is refused again."""
        virtual, arguments = self.virtual, action.arguments
        automaton, name = _number(action, "automaton"), str(arguments.get("name"))
        with suppress(ComponentError, ValueError):
            if action.kind == "pause":
                virtual.pause()
            elif action.kind == "resume":
                virtual.resume()
            elif action.kind == "force":
                virtual.force(automaton, _number(action, "transition"))
            elif action.kind in ("set", "send"):
                value = typed.from_json(str(arguments.get("json")).encode())
                if action.kind == "set":
                    virtual.set_variable(automaton, name, value)
                else:
                    virtual.proofs.arrives(name)
                    virtual.tree.send(make_event(name, value), now)

    # Cycles of an edited document that the recording does not have.

    @property
    def _ended(self) -> bool:
        """Whether the component has ended."""
        return self.virtual.ended.is_set()

    def _is_unrecorded(self, actor: Actor) -> bool:
        """Return whether an automaton runs cycles that the recording does not have."""
        automaton = actor.automaton
        recorded_period = self._periods.get(automaton.id, 0)
        return automaton.id not in self._recorded_active or recorded_period != automaton.interval

    def _run_unrecorded(self, now: int) -> None:
        """Run the cycles that the recording does not have up to a time, ancestors first."""
        tree = self.virtual.tree
        while self._started and not self._ended and not tree.held and self.answers.fatal is None:
            due = [
                (actor.cycle.next_slot, index, actor)
                for index, actor in enumerate(tree.actors)
                if actor.active
                and actor.cycle.next_slot < now
                and not actor.finished
                and not actor.in_cycle
                and self._is_unrecorded(actor)
            ]
            if not due:
                return
            slot, _, actor = min(due)
            with self._at(slot):
                self._run_cycle(actor, slot)

    # The records.

    def _passed(self, record: TimedMessage) -> None:
        self.answers.latest.learn(record)
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


class _RecordedClock(InterceptedClock):
    """The clock of the component: what it shows, and how its waits end, is in the recording."""

    def advance(self, seconds: float) -> None:
        """Wait on behalf of `self.sleep`."""
        ending = self._ask("sleep", lambda: None, lambda: seconds)
        if ending == "stopped":
            raise ComponentStoppedError
        if ending == "cut":
            raise CycleCutError


class _ReplayTree(Tree):
    """Automata that hand over when they did in the recording."""

    def __init__(self, root: Automaton, answers: Answers) -> None:
        super().__init__(root)
        self._answers = answers

    def wait_for_cycles(self, actor: Actor, timeout: float) -> list[Actor]:  # noqa: ARG002
        """Wait until the automata below have ended their cycles, or until the recorded wait was given up."""
        if not actor.below:
            return []
        late = self._answers.ask("handover")
        found = [self.actor(each) for each in late if isinstance(each, int)] if isinstance(late, list) else []
        return [each for each in found if each is not None]


def _number(action: Action, name: str) -> int:
    """Return a number among the arguments of an action; 0 where there is none."""
    value = action.arguments.get(name)
    return value if isinstance(value, int) else 0


def _policy(kind: type[OnError | OnRefused], value: object) -> str | None:
    """Return a recorded policy; None where it is none, so that the document's applies."""
    return value if isinstance(value, str) and value in {each.value for each in kind} else None


def _plain(value: object) -> object:
    """Return a value that code sends, with its fields as mappings, as readable JSON."""
    if isinstance(value, dict):
        return {name: _plain(each) for name, each in value.items()}
    return readable(value)


def _periods(recording: Recording) -> dict[int, Any]:
    """Return the recorded periods of automata in ns, by id."""
    periods = recording.settings.get("periods")
    if not isinstance(periods, dict):
        return {}
    return {int(key): value for key, value in periods.items() if key.isdecimal() and len(key) <= _LONGEST_ID}
