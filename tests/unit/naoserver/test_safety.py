"""The safety layer's rules, on a robot that moves in virtual time."""

import math
from dataclasses import replace
from itertools import pairwise

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from naoserver.body import H25
from naoserver.errors import InvalidCommand
from naoserver.fake import FakeDevice
from naoserver.options import SafetyOptions
from naoserver.safety import JointSafety
from tests.support.examples import examples
from zenoh_ice.clock import VirtualClock

LIMITS = {joint.name: joint for joint in H25.joints}
TABLES = {table.dependent: table for table in H25.anticollision}


class Rig:
    """A robot behind its safety layer, looked after every period of virtual time."""

    def __init__(self, posture=None, **options):
        self.clock = VirtualClock()
        self.device = FakeDevice("Nao", H25.joints, self.clock, posture or {})
        self.safety = JointSafety(H25.joints, SafetyOptions(**options), H25.anticollision, H25.couplings)
        self.wall = 0.0
        self.limitations = []
        self.stopped = []
        self.trace = []

    def move(self, targets, speeds=None):
        return self._apply(self.safety.move(targets, speeds or {}, self.device.read()))

    def drive(self, velocities, client="c1"):
        return self._apply(self.safety.drive(velocities, self.device.read(), client, self.wall))

    def run(self, seconds, renew=None):
        for _ in range(round(seconds / self.safety.options.period)):
            self.clock.advance(self.safety.options.period)
            self.wall += self.safety.options.period
            if renew:
                self.drive(renew)
            self._apply(self.safety.watch(self.device.read(), self.wall))
            self.trace.append(self.setpoints())

    def setpoints(self):
        return dict(zip(LIMITS, self.device.read().commands, strict=True))

    def velocities(self):
        return dict(zip(LIMITS, self.device.read().velocities, strict=True))

    def _apply(self, outcome):
        self.device.command_positions(outcome.positions, outcome.max_speeds)
        self.device.command_velocities(outcome.velocities)
        self.limitations += outcome.limitations
        self.stopped += outcome.stopped
        return outcome


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
def test_a_value_that_is_not_finite_is_refused_with_the_joint(value):
    rig = Rig()
    with pytest.raises(InvalidCommand, match="HeadPitch") as refused:
        rig.move({"HeadYaw": 1.0, "HeadPitch": value})
    assert refused.value.field == "HeadPitch"
    with pytest.raises(InvalidCommand, match="HeadYaw"):
        rig.move({"HeadYaw": 1.0}, {"HeadYaw": value})
    with pytest.raises(InvalidCommand, match="HeadYaw"):
        rig.drive({"HeadYaw": value})
    rig.run(0.5)
    assert rig.setpoints()["HeadYaw"] == 0.0, "a refused command moves nothing"


def test_an_unknown_joint_is_refused_with_those_there_are():
    with pytest.raises(InvalidCommand, match=r"'Tail'.*HeadYaw") as refused:
        Rig().move({"Tail": 1.0})
    assert refused.value.field == "Tail"


def test_a_negative_speed_is_refused():
    with pytest.raises(InvalidCommand, match="negative"):
        Rig().move({"HeadYaw": 1.0}, {"HeadYaw": -1.0})


def test_a_target_out_of_range_is_clamped_and_reported():
    outcome = Rig().move({"LElbowRoll": 1.0, "LKneePitch": 0.5})
    assert outcome.accepted == {"LElbowRoll": LIMITS["LElbowRoll"].upper, "LKneePitch": 0.5}
    assert [limitation.joint for limitation in outcome.limitations] == ["LElbowRoll"]


def test_a_command_without_a_speed_moves_at_a_tenth():
    outcome = Rig().move({"LKneePitch": 0.5})
    assert outcome.max_speeds["LKneePitch"] == pytest.approx(0.1 * LIMITS["LKneePitch"].max_velocity)


@pytest.mark.parametrize(("joint", "fraction"), [("RShoulderPitch", 0.3), ("HeadYaw", 1.0)])
def test_a_speed_is_capped_at_the_joints_fraction(joint, fraction):
    outcome = Rig().move({joint: 0.2}, {joint: 100.0})
    assert outcome.max_speeds[joint] == pytest.approx(fraction * LIMITS[joint].max_velocity)
    assert [limitation.joint for limitation in outcome.limitations] == [joint]


