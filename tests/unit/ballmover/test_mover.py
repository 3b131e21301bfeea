"""The mover, in virtual time with a ball that follows its setpoints like a real one."""

from __future__ import annotations

import math
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from itertools import pairwise
from typing import Self

import pytest

from ballmover import _mover
from ballmover._axes import AxisLimits, AxisPosition, Point
from ballmover._exceptions import NotArrivedException
from ballmover._mover import PERIOD, Mover
from ballmover._progress import Progress
from ballmover._route import Route, Stop
from ballmover._waypoints import Waypoint
from tests.support.limits import EVENT_LIMIT
from tests.support.stepped_clock import SteppedClock
from zenoh_ice.data.exceptions import ConnectionLostException

LIMITS = AxisLimits(-math.pi, math.pi, 0.3, 2.0, 0.05, 1.2, 2.0, 1.0)
HOME = AxisPosition(0.0, 1.0, 0.5)


class Ball(_mover.Ball):
    """Axes that run to their setpoints at a limited speed."""

    limits = LIMITS

    def __init__(self, clock: SteppedClock, speed: float = 1.0) -> None:
        self.clock = clock
        self.speed = speed
        self.present = True
        self.commands: list[tuple[float, AxisPosition]] = []
        self.here = self.target = HOME
        self.time = clock.now()

    def _move(self) -> None:
        if not self.present:
            raise ConnectionLostException("the server is offline")
        now = self.clock.now()
        reach = self.speed * (now - self.time)
        self.time = now

        def step(a: float, b: float) -> float:
            return a + max(-reach, min(reach, b - a))

        a, b = self.here, self.target
        self.here = AxisPosition(step(a.pan, b.pan), step(a.distance, b.distance), step(a.height, b.height))

    def command(self, target: AxisPosition) -> None:
        self._move()
        self.target = target
        self.commands.append((self.clock.now(), target))

    def position(self) -> AxisPosition:
        self._move()
        return self.here


class Log(Progress):
    """What the mover reported, with times."""

    def __init__(self, clock: SteppedClock) -> None:
        self.clock = clock
        self.events: list[tuple[str, float]] = []
        self.lost_event = threading.Event()
        self.on_move: Callable[[], None] = lambda: None

    def _add(self, name: str) -> None:
        self.events.append((name, round(self.clock.now(), 6)))

    def departed(self, index: int, stop: Stop, lap: int) -> None:
        self._add(f"depart {lap}.{index}")

    def moved(self, target: Point, fraction: float) -> None:
        self.on_move()

    def arrived(self, stop: Stop, error: float) -> None:
        self._add(f"arrive {stop.waypoint.source}")

    def lost(self, reason: str) -> None:
        self._add("lost")
        self.lost_event.set()

    def returned(self) -> None:
        self._add("returned")

    @property
    def names(self) -> list[str]:
        return [name for name, _ in self.events]

    def time_of(self, name: str) -> float:
        return dict(self.events)[name]


class Run:
    """A mover in its thread, driven by a virtual clock."""

    def __init__(
        self,
        waypoints: Sequence[Waypoint],
        *,
        ball_speed: float = 1.0,
        loop: bool = False,
        clock: SteppedClock | None = None,
        **options: float,
    ) -> None:
        self.clock = clock or SteppedClock()
        self.ball = Ball(self.clock, ball_speed)
        self.log = Log(self.clock)
        self.route = Route.plan(waypoints, LIMITS, speed=0.25, loop=loop)
        self.ending = threading.Event()
        self.mover = Mover(self.ball, self.clock, self.route, self.log, ending=self.ending, **options)
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
        self.log.on_move = self.ending.set
        self.finish(10.0)


A = Waypoint(Point(1.0, 0.0, 0.5), None, 0.0, "a")
B = Waypoint(Point(1.0, 0.5, 0.5), None, 1.0, "b")
C = Waypoint(Point(0.8, 0.0, 0.7), 0.1, 0.0, "c")


def test_the_ball_goes_straight_at_constant_speed() -> None:
    run = Run([A, B]).finish()
    departure = run.log.time_of("depart 1.1")
    line = [(t, axes.point) for t, axes in run.ball.commands if departure < t <= departure + 2.0]
    assert len(line) == 100  # 0.5 m at 0.25 m/s, 50 setpoints a second
    for number, (time, point) in enumerate(line, start=1):
        assert time == pytest.approx(departure + number * PERIOD)
        assert point == pytest.approx((1.0, 0.25 * number * PERIOD, 0.5))


