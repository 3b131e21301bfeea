"""Curves of joints, and paths along them on a fake robot in virtual time."""

import math
import threading
from contextlib import nullcontext
from itertools import accumulate
from types import SimpleNamespace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from naoserver.errors import CommandRefused, InvalidCommand
from naoserver.fake import FakeRobot
from naoserver.moves.joint_paths import PERIOD, Curve, Key, Path, smooth_curve
from naoserver.options import SafetyOptions, ServerOptions
from naoserver.serving.assembly import Assembly
from tests.support.limits import EVENT_LIMIT
from zenoh_ice import VirtualClock

HEAD = frozenset({"HeadYaw"})
angles = st.floats(-3.0, 3.0)
keys = st.lists(st.tuples(st.floats(0.05, 2.0), angles), min_size=1, max_size=6)


def smooth(start, steps):
    times = list(accumulate(seconds for seconds, _ in steps))
    return times, smooth_curve("HeadYaw", start, times, [angle for _, angle in steps])


@given(angles, keys)
def test_a_smooth_one_goes_through_every_key(start, steps):
    times, path = smooth(start, steps)
    assert path.at(0.0) == start
    assert [path.at(time) for time in times] == pytest.approx([angle for _, angle in steps], abs=1e-9)


@given(angles, keys, st.floats(0.0, 1.0))
def test_a_smooth_one_never_leaves_the_range_of_the_keys_beside(start, steps, share):
    times, path = smooth(start, steps)
    bounds = [start, *(angle for _, angle in steps)]
    for i, (begin, end) in enumerate(zip([0.0, *times], times, strict=False)):
        low, high = sorted(bounds[i : i + 2])
        assert low - 1e-9 <= path.at(begin + share * (end - begin)) <= high + 1e-9


def test_a_smooth_one_begins_and_ends_at_rest():
    path = smooth_curve("HeadYaw", 0.0, [1.0], [1.0])
    assert path.at(0.01) < 0.001
    assert path.at(0.5) == pytest.approx(0.5)
    assert path.at(0.99) > 0.999


def test_a_smooth_one_passes_a_key_without_a_stop():
    path = smooth_curve("HeadYaw", 0.0, [1.0, 2.0], [1.0, 2.0])
    assert (path.at(1.01) - path.at(0.99)) / 0.02 == pytest.approx(1.0, rel=0.01)


@given(angles, keys)
def test_a_bezier_one_goes_through_every_key(start, steps):
    times = list(accumulate(seconds for seconds, _ in steps))
    path = Curve(
        "HeadYaw",
        Key(0.0, start),
        [Key(t, angle, (-0.01, 0.1), (0.01, -0.1)) for t, (_, angle) in zip(times, steps, strict=True)],
    )
    assert path.at(0.0) == start
    assert [path.at(time) for time in times] == pytest.approx([angle for _, angle in steps], abs=1e-6)


def test_a_bezier_one_follows_its_handles():
    # Handles of a third of the way at the height of their keys give Hermite's cubic from rest to rest.
    key = Key(3.0, 1.0, before=(-1.0, 0.0))
    path = Curve("HeadYaw", Key(0.0, 0.0), [Key(1e-9, 0.0, after=(1.0, 0.0)), key])
    for time in (0.3, 1.0, 1.5, 2.4):
        share = time / 3.0
        assert path.at(time) == pytest.approx(share * share * (3 - 2 * share), abs=1e-6)


def test_handles_beyond_the_next_key_do_not_turn_time_back():
    path = Curve("HeadYaw", Key(0.0, 0.0), [Key(1.0, 1.0, before=(-5.0, 0.0))])
    values = [path.at(i / 100) for i in range(101)]
    assert values == sorted(values)


def test_handles_that_lead_away_from_their_piece_have_no_length():
    away, none = (
        Curve("HeadYaw", Key(0.0, 0.0, after=(-length, 0.1)), [Key(1.0, 1.0, before=(length, 0.1))])
        for length in (5.0, 0.0)
    )
    assert [away.at(i / 10) for i in range(11)] == [none.at(i / 10) for i in range(11)]


def test_a_smooth_one_is_exact_whatever_its_duration():
    path = smooth_curve("HeadYaw", 0.0, [3.0], [1.0])
    assert path.at(0.75) == pytest.approx(0.25 * 0.25 * (3 - 2 * 0.25), abs=1e-14)