def test_the_full_speed_as_a_client_gives_it_is_not_called_limited():
    speed = 1.0 * LIMITS["HeadYaw"].max_velocity
    assert Rig().move({"HeadYaw": 0.2}, {"HeadYaw": speed}).limitations == []


def test_pitch_is_clamped_to_what_the_goal_of_yaw_leaves():
    outcome = Rig().move({"HeadYaw": 1.526988, "HeadPitch": 0.5})
    assert outcome.accepted["HeadPitch"] == pytest.approx(0.200015)


def test_turning_the_head_alone_takes_the_pitch_along():
    rig = Rig({"HeadPitch": 0.5})
    outcome = rig.move({"HeadYaw": 1.526988}, {"HeadYaw": 8.0})
    assert outcome.accepted == {"HeadYaw": 1.526988}
    assert [limitation.joint for limitation in outcome.limitations] == ["HeadPitch"]
    rig.run(2)
    assert rig.setpoints()["HeadPitch"] == pytest.approx(0.200015)


def test_a_legal_goal_behind_a_narrow_place_is_reached_round_it():
    rig = Rig({"HeadYaw": 2.08, "HeadPitch": 0.32})
    outcome = rig.move({"HeadYaw": 0.0, "HeadPitch": 0.5}, {"HeadYaw": 8.0, "HeadPitch": 7.0})
    assert outcome.limitations == []
    rig.run(2)
    assert rig.setpoints()["HeadPitch"] == pytest.approx(0.5)
    assert min(setpoints["HeadPitch"] for setpoints in rig.trace) < 0.23, "it dived under the narrow place"


def test_after_it_has_arrived_nothing_is_left_to_watch():
    rig = Rig()
    rig.move({"HeadYaw": 0.5, "HeadPitch": 0.1})
    assert rig.safety.next_watch(rig.device.read(), rig.wall) is not None
    rig.run(3)
    assert rig.safety.next_watch(rig.device.read(), rig.wall) is None


def test_a_slow_pitch_makes_way_for_a_fast_yaw_at_full_speed():
    rig = Rig({"HeadPitch": 0.47})
    rig.move({"HeadYaw": -1.4, "HeadPitch": 0.1}, {"HeadYaw": 8.0, "HeadPitch": 0.1})
    rig.run(1)
    for setpoints in rig.trace:
        assert setpoints["HeadPitch"] <= TABLES["HeadPitch"].at(setpoints["HeadYaw"])[1] + 0.01
    assert rig.setpoints()["HeadPitch"] > 0.1, "once out of the way it goes on as slowly as commanded"


def test_a_joint_is_slowed_down_before_which_another_cannot_make_way_in_time():
    rig = Rig({"LAnklePitch": -0.3, "LAnkleRoll": 0.76})
    rig.move({"LAnklePitch": -0.75}, {"LAnklePitch": 1.9})
    assert any("no time to make way" in limitation.reason for limitation in rig.limitations)
    rig.run(2)
    for setpoints in rig.trace:
        assert setpoints["LAnkleRoll"] <= TABLES["LAnkleRoll"].at(setpoints["LAnklePitch"])[1] + 0.01
    assert rig.setpoints()["LAnklePitch"] == pytest.approx(-0.75)


def test_a_joint_that_has_its_way_free_keeps_its_speed():
    rig = Rig({"LAnklePitch": -0.3})
    assert rig.move({"LAnklePitch": -0.75}, {"LAnklePitch": 1.9}).limitations == []


@settings(max_examples=examples(60))
@given(
    st.lists(
        st.tuples(
            st.floats(-3, 3),
            st.floats(-1, 1),
            st.tuples(st.floats(0, 9), st.floats(0, 9)),
            st.booleans(),
            st.floats(0.02, 0.6),
        ),
        min_size=1,
        max_size=6,
    )
)
def test_the_head_stays_clear_whatever_is_commanded(commands):
    """A setpoint may pass a table's edge by what the yaw turns in one period while the pitch gets out of the way."""
    rig = Rig()
    for pan, tilt, speeds, velocity, seconds in commands:
        if velocity:
            rig.drive({"HeadYaw": pan * 3, "HeadPitch": tilt * 7})
        else:
            rig.move(
                {"HeadYaw": pan, "HeadPitch": tilt}, dict(zip(("HeadYaw", "HeadPitch"), speeds, strict=True))
            )
        rig.run(seconds)
    rig.run(1)
    for setpoints in rig.trace:
        lower, upper = TABLES["HeadPitch"].at(setpoints["HeadYaw"])
        assert lower - 0.06 <= setpoints["HeadPitch"] <= upper + 0.06
    lower, upper = TABLES["HeadPitch"].at(rig.setpoints()["HeadYaw"])
    assert lower - 1e-3 <= rig.setpoints()["HeadPitch"] <= upper + 1e-3