def test_waypoints_have_their_own_speed_and_dwell() -> None:
    run = Run([A, B, C]).finish()
    log = run.log
    assert log.names == ["depart 1.0", "arrive a", "depart 1.1", "arrive b", "depart 1.2", "arrive c"]
    assert log.time_of("arrive b") - log.time_of("depart 1.1") == pytest.approx(2.0, abs=0.03)
    assert log.time_of("depart 1.2") - log.time_of("arrive b") == pytest.approx(1.0, abs=0.03)
    length = math.dist(B.point, C.point)
    assert log.time_of("arrive c") - log.time_of("depart 1.2") == pytest.approx(length / 0.1, abs=0.03)


def test_the_next_line_waits_for_the_encoders() -> None:
    run = Run([A, B, A], ball_speed=0.1, limit=60.0, tolerance=0.01).finish()
    arrival = run.log.time_of("arrive b")
    pan = math.atan2(0.5, 1.0)
    assert arrival - run.log.time_of("depart 1.1") == pytest.approx(pan / 0.1, abs=0.15)
    assert run.log.time_of("depart 1.2") >= arrival + 1.0


def test_a_ball_that_does_not_come_is_reported_and_stopped() -> None:
    run = Run([A, B], ball_speed=0.01, limit=3.0)
    with pytest.raises(
        NotArrivedException, match=r"^b: waypoint \(1, 0\.5, 0\.5\): after 3 s the ball is still 0\.4"
    ):
        run.finish()
    assert run.ball.target == run.ball.here


def test_it_approaches_the_first_waypoint_from_wherever_the_ball_is() -> None:
    run = Run([C])
    run.finish()
    assert run.ball.here.point == pytest.approx(C.point, abs=0.02)
    heights = [axes.height for _, axes in run.ball.commands]
    assert heights == sorted(heights)


def test_loop_goes_round_and_counts_laps() -> None:
    run = Run([A, B], loop=True).start()
    run.clock.advance(12.0)
    assert run.log.names[:10:2] == ["depart 1.0", "depart 1.1", "depart 2.0", "depart 2.1", "depart 3.0"]
    run.end()


def test_a_loop_of_one_waypoint_stays_there() -> None:
    run = Run([A], loop=True).start()
    run.clock.advance(5.0)
    assert run.log.names == ["depart 1.0", "arrive a"]
    assert run.ball.commands[-1][0] == pytest.approx(5.0, abs=0.03)
    with run.server_away():
        run.end()
    assert run.log.names[:3] == ["depart 1.0", "arrive a", "lost"]


def test_breaking_off_stops_the_ball_where_it_is() -> None:
    run = Run([A, B]).start()
    run.clock.advance(1.0)
    run.end()
    assert run.ball.commands[-1][1] == run.ball.here
    assert 0.1 < run.ball.here.point.y < 0.4


def test_a_run_ends_while_the_server_is_lost() -> None:
    run = Run([A, B]).start()
    run.ball.present = False
    run.log.lost = lambda reason: run.ending.set()  # type: ignore[method-assign]
    run.finish()
    assert run.log.names == ["depart 1.0"]


def test_a_lost_server_is_reported_and_the_ball_goes_on_when_it_is_back() -> None:
    run = Run([A, B]).start()
    run.clock.advance(1.5)
    sent = len(run.ball.commands)
    with run.server_away():
        run.finish()
    assert run.log.names == [
        "depart 1.0",
        "arrive a",
        "depart 1.1",
        "lost",
        "returned",
        "depart 1.1",
        "arrive b",
    ]
    assert run.log.time_of("lost") == pytest.approx(1.5, abs=0.03)
    # Nothing old is replayed: it starts again at home.
    assert run.ball.commands[sent][1].point == pytest.approx(HOME.point, abs=0.02)


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
    assert run.log.names == ["depart 1.0", "arrive a", "depart 1.1", "depart 1.1", "arrive b"]
    assert run.log.time_of("arrive b") < 5.0


def test_a_fast_simulation_does_not_get_more_setpoints_than_it_can_take() -> None:
    clock = SteppedClock()
    clock.rate = 20.0
    run = Run([A, B], clock=clock).finish()
    times = [time for time, _ in run.ball.commands]
    assert all(b - a == pytest.approx(0.1) for a, b in pairwise(times))
    assert run.log.names[-1] == "arrive b"


def test_setpoints_that_come_late_are_skipped_not_sent_in_a_burst() -> None:
    run = Run([A, B]).start()
    run.clock.advance(0.5)
    late = run.ball.commands[-1][0]
    original = run.log.on_move

    def stall() -> None:
        run.log.on_move = original
        run.clock.sleep(0.5)

    run.log.on_move = stall
    run.finish()
    times = [time for time, _ in run.ball.commands if time > late + PERIOD * 1.5]
    assert times[0] - late >= 0.5
    assert all(b - a > PERIOD * 0.5 for a, b in pairwise(times[1:]))
