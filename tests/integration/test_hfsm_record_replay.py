"""Components on real threads with real servants are recorded, and replayed to the same end."""

from __future__ import annotations

import math
import random
import re
import threading
import time
from collections.abc import Callable, Iterator
from concurrent.futures import Future
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, ClassVar

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from hfsm_runtime import Automaton, Component, Output, Proxy, State, Transition
from hfsm_runtime._recording.run import RecordedRuntime, recording
from hfsm_runtime._replay.comparison import Comparison
from hfsm_runtime._replay.run import Replay
from hfsm_runtime._replay.script import Recording, ReplayError
from hfsm_runtime._robot import connect
from hfsm_runtime.debugger._breakpoints import Breakpoints
from hfsm_runtime.recording_file import writer
from hfsm_runtime.recording_file.messages import Action, Cycle, Mark, Reading, Result
from hfsm_runtime.tree import Actor
from interfaces.hfsm import Breakpoint
from interfaces.jderobot import CommandRefusedException, ImageProviderPrx
from interfaces.nao import HeadLimits, HeadPose, PoseHead, PoseHeadPrx
from tests.support.carriers import COLLOCATED, everywhere, is_used
from tests.support.examples import examples
from tests.support.fast_clock import FastClock
from tests.support.image_servant import ImageI, image
from tests.support.limits import CALL_LIMIT, EVENT_LIMIT
from tests.support.robot_server import eventually
from tests.support.waiting import listened
from zenoh_ice import (
    Communicator,
    Current,
    MarshalException,
    ObjectAdapter,
    Sample,
    TimeoutException,
    initialize,
)
from zenoh_ice import generated as ice
from zenoh_ice.data.keys import Target
from zenoh_ice.data.wire import encode_sample_attachment
from zenoh_ice.generated import Object, ObjectPrx

FOREVER = 10**18

MakeCommunicator = Callable[..., Communicator]
World = tuple[Communicator, "HeadI"]


class HeadI(PoseHead):
    """A head with an unpredictable pose; while it is `stopped` it refuses speeds."""

    stopped = False

    def __init__(self) -> None:
        self._random = random.SystemRandom()
        self.executed: list[str] = []

    def setPose(self, pan: float, tilt: float, fraction: float, current: Current) -> HeadPose:
        return self.pose()

    def setSpeed(self, panSpeed: float, tiltSpeed: float, current: Current) -> HeadPose:
        self.executed.append(current.operation)
        if self.stopped:
            raise CommandRefusedException("the robot is stopped", "")
        return self.pose()

    def stop(self, current: Current) -> None:
        if self._random.random() < 0.3:
            raise RuntimeError("the head is stuck")

    def getPose(self, current: Current) -> HeadPose:
        self.executed.append(current.operation)
        return self.pose()

    def getLimits(self, current: Current) -> HeadLimits:
        raise RuntimeError("nobody knows")

    def pose(self) -> HeadPose:
        number = self._random.random
        return HeadPose(number(), number(), number(), number(), number())


@pytest.fixture
def path(tmp_path: Path) -> Path:
    """The recording of a test."""
    return tmp_path / "run.mcap"


@pytest.fixture
def carrier() -> str:
    """By default a component and its robot are one process, so that a test waits for no other thread."""
    return COLLOCATED


@pytest.fixture
def server(endpoint: str, make_communicator: MakeCommunicator) -> Communicator:
    return make_communicator(listen=[endpoint])


@pytest.fixture
def world(carrier: str, endpoint: str, server: Communicator, make_communicator: MakeCommunicator) -> World:
    """The communicator of components, and the head of its realm."""
    head = HeadI()
    adapter = server.createObjectAdapter("Test")
    adapter.add(head, "Head")
    adapter.activate()
    return server if carrier == COLLOCATED else make_communicator(connect=[endpoint]), head


@contextmanager
def running(
    make: Callable[[], Component],
    world: World,
    path: Path,
    *,
    on_error: str = "continue",
    begin_at: tuple[int, int] | None = None,
    with_images: bool = False,
) -> Iterator[tuple[RecordedRuntime, FastClock]]:
    """Record a component on its threads, thirty times as fast as the wall's clock."""
    from hfsm_runtime.errors import OnError

    component = make()
    component.log.disabled = True
    connect(component, world[0])
    clock = FastClock()
    with recording(component, path, with_images=with_images) as recorder:
        runtime = RecordedRuntime(component, clock, recorder, on_error=OnError(on_error))
        if begin_at is not None:
            runtime.begin_at(*begin_at)
        runtime.start()
        try:
            yield runtime, clock
        finally:
            runtime.stop()


def pass_cycles(runtime: RecordedRuntime, number: int) -> None:
    """Wait for more than a number of further cycles."""
    cycles = runtime.tree.root.cycle.count
    eventually(lambda: runtime.tree.root.cycle.count > cycles + number)


def replayed(path: Path, make: Callable[[], Component], **options: Any) -> tuple[Replay, Comparison]:
    with Replay(Recording(path), make, FOREVER, **options) as run:
        return run, run.run()


