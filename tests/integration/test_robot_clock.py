"""The robot's clock over Zenoh, and the choice between it and the wall clock."""

from __future__ import annotations

import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager

import pytest

from interfaces.nao import Clock, ClockReading
from tests.support.limited import HASTY
from tests.support.limits import EVENT_LIMIT
from tests.support.serving import serve
from tests.support.waiting import until
from zenoh_ice import (
    CommunicatorDestroyedException,
    ConnectFailedException,
    Current,
    ObjectNotExistException,
    WallClock,
    initialize,
)


class ClockI(Clock):
    """A robot whose time a test sets."""

    def __init__(self, start: float, rate: float, *, simulated: bool = True) -> None:
        self.start = start
        self.rate = rate
        self.simulated = simulated
        self.began = time.monotonic()

    def reading(self) -> ClockReading:
        passed = time.monotonic() - self.began
        return ClockReading(self.start + self.rate * passed, self.rate, self.simulated)

    def getTime(self, current: Current) -> ClockReading:
        return self.reading()


@contextmanager
def serving(servant: ClockI, endpoint: str) -> Iterator[None]:
    """Serve a clock and publish its time 100 times a second."""
    ended = threading.Event()

    def publish() -> None:
        while not ended.wait(0.01):
            servant.getTimePublisher.publish(servant.reading())

    with initialize(listen=[endpoint], connect=[]) as communicator:
        serve(communicator, servant, "Clock")
        thread = threading.Thread(target=publish, daemon=True)
        thread.start()
        try:
            yield
        finally:
            ended.set()
            thread.join()


@pytest.mark.parametrize("choice", ["auto", "sim"])
def test_a_component_goes_by_the_time_of_a_simulation(endpoint: str, choice: str) -> None:
    servant = ClockI(100.0, 5.0)
    with serving(servant, endpoint), initialize(connect=[endpoint], clock=choice) as communicator:
        clock = communicator.clock
        assert clock is communicator.clock
        assert clock.simulated
        assert clock.rate == 5.0
        before = clock.now()  # behind the servant's time for as long as samples take to come
        clock.sleep(2.0)
        assert servant.reading().time >= before + 2.0
        servant.start, servant.rate, servant.began = 500.0, 20.0, time.monotonic()
        until(lambda: clock.rate == 20.0)
        until(lambda: abs(clock.now() - servant.reading().time) < 5.0)


def test_auto_is_the_wall_beside_a_real_robot(endpoint: str) -> None:
    servant = ClockI(1.7e9, 1.0, simulated=False)
    with serving(servant, endpoint), initialize(connect=[endpoint], clock="auto") as communicator:
        assert isinstance(communicator.clock, WallClock)
        until(lambda: not servant.getTimePublisher.listening)  # nobody wants the robot's time


def test_auto_is_the_wall_without_a_robot(endpoint: str) -> None:
    with initialize(connect=[endpoint], clock="auto", timeout=0.1) as communicator:
        assert isinstance(communicator.clock, WallClock)


def test_sim_needs_a_robot(endpoint: str) -> None:
    with (
        initialize(connect=[endpoint], clock="sim", timeout=0.1) as communicator,
        pytest.raises(ConnectFailedException, match="start a server"),
    ):
        _ = communicator.clock
    with (
        initialize(listen=[endpoint], connect=[]),
        initialize(connect=[endpoint], clock="sim", limits=HASTY) as communicator,
        pytest.raises(ObjectNotExistException, match="Clock"),
    ):
        _ = communicator.clock


def test_wall_does_not_look_for_the_robot(endpoint: str) -> None:
    with (
        serving(ClockI(100.0, 5.0), endpoint),
        initialize(connect=[endpoint], clock="wall") as communicator,
    ):
        assert isinstance(communicator.clock, WallClock)


def test_it_goes_on_while_the_robot_is_away_and_follows_the_next_one(endpoint: str) -> None:
    with initialize(listen=["tcp/127.0.0.1:0"], connect=[endpoint], clock="sim") as communicator:
        with serving(ClockI(100.0, 1.0), endpoint):
            clock = communicator.clock
            assert clock.now() >= 100.0
        before = clock.now()
        clock.sleep(0.1)
        assert clock.now() >= before + 0.1
        ended = threading.Event()

        def sleep() -> None:
            clock.sleep(90_000.0)
            ended.set()

        sleeper = threading.Thread(target=sleep, daemon=True)
        sleeper.start()
        with serving(ClockI(0.0, 1.0), endpoint):
            assert ended.wait(EVENT_LIMIT)
            assert clock.now() < 50.0
        sleeper.join()


def test_destroying_the_communicator_ends_sleeps(endpoint: str) -> None:
    errors: list[CommunicatorDestroyedException] = []

    def sleep() -> None:
        try:
            clock.sleep(60.0)
        except CommunicatorDestroyedException as error:
            errors.append(error)

    with serving(ClockI(0.0, 1.0), endpoint):
        with initialize(connect=[endpoint]) as communicator:
            clock = communicator.clock
            sleeper = threading.Thread(target=sleep, daemon=True)
            sleeper.start()
        sleeper.join(EVENT_LIMIT)
        assert not sleeper.is_alive()
    assert len(errors) == 1
