"""The component of a replay: made, equipped with what stands for the world, and exchanged."""

from __future__ import annotations

import threading
from collections.abc import Callable, Mapping
from contextlib import ExitStack, suppress
from functools import partial
from typing import Final

import msgspec

from ..automaton import Automaton, Transition
from ..component import Component, equip, make_automata, parameters_of, source_of
from ..control.carrying import take_attributes
from ..control.replacement import Replacement, first_values_of
from ..errors import ComponentStoppedError, CycleCutError, UnknownElementError
from ..events import make_event
from ..recording.clocks import replaced_time
from ..recording.recorder import Recorder
from ..supervision import OnError, OnRefused, Refusal, Supervision
from ..tree import ChangeKind, Run, Tree
from .answers import Answers
from .clocks import ReplayClock, ReplayTimeline, time_function
from .script import Recording
from .stand_ins import connect

__all__ = ["Host"]

_SECOND: Final = 1_000_000_000


class Host:
    """Hold the component of a replay and its automata; use it in a `with` block.

    `make` and `exchange` run user code, so they belong on a strand.
    """

    tree: Tree
    component: Component
    supervision: Supervision

    def __init__(self, recording: Recording, answers: Answers, recorder: Recorder) -> None:
        self.ended = threading.Event()
        self.started = False
        self._recording = recording
        self._answers = answers
        self._recorder = recorder
        self._on_error: OnError | None = None
        self._on_refused: OnRefused | None = None
        self._stack = ExitStack()

    def __enter__(self) -> Host:
        return self

    def __exit__(self, *_: object) -> None:
        self._stack.close()

    def make(self, make: Callable[[], Component]) -> None:
        """Make the component and its automata."""
        self.component = make()
        self._equip(self.component)
        self.tree = _ReplayTree(make_automata(self.component), self._answers)
        self._recorder.watch(self.tree)
        self.tree.on_change.append(self._changed)
        self._first = first_values_of(self.tree.runs)
        self._timeline = ReplayTimeline(self._answers)

    def begin_at(self, arguments: Mapping[str, object]) -> None:
        """Let the state be the first one that was it in the recording, if it is still there."""
        automaton, state = arguments.get("automaton"), arguments.get("state")
        if isinstance(automaton, int) and isinstance(state, int) and not self.started:
            with suppress(UnknownElementError):
                self.tree.begin_at(automaton, state)

    def start(self, on_error: OnError | None, on_refused: OnRefused | None) -> None:
        """Enter the initial states."""
        if self.started:
            return
        component = self.component
        self.started = True
        self._on_error, self._on_refused = on_error, on_refused
        self.supervision = Supervision(
            self.tree,
            self._timeline,
            component._hfsm_log,
            on_error=on_error or component._hfsm_on_error,
            on_refused=on_refused or component._hfsm_on_refused,
            file=source_of(component),
            document=component._hfsm_document,
            halt=self.ended.set,
            refused=self._refused,
            entered=self._entered,
        )
        self.tree.start(0)

    @property
    def resting(self) -> bool:
        """Whether no code is under way: the moment to exchange it."""
        return self.started and not any(run.in_cycle for run in self.tree.runs)

    def exchange(self, make: Callable[[], Component], at: int) -> tuple[str, ...]:
        """Let another version of the component take the place of this one; return what it could not keep."""
        former, component = self.component, make()
        told = take_attributes(former, component)
        self._equip(component)
        replacement = Replacement(component, tuple(told))
        with self.tree.lock:
            replacement.apply(self.tree, former, self._first, at)
        self.component = component
        self.supervision.turn_to(
            component._hfsm_log,
            on_error=self._on_error or component._hfsm_on_error,
            on_refused=self._on_refused or component._hfsm_on_refused,
            file=source_of(component),
            document=component._hfsm_document,
        )
        return replacement.not_kept

    def _equip(self, component: Component) -> None:
        """Give a component what it sees of the world."""
        _set_parameters(component, self._recording)
        connect(component, self._answers)
        made = partial(time_function, self._answers)
        self._stack.enter_context(replaced_time(type(component), made))
        equip(component, ReplayClock(self._answers), self._sleep, self._send)

    def _sleep(self, seconds: float) -> None:
        ending = self._answers.read("sleep", waits=seconds)
        if ending == "stopped":
            raise ComponentStoppedError
        if ending == "cut":
            raise CycleCutError

    def _send(self, name: str, data: object = None) -> None:
        self.tree.send(make_event(name, data), self._timeline.now())

    def _changed(self, _now: int, run: Run, kind: ChangeKind) -> None:
        if kind is ChangeKind.FINISHED and run is self.tree.root:
            self.ended.set()

    def _refused(self, _refusal: Refusal) -> None:
        """Pause as the recorded component did; it resumes when that one did."""
        self.tree.held = True

    def _entered(self, _run: Run, _transition: Transition | None) -> bool:
        """Stop where a breakpoint stopped the recorded component."""
        stops = self._answers.was_stopped()
        self.tree.held = self.tree.held or stops
        return stops


class _ReplayTree(Tree):
    """Automata that hand over when they did."""

    def __init__(self, root: Automaton, answers: Answers) -> None:
        super().__init__(root)
        self._answers = answers

    def wait_for_cycles(self, run: Run, timeout: float) -> list[Run]:  # noqa: ARG002
        """Wait until the automata below have ended their cycles, or had not when the wait was given up."""
        if not run.below:
            return []
        late = self._answers.read("handover")
        found = [self.run(each) for each in late if isinstance(each, int)] if isinstance(late, list) else []
        return [each for each in found if each is not None]


def _set_parameters(component: Component, recording: Recording) -> None:
    with suppress(msgspec.MsgspecError, AttributeError):
        values = msgspec.json.decode(recording.metadata.get("parameters", "{}").encode())
        declared = parameters_of(component)
        for name, value in values.items():
            if name in declared and type(value) is type(declared[name].default):
                setattr(component, name, value)