@settings(max_examples=examples(40))
@given(st.dictionaries(st.sampled_from(H25.joint_names), st.floats(-10, 10), min_size=1), st.floats(0, 30))
def test_whatever_is_commanded_the_device_gets_it_in_range_and_below_the_cap(targets, speed):
    rig = Rig()
    outcome = rig.move(targets, dict.fromkeys(targets, speed))
    assert outcome.accepted.keys() == targets.keys()
    for joint, target in outcome.positions.items():
        assert LIMITS[joint].lower <= target <= LIMITS[joint].upper
        assert 0 < outcome.max_speeds[joint] <= rig.safety.speed_cap(joint)


def test_a_velocity_stops_half_a_second_after_it_was_last_renewed():
    rig = Rig()
    rig.run(0.3, renew={"HeadYaw": 0.5})
    assert rig.velocities()["HeadYaw"] == pytest.approx(0.5, abs=0.01)
    rig.run(0.48)
    assert not rig.stopped
    rig.run(0.04)
    assert rig.stopped == ["HeadYaw"]
    stopped_at = rig.setpoints()["HeadYaw"]
    rig.run(0.2)
    assert rig.setpoints()["HeadYaw"] == stopped_at
    assert rig.velocities()["HeadYaw"] == pytest.approx(0.0, abs=1e-3)


def test_the_deadline_counts_wall_time_though_the_robots_time_stands_still():
    rig = Rig()
    rig.drive({"HeadYaw": 0.5})
    reading = rig.device.read()
    assert rig.safety.watch(reading, 0.49).stopped == []
    assert rig.safety.watch(reading, 0.5).stopped == ["HeadYaw"]


def test_the_next_look_is_due_at_the_deadline():
    rig = Rig()
    rig.drive({"HeadYaw": 0.5})
    assert rig.safety.next_watch(rig.device.read(), 0.49) == pytest.approx(0.01)
    assert rig.safety.next_watch(rig.device.read(), 0.6) == 0.0


def test_a_velocity_is_reached_and_left_by_a_ramp():
    rig = Rig()
    rig.clock.advance(100.0)
    rig.trace = [rig.setpoints()] * 2
    rig.run(0.4, renew={"HeadYaw": 8.0})
    steps = [b["HeadYaw"] - a["HeadYaw"] for a, b in pairwise(rig.trace)]
    period, ramp = rig.safety.options.period, rig.safety.options.ramp_time
    most = LIMITS["HeadYaw"].max_velocity / ramp * period * period
    assert all(b - a <= most * 1.001 for a, b in pairwise(steps))


def test_a_velocity_ends_at_the_joints_limit_and_leaves_it_again():
    rig = Rig()
    rig.run(2.0, renew={"HeadYaw": 4.0})
    assert rig.setpoints()["HeadYaw"] == LIMITS["HeadYaw"].upper
    assert [limitation.joint for limitation in rig.limitations] == ["HeadYaw"], "told once"
    rig.run(0.3, renew={"HeadYaw": -4.0})
    assert rig.setpoints()["HeadYaw"] < LIMITS["HeadYaw"].upper - 0.5


def test_a_velocity_above_the_cap_is_capped_and_reported():
    outcome = Rig().drive({"HeadYaw": -100.0, "HeadPitch": 1.0})
    assert outcome.accepted == {"HeadYaw": -LIMITS["HeadYaw"].max_velocity, "HeadPitch": 1.0}
    assert [limitation.joint for limitation in outcome.limitations] == ["HeadYaw"]


