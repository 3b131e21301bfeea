"""The execution of a component in virtual time: run it, see everything it does, and interfere."""

from __future__ import annotations

import inspect
from collections import deque
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from functools import cached_property
from typing import Any, Final, Self

from interfaces.jderobot import CommandRefusedException
from interfaces.nao import SafetyPrx
from zenoh_ice import Object
from zenoh_ice.data.text import sentence

from .._limits import LIMITS, RuntimeLimits
from .._own_threads import forget_threads_of
from .._recording.clocks import TimeModule, restore
from .._robot import Permission
from .._stop import end_callbacks, stop_robot
from .._supervision import UNAVAILABLE
from .._variables import short_repr, values_of
from ..component import Component, parameters_of, source_of
from ..debugger.reload import Reloading
from ..errors import OnRefused, describe
from ..places import locate
from ..tree import Actor, Replaced
from ._guards import GuardTable, path_of
from ._journal import Call, Fired
from ._run import VirtualRun
from .errors import BehaviorFailed, UnknownName, says_it_all
from .world import VirtualWorld

__tracebackhide__ = says_it_all

Condition = str | Callable[[], object] | Callable[[Any], object]
"""A path of states, or a function, of nothing or of the execution, that returns whether it holds."""


class Execution(VirtualRun):
    """A component in virtual time, whose calls stay within the process.

    Life: creating it sets the parameters, serves the stubs, connects the component to the `world`, runs the
    variables of its document and enters the initial states at time 0. Nothing else happens until `advance` or
    `run_until` moves the time; both run the cycles that fall due, in the thread that calls them. `close`, or
    the end of a `with` block, ends the world, also one that was passed. The same component with the same
    stimuli does the same every time, but for threads that its code starts.

    Errors: an exception in the component's code raises BehaviorFailed, with the line of the document and the
    timeline, unless `on_error` is given: then this policy (`stop` or `continue`) applies, `errors` has the
    exceptions, and `stop` stops the robot as a real component does. A refused command is no error if the
    document lets it pause the component; it is tried again after each second of the clock. UnknownName says
    which names there are. What creating it may raise is in `VirtualRun`.

    Time: `time` is that of the component in s, `clock` that of its world. Code that sleeps, by `self.sleep`
    or by `time.sleep` in the component's own modules, or waits for a sample, goes on when the time has come;
    the other automata run meanwhile, and `advance` may return in the middle of a cycle. The functions of
    `time` follow the clock.

    Methods take an automaton by its name, its path (`followBall/green`: the states that own it) or its id.
    """

    component: Any
    """The `self` of user code: its parameters, proxies and functions."""

    def __init__(
        self,
        component: Component,
        world: VirtualWorld | None = None,
        *,
        parameters: Mapping[str, object] | None = None,
        stubs: Mapping[str, Object | Mapping[str, object]] | None = None,
        on_error: str | None = None,
        on_refused: str | None = None,
        starts: bool = True,
        limits: RuntimeLimits = LIMITS,
    ) -> None:
        self.world: Final = world or VirtualWorld()
        """The clock, the servants and the ROS that surround the component."""
        self._journal: Final = self.world.journal
        self._strict = on_error is None
        self._failed_threads = deque[tuple[str, str]]()
        """Where and how threads failed that user code started."""
        self._time_module: Final = TimeModule(self.world.clock)
        try:
            for name, stub in (stubs or {}).items():
                self.world.stub(component, name, stub)
            _set_parameters(component, parameters or {})
            self.world.connect(component)
            safety = SafetyPrx.uncheckedCast(self.world.communicator.stringToProxy("Safety"))
            permission = Permission(safety, component)
            with self._time_module.shown_to(component):
                super().__init__(
                    component,
                    clock=self.world.clock,
                    on_error=on_error,
                    on_refused=on_refused,
                    on_end=self._stop_robot,
                    commands_accepted=permission.is_given,
                    observers=[self._journal],
                    kept=self.world.kept,
                    starts=starts,
                    limits=limits,
                )
            self.on_resumed = permission.begin_again
            self._reloading = Reloading(self, self.world.connect)
        except BaseException:
            self.close()
            raise

    # -- time ----------------------------------------------------------------------------------------------

    def advance(self, seconds: float) -> None:
        """Run all cycles that fall due in the next `seconds`, the end included.

        Raises BehaviorFailed when user code, also on a thread that it started, raises an exception and no
        `on_error` was given, and when it calls `sys.exit`, or raises what is no Exception, which ends the
        component and stops the robot.
        """
        try:
            self._run_cycles(seconds)
        except BaseException as end:
            self._tell(end)
            raise
        self._check()

    def thread_failed(self, location: str, message: str) -> None:
        """Handle an exception that has ended a thread of user code; the next `advance` raises it."""
        if not self.ended.is_set():
            self._failed_threads.append((location, message))
        super().thread_failed(location, message)

    def step(self, automaton: int) -> None:
        """Run one cycle of one automaton, or of all with 0, while paused: see `ComponentRun`.

        Raises BehaviorFailed for what `sys.exit` ends, as `advance` does.
        """
        try:
            super().step(automaton)
        except BaseException as end:
            self._tell(end)
            raise

    def run_until(self, condition: Condition, limit: float = 60.0) -> float:
        """Run cycle by cycle until a condition holds, and return the time at which it does.

        A path holds when it, or anything below it, is active. Raises BehaviorFailed after `limit` s, and when
        the component has ended or a client pauses it.
        """
        holds = self._condition(condition)
        end = self.clock.now() + limit  # the component's own time may stand still
        step = min(actor.automaton.period for actor in self.tree.actors)
        while True:
            over, late = self._why_over(), self.clock.now() >= end - 1e-9
            if holds():
                return self.time
            if over or late:
                what, present = _not_so(condition), over or sentence("is")
                if not over:
                    what = sentence(f"{what} within {limit:g} s")
                where = sentence(f"at {self.time:.3f} s the behavior {present} in {self.active}")
                raise BehaviorFailed(f"{what}: {where}\n{self.timeline}")
            # Advance to the next multiple of the shortest period, when cycles are due.
            left = (int(self.time / step + 1e-6) + 1) * step - self.time
            self.advance(min(left, max(0.0, end - self.clock.now())))

    # -- present state -------------------------------------------------------------------------------------

    def __repr__(self) -> str:
        return f"<{self.name} at {self.time:g} s in {self.active}>"  # pytest shows it of a failed assertion

    def is_active(self, path: str) -> bool:
        """Return whether all states of a path from the root are current: `followBall/green`."""
        return any(f"{active}/".startswith(f"{path}/") for active in self.active_paths)

    @property
    def states(self) -> list[str]:
        """The paths of all states: `followBall/green`."""
        return [
            f"{path}/{state.name}" if path else state.name
            for actor, path in self._paths.items()
            for state in actor.automaton.states
        ]

    def state(self, automaton: str | int) -> str:
        """Return the current state of an automaton; for a ghost, the state that it remembers."""
        return self.automaton(automaton).current.name

    def is_ghost(self, automaton: str | int) -> bool:
        """Return whether an ancestor has left the state above an automaton."""
        return not self.automaton(automaton).active

    def automaton(self, name: str | int) -> Actor:
        """Return a running automaton; raises UnknownName when none, or more than one, matches."""
        actors = self.tree.actors
        found = [actor for actor, path in self._paths.items() if name in (actor.automaton.id, path)]
        if not found:
            found = [actor for actor in actors if actor.automaton.name == name]
        if len(found) == 1:
            return found[0]
        if found:
            paths = ", ".join(self._paths[actor] for actor in found)
            raise UnknownName(f"several automata are called {name!r}: name one by its path: {paths}")
        known = ", ".join(dict.fromkeys(actor.automaton.name for actor in actors))
        raise UnknownName(f"there is no automaton {name!r}; there are {known}")

    def variables(self, automaton: str | int) -> dict[str, Any]:
        """Return the variables of an automaton by name."""
        return values_of(self.automaton(automaton).automaton)

    # -- history -------------------------------------------------------------------------------------------

    @property
    def fired(self) -> list[Fired]:
        """Every transition that fired."""
        return self._journal.fired_transitions

    def changes(self, automaton: str) -> list[tuple[float, str]]:
        """Return the states that an automaton has entered, the initial one included, each with its time."""
        return super().changes(self.automaton(automaton).automaton.name)

    def calls(self, target: str = "") -> list[Call]:
        """Return the calls of an operation (`Head.setPose`) or of a servant (`Head`), or all, in order."""
        return self._journal.calls(target)

    @property
    def timeline(self) -> str:
        """The events of the run as text, which errors show."""
        name = self.tree.root.automaton.name
        head = f"timeline of {name}, {self.time:.3f} s, in {', '.join(self.active_paths)}"
        return f"{head}\n{self._journal.text()}"

    # -- control from outside ------------------------------------------------------------------------------

    @property
    def ros(self) -> Any:  # noqa: ANN401
        """The ROS around it, to publish messages, answer calls, carry out goals, and read what was sent."""
        return self.world.ros

    def set(self, automaton: str | int, /, **variables: object) -> None:
        """Set variables of an automaton, or with 0 parameters of the component."""
        number = 0 if automaton == 0 else self.automaton(automaton).automaton.id
        whose = f" of {automaton}" if number else ""
        for name, value in variables.items():
            self.set_variable(number, name, value)
            self._journal.note(f"sets {name}{whose} to {value!r}")

    def force(self, automaton: str | int, transition: str | int) -> None:
        """Make a transition out of the current state fire in the next cycle, whatever its guard returns."""
        actor = self.automaton(automaton)
        leaving = actor.automaton.outgoing(actor.current)
        found = [each for each in leaving if transition in (each.id, each.name)]
        if not found:
            known = ", ".join(each.name or str(each.id) for each in leaving) or "none"
            raise UnknownName(f"no transition {transition!r} leaves {actor.current.name}; there are {known}")
        super().force(actor.automaton.id, found[0].id)
        self._journal.note(f"forces {found[0].name or found[0].id} of {actor.automaton.name}")

    @property
    def guards(self) -> tuple[str, ...]:
        """The names of the guards that can be set."""
        return self._guards.names

    def guard(self, name: str, value: bool | None) -> None:
        """Make a guard true or false, whatever its code returns; None lets its code decide again.

        A guard has the name of its transition; where several have that name, the path of the automaton
        precedes it: `red/lost`.
        """
        self.proofs.doubt()
        self._guards.set(name, value)
        self._journal.note(f"sets the guard {name} to {value}")

    def stub(self, name: str, servant: Object | None = None, /, **operations: object) -> None:
        """Answer the calls of an interface from here, in place of the servant that served it so far.

        `name` is the name of the attribute or of the servant. Pass a servant, or single operations, each as
        a function of its arguments, a value to return, or an exception to raise; other operations work as
        before. Returned values are validated as on the wire.
        """
        self.world.stub(self.component, name, operations if servant is None else servant)

    @contextmanager
    def server_offline(self, *servants: str) -> Iterator[None]:
        """Take some servants, or all, offline in a `with` block: calls fail as if the connection were cut.

        Streams bring nothing meanwhile.
        """
        self._journal.note(f"takes {', '.join(servants) or 'the server'} offline")
        try:
            with self.world.offline(*servants):
                yield
        finally:
            self._journal.note("brings it back")

    def exchange(self, component: Component) -> tuple[str, ...]:
        """Continue in another version of the component, as a running one does after a reload.

        Returns what could not be kept.
        """
        with self._time_module.shown_to(component):
            return tuple(self._reloading.exchange(component).notKept)

    def replace(
        self, component: Component, actors: tuple[Actor, ...], apply: Callable[[int], Replaced]
    ) -> float:
        """Replace the component with another version of it, see `ComponentRun`."""
        held = super().replace(component, actors, apply)
        for named in ("_guards", "_paths"):
            vars(self).pop(named, None)
        return held

    def close(self) -> None:
        """End the code that sleeps, and the world: servants, proxies and streams."""
        try:
            if "tree" in vars(self):  # otherwise it could not be made
                self.end_cycles()
                forget_threads_of(self)
        finally:
            self.world.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    @cached_property
    def _guards(self) -> GuardTable:
        return GuardTable(self.tree)

    @cached_property
    def _paths(self) -> dict[Actor, str]:
        return {actor: path_of(actor) for actor in self.tree.actors}

    def _tell(self, end: BaseException) -> None:
        """Raise BehaviorFailed if an exception ends the component, and stop the robot."""
        if isinstance(end, Exception | KeyboardInterrupt):
            return
        location = locate(end, source_of(self.component))
        self._supervision.crashed(self.running or self.tree.root, end)
        self._wind_up()
        what = f"sys.exit({short_repr(end.code)})" if isinstance(end, SystemExit) else describe(end)
        raise self._failure(sentence(f"{what} ends the component"), location) from end

    def _stop_robot(self) -> None:
        end_callbacks(self.component)
        stop_robot(self.component)

    def _run_cycles(self, seconds: float) -> None:
        """Advance, while the code of the component sees virtual time; raises what ends the component."""
        genuine = self._time_module.show(self.component)
        try:
            super().advance(seconds)
        finally:
            restore(genuine)

    def _why_over(self) -> str:
        """Return why no cycle will run, as what the behavior does or is; empty while one may."""
        if not self.ended.is_set():
            return sentence("is paused") if self.paused_by_client else ""
        if self.failed:
            return sentence("has halted")
        return sentence("has finished") if self.finished else sentence("has ended")

    def _check(self) -> None:
        if self.proofs.reported:
            reported = [*self.proofs.reported, self.timeline]
            self.proofs.reported.clear()
            raise BehaviorFailed("\n".join(reported))
        failures = self._journal.take_failures()
        pauses = failures and self.component._hfsm_on_refused is OnRefused.PAUSE
        for actor, failure in failures:
            if pauses and isinstance(failure, CommandRefusedException):
                continue
            network = self.world.network
            is_cut = network.offline or network.has_failed
            if self._strict and not (is_cut and isinstance(failure, UNAVAILABLE)):
                last = self.errors[-1] if self.errors else None
                error = last.message if last else describe(failure)
                what = sentence(f"the code of {actor.automaton.name} raised {error}")
                raise self._failure(what, last.location if last else "") from failure
        if self._strict and self._failed_threads:
            location, what = self._failed_threads.popleft()
            raise self._failure(what, location)

    def _failure(self, what: str, location: str) -> BehaviorFailed:
        place = f"\n  at {location}" if location else ""
        return BehaviorFailed(f"{what}{place}\n{self.timeline}")

    def _condition(self, condition: Condition) -> Callable[[], object]:
        if isinstance(condition, str):
            return lambda: self.is_active(condition)
        if inspect.signature(condition).parameters:
            return lambda: condition(self)  # type: ignore[call-arg]
        return condition  # type: ignore[return-value]


def _not_so(condition: Condition) -> str:
    """Return the beginning of the sentence that says that a condition does not hold."""
    if isinstance(condition, str):
        return sentence(f"the state {condition} was not reached")
    name = name_of(condition, nameless := "the condition")
    return sentence("the condition did not hold") if name == nameless else sentence(f"{name} did not hold")


def name_of(function: object, nameless: str) -> str:
    """Return the name of a function, or `nameless` if it has none."""
    return str(getattr(function, "__name__", function)).replace("<lambda>", nameless)


def _set_parameters(component: Component, parameters: Mapping[str, object]) -> None:
    for name, value in parameters.items():
        if name not in parameters_of(component):
            known = ", ".join(parameters_of(component)) or "none"
            raise UnknownName(f"the component has no parameter {name!r}; there are {known}")
        setattr(component, name, value)