def identical(path: Path, make: Callable[[], Component]) -> Comparison:
    run, comparison = replayed(path, make)
    assert comparison.divergences == []
    assert comparison.differences == []
    assert comparison.identical
    assert not run.guesses
    return comparison


class Watcher(Component, document="watcher.xml"):
    """One automaton; subclasses say what it does."""

    head = Proxy("Head", PoseHeadPrx)
    threshold = 0.5

    def automaton(self) -> Automaton:
        values: list[Any] = []
        count = 0

        def look() -> None:
            nonlocal count, values
            count += 1
            values = self.look(count)

        def guard() -> bool:
            return self.decide()

        return Automaton(
            id=1,
            name="watcher",
            states=(State(id=1, name="a", initial=True, code=look), State(id=2, name="b", code=look)),
            transitions=(
                Transition(id=1, name="up", origin=1, destination=2, guard=guard),
                Transition(id=2, name="down", origin=2, destination=1, seconds=0.25),
            ),
        )

    def look(self, count: int) -> list[Any]:
        return [count]

    def decide(self) -> bool:
        return self.head.getPose().pan > self.threshold


class Stays(Watcher, document="watcher.xml"):
    """One that stays in its first state."""

    def decide(self) -> bool:
        return False


def record_watcher(kind: Callable[[], Component], world: World, path: Path, seconds: float = 3.0) -> None:
    with running(kind, world, path) as (runtime, clock):
        clock.sleep(seconds)
        eventually(lambda: runtime.tree.root.cycle.count > 8 * seconds)


@everywhere
def test_calls_come_back_with_what_they_brought(path: Path, world: World, carrier: str) -> None:
    class Calls(Watcher, document="watcher.xml"):
        def look(self, count: int) -> list[Any]:
            pose = self.head.setSpeed(0.1, float("nan"))
            return [pose, pose.pan, self.head.ice_getIdentity()]

    record_watcher(Calls, world, path)
    assert is_used(carrier)
    calls = [record.message for record in Recording(path) if isinstance(record.message, Result)]
    assert [call.operation for call in calls] == world[1].executed
    assert {call.kind for call in calls} == {"call"}
    comparison = identical(path, Calls)
    assert comparison.cycles > 10
    assert len(comparison.replayed_steps) > 2


@everywhere
def test_exceptions_come_back_as_what_they_were(path: Path, world: World) -> None:
    class Fails(Watcher, document="watcher.xml"):
        def look(self, count: int) -> list[Any]:
            found: list[Any] = []
            wrong: Any = self.head.setSpeed
            calls: list[Callable[[], object]] = [
                self.head.stop, self.head.getLimits, lambda: wrong("fast"),
                lambda: self.head.getPose.wait(timeout=0.001),
            ]  # fmt: skip
            for call in calls:
                try:
                    call()
                except Exception as error:  # noqa: BLE001
                    found.append([type(error).__name__, str(error)])
            if count % 5 == 0:
                self.head.getLimits()
            return found

    record_watcher(Fails, world, path)
    identical(path, Fails)


@everywhere
def test_exit_code_that_fails_and_what_is_stopped_for_it_come_back(path: Path, world: World) -> None:
    class Leaves(Component, document="leaves.xml"):
        head = Proxy("Head", PoseHeadPrx)

        def automaton(self) -> Automaton:
            return Automaton(
                id=1,
                name="leaves",
                states=(
                    State("a", initial=True, code=self.head.getPose, exit=self.leave),
                    State("b", code=self.head.getPose),
                ),
                transitions=(Transition("", 1, 2, seconds=0.2), Transition("", 2, 1, seconds=0.2)),
            )

        def leave(self) -> None:
            self.head.getLimits()  # fails
            self.head.stop()

    record_watcher(Leaves, world, path)
    assert identical(path, Leaves).cycles > 10


class Hands(Component, document="hands.xml"):
    """An automaton that takes what the one below sees, which sleeps meanwhile."""

    head = Proxy("Head", PoseHeadPrx)

    def automaton(self) -> Automaton:
        pan, seen, changes = 0.0, 0.0, 0

        def look() -> None:
            nonlocal pan
            pan = self.head.getPose().pan
            self.sleep(0.03 + 0.1 * pan)  # sometimes longer than a period
            pan += 1.0

        def set_outputs(values: Any) -> None:
            nonlocal pan
            pan = values["pan"]

        def take(values: Any) -> None:
            nonlocal seen
            seen = values["pan"]

        def count() -> None:
            nonlocal changes
            changes += 1

        below = Automaton(
            id=2, name="eye", period=0.05, states=(State(id=1, name="look", initial=True, code=look),),
            outputs=(Output(name="pan", type=float, default=0.0),),
            set_outputs=set_outputs, get_outputs=lambda: {"pan": pan},
        )  # fmt: skip
        states = (
            State(id=1, name="a", initial=True, children=(below,), results=take, restart=True),
            State(id=2, name="b", code=count),
        )
        ways = (
            Transition("", 1, 2, id=1, guard=lambda: seen > 1.5),
            Transition("", 2, 1, id=2, seconds=0.1, guard=lambda: changes >= 0),
        )
        return Automaton(id=1, name="hands", period=0.05, states=states, transitions=ways)


