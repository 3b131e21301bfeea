"""The component of a replay: created, connected to the recorded world, and exchanged."""

from __future__ import annotations

import threading
from collections.abc import Callable, Mapping
from contextlib import ExitStack, suppress
from typing import Final

import msgspec

from hfsm_runtime.recording_file.messages import Action
from zenoh_ice.clock import VirtualClock

from ..automaton import Automaton, Transition
from ..automaton_run import make_event
from ..component import Component, equip, make_automata, parameters_of, ros_of
from ..debugger.reload import Replacement, first_values_of
from ..errors import (
    ComponentError,
    ComponentStoppedError,
    CycleCutError,
    OnError,
    OnRefused,
    UnknownElementError,
)
from ..observer import Observer
from ..recording.clocks import InterceptedClock, InterceptedTimeline, intercepted_time
from ..recording.recorder import Recorder
from ..supervision import Refusal, Supervision
from ..tree import ChangeKind, Run, Tree
from ..variables import assign
from .script import Recording
from .threads import Answers
from .transport import ReplayTransport

_SECOND: Final = 1_000_000_000


class Host(Observer):
    """Hold the component of a replay and its automata; what it opens is closed with `stack`.

    `make` and `exchange` run user code, so they belong on a thread of the replay.
    """

    tree: Tree
    component: Component
    supervision: Supervision

    def __init__(self, recording: Recording, answers: Answers, recorder: Recorder, stack: ExitStack) -> None:
        self.ended = threading.Event()
        self.started = False
        self._recording = recording
        self._answers = answers
        self._recorder = recorder
        self._stack = stack
        self._transport = ReplayTransport(recording, answers)
        self._stack.enter_context(self._transport.communicator)

    def make(self, make: Callable[[], Component]) -> None:
        """Make the component and its automata."""
        self.component = make()
        self._equip(self.component)
        self.tree = _ReplayTree(make_automata(self.component), self._answers)
        self._recorder.watch(self.tree)
        self.tree.observers.append(self)
        self._first = first_values_of(self.tree.runs)
        self._timeline = InterceptedTimeline(VirtualClock(), self._answers.ask)

    def begin_at(self, arguments: Mapping[str, object]) -> None:
        """Begin in the state in which the recorded component began, if it still exists."""
        automaton, state = arguments.get("automaton"), arguments.get("state")
        if isinstance(automaton, int) and isinstance(state, int) and not self.started:
            with suppress(UnknownElementError):
                self.tree.begin_at(automaton, state)

    def start(self, on_error: OnError | None, on_refused: OnRefused | None) -> None:
        """Enter the initial states."""
        if self.started:
            return
        self.started = True
        self.supervision = Supervision(
            self.tree,
            self._timeline,
            self.component,
            on_error,
            on_refused,
            halt=self.ended.set,
            refused=self._refused,
        )
        self.tree.start(0)

    @property
    def resting(self) -> bool:
        """Whether no cycle is running, so that the component can be exchanged."""
        return self.started and not any(run.in_cycle for run in self.tree.runs)

    def exchange(self, make: Callable[[], Component], at: int) -> list[str]:
        """Replace the component with another version of it; return what that could not keep."""
        component = make()
        replacement = Replacement(self.component, component, self._equip)
        with self.tree.lock:
            replacement.apply(self.tree, self._first, at)
        self.component = component
        self.supervision.turn_to(component)
        return replacement.not_kept

    def _equip(self, component: Component) -> None:
        """Connect a component to the recorded world."""
        with suppress(msgspec.MsgspecError, AttributeError):
            values = msgspec.json.decode(self._recording.metadata.get("parameters", "{}").encode())
            declared = parameters_of(component)
            for name, value in values.items():
                if name in declared and type(value) is type(declared[name].default):
                    setattr(component, name, value)
        self._transport.connect(component)
        if ros_of(component):
            from ..recording.ros import replayed_ros  # only components that use ROS need its libraries

            replayed_ros(component, self._answers.ask, self._differs)
        self._stack.enter_context(intercepted_time(type(component), self._answers.ask))
        equip(component, InterceptedClock(VirtualClock(), self._answers.ask), self._sleep, self._send)

    def _differs(self, what: str, recorded: object, replayed: object) -> None:
        """Report a message that code sends over ROS and that differs from the recorded one."""
        context = self._answers.context
        if context is not None:
            self._answers.comparison.called(self._answers.now(), context, what, recorded, replayed)

    def _sleep(self, seconds: float) -> None:
        ending = self._answers.ask("sleep", waits=lambda: seconds)
        if ending == "stopped":
            raise ComponentStoppedError
        if ending == "cut":
            raise CycleCutError

    def _send(self, name: str, data: object = None) -> None:
        self.tree.send(make_event(name, data), self._timeline.now())

    def changed(self, now: int, run: Run, kind: ChangeKind) -> None:  # noqa: ARG002
        """End when the root has finished."""
        if kind is ChangeKind.FINISHED and run is self.tree.root:
            self.ended.set()

    def _refused(self, _refusal: Refusal) -> None:
        """Pause as the recorded component did; it resumes when that one did."""
        self.tree.held = True

    def entered(self, run: Run, transition: Transition | None) -> bool:  # noqa: ARG002
        """Stop where a breakpoint stopped the recorded component."""
        stops = self._answers.was_stopped()
        self.tree.held = self.tree.held or stops
        return stops


class _ReplayTree(Tree):
    """Automata that hand over when they did in the recording."""

    def __init__(self, root: Automaton, answers: Answers) -> None:
        super().__init__(root)
        self._answers = answers

    def wait_for_cycles(self, run: Run, timeout: float) -> list[Run]:  # noqa: ARG002
        """Wait until the automata below have ended their cycles, or until the recorded wait was given up."""
        if not run.below:
            return []
        late = self._answers.ask("handover")
        found = [self.run(each) for each in late if isinstance(each, int)] if isinstance(late, list) else []
        return [each for each in found if each is not None]


def act(host: Host, action: Action, now: int) -> None:
    """Carry out an action at a component time in ns; one that was refused is refused again."""
    arguments = action.arguments
    number = arguments.get("automaton")
    run = host.tree.run(number) if isinstance(number, int) else None
    with suppress(ComponentError, ValueError):
        if action.kind in ("pause", "resume"):
            host.tree.held = action.kind == "pause"
        elif action.kind == "force" and run is not None:
            leaving = run.automaton.outgoing(run.current)
            run.forced = next((t for t in leaving if t.id == arguments.get("transition")), run.forced)
        elif action.kind in ("set", "send"):
            name, value = str(arguments.get("name")), msgspec.json.decode(str(arguments.get("json")).encode())
            if action.kind == "send":
                host.tree.send(make_event(name, value), now)
            elif run is not None:
                assign(run.automaton, name, value)
            elif name in parameters_of(host.component):
                setattr(host.component, name, value)
