"""Curves of joints, and paths along them on a fake robot in virtual time."""

import math
from itertools import accumulate

import pytest
from hypothesis import given
from hypothesis import strategies as st

from naoserver._joint_paths import PERIOD, Curve, Key, Path, smooth_curve
from naoserver.assembly import Assembly
from naoserver.errors import CommandRefused, InvalidCommand
from naoserver.fake import FakeRobot
from naoserver.options import ServerOptions
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


@pytest.mark.parametrize("times", [[], [0.0], [-1.0], [1.0, 1.0], [2.0, 1.0], [1.0, 2.0, 3.0]])
def test_times_that_are_none(times):
    with pytest.raises(InvalidCommand, match="HeadYaw"):
        smooth_curve("HeadYaw", 0.0, times, [1.0, 2.0] if len(times) != 1 else [1.0])


def test_before_and_after_it_stands():
    path = smooth_curve("HeadYaw", 0.2, [1.0], [0.7])
    assert (path.at(-math.inf), path.at(math.inf)) == (0.2, 0.7)


class Rig:
    """A fake robot behind its guards."""

    def __init__(self):
        self.clock = VirtualClock()
        self.robot = FakeRobot(self.clock)
        self.assembly = Assembly(self.robot, ServerOptions(), self.clock)
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
    assert (rig.yaw, type(path.error)) == (there, CommandRefused)
    assert "look ended: " in rig.assembly.events.snapshot()[0][-1].message
    with pytest.raises(CommandRefused):
        rig.start(0.5)


def test_a_path_does_not_go_on_after_a_stop_that_was_reset_at_once(rig):
    path = rig.start(0.5)
    rig.advance(0.3)
    rig.assembly.gate.stop("a test")
    rig.assembly.gate.reset()
    there = rig.yaw
    rig.advance(1.0)
    assert (rig.yaw, str(path.error)) == (there, "the robot was stopped")


def test_joints_that_something_else_moves_begin_no_path(rig):
    rig.assembly.body.claims.claim("the dance", HEAD, lambda: None)
    with pytest.raises(InvalidCommand, match="HeadYaw is moved by the dance now"):
        rig.start(0.5)
    assert not rig.paths.busy