@pytest.mark.parametrize("times", [[], [0.0], [-1.0], [1.0, 1.0], [2.0, 1.0], [1.0, 2.0, 3.0]])
def test_times_that_are_none(times):
    with pytest.raises(InvalidCommand, match="HeadYaw"):
        smooth_curve("HeadYaw", 0.0, times, [1.0, 2.0] if len(times) != 1 else [1.0])


def test_before_and_after_it_stands():
    path = smooth_curve("HeadYaw", 0.2, [1.0], [0.7])
    assert (path.at(-math.inf), path.at(math.inf)) == (0.2, 0.7)


class Rig:
    """A fake robot behind its guards."""

    def __init__(self, safety=SafetyOptions()):  # noqa: B008 - it is frozen
        self.clock = VirtualClock(start=5.0)
        self.robot = FakeRobot(self.clock)
        self.assembly = Assembly(self.robot, ServerOptions(safety=safety), self.clock)
        self.paths = self.assembly.paths

    def start(self, angle, seconds=1.0, client="Ada"):
        """Move the head to an angle within some seconds; return the path."""
        path = Path("look", HEAD, client)
        self.paths.start(path, {"HeadYaw": smooth_curve("HeadYaw", self.yaw, [seconds], [angle])})
        return path

    def advance(self, seconds):
        """Advance the time of robot, paths and guards."""
        for _ in range(round(seconds / PERIOD)):
            self.clock.advance(PERIOD)
            self.paths.tick()
            for watched in self.assembly.watched:
                watched.watch()

    @property
    def yaw(self):
        """The setpoint of the head."""
        return self.assembly.body.angles(measured=False)["HeadYaw"]

    @property
    def events(self):
        """What the events say."""
        return [event.message for event in self.assembly.events.snapshot()[0]]


@pytest.fixture
def rig():
    return Rig()


def test_a_path_leads_to_its_end(rig):
    path = rig.start(0.5)
    rig.advance(0.5)
    assert rig.yaw == pytest.approx(0.25, abs=0.02)
    rig.advance(1.0)
    assert (rig.yaw, path.error, rig.paths.busy) == (pytest.approx(0.5), None, False)


def test_a_newer_path_takes_the_joints(rig):
    older = rig.start(0.5)
    rig.advance(0.3)
    newer = rig.start(-0.2, client="Bob")
    assert (older.ended.is_set(), rig.paths.all()) == (True, [newer])
    rig.advance(2.0)
    assert rig.yaw == pytest.approx(-0.2)


def test_a_path_goes_on_with_the_joints_that_nothing_has_taken(rig):
    goals = {"HeadYaw": 0.5, "HeadPitch": 0.2}
    curves = {joint: smooth_curve(joint, 0.0, [1.0], [angle]) for joint, angle in goals.items()}
    rig.paths.start(Path("nod", frozenset(goals), "Ada"), curves)
    rig.advance(0.3)
    rig.start(-0.2, client="Bob")
    rig.advance(2.0)
    angles = rig.assembly.body.angles(measured=False)
    assert [angles[joint] for joint in goals] == pytest.approx([-0.2, 0.2])


def test_a_path_ends_with_its_client(rig):
    rig.start(0.5)
    rig.advance(0.3)
    rig.assembly.drop_client("Ada")
    there = rig.yaw
    rig.advance(1.0)
    assert (rig.yaw, rig.paths.busy) == (there, False)


def test_an_emergency_stop_ends_a_path_and_refuses_others(rig):
    path = rig.start(0.5)
    rig.advance(0.3)
    rig.assembly.gate.stop("a test")
    there = rig.yaw
    rig.advance(1.0)
    assert (rig.yaw, type(path.error), rig.paths.busy) == (there, CommandRefused, False)
    assert "look ended: " in rig.events[-1]
    with pytest.raises(CommandRefused):
        rig.start(0.5)


@pytest.mark.parametrize("resume", [False, True])
def test_a_path_does_not_go_on_after_a_stop_that_was_reset_at_once(rig, resume):
    path = rig.start(0.5)
    rig.advance(0.3)
    rig.assembly.gate.stop("a test")
    rig.assembly.gate.reset(resume=resume)
    there = rig.yaw
    rig.advance(1.0)
    assert (rig.yaw, str(path.error)) == (there, "the robot was stopped")