def test_a_velocity_of_zero_is_a_stop_and_no_timeout():
    rig = Rig()
    rig.run(0.2, renew={"HeadYaw": 1.0})
    rig.drive({"HeadYaw": 0.0})
    rig.run(0.2)
    assert rig.velocities()["HeadYaw"] == pytest.approx(0.0, abs=1e-3)
    assert rig.stopped == []
    assert rig.safety.next_watch(rig.device.read(), rig.wall) is None


def test_a_head_that_sags_a_little_below_its_goal_is_left_alone():
    rig = Rig()
    rig.move({"HeadYaw": 1.0, "HeadPitch": 0.5})
    rig.run(4.0)
    reading = rig.device.read()
    sagging = replace(reading, positions=(reading.positions[0] + 0.02, *reading.positions[1:]))
    assert rig.safety.watch(sagging, rig.wall).positions == {}
    assert rig.safety.next_watch(sagging, rig.wall) is None


def test_a_head_that_lags_far_behind_keeps_clear_of_where_it_is():
    rig = Rig()
    rig.move({"HeadYaw": 0.0, "HeadPitch": 0.5})
    rig.run(3.0)
    reading = rig.device.read()
    blocked = replace(reading, positions=(1.526988, *reading.positions[1:]))
    assert rig.safety.watch(blocked, rig.wall).positions["HeadPitch"] == pytest.approx(0.200015)


def test_a_joint_that_stops_where_it_would_hit_is_moved_clear_not_held():
    rig = Rig()
    reading = rig.device.read()
    rig.safety.drive({"HeadYaw": 1.0, "HeadPitch": 0.1}, reading, "c1", 0.0)
    there = (1.526988, 0.4, *reading.commands[2:])
    outcome = rig.safety.watch(replace(reading, commands=there, positions=there), 0.5)
    assert outcome.velocities == {"HeadYaw": 0.0}
    assert outcome.positions == {"HeadPitch": pytest.approx(0.200015)}


def test_a_limit_that_is_only_near_is_not_reported():
    rig = Rig({"HeadYaw": 2.0035})
    rig.run(0.08, renew={"HeadYaw": 1.0})
    rig.run(0.2, renew={"HeadYaw": -1.0})
    assert 2.08 < max(setpoints["HeadYaw"] for setpoints in rig.trace) < LIMITS["HeadYaw"].upper - 0.001
    assert rig.limitations == []


def test_a_lost_client_stops_what_it_drove_and_nothing_else():
    rig = Rig()
    rig.drive({"HeadYaw": 1.0}, client="lost")
    rig.drive({"HeadPitch": 0.2}, client="other")
    outcome = rig.safety.drop_client("lost", rig.device.read())
    assert outcome.stopped == ["HeadYaw"]
    assert outcome.velocities == {"HeadYaw": 0.0}
    assert rig.safety.velocity("HeadPitch") == 0.2


def test_a_position_takes_a_joint_over_from_a_velocity():
    rig = Rig()
    rig.run(0.2, renew={"HeadYaw": 1.0})
    rig.move({"HeadYaw": -0.3})
    rig.run(2.0)
    assert rig.setpoints()["HeadYaw"] == pytest.approx(-0.3)
    assert rig.stopped == []


def test_hold_stops_a_joint_where_it_is():
    rig = Rig()
    rig.move({"LKneePitch": 2.0})
    rig.run(0.3)
    outcome = rig.safety.hold(["LKneePitch"], rig.device.read())
    assert outcome.velocities == {"LKneePitch": 0.0}
    assert rig.safety.goal("LKneePitch") is None
    assert rig.safety.next_watch(rig.device.read(), rig.wall) is None


@pytest.mark.parametrize(
    ("targets", "shared", "limited"),
    [
        ({"LHipYawPitch": -0.3}, -0.3, []),
        ({"RHipYawPitch": -0.2}, -0.2, []),
        ({"RHipYawPitch": -0.2, "LHipYawPitch": -0.3}, -0.3, ["RHipYawPitch"]),
    ],
)
def test_the_joints_of_one_motor_are_reported_the_same_and_the_left_wins(targets, shared, limited):
    outcome = Rig().move(targets)
    assert outcome.positions == {"LHipYawPitch": shared, "RHipYawPitch": shared}
    assert [limitation.joint for limitation in outcome.limitations] == limited
    assert outcome.accepted == dict.fromkeys(targets, shared)
