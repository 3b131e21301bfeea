"""A behavior under test: a component in virtual time with a robot, and access to everything it does."""

from __future__ import annotations

import inspect
import threading
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import AbstractContextManager, contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from hfsm_runtime import Component
from hfsm_runtime.component import parameters_of, proxies_of, ros_of, source_of
from hfsm_runtime.debugger.reload import ReloadableRun
from hfsm_runtime.errors import OnRefused
from hfsm_runtime.recording.clocks import intercepted_time
from hfsm_runtime.robot import Permission, stop_robot
from hfsm_runtime.source_map import locate
from hfsm_runtime.supervision import UNAVAILABLE
from hfsm_runtime.tree import Run
from hfsm_runtime.variables import assign, values_of
from hfsm_runtime.virtual.clock import TaskClock
from hfsm_runtime.virtual.errors import BehaviorFailed, UnknownName, says_it_all
from hfsm_runtime.virtual.guards import GuardTable, path_of
from hfsm_runtime.virtual.journal import Call, Fired
from hfsm_runtime.virtual.network import VirtualNetwork, make_stub
from interfaces.jderobot import CommandRefusedException
from interfaces.nao import SafetyPrx
from zenoh_ice import Object

from .loading import forget, load_component
from .robot import CameraKind, RobotKind, RobotUnderTest

if TYPE_CHECKING:
    from hfsm_runtime.ros import Endpoints
    from hfsm_runtime.virtual.ros import FakeRos

__tracebackhide__ = says_it_all

Condition = str | Callable[[], object] | Callable[["Behavior"], object]
"""A path of states, or a function, of nothing or of the behavior, that returns whether it holds."""