def test_joints_that_something_else_moves_begin_no_path(rig):
    rig.assembly.body.claims.claim("the dance", HEAD, lambda: None)
    with pytest.raises(InvalidCommand, match="HeadYaw is moved by the dance now"):
        rig.start(0.5)
    assert not rig.paths.busy


def test_a_path_ends_with_its_curve(rig):
    path = rig.start(0.5)
    rig.advance(1.0 - PERIOD)
    assert not path.ended.is_set()
    rig.advance(PERIOD)
    assert path.ended.is_set()


def test_a_path_that_is_too_fast_ends_when_the_joint_arrives(rig):
    path = rig.start(2.0, seconds=PERIOD)
    rig.advance(0.2)
    assert not path.ended.is_set()
    while not path.ended.is_set():
        assert rig.yaw < 2.0
        rig.advance(PERIOD)
    assert rig.yaw == pytest.approx(2.0)


def test_a_path_waits_three_seconds_for_a_joint_that_does_not_arrive():
    rig = Rig(SafetyOptions(speed_fraction=0.01))
    path = rig.start(2.0, seconds=1.0)
    rig.advance(3.9)
    assert not path.ended.is_set()
    rig.advance(0.2)
    assert path.ended.is_set()


def test_a_path_does_not_wait_for_limp_joints():
    rig = Rig(SafetyOptions(speed_fraction=0.01))
    rig.assembly.body.stiffen({"HeadYaw": 0.0}, 0.0)
    path = rig.start(2.0, seconds=1.0)
    rig.advance(1.0 + PERIOD)
    assert path.ended.is_set()


def test_a_joint_that_stays_where_it_is_does_not_keep_others_there(rig):
    goals = {"HeadYaw": 0.0, "HeadPitch": 0.2}
    curves = {joint: smooth_curve(joint, 0.0, [1.0], [angle]) for joint, angle in goals.items()}
    rig.paths.start(Path("nod", frozenset(goals), "Ada"), curves)
    rig.advance(1.0)
    assert rig.assembly.body.angles(measured=False)["HeadPitch"] == pytest.approx(0.2)


def test_between_its_steps_a_joint_is_between_its_setpoints(rig):
    rig.start(0.5)
    rig.advance(0.5)
    before = rig.yaw
    rig.clock.advance(PERIOD / 2)
    middle = rig.yaw
    rig.clock.advance(PERIOD / 2)
    assert middle == pytest.approx((before + rig.yaw) / 2, abs=1e-6)


def test_a_curve_that_is_too_fast_is_reported(rig):
    rig.start(0.5, seconds=PERIOD)
    rig.advance(PERIOD)
    assert "speed" in rig.events[-1]


def test_a_joint_that_catches_up_is_not_reported(rig):
    path = Path("look", HEAD, "Ada")
    rig.paths.start(path, {"HeadYaw": smooth_curve("HeadYaw", 1.0, [0.5], [1.05])})
    rig.advance(1.0)
    assert (rig.yaw, rig.events) == (pytest.approx(1.05), [])


def follow(rig, angle, **more):
    """Follow a path of Ada in this thread, which moves the clock meanwhile; return it."""
    path = Path("look", HEAD, "Ada", **more)
    end = rig.clock.call_every(PERIOD, rig.paths.tick)
    try:
        rig.paths.follow(path, lambda: {"HeadYaw": smooth_curve("HeadYaw", rig.yaw, [1.0], [angle])})
    finally:
        end()
        assert (path.ended.is_set(), rig.paths.busy) == (True, False)
    return path


def test_who_follows_a_path_returns_at_its_end(rig):
    follow(rig, 0.5)
    assert (rig.yaw, rig.clock.now()) == (pytest.approx(0.5), pytest.approx(6.0))


def test_each_path_has_a_number_of_its_own(rig):
    assert follow(rig, 0.5).number < follow(rig, 0.2).number


def test_a_path_says_which_joints_it_moves(rig):
    moved: set[str] = set()
    follow(rig, 0.5, moves=moved.update)
    assert moved == HEAD


def test_a_path_whose_steps_may_not_be_taken_moves_nothing(rig):
    moved: list[object] = []
    follow(rig, 0.5, may_step=lambda: nullcontext(False), moves=moved.append)
    assert (rig.yaw, moved) == (0.0, [])


def test_a_robot_that_is_stopped_follows_no_path(rig):
    rig.assembly.gate.stop("a test")
    with pytest.raises(CommandRefused, match="a test"):
        follow(rig, 0.5)