def test_outputs_are_handed_up_in_the_same_cycles(path: Path, world: World) -> None:
    with running(Hands, world, path) as (runtime, clock):
        clock.sleep(4.0)
        eventually(lambda: runtime.tree.root.cycle.count > 30)
    assert identical(path, Hands).cycles > 30


def test_clocks_sleeps_and_random_numbers_are_those_of_the_run(path: Path, world: World) -> None:
    class Clocks(Watcher, document="watcher.xml"):
        def look(self, count: int) -> list[Any]:
            if count % 4 == 0:
                self.sleep(0.03)
            if count % 6 == 0:
                self.clock.sleep(0.01)
            return [self.clock.now(), self.clock.simulated, time.time(), time.monotonic_ns(), random.random()]

        def decide(self) -> bool:
            return random.random() > 0.5

    record_watcher(Clocks, world, path)
    identical(path, Clocks)
    assert time.time is __import__("time").time


def test_streams_bring_the_same_samples_with_the_same_ages(path: Path, world: World) -> None:
    class Streams(Watcher, document="watcher.xml"):
        last: Sample[HeadPose] | None = None
        identities: ClassVar[set[bool]] = set()

        def look(self, count: int) -> list[Any]:
            sample = self.head.getPose.latest()
            again = self.head.getPose.latest()
            found: list[Any] = [sample is self.last, sample is again]
            newer = again is not None and (sample is None or again.sequence > sample.sequence)
            if not newer:  # one may come between two looks
                self.identities.add(sample is again)
            if sample is not None:
                found += [sample.value, sample.age, sample.sequence, sample.time, sample.wall_time]
            if count % 7 == 0:
                found.append(self.head.getPose.wait(timeout=0.5).value.pan)
            self.last = sample
            return found

        def decide(self) -> bool:
            return self.last is not None and self.last.value.pan > 0.5

    publisher = world[1].getPosePublisher
    with running(Streams, world, path) as (_, clock):
        clock.sleep(0.1)
        assert listened(publisher, EVENT_LIMIT)
        for step in range(30):
            if step % 3 == 0:
                publisher.publish(world[1].pose(), time=float(step))
            clock.sleep(0.1)
    assert Streams.identities == {True}
    identical(path, Streams)


@everywhere
def test_asynchronous_results_arrive_in_the_same_cycle(path: Path, world: World, carrier: str) -> None:
    class Futures(Watcher, document="watcher.xml"):
        pending: Future[HeadPose] | None = None
        arrived = 0

        def look(self, count: int) -> list[Any]:
            found: list[Any] = [self.arrived]
            if self.pending is None:
                self.pending = self.head.getPose.begin()
                self.pending.add_done_callback(self.note)
            elif self.pending.done():
                found.append(self.pending.result())
                self.pending = None
            elif count % 3 == 0:
                found.append(self.pending.result(CALL_LIMIT).pan)
            return found

        def note(self, _future: Future[HeadPose]) -> None:
            self.arrived += 1

    record_watcher(Futures, world, path)
    assert is_used(carrier)
    identical(path, Futures)


def test_callbacks_of_streams_are_called_with_the_same_samples(path: Path, world: World) -> None:
    class Callbacks(Watcher, document="watcher.xml"):
        seen = 0.0
        subscribed = False

        def look(self, count: int) -> list[Any]:
            if not self.subscribed:
                self.subscribed = True
                self.head.getPose.subscribe(self.note)
            return [self.seen]

        def note(self, sample: Sample[HeadPose]) -> None:
            self.seen += sample.value.pan + self.head.getPose().tilt

    publisher = world[1].getPosePublisher
    with running(Callbacks, world, path) as (_, clock):
        clock.sleep(0.1)
        assert listened(publisher, EVENT_LIMIT)
        for step in range(20):
            publisher.publish(world[1].pose(), time=float(step))
            clock.sleep(0.1)
    identical(path, Callbacks)


def test_what_others_did_to_it_is_done_again(path: Path, world: World) -> None:
    class Steered(Watcher, document="watcher.xml"):
        threshold = 2.0  # never by itself

    with running(Steered, world, path) as (runtime, clock):
        clock.sleep(0.3)
        runtime.force(1, 1)
        clock.sleep(0.2)
        runtime.pause()
        runtime.set_variable(1, "count", 1000)
        runtime.step(0)
        clock.sleep(1.0)
        runtime.resume()
        eventually(lambda: runtime.tree.root.last_transition == 2)
        runtime.send("hello", {"a": [1, 2.5, None]})
        clock.sleep(0.3)
    comparison = identical(path, Steered)
    assert [step.state for step in comparison.replayed_steps] == ["a", "b", "a"]