class Behavior(ReloadableRun):
    """A component under test, in virtual time and with a robot; the fixture `behavior` makes it.

    An exception in its code fails the test, unless `on_error` is given: then this policy applies, `errors`
    lists the exceptions, and the policy `stop` stops the robot as a real component does. A refused command
    is not an error if the document lets it pause the component. Methods take an automaton by its name, its
    path (`followBall/green`: the states that own it) or its id.
    """

    component: Any
    """The `self` of user code: its parameters, proxies and functions."""

    def __init__(
        self,
        component: Component,
        *,
        robot: RobotKind | None = None,
        parameters: Mapping[str, object] | None = None,
        stubs: Mapping[str, Object | Mapping[str, object]] | None = None,
        on_error: str | None = None,
        camera: CameraKind = "auto",
        document: Path | None = None,
        **settings: Any,  # noqa: ANN401 - those of the robot
    ) -> None:
        self.document = document
        """The file of the document, if it is known."""
        self._strict = on_error is None
        self._thread: Final = threading.get_ident()
        self._date: Final = time.time()
        clock: Final = TaskClock()
        self._network: Final = VirtualNetwork(clock)
        self._ros: FakeRos | None = None
        self._endpoints: Endpoints | None = None
        self._robot: Final = (
            None if robot is None else RobotUnderTest(robot, clock, self._network, camera=camera, **settings)
        )
        try:
            for name, stub in (stubs or {}).items():
                self._stub(component, name, stub)
            for name, value in (parameters or {}).items():
                if name not in parameters_of(component):
                    known = ", ".join(parameters_of(component)) or "none"
                    raise UnknownName(f"the component has no parameter {name!r}; there are {known}")
                setattr(component, name, value)
            self._connect(component)
            self._journal: Final = self._network.journal
            safety = SafetyPrx.uncheckedCast(self._network.communicator.stringToProxy("Safety"))
            with self._virtual_time(component):
                super().__init__(
                    component,
                    clock=clock,
                    on_error=on_error,
                    on_halt=lambda: stop_robot(self.component),
                    commands_accepted=Permission(safety).is_given,
                    observers=[self._journal],
                )
        except BaseException:
            self.close()
            raise
        self._name_parts()
        self._tolerated = 0

    # -- time ----------------------------------------------------------------------------------------------

    def advance(self, seconds: float) -> None:
        """Run all cycles that fall due in the next `seconds`, the end included.

        Raises BehaviorFailed when user code raises an exception and no `on_error` was given, and when it
        calls `sys.exit`.
        """
        try:
            with self._virtual_time(self.component):
                super().advance(seconds)
        except SystemExit as end:
            location = locate(end, source_of(self.component))
            raise BehaviorFailed(
                f"sys.exit({end.code!r}) ends the component"
                + (f"\n  at {location}" if location else "")
                + f"\n{self.timeline}"
            ) from end
        self._check()

    def run_until(self, condition: Condition, limit: float = 60.0) -> float:
        """Run cycle by cycle until a condition holds, and return the time at which it does.

        A path holds when it, or anything below it, is active. Raises BehaviorFailed after `limit` s.
        """
        holds = self._condition(condition)
        end = self.clock.now() + limit  # the component's own time may stand still
        step = min(run.automaton.period for run in self.tree.runs)
        while not holds():
            if self.clock.now() >= end - 1e-9 or self.halted or self.finished:
                what = "halted" if self.halted else "finished" if self.finished else f"{limit:g} s"
                raise BehaviorFailed(
                    f"{name_of(condition, 'the condition')} did not happen: {what} at {self.time:.3f} s, "
                    f"in {self.active}\n{self.timeline}"
                )
            # Advance to the next multiple of the shortest period, when cycles are due.
            left = (int(self.time / step + 1e-6) + 1) * step - self.time
            self.advance(min(left, end - self.clock.now()))
        return self.time

    # -- present state -------------------------------------------------------------------------------------

    def is_active(self, path: str) -> bool:
        """Return whether all states of a path from the root are current: `followBall/green`."""
        return any(f"{active}/".startswith(f"{path}/") for active in self.active_paths)

    def state(self, automaton: str | int) -> str:
        """Return the current state of an automaton; for a ghost, the state that it remembers."""
        return self.automaton(automaton).current.name

    def is_ghost(self, automaton: str | int) -> bool:
        """Return whether an ancestor has left the state above an automaton."""
        return not self.automaton(automaton).active

    def automaton(self, name: str | int) -> Run:
        """Return a running automaton; raises UnknownName when none, or more than one, matches."""
        runs = self.tree.runs
        found = [run for run, path in self._paths.items() if name in (run.automaton.id, path)]
        if not found:
            found = [run for run in runs if run.automaton.name == name]
        if len(found) == 1:
            return found[0]
        if found:
            paths = ", ".join(self._paths[run] for run in found)
            raise UnknownName(f"several automata are called {name!r}: name one by its path: {paths}")
        known = ", ".join(dict.fromkeys(run.automaton.name for run in runs))
        raise UnknownName(f"there is no automaton {name!r}; there are {known}")

    def variables(self, automaton: str | int) -> dict[str, Any]:
        """Return the variables of an automaton by name."""
        return values_of(self.automaton(automaton).automaton)

    # -- history -------------------------------------------------------------------------------------------

    @property
    def fired(self) -> list[Fired]:
        """Every transition that fired."""
        return list(self._journal.fired_transitions)

    def changes(self, automaton: str) -> list[tuple[float, str]]:
        """Return the states that an automaton has entered, the initial one included, each with its time."""
        return super().changes(self.automaton(automaton).automaton.name)

    def calls(self, target: str = "") -> list[Call]:
        """Return the calls of an operation (`Head.setPose`) or of a servant (`Head`), or all, in order."""
        return self._journal.calls(target)

    @property
    def timeline(self) -> str:
        """The events of the run as text, shown when a test fails."""
        name = self.tree.root.automaton.name
        head = f"timeline of {name}, {self.time:.3f} s, in {', '.join(self.active_paths)}"
        return f"{head}\n{self._journal.text()}"

    # -- control by the test -------------------------------------------------------------------------------

    @property
    def robot(self) -> RobotUnderTest:
        """The robot: tests use it to place balls, read joints, and get camera images."""
        if self._robot is None:
            raise UnknownName("this behavior has no robot: pass robot='fake' or robot='sim'")
        return self._robot

    @property
    def ros(self) -> FakeRos:
        """The ROS of the test, to publish messages, answer calls, carry out goals, and read what was sent."""
        if self._ros is None:
            raise UnknownName("this behavior has no interfaces of ROS")
        return self._ros

    def set(self, automaton: str | int, **variables: object) -> None:
        """Set variables of an automaton."""
        for name, value in variables.items():
            assign(self.automaton(automaton).automaton, name, value)
            self._journal.note(f"sets {name} of {automaton} to {value!r}")

    def force(self, automaton: str | int, transition: str | int) -> None:
        """Make a transition out of the current state fire in the next cycle, whatever its guard returns."""
        run = self.automaton(automaton)
        leaving = run.automaton.outgoing(run.current)
        found = [each for each in leaving if transition in (each.id, each.name)]
        if not found:
            known = ", ".join(each.name or str(each.id) for each in leaving) or "none"
            raise UnknownName(f"no transition {transition!r} leaves {run.current.name}; there are {known}")
        run.forced = found[0]
        self._journal.note(f"forces {found[0].name or found[0].id} of {run.automaton.name}")

    @property
    def guards(self) -> tuple[str, ...]:
        """The names of the guards that can be set."""
        return self._guards.names

    def guard(self, name: str, value: bool | None) -> None:
        """Make a guard true or false, whatever its code returns; None lets its code decide again.

        A guard has the name of its transition; where several have that name, the path of the automaton
        precedes it: `red/lost`.
        """
        self._guards.set(name, value)
        self._journal.note(f"sets the guard {name} to {value}")

    def stub(self, name: str, servant: Object | None = None, /, **operations: object) -> None:
        """Answer the calls of an interface in the test, in place of the robot's servant.

        `name` is the name of the attribute or of the servant. Pass a servant, or single operations, each as
        a function of its arguments, a value to return, or an exception to raise; other operations work as
        before. Returned values are validated as on the wire.
        """
        self._stub(self.component, name, operations if servant is None else servant)

    @contextmanager
    def server_offline(self, *servants: str) -> Iterator[None]:
        """Take some servants, or all, offline in a `with` block: calls fail as if the connection were cut."""
        network = self._network
        before, network.offline = (
            network.offline,
            network.offline.union(servants or network.communicator.identities()),
        )
        self._journal.note(f"takes {', '.join(servants) or 'the server'} offline")
        try:
            yield
        finally:
            network.offline = before
            self._journal.note("brings it back")

    def reload(self, document: str | Path) -> tuple[str, ...]:
        """Continue with another version of the document, as a running component does after a reload.

        A relative path starts at the folder of the present document. Returns what could not be kept. Raises
        DocumentInvalid without changing anything.
        """
        path = (self.document or Path()).parent / document
        former, component = self.component, load_component(path)()
        try:
            self._connect(component)
            with self._virtual_time(component):
                not_kept = self.exchange(component)
        except BaseException:
            forget(type(component))
            raise
        forget(type(former))
        self.document = path
        self._name_parts()
        self._journal.note(f"reloads {path.name}")
        return not_kept

    def close(self) -> None:
        """Stop the robot and release its resources."""
        try:
            if self._robot is not None:
                self._robot.close()
        finally:
            self._network.communicator.destroy()

    def _name_parts(self) -> None:
        self._guards = GuardTable(self.tree)
        self._paths = {run: path_of(run) for run in self.tree.runs}

    def _virtual_time(self, component: Component) -> AbstractContextManager[None]:
        """Make the module `time` follow the clock of the test while user code runs."""
        return intercepted_time(type(component), self._read_time)

    def _read_time(self, kind: str, read: Callable[[], Any], waits: Callable[[], float] | None) -> object:
        name = kind.removeprefix("time.")
        if threading.get_ident() != self._thread or name == "process_time":
            return read()  # a thread of user code must not move the clock of the test
        if waits is not None and waits() >= 0:
            self._sleep(waits())
            return None
        if name == "sleep":
            return read()  # which raises
        now = self.clock.now() + (self._date if name.startswith("time") else 0.0)
        return round(now * 1e9) if name.endswith("_ns") else now

    def _connect(self, component: Component) -> None:
        for name, declared in proxies_of(component).items():
            if name in vars(component):
                continue
            untyped = self._network.communicator.stringToProxy(declared.identity)
            served = self._network.servant(declared.identity) is not None
            # Without a servant only calls fail: a test need not stub interfaces that it does not reach.
            cast = declared.type.checkedCast if served else declared.type.uncheckedCast
            vars(component)[name] = cast(untyped)
        if ros_of(component):
            self._connect_ros(component)

    def _connect_ros(self, component: Component) -> None:
        from hfsm_runtime.ros import Endpoints  # only behaviors that use ROS need its libraries
        from hfsm_runtime.virtual.ros import FakeRos

        if self._endpoints is None:
            network = self._network
            self._ros = FakeRos(network.clock.now, network.clock.wait_for, network.journal.called)
            self._endpoints = Endpoints(self._ros, self._ros.types)
        self._endpoints.connect(component)

    def _stub(self, component: Component, name: str, stub: Object | Mapping[str, object]) -> None:
        declared = proxies_of(component)
        found = {proxy.identity: proxy for key, proxy in declared.items() if name in (key, proxy.identity)}
        if not found:
            known = ", ".join(declared) or "none"
            raise UnknownName(f"the component has no interface {name!r}; there are {known}")
        ((identity, proxy),) = found.items()
        if isinstance(stub, Object):
            self._network.serve(identity, stub)
        else:
            below = self._network.servant(identity)
            servant, polls = make_stub(identity, proxy.type.ice_interface, stub, below)
            self._network.serve(identity, servant, polls)

    def _check(self) -> None:
        new = self._journal.failures[self._tolerated :]
        self._tolerated = len(self._journal.failures)
        pauses = self.component._hfsm_on_refused is OnRefused.PAUSE
        for run, error in new:
            if pauses and isinstance(error, CommandRefusedException):
                continue
            if self._strict and not (self._network.offline and isinstance(error, UNAVAILABLE)):
                location = self.errors[-1].location if self.errors else ""
                raise BehaviorFailed(
                    f"the code of {run.automaton.name} raised {type(error).__name__}: {error}"
                    + (f"\n  at {location}" if location else "")
                    + f"\n{self.timeline}"
                ) from error

    def _condition(self, condition: Condition) -> Callable[[], object]:
        if isinstance(condition, str):
            return lambda: self.is_active(condition)
        if inspect.signature(condition).parameters:
            return lambda: condition(self)  # type: ignore[call-arg]
        return condition  # type: ignore[return-value]


def name_of(function: object, nameless: str) -> str:
    """Return the name of a function, or `nameless` if it has none."""
    return str(getattr(function, "__name__", function)).replace("<lambda>", nameless)
