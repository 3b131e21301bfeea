"""The mover, in virtual time with a ball that follows its setpoints like a real one."""

from __future__ import annotations

import logging
import math
import re
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from itertools import pairwise
from typing import Self

import pytest

from ballmover import _mover
from ballmover._exceptions import NotArrivedException
from ballmover._mover import PERIOD, Mover
from ballmover._waypoints import Color, Point, Waypoint
from tests.support.limits import EVENT_LIMIT
from tests.support.stepped_clock import SteppedClock
from zenoh_ice.data.exceptions import ConnectionLostException

HOME = Point(1.0, 0.0, 0.5)


class Ball(_mover.Ball):
    """A ball that runs to its setpoints at a limited speed."""

    def __init__(self, clock: SteppedClock, speed: float) -> None:
        self.color = Color.GREEN
        self.clock = clock
        self.speed = speed
        self.present = True
        self.commands: list[tuple[float, Point]] = []
        self.here = self.target = HOME
        self.time = clock.now()
        self.on_command: Callable[[], None] = lambda: None

    def _move(self) -> None:
        if not self.present:
            raise ConnectionLostException("the server is offline")
        now = self.clock.now()
        reach = self.speed * (now - self.time)
        self.time = now
        self.here = Point(
            *(a + max(-reach, min(reach, b - a)) for a, b in zip(self.here, self.target, strict=True))
        )

    def command(self, target: Point) -> None:
        self._move()
        self.target = target
        self.commands.append((self.clock.now(), target))
        self.on_command()

    def position(self) -> Point:
        self._move()
        return self.here


class Log(logging.Handler):
    """What the mover reported, with times."""

    def __init__(self, clock: SteppedClock) -> None:
        super().__init__()
        self.clock = clock
        self.events: list[tuple[str, float]] = []
        self.lost_event = threading.Event()
        self.on_loss: Callable[[], None] = self.lost_event.set

    def emit(self, record: logging.LogRecord) -> None:
        text = record.getMessage().removeprefix("green: ")
        self.events.append((text, round(self.clock.now(), 6)))
        if text.startswith("lost the ball"):
            self.on_loss()

    @property
    def names(self) -> list[str]:
        """Return the reports without their details: `waypoint 1`, `arrived`, `lost`, `the ball is back`."""
        return [re.sub(r"( of |[,;:]| the ball;).*", "", text) for text, _ in self.events]

    def time_of(self, name: str, number: int = 0) -> float:
        """Return when a report came for the first time, or for a later one."""
        times = [time for found, (_, time) in zip(self.names, self.events, strict=True) if found == name]
        return times[number]


@pytest.fixture(autouse=True)
def _debugging(caplog: pytest.LogCaptureFixture) -> Iterator[None]:
    caplog.set_level(logging.DEBUG, _mover.__name__)
    logger = logging.getLogger(_mover.__name__)
    yield
    for handler in [*logger.handlers]:
        logger.removeHandler(handler)


class Run:
    """A mover in its thread, driven by a virtual clock."""

    def __init__(
        self,
        waypoints: Sequence[Waypoint],
        *,
        ball_speed: float = 1.0,
        loop: bool = False,
        clock: SteppedClock | None = None,
        tolerance: float = 0.02,
        limit: float = 5.0,
    ) -> None:
        self.clock = clock or SteppedClock()
        self.ball = Ball(self.clock, ball_speed)
        self.log = Log(self.clock)
        logging.getLogger(_mover.__name__).addHandler(self.log)
        self.ending = threading.Event()
        self.mover = Mover(self.ball, self.clock, waypoints, self.ending, 0.25, tolerance, limit)
        self.loop = loop
        self.error: BaseException | None = None
        self.thread = threading.Thread(target=self._run, daemon=True)

    def _run(self) -> None:
        try:
            self.mover.run(loop=self.loop)
        except BaseException as error:  # noqa: BLE001 -- the test raises it again
            self.error = error

    def start(self) -> Self:
        self.thread.start()
        self.clock.wait_for_waiters(1)
        return self

    def finish(self, seconds: float = 60.0) -> Self:
        if not self.thread.ident:
            self.start()
        self.clock.advance(seconds)
        self.thread.join(EVENT_LIMIT)
        assert not self.thread.is_alive()
        if self.error is not None:
            raise self.error
        return self

    @contextmanager
    def server_away(self) -> Iterator[None]:
        """Let the server be offline until that is noticed; then the ball is at home, as after a restart."""
        self.ball.present = False

        def restart() -> None:
            assert self.log.lost_event.wait(EVENT_LIMIT)
            self.ball.here = self.ball.target = HOME
            self.ball.present = True

        helper = threading.Thread(target=restart, daemon=True)
        helper.start()
        yield
        helper.join(EVENT_LIMIT)

    def end(self) -> None:
        """End a run that goes round and round."""
        self.ball.on_command = self.ending.set
        self.finish(10.0)


A = Waypoint(1.0, 0.0, 0.5)
B = Waypoint(1.0, 0.5, 0.5, dwell=1.0)
C = Waypoint(0.8, 0.0, 0.7, speed=0.1)


def test_the_ball_goes_straight_at_constant_speed() -> None:
    run = Run([A, B]).finish()
    departure = run.log.time_of("waypoint 2")
    line = [(t, point) for t, point in run.ball.commands if departure < t <= departure + 2.0]
    assert len(line) == 100  # 0.5 m at 0.25 m/s, 50 setpoints a second
    for number, (time, point) in enumerate(line, start=1):
        assert time == pytest.approx(departure + number * PERIOD)
        assert point == pytest.approx((1.0, 0.25 * number * PERIOD, 0.5))