def test_a_document_that_was_renamed_is_compared_under_one_name(path: Path, world: World) -> None:
    class Renamed(Watcher, document="copy.xml"):
        def automaton(self) -> Automaton:
            return replace(super().automaton(), name="copy")

    with running(Watcher, world, path) as (runtime, _):
        eventually(lambda: runtime.tree.root.last_transition == 1)
    run, comparison = replayed(path, Renamed)
    assert comparison.identical
    assert len({step.name for step in (*comparison.recorded_steps, *comparison.replayed_steps)}) == 1
    assert run.notes == ["the recording is of watcher.xml, and copy.xml is compared with it"]


def test_a_run_that_began_elsewhere_is_replayed_from_there(path: Path, world: World) -> None:
    with running(Watcher, world, path, begin_at=(1, 2)) as (_, clock):
        clock.sleep(0.5)
    comparison = identical(path, Watcher)
    assert comparison.replayed_steps[0].state == "b"


def test_a_breakpoint_stops_the_replay_where_it_stopped_the_run(path: Path, world: World) -> None:
    with running(Watcher, world, path) as (runtime, clock):
        breakpoints = Breakpoints(runtime)
        breakpoints.set([Breakpoint(1, 2, 0, "")])
        eventually(lambda: runtime.component_time.paused)
        clock.sleep(0.5)
        runtime.step(0)
        breakpoints.set([])
        runtime.resume()
        eventually(lambda: runtime.tree.root.last_transition == 2)
    comparison = identical(path, Watcher)
    assert [step.state for step in comparison.replayed_steps][:3] == ["a", "b", "a"]


class Gate(HeadI):
    """A head that answers when it may."""

    def __init__(self) -> None:
        super().__init__()
        self.entered = threading.Semaphore(0)
        self.leave = threading.Semaphore(0)

    def getPose(self, current: Current) -> HeadPose:
        self.entered.release()
        assert self.leave.acquire(timeout=CALL_LIMIT)
        return self.pose()


class Sharing(Component, document="sharing.xml"):
    """Two automata that change one attribute before and after a call."""

    upper = Proxy("Upper", PoseHeadPrx)
    lower = Proxy("Lower", PoseHeadPrx)

    def automaton(self) -> Automaton:
        self.shared = 1
        seen_above = seen_below = 0

        def above() -> None:
            nonlocal seen_above
            self.shared = 3 * self.shared + 1
            self.upper.getPose()
            seen_above = self.shared = self.shared * 5 % 1009

        def below() -> None:
            nonlocal seen_below
            self.shared = 7 * self.shared + 2
            self.lower.getPose()
            seen_below = self.shared = self.shared * 2 % 1013

        child = Automaton(id=2, name="child", states=(State(id=1, name="c", initial=True, code=below),))
        state = State(id=1, name="a", initial=True, code=above, children=(child,))
        return Automaton(id=1, name="root", states=(state,))


def end_cycle(run: Actor, gate: Gate) -> None:
    """Let the call through for which a cycle waits, and wait for its end."""
    cycles = run.cycle.count
    gate.leave.release()
    eventually(lambda: run.cycle.count > cycles)


def test_code_that_waits_goes_on_where_it_did_between_the_cycles_of_others(path: Path) -> None:
    gates = Gate(), Gate()
    ends: list[int] = []
    with initialize(connect=[], clock="wall", timeout=CALL_LIMIT) as communicator:
        adapter = communicator.createObjectAdapter("Test")
        for name, gate in zip(("Upper", "Lower"), gates, strict=True):
            adapter.add(gate, name)
        adapter.activate()
        with running(Sharing, (communicator, HeadI()), path) as (runtime, _):
            for first in (0, 1, 1, 0, 1):
                for gate in gates:
                    assert gate.entered.acquire(timeout=EVENT_LIMIT)  # both wait
                for each in (first, 1 - first):
                    end_cycle(runtime.tree.actors[each], gates[each])
                    ends.append(each + 1)
            runtime.request_stop()
            for gate in gates:
                gate.leave.release(2)
    recorded = [record.message for record in Recording(path)]
    ended = [each.automaton for each in recorded if isinstance(each, Cycle) and not each.begins]
    assert ended[: len(ends)] == ends
    identical(path, Sharing)


# Edited documents.


def test_a_refused_command_pauses_the_replay_where_it_paused_the_run(path: Path, world: World) -> None:
    class Commands(Watcher, document="watcher.xml"):
        def look(self, count: int) -> list[Any]:
            return [self.head.setSpeed(0.1, 0.0)]

    with running(Commands, world, path, on_error="stop") as (runtime, _clock):
        for _ in range(3):
            pass_cycles(runtime, 5)
            world[1].stopped = True
            eventually(lambda: runtime.refusal is not None)
            world[1].stopped = False
            runtime.resume()
        pass_cycles(runtime, 5)
    assert identical(path, Commands).cycles > 20