@pytest.mark.parametrize("of_calls", [False, True], ids=["its steps", "its call"])
def test_an_emergency_stop_is_raised_where_a_path_is_followed(rig, of_calls):
    stopped = threading.Event()

    def stop():
        rig.assembly.gate.stop("a test")
        if of_calls:
            stopped.set()

    rig.clock.call_every(0.3, stop)
    with pytest.raises(CommandRefused, match="a test"):
        follow(rig, 0.5, stopped=stopped)
    assert "look ended" not in "".join(rig.events)


def test_a_path_whose_client_is_gone_ends_and_is_no_command_that_is_refused(rig):
    stopped = threading.Event()

    def leave():
        rig.assembly.gate.is_lost = lambda client: True
        stopped.set()

    rig.clock.call_every(0.3, leave)
    follow(rig, 0.5, stopped=stopped)
    assert not [event for event in rig.events if "refused" in event]


def test_who_follows_a_path_hears_what_refuses_a_step(rig):
    claims = rig.assembly.body.claims
    rig.clock.call_every(0.3, lambda: claims.claim("the dance", HEAD, lambda: None))
    with pytest.raises(InvalidCommand, match="the dance"):
        follow(rig, 0.5)


@pytest.mark.parametrize("error", [OSError("no bus"), SystemExit("no bus")])
def test_a_driver_that_fails_ends_a_path_and_no_other(rig, monkeypatch, error):
    def fails(*_):
        monkeypatch.undo()
        raise error

    path = rig.start(0.5)
    nod = Path("nod", frozenset({"RElbowYaw"}), "Ada")
    rig.paths.start(nod, {"RElbowYaw": smooth_curve("RElbowYaw", 1.0, [2.0], [1.1])})
    rig.advance(0.3)
    monkeypatch.setattr(rig.robot, "command_positions", fails)
    rig.advance(0.1)
    assert (path.ended.is_set(), path.error, rig.paths.all()) == (True, error, [nod])
    assert rig.events[-1] == "look ended: no bus"


def test_the_stop_of_a_path_is_no_error(rig):
    stopped = threading.Event()
    rig.clock.call_every(0.5, stopped.set)
    follow(rig, 0.5, stopped=stopped)
    assert rig.yaw == pytest.approx(0.25, abs=0.02)


def test_joints_that_are_taken_from_a_path_stay_where_they_are(rig):
    rig.clock.call_every(0.5, lambda: rig.paths.release(["HeadPitch", "HeadYaw"]))
    follow(rig, 0.5)
    assert rig.yaw == pytest.approx(0.25, abs=0.02)


class Looks(threading.Event):
    """An event that counts how often somebody looked whether it is set."""

    def __init__(self):
        super().__init__()
        self.count = threading.Semaphore(0)

    def is_set(self):
        self.count.release()
        return super().is_set()


@pytest.fixture
def waiting(rig):
    """A path that a thread begins to follow once another one, which is half done, leaves it the joints."""
    other, looks, asked = rig.start(0.5, client="Bob"), Looks(), threading.Event()
    rig.advance(0.5)
    rig.clock.call_every(PERIOD, rig.paths.tick)

    def curves():
        asked.set()
        return {"HeadYaw": smooth_curve("HeadYaw", rig.yaw, [1.0], [-0.2])}

    path = Path("look", HEAD, "Ada", looks)
    thread = threading.Thread(target=rig.paths.follow, args=(path, curves), daemon=True)
    thread.start()
    assert all(looks.count.acquire(timeout=EVENT_LIMIT) for _ in range(2))
    assert not asked.is_set()
    yield SimpleNamespace(path=path, other=other, asked=asked)
    thread.join(EVENT_LIMIT)
    assert not thread.is_alive()


def test_a_path_waits_for_the_end_of_the_one_that_moves_its_joints(rig, waiting):
    rig.paths.stop("Bob")
    rig.paths.tick()
    assert waiting.path.ended.wait(EVENT_LIMIT)
    assert rig.yaw == pytest.approx(-0.2)


def test_a_path_that_is_stopped_while_it_waits_takes_no_joints(rig, waiting):
    waiting.path.stopped.set()
    assert waiting.path.ended.wait(EVENT_LIMIT)
    assert (waiting.asked.is_set(), rig.paths.all()) == (False, [waiting.other])
    rig.clock.advance(1.0)
    assert rig.yaw == pytest.approx(0.5)