def test_waypoints_have_their_own_speed_and_dwell() -> None:
    run = Run([A, B, C]).finish()
    log = run.log
    assert log.names == ["waypoint 1", "arrived", "waypoint 2", "arrived", "waypoint 3", "arrived"]
    assert log.time_of("arrived", 1) - log.time_of("waypoint 2") == pytest.approx(2.0, abs=0.03)
    assert log.time_of("waypoint 3") - log.time_of("arrived", 1) == pytest.approx(1.0, abs=0.03)
    length = math.dist(B.point, C.point)
    assert log.time_of("arrived", 2) - log.time_of("waypoint 3") == pytest.approx(length / 0.1, abs=0.03)


def test_the_next_line_waits_for_the_encoders() -> None:
    run = Run([A, B, A], ball_speed=0.1, limit=60.0, tolerance=0.01).finish()
    arrival = run.log.time_of("arrived", 1)
    assert arrival - run.log.time_of("waypoint 2") == pytest.approx(0.5 / 0.1, abs=0.15)
    assert run.log.time_of("waypoint 3") >= arrival + 1.0


def test_a_ball_that_does_not_come_is_reported_and_stopped() -> None:
    run = Run([A, B], ball_speed=0.01, limit=3.0)
    with pytest.raises(
        NotArrivedException, match=r"^waypoint 2 of 2 \(1, 0\.5, 0\.5\): after 3 s the ball is still 0\.4"
    ):
        run.finish()
    assert run.ball.target == run.ball.here


def test_it_approaches_the_first_waypoint_from_wherever_the_ball_is() -> None:
    run = Run([C])
    run.finish()
    assert run.ball.here == pytest.approx(C.point, abs=0.02)
    heights = [place.z for _, place in run.ball.commands]
    assert heights == sorted(heights)


def test_loop_goes_round() -> None:
    run = Run([A, B], loop=True).start()
    run.clock.advance(12.0)
    assert run.log.names[:10:2] == ["waypoint 1", "waypoint 2", "waypoint 1", "waypoint 2", "waypoint 1"]
    run.end()


def test_a_loop_of_one_waypoint_stays_there() -> None:
    run = Run([A], loop=True).start()
    run.clock.advance(5.0)
    assert run.log.names == ["waypoint 1", "arrived"]
    assert run.ball.commands[-1][0] == pytest.approx(5.0, abs=0.03)
    with run.server_away():
        run.end()
    assert run.log.names[:3] == ["waypoint 1", "arrived", "lost"]


def test_breaking_off_stops_the_ball_where_it_is() -> None:
    run = Run([A, B]).start()
    run.clock.advance(1.0)
    run.end()
    assert run.ball.commands[-1][1] == run.ball.here
    assert 0.1 < run.ball.here.y < 0.4


def test_a_run_ends_while_the_server_is_lost() -> None:
    run = Run([A, B]).start()
    run.ball.present = False
    run.log.on_loss = run.ending.set
    run.finish()
    assert run.log.names == ["waypoint 1", "lost"]


def test_a_lost_server_is_reported_and_the_ball_goes_on_when_it_is_back() -> None:
    run = Run([A, B]).start()
    run.clock.advance(1.5)
    sent = len(run.ball.commands)
    with run.server_away():
        run.finish()
    assert run.log.names == [
        "waypoint 1",
        "arrived",
        "waypoint 2",
        "lost",
        "the ball is back",
        "waypoint 2",
        "arrived",
    ]
    assert run.log.time_of("lost") == pytest.approx(1.5, abs=0.03)
    # Nothing old is replayed: it starts again at home.
    assert run.ball.commands[sent][1] == pytest.approx(HOME, abs=0.02)


class RestartingClock(SteppedClock):
    """A virtual clock that can jump back as the clock of a simulation that restarted."""

    offset = 0.0

    def now(self) -> float:
        return super().now() - self.offset


def test_a_simulation_that_restarts_does_not_stop_it() -> None:
    clock = RestartingClock(100.0)
    run = Run([A, B], clock=clock).start()
    clock.advance(1.0)
    clock.offset = 101.0
    run.ball.time = clock.now()
    run.ball.here = run.ball.target = HOME
    run.finish()
    assert run.log.names == [
        "waypoint 1",
        "arrived",
        "waypoint 2",
        "the simulation restarted",
        "waypoint 2",
        "arrived",
    ]
    assert run.log.time_of("arrived", 1) < 5.0


def test_a_fast_simulation_does_not_get_more_setpoints_than_it_can_take() -> None:
    clock = SteppedClock()
    clock.rate = 20.0
    run = Run([A, B], clock=clock).finish()
    times = [time for time, _ in run.ball.commands]
    assert all(b - a == pytest.approx(0.1) for a, b in pairwise(times))
    assert run.log.names[-1] == "arrived"


def test_setpoints_that_come_late_are_skipped_not_sent_in_a_burst() -> None:
    run = Run([A, B]).start()
    run.clock.advance(0.5)
    late = run.ball.commands[-1][0]
    original = run.ball.on_command

    def stall() -> None:
        run.ball.on_command = original
        run.clock.sleep(0.5)

    run.ball.on_command = stall
    run.finish()
    times = [time for time, _ in run.ball.commands if time > late + PERIOD * 1.5]
    assert times[0] - late >= 0.5
    assert all(b - a > PERIOD * 0.5 for a, b in pairwise(times[1:]))