def test_an_edited_document_parts_in_the_cycle_in_which_it_decides_otherwise(
    path: Path, world: World
) -> None:
    class Edited(Watcher, document="watcher.xml"):
        threshold = 0.9

    record_watcher(Watcher, world, path)
    _, same = replayed(path, Watcher)
    fired = [step.time for step in same.recorded_steps if step.state == "b"]
    _, comparison = replayed(path, Edited)
    poses: list[tuple[int, float]] = []
    at = 0
    for record in Recording(path):
        if isinstance(record.message, Cycle) and record.message.begins:
            at = record.message.at
        elif record.topic == "/proxy/head/getPose":
            poses.append((at, record.message.value["pan"]))  # type: ignore[attr-defined]
    first = next(at for at, pan in poses if 0.5 < pan <= 0.9)
    (found,) = comparison.divergences
    assert found.time == pytest.approx(first / 1e9)  # the cycle in which it was read
    assert found.time in fired
    assert (found.recorded.guards, found.replayed.guards) == ({"up": True}, {"up": False})
    assert (found.recorded.fired, found.replayed.fired) == (["up"], [])
    assert (found.recorded.state_after, found.replayed.state_after) == ("b", "a")


def test_a_proof_that_is_wrong_in_the_replay_alone_is_a_divergence(path: Path, world: World) -> None:
    class Asks(Watcher, document="watcher.xml"):
        def look(self, count: int) -> list[Any]:
            self.send("go")
            return [count]

    class Proved(Asks, document="watcher.xml"):
        _hfsm_proofs = (("sent", "go", ()),)

    also = path.with_name("also.mcap")
    record_watcher(Asks, world, path, 0.5)
    _, comparison = replayed(path, Proved)
    (found,) = comparison.divergences
    assert not found.recorded.errors
    assert any("what is proved of watcher.xml is wrong here" in each for each in found.replayed.errors)
    record_watcher(Proved, world, also, 0.5)
    identical(also, Proved)


def test_values_that_nobody_had_asked_for_are_the_newest_before(path: Path, world: World) -> None:
    class Curious(Watcher, document="watcher.xml"):
        def look(self, count: int) -> list[Any]:
            return [self.head.getPose().pan]

    record_watcher(Watcher, world, path)
    run, comparison = replayed(path, Curious)
    assert comparison.divergences == []
    assert set(run.guesses) == {"self.head.getPose (call)"}
    assert {found.what for found in comparison.differences} == {"values"}


def test_what_was_never_recorded_is_an_error_of_the_edited_document(path: Path, world: World) -> None:
    class Lost(Watcher, document="watcher.xml"):
        def look(self, count: int) -> list[Any]:
            return [self.head.setSpeed(0.0, 0.0)]

    record_watcher(Watcher, world, path, 0.5)
    _, comparison = replayed(path, Lost)
    (found,) = comparison.divergences
    assert "nobody had read self.head.setSpeed (call)" in found.replayed.errors[0]


def test_cycles_that_the_recording_lacks_last_as_long_as_their_code_waits(path: Path, world: World) -> None:
    class Slow(Stays, document="watcher.xml"):
        def automaton(self) -> Automaton:
            return replace(super().automaton(), period=0.2)

        def look(self, count: int) -> list[Any]:
            self.sleep(0.3)
            return [count]

    record_watcher(Watcher, world, path)
    run, comparison = replayed(path, Slow)
    assert comparison.cycles == math.ceil(Recording(path).duration / 0.4e9)  # every other slot is missed
    assert not run.guesses


def test_an_edited_document_takes_over_at_a_moment_and_keeps_states_and_variables(
    path: Path, world: World
) -> None:
    class Patient(Watcher, document="watcher.xml"):
        threshold = 2.0

    record_watcher(Watcher, world, path, 6.0)
    run, comparison = replayed(path, Watcher, edited=Patient, since=3_000_000_000)
    before = [step for step in comparison.recorded_steps if step.time < 3.0]
    assert comparison.replayed_steps[: len(before)] == before
    assert [step for step in comparison.replayed_steps if step.time > 3.0 and step.state == "b"] == []
    assert comparison.divergences[0].time >= 3.0
    assert not [found for found in comparison.differences if found.what == "count"]
    taken = re.search(r"the edited document took over at (\d+\.\d)", run.notes[0])
    assert taken is not None
    assert float(taken[1]) >= 3.0


def test_an_edited_document_does_not_take_over_from_a_component_that_has_ended(
    path: Path, world: World
) -> None:
    class Fails(Watcher, document="watcher.xml"):
        def look(self, count: int) -> list[Any]:
            return [1 // (3 - count)]

    with running(Fails, world, path, on_error="stop") as (runtime, clock):
        assert runtime.ended.wait(EVENT_LIMIT)
        clock.sleep(0.5)
        ended = runtime.component_time.now()
        runtime.send("hello")
    identical(path, Fails)
    run, comparison = replayed(path, Fails, edited=Watcher, since=ended)
    assert run.notes == ["the edited document did not take over: the replay ended before it could"]
    assert comparison.identical


def test_a_gap_in_the_recording_is_reported_and_ends_the_replay(path: Path, world: World) -> None:
    with running(Watcher, world, path) as (runtime, _):
        for size in (0, writer._MOST_BYTES - 1000, 0):
            if size:  # nothing else fits into the queue until it is written
                runtime._recorder.put("/marks", Mark("top", 0.0, 0.0, ""), size)
            pass_cycles(runtime, 10)
    run, comparison = replayed(path, Watcher)
    (note,) = run.notes
    gap = re.match(r"the recording has a gap at (\d+\.\d+) s", note)
    assert gap is not None, note
    assert comparison.divergences == []
    assert max(step.time for step in comparison.replayed_steps) <= float(gap[1]) + 0.001


def test_a_recording_of_more_automata_than_any_component_has_is_refused(path: Path) -> None:
    recorded = writer.RecordingWriter(path, {"name": "many", "start": "0"}, {}, 0)
    recorded.put(writer.Entry("/actions", 0, Action("start")))
    for number in range(101):
        recorded.put(writer.Entry("/cycles/x", number, Cycle(number, "x", True, number)))
    recorded.close()
    with pytest.raises(ReplayError, match="runs more than 100 automata at a time"):
        replayed(path, Watcher, most_automata=100)


# What passes the transport.


class DirectoryPrx(ObjectPrx, id="::test::Directory", fingerprint="c0ffee000000000d"):
    @ice.operation()
    def find(self) -> PoseHeadPrx | None: ...


class Directory(Object, proxy=DirectoryPrx):
    """Knows a head."""

    def __init__(self, head: ObjectPrx) -> None:
        self._head = PoseHeadPrx.uncheckedCast(head)

    def find(self, current: Current) -> PoseHeadPrx | None:
        return self._head


@pytest.fixture
def adapter(server: Communicator) -> ObjectAdapter:
    """What serves more than the head."""
    made = server.createObjectAdapter("More")
    made.activate()
    return made


def test_a_servant_that_is_away_is_away_in_the_replay(path: Path) -> None:
    class Patient(Stays, document="watcher.xml"):
        def look(self, count: int) -> list[Any]:
            found: list[Any] = []
            for call in (self.head.getPose, self.head.stop, lambda: self.head.getPose.wait(timeout=0.01)):
                try:
                    found.append(call())
                except Exception as error:  # noqa: BLE001
                    found.append([type(error).__name__, str(error)])
            return found

    with initialize(connect=[], clock="wall") as communicator:
        head = HeadI()
        adapter = communicator.createObjectAdapter("Test")
        adapter.add(head, "Head")
        adapter.activate()

        with running(Patient, (communicator, head), path) as (runtime, _):
            pass_cycles(runtime, 3)
            adapter.removeAll(["Head"])
            pass_cycles(runtime, 3)
            adapter.add(head, "Head")
            pass_cycles(runtime, 3)
    identical(path, Patient)
    seen = {record.message.error for record in Recording(path) if isinstance(record.message, Result)}
    assert {error.partition(": ")[0] for error in seen} >= {"", "ConnectionLostException"}


@everywhere
def test_a_proxy_that_comes_in_a_value_leads_to_what_it_led_to(
    path: Path, world: World, adapter: ObjectAdapter
) -> None:
    class Finder(Stays, document="watcher.xml"):
        directory = Proxy("Directory", DirectoryPrx)

        def look(self, count: int) -> list[Any]:
            found = self.directory.find()
            assert found is not None
            return [found.getPose(), found.ice_toString()]

    adapter.add(Directory(world[0].stringToProxy("Head")), "Directory")
    record_watcher(Finder, world, path, 1.0)
    assert identical(path, Finder).cycles > 5


class Looks(Stays, document="watcher.xml"):
    """Looks at images."""

    camera = Proxy("Camera", ImageProviderPrx)

    def look(self, count: int) -> list[Any]:
        sample = self.camera.getImageData.latest()
        image = self.camera.getImageData("GRAY8").pixelData
        seen = sample and (sample.value.timeStamp.seconds, hash(bytes(sample.value.pixelData)))
        return [hash(bytes(image)), len(image), seen]


@everywhere
@pytest.mark.parametrize("size", [500, 5000, 200_000])
@pytest.mark.parametrize("with_images", [False, True])
def test_images_come_back_where_they_are_recorded(
    *,
    path: Path,
    world: World,
    adapter: ObjectAdapter,
    caplog: pytest.LogCaptureFixture,
    size: int,
    with_images: bool,
) -> None:
    camera = ImageI()
    adapter.add(camera, "Camera")
    with running(Looks, world, path, with_images=with_images) as (runtime, clock):
        assert listened(camera.getImageDataPublisher, EVENT_LIMIT)
        for number in range(10):
            camera.getImageDataPublisher.publish(image(number, bytes([number]) * size))
            clock.sleep(0.1)
        eventually(lambda: runtime.tree.root.cycle.count > 10)
    warned = [record for record in caplog.messages if "images of self.camera are not recorded" in record]
    assert len(warned) == (0 if with_images else 1)
    if with_images:
        identical(path, Looks)
    else:  # those of the calls are large
        with pytest.raises(ReplayError, match=r"returned \d+ bytes that are not in the recording"):
            replayed(path, Looks)


class Loops(Stays, document="watcher.xml"):
    """Looks at each sample of a stream."""

    last: Sample[HeadPose] | None = None

    def look(self, count: int) -> list[Any]:
        found: list[Any] = []
        try:
            self.last = self.head.getPose.wait(self.last, timeout=0.02)
            for sample in self.head.getPose.samples(timeout=0.02):
                seen = [sample.value.pan, sample.sequence, sample.lost, sample.follows(self.last)]
                found.append(seen)
        except TimeoutException as error:
            found.append(str(error))
        return found


class Paced(Stays, document="watcher.xml"):
    """Looks at samples of a stream at a rate."""

    def look(self, count: int) -> list[Any]:
        found: list[Any] = []
        try:
            samples = self.head.getPose.samples(timeout=0.02, rate=50.0)
            found.extend([sample.value.pan, sample.sequence] for sample in samples)
        except TimeoutException as error:
            found.append(str(error))
        return found


@pytest.mark.parametrize(
    ("kind", "message", "waits"), [(Loops, Result, "wait"), (Paced, Reading, "clock.wait")]
)
def test_loops_over_a_stream_see_the_same_samples_and_wait_for_nothing_in_the_replay(
    path: Path, world: World, kind: type[Watcher], message: type[Result | Reading], waits: str
) -> None:
    publisher = world[1].getPosePublisher
    with running(kind, world, path) as (runtime, clock):
        assert listened(publisher, EVENT_LIMIT)
        chance = random.Random(1)
        for _ in range(40):
            publisher.publish(world[1].pose())
            clock.sleep(chance.choice([0.02, 0.1, 0.3]))
        eventually(lambda: runtime.tree.root.cycle.count > 10)
    identical(path, kind)
    kinds = [record.message.kind for record in Recording(path) if isinstance(record.message, message)]
    assert kinds.count(waits) > (10 if kind is Loops else 0)


def test_a_stream_that_nobody_asked_for_is_let_go_of_in_the_replay_too(path: Path) -> None:
    class Seldom(Stays, document="watcher.xml"):
        def look(self, count: int) -> list[Any]:
            if count % 20 > 3:
                return []
            sample = self.head.getPose.latest()
            forgotten.append(sample is None)
            return [sample and [sample.value.pan, sample.lost]]

    forgotten: list[bool] = []

    def was_forgotten() -> bool:
        return False in forgotten and True in forgotten[forgotten.index(False) :]

    with initialize(connect=[], clock="wall") as communicator:
        head = HeadI()
        adapter = communicator.createObjectAdapter("Test")
        adapter.add(head, "Head")
        adapter.activate()

        def forgets() -> bool:
            head.getPosePublisher.publish(head.pose())
            communicator.streams.close_unwanted()  # as otherwise each 2.5 s
            return was_forgotten()

        with running(Seldom, (communicator, head), path):
            eventually(forgets, EVENT_LIMIT)
    identical(path, Seldom)
    seen = [record.message for record in Recording(path) if isinstance(record.message, Result)]
    nothing = [bool(each.packed is None and not each.same) for each in seen]
    assert True in nothing[nothing.index(False) :]  # it was forgotten


def test_a_sample_that_does_not_fit_does_not_fit_in_the_replay(path: Path, world: World) -> None:
    class Bad(Stays, document="watcher.xml"):
        def look(self, count: int) -> list[Any]:
            try:
                return [self.head.getPose.latest()]
            except MarshalException as error:
                return [str(error)]

    operation = PoseHeadPrx.ice_interface.all_operations["getPose"]
    with running(Bad, world, path) as (runtime, _):

        def cycles_after(past: int) -> bool:
            return runtime.tree.root.cycle.count > past + 1  # the first of them may have looked before

        outlet = world[0].transport.publish(Target("nao", "Head"), operation)
        assert listened(world[1].getPosePublisher, EVENT_LIMIT)
        fingerprint = PoseHeadPrx.ice_interface.fingerprint
        for number in range(10):
            payload = b"\x81\xa3bad\xc3" if number % 2 else b"\xc1"
            outlet.put(payload, encode_sample_attachment(fingerprint, number, 0.0))
            eventually(partial(cycles_after, runtime.tree.root.cycle.count))
        outlet.close()
    comparison = identical(path, Bad)
    assert comparison.cycles > 10
    seen = [record.message.error for record in Recording(path) if isinstance(record.message, Result)]
    assert sum(error.startswith("MarshalException") for error in seen) >= 10


def test_automata_of_an_edited_document_look_at_one_stream(path: Path, world: World) -> None:
    class Two(Component, document="two.xml"):
        head = Proxy("Head", PoseHeadPrx)
        more = False

        def automaton(self) -> Automaton:
            seen: Any = None

            def look() -> None:
                nonlocal seen
                seen = self.head.getPose.latest()

            def look_long() -> None:
                if self.more:
                    look()
                self.sleep(0.25)
                try:
                    self.head.getPose.wait(self.head.getPose.latest(), 0.02)
                except TimeoutException:
                    look()

            child = Automaton(id=2, name="child", states=(State(id=1, name="c", initial=True, code=look),))
            state = State(id=1, name="a", initial=True, code=look_long, children=(child,))
            return Automaton(id=1, name="root", period=0.5, states=(state,))

    class Edited(Two, document="two.xml"):
        more = True

    with running(Two, world, path) as (runtime, clock):
        for _ in range(10):
            world[1].getPosePublisher.publish(world[1].pose())
            clock.sleep(0.4)
        eventually(lambda: runtime.tree.root.cycle.count > 5)
    identical(path, Two)
    run, comparison = replayed(path, Edited)
    assert comparison.divergences == []
    assert set(run.guesses) <= {"self.head.getPose (latest)"}


# Random components.


@dataclass(frozen=True)
class Spec:
    """An automaton: per state what it does, and its transitions as origin, destination and trigger."""

    period: float
    states: tuple[str, ...]
    transitions: tuple[tuple[int, int, str], ...]
    child: Spec | None = None
    owner: int = 0


DEEDS = ("nothing", "read", "sleep", "count", "share", "send", "fail", "latest", "random", "async")
TRIGGERS = ("0.1", "0.25", "pose", "shared", "random", "event", "clock")


def specs(depth: int) -> st.SearchStrategy[Spec]:
    plain = st.integers(1, 3).flatmap(
        lambda count: st.builds(
            Spec,
            period=st.sampled_from([0.05, 0.1, 0.12]),
            states=st.tuples(*[st.sampled_from(DEEDS)] * count),
            transitions=st.lists(
                st.tuples(st.integers(0, count - 1), st.integers(0, count - 1), st.sampled_from(TRIGGERS)),
                max_size=4,
            ).map(tuple),
        )
    )
    if depth == 0:
        return plain
    return st.builds(
        lambda spec, child, owner: replace(spec, child=child, owner=owner % len(spec.states)),
        plain,
        st.none() | specs(depth - 1),
        st.integers(0, 2),
    )


class RandomComponent(Component, document="random.xml"):
    """Does what a spec says."""

    head = Proxy("Head", PoseHeadPrx)
    spec: Spec

    def automaton(self) -> Automaton:
        self.shared = 0
        return self.build(self.spec, iter(range(1, 100)))

    def build(self, spec: Spec, ids: Iterator[int]) -> Automaton:
        number = next(ids)
        count = 0
        seen: Any = None

        def do(deed: str) -> None:
            nonlocal count, seen
            count += 1
            if deed == "read":
                seen = self.head.getPose().pan
            elif deed == "sleep":
                self.sleep(0.03)
                seen = self.shared
            elif deed == "share":
                seen, self.shared = self.shared, self.shared + 1
            elif deed == "send":
                for number in range(count % 3 + 1):
                    self.send("ping", number)
            elif deed == "fail" and count % 3 == 0:
                raise ValueError(count)
            elif deed == "latest":
                sample = self.head.getPose.latest()
                seen = sample and (sample.value.pan, sample.age)
            elif deed == "random":
                seen = random.random()
            elif deed == "async":
                seen = self.head.getPose.begin().result().tilt

        def holds(trigger: str) -> bool:
            return {
                "pose": lambda: self.head.getPose().pan > 0.6,
                "shared": lambda: self.shared % 3 == 1,
                "random": lambda: random.random() > 0.7,
                "clock": lambda: self.clock.now() % 0.7 > 0.5,
            }[trigger]()

        def transition(number: int, origin: int, destination: int, trigger: str) -> Transition:
            common: dict[str, Any] = {
                "name": "",
                "id": number,
                "origin": origin + 1,
                "destination": destination + 1,
            }
            if trigger == "event":
                return Transition(**common, event="ping", code=lambda event: do("count"))
            if trigger[0].isdigit():
                return Transition(**common, seconds=float(trigger))
            return Transition(**common, guard=lambda: holds(trigger), code=lambda: do("read"))

        child = self.build(spec.child, ids) if spec.child else None
        return Automaton(
            id=number,
            name=f"automaton_{number}",
            period=spec.period,
            states=tuple(
                State(
                    id=index + 1,
                    name=f"{deed}_{index}",
                    initial=index == 0,
                    code=partial(do, deed),
                    exit=(lambda: do("share")) if index == 1 else None,
                    children=(child,) if child and index == spec.owner else (),
                )
                for index, deed in enumerate(spec.states)
            ),
            transitions=tuple(
                transition(number, *each) for number, each in enumerate(spec.transitions, start=1)
            ),
        )


@settings(
    max_examples=examples(4), deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
@given(spec=specs(2))
def test_random_components_are_replayed_to_the_same_end(world: World, spec: Spec) -> None:
    kind = type("Random", (RandomComponent,), {"spec": spec}, document="random.xml")
    with TemporaryDirectory() as folder:
        path = Path(folder, "run.mcap")
        with running(kind, world, path) as (runtime, clock):
            for step in range(20):
                for number in range(step % 3):
                    runtime.send("ping", -number)
                world[1].getPosePublisher.publish(world[1].pose(), time=float(step))
                clock.sleep(0.1)
        identical(path, kind)
