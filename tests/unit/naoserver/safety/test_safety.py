"""The safety layer's rules, on a robot that moves in virtual time."""

import math
from dataclasses import replace
from itertools import pairwise

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from naoserver.bodies.nao import H25
from naoserver.bodies.parts import JointFacts, RangeTable, SpeedRule
from naoserver.errors import InvalidCommand
from naoserver.fake import FakeDevice, FakeRobot
from naoserver.options import SafetyOptions, capped
from naoserver.robot import LIMP, JointFault, JointReading
from naoserver.safety._limits import Goal, JointSafety
from tests.support.examples import examples
from tests.support.linkage import LINKAGE
from zenoh_ice.threads.clock import VirtualClock

LIMITS = {joint.name: joint for joint in H25.joints}
TABLES = {table.dependent: table for table in H25.tables}


def safety_of(body, options):
    return JointSafety(body.joints, options, body.tables, body.couplings, body.speed_rules)


class Rig:
    """A robot behind its safety layer, looked after every period of virtual time."""

    def __init__(self, posture=None, **options):
        self.clock = VirtualClock()
        self.device = FakeDevice("Nao", H25.joints, self.clock, posture or {})
        self.safety = safety_of(H25, SafetyOptions(**options))
        self.wall = 0.0
        self.limitations = []
        self.stopped = []
        self.trace = []

    def move(self, targets, speeds=None, client=""):
        return self._apply(self.safety.safe_goals(targets, speeds or {}, self.device.read(), client))

    def drive(self, velocities, client="c1"):
        return self._apply(self.safety.safe_velocities(velocities, self.device.read(), client, self.wall))

    def run(self, seconds, renew=None):
        for _ in range(round(seconds / self.safety.options.period)):
            self.clock.advance(self.safety.options.period)
            self.wall += self.safety.options.period
            if renew:
                self.drive(renew)
            self._apply(self.safety.watch(self.device.read(), self.wall))
            self.trace.append(self.setpoints())

    def reading(self, time=0.0, **setpoints):
        """Return a reading of joints that are at their setpoints."""
        at = tuple({**self.setpoints(), **setpoints}.values())
        return replace(self.device.read(), time=time, commands=at, positions=at)

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


def test_a_refusal_says_what_of_the_joint_is_not_finite():
    rig, reasons = Rig(), []
    for command in (
        lambda: rig.move({"HeadYaw": math.nan}),
        lambda: rig.move({"HeadYaw": 1.0}, {"HeadYaw": math.nan}),
        lambda: rig.drive({"HeadYaw": math.nan}),
        lambda: rig.safety.safe_stiffnesses({"HeadYaw": math.nan}),
    ):
        with pytest.raises(InvalidCommand) as refused:
            command()
        reasons.append(str(refused.value))
    values = ("target", "speed", "velocity", "stiffness")
    assert reasons == [f"HeadYaw: a {value} of nan is not a finite number" for value in values]


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


BENT = {"LKneePitch": 0.7, "RKneePitch": 0.7}


@pytest.mark.parametrize(
    ("joint", "posture", "fraction"),
    [
        ("RShoulderPitch", BENT, 1.0),
        ("RShoulderPitch", {}, 0.5),
        ("LElbowYaw", {"LKneePitch": -0.09, "RKneePitch": -0.09}, 0.5),
        ("LElbowYaw", {"LKneePitch": 0.7, "RKneePitch": 0.0}, 1.0),
        ("LElbowYaw", {"LKneePitch": 0.3, "RKneePitch": 0.0}, 1.0),
        ("HeadYaw", {}, 1.0),
        ("LHipPitch", {}, 1.0),
    ],
)
def test_a_joint_moves_at_full_speed_but_arms_on_straight_legs(joint, posture, fraction):
    outcome = Rig(posture).move({joint: 0.2}, {joint: 100.0})
    assert outcome.max_speeds[joint] == pytest.approx(fraction * LIMITS[joint].max_velocity)
    assert [limitation.joint for limitation in outcome.limitations] == [joint]


@pytest.mark.parametrize("posture", [{}, BENT])
def test_a_cap_that_is_set_holds_in_every_posture(posture):
    safety = safety_of(H25, capped(0.8))
    reading = Rig(posture).device.read()
    assert safety.speed_cap("RShoulderPitch", reading) == pytest.approx(
        0.8 * LIMITS["RShoulderPitch"].max_velocity
    )


def test_a_speed_rule_holds_for_the_joints_that_it_names_while_all_of_its_condition_holds():
    names = ("slow", "other", "first", "second")
    joints = [JointFacts(name, -3.0, 3.0, 2.0, 1.0) for name in names]
    rules = [
        SpeedRule(slower=("slow",), fraction=0.5, while_below={"first": 0.1, "second": 0.2}),
        SpeedRule(slower=("slow",), fraction=0.25, while_below={"second": -0.5}),
    ]
    safety = JointSafety(joints, SafetyOptions(), speed_rules=rules)

    def caps(first, second):
        places = (0.0, 0.0, first, second)
        reading = JointReading(0.0, places, (0.0,) * 4, places, (0.0,) * 4, (1.0,) * 4, (30.0,) * 4)
        return [safety.speed_cap(name, reading) for name in ("slow", "other")]

    assert caps(0.0, 0.0) == [1.0, 2.0]
    assert caps(0.1, 0.0) == caps(0.0, 0.2) == [2.0, 2.0]
    assert caps(0.0, -0.6) == caps(1.0, -0.6) == [0.5, 2.0], "the slowest rule counts"


@pytest.mark.parametrize("target", [-1e6, 0.0, 400.0])
def test_a_joint_that_turns_without_end_goes_anywhere_and_on_and_on(target):
    clock = VirtualClock()
    device = FakeDevice("Wheel", (JointFacts("wheel", -math.inf, math.inf, 10.0, 1.0),), clock, {})
    safety = JointSafety(device.joints, SafetyOptions())
    outcome = safety.safe_goals({"wheel": target}, {"wheel": 10.0}, device.read())
    assert (outcome.accepted, outcome.limitations) == ({"wheel": target}, [])
    driven = safety.safe_velocities({"wheel": -99.0}, device.read(), "c1", 0.0)
    assert driven.accepted == {"wheel": -10.0}
    for _ in range(100):
        clock.advance(0.02)
        outcome = safety.watch(device.read(), 0.0)
        device.command_positions(outcome.positions, outcome.max_speeds)
        device.command_velocities(outcome.velocities)
    assert device.read().velocities[0] == pytest.approx(-10.0)
    assert device.read().positions[0] < -10.0
    device.command_velocities(safety.hold(["wheel"], device.read()).velocities)
    clock.advance(1.0)
    assert device.read().velocities[0] == pytest.approx(0.0)


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


@pytest.mark.slow
@settings(max_examples=examples(40))
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
    before = rig.device.read()
    outcome = rig.move(targets, dict.fromkeys(targets, speed))
    assert outcome.accepted.keys() == targets.keys()
    for joint, target in outcome.positions.items():
        assert LIMITS[joint].lower <= target <= LIMITS[joint].upper
        assert 0 < outcome.max_speeds[joint] <= rig.safety.speed_cap(joint, before)


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
    assert [limitation.joint for limitation in rig.limitations] == ["HeadYaw"], "reported once"
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
    rig.safety.safe_velocities({"HeadYaw": 1.0, "HeadPitch": 0.1}, reading, "c1", 0.0)
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


def test_a_lost_client_leaves_the_joints_that_it_sent_somewhere_where_they_are():
    rig = Rig()
    rig.move({"LShoulderPitch": -1.5, "LElbowYaw": 0.5}, {"LShoulderPitch": 0.5}, client="lost")
    rig.move({"RShoulderPitch": -1.5}, client="other")
    rig.run(0.5)
    there = rig.setpoints()
    assert rig.safety.moves_for("lost", rig.device.read())
    outcome = rig.safety.drop_client("lost", rig.device.read())
    assert outcome.stopped == ["LShoulderPitch", "LElbowYaw"]
    assert not rig.safety.moves_for("lost", rig.device.read())
    rig.device.command_velocities(outcome.velocities)
    rig.run(1.0)
    assert rig.setpoints()["LShoulderPitch"] == pytest.approx(there["LShoulderPitch"])
    assert rig.setpoints()["RShoulderPitch"] < there["RShoulderPitch"] - 0.3


@pytest.mark.parametrize("without", ["a motor that holds", "a servo that answers"])
def test_nobody_waits_for_a_joint_that_cannot_come_to_its_goal(without):
    rig = Rig()
    rig.move({"HeadYaw": 1.0}, client="lost")
    reading = rig.device.read()
    if without == "a motor that holds":
        reading = replace(reading, stiffnesses=(0.0, *reading.stiffnesses[1:]))
    else:
        reading = replace(reading, faults={"HeadYaw": JointFault("lost", lost=True)})
    assert not rig.safety.moves_for("lost", reading)
    assert rig.safety.drop_client("lost", reading).stopped == ["HeadYaw"], "it may become stiff again"


def test_a_joint_that_just_holds_moves_for_its_client():
    rig = Rig()
    rig.move({"HeadYaw": 1.0}, client="lost")
    reading = rig.device.read()
    assert rig.safety.moves_for("lost", replace(reading, stiffnesses=(LIMP, *reading.stiffnesses[1:])))


def test_a_lost_client_does_not_stop_what_another_has_taken_over_or_what_has_arrived():
    rig = Rig()
    rig.move({"HeadYaw": 0.1, "LElbowYaw": 0.5, "RElbowYaw": 1.0}, {"HeadYaw": 2.0}, client="lost")
    rig.run(0.3)
    rig.move({"LElbowYaw": 0.5}, client="other")
    rig.drive({"RElbowYaw": 0.2}, client="other")
    assert rig.safety.moves_for("other", rig.device.read())
    assert not rig.safety.moves_for("lost", rig.device.read())
    assert rig.safety.drop_client("lost", rig.device.read()).stopped == []


def test_a_lost_client_leaves_the_other_joint_of_a_motor_where_it_is_too():
    rig = Rig()
    rig.move({"LHipYawPitch": -0.5}, client="lost")
    rig.run(0.2)
    assert rig.safety.drop_client("lost", rig.device.read()).velocities == {
        "LHipYawPitch": 0.0,
        "RHipYawPitch": 0.0,
    }


def test_a_joint_that_was_to_make_way_stops_with_the_client_that_caused_it():
    rig = Rig({"HeadPitch": 0.5})
    rig.move({"HeadYaw": 1.0}, client="lost")
    rig.run(0.1)
    stopped = rig.safety.drop_client("lost", rig.device.read()).stopped
    assert stopped == ["HeadYaw", "HeadPitch"]


def test_nothing_ends_a_goal_that_no_client_set():
    rig = Rig()
    rig.move({"LElbowYaw": 0.5})
    rig.run(0.1)
    assert rig.safety.moves_for("", rig.device.read())
    rig.safety.drop_client("lost", rig.device.read())
    assert rig.safety.goal("LElbowYaw") is not None


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


def test_an_unknown_joint_is_refused_with_a_list_of_the_others():
    rig = AxisRig(0.0, 1.0)
    with pytest.raises(InvalidCommand) as refused:
        rig.safety.safe_goals({"Tail": 1.0}, {}, rig.at(0.0))
    assert str(refused.value) == "there is no joint 'Tail'; there are Axis, Other"


@pytest.mark.parametrize(("posture", "fraction"), [(BENT, 1.0), ({}, 0.5)])
def test_the_posture_decides_how_fast_an_arm_is_driven(posture, fraction):
    outcome = Rig(posture).drive({"RShoulderPitch": 100.0})
    assert outcome.accepted["RShoulderPitch"] == pytest.approx(
        fraction * LIMITS["RShoulderPitch"].max_velocity
    )


def test_a_proven_motion_may_move_as_fast_as_the_motor():
    rig = Rig()
    speeds = {"RShoulderPitch": 100.0}
    outcome = rig.safety.safe_goals({"RShoulderPitch": 0.2}, speeds, rig.reading(), full_speed=True)
    assert outcome.max_speeds["RShoulderPitch"] == LIMITS["RShoulderPitch"].max_velocity


@pytest.mark.parametrize(("target", "limit"), [(-1e-9, 0.0), (1.0 + 1e-10, 1.0)])
def test_a_target_that_is_out_of_range_by_a_rounding_is_not_called_limited(target, limit):
    outcome = Rig().move({"LHand": target})
    assert (outcome.accepted, outcome.limitations) == ({"LHand": limit}, [])


def test_limitations_say_what_was_wrong_and_what_it_is_now():
    outcome = Rig().move({"LHand": 2.0}, {"LHand": 9.0})
    assert [limitation.reason for limitation in outcome.limitations] == [
        "2 is out of range, limited to 1",
        "speed 9 is too fast, limited to 8.33",
    ]


# -- stiffness -------------------------------------------------------------------------------------------


@pytest.mark.parametrize("stiffness", [0.0, 0.5, 1.0])
def test_a_motor_is_made_as_stiff_as_commanded(stiffness):
    assert Rig().safety.safe_stiffnesses({"HeadYaw": stiffness}) == {"HeadYaw": stiffness}


@pytest.mark.parametrize("stiffness", [-0.1, 1.1, math.nan])
def test_a_stiffness_that_is_not_from_0_to_1_is_refused_with_the_joint(stiffness):
    with pytest.raises(InvalidCommand, match="HeadYaw: a stiffness of ") as refused:
        Rig().safety.safe_stiffnesses({"HeadYaw": stiffness})
    assert refused.value.field == "HeadYaw"


def test_the_joints_of_one_motor_are_made_equally_stiff():
    assert Rig().safety.safe_stiffnesses({"RHipYawPitch": 0.5}) == {"RHipYawPitch": 0.5, "LHipYawPitch": 0.5}


@pytest.mark.parametrize("joint", ["LHipYawPitch", "RHipYawPitch"])
def test_the_joints_of_one_motor_belong_together(joint):
    found = Rig().safety.with_coupled(["HeadYaw", joint])
    assert found[:2] == ("HeadYaw", joint)
    assert sorted(found) == ["HeadYaw", "LHipYawPitch", "RHipYawPitch"]


def test_a_joint_with_a_motor_of_its_own_stands_alone():
    assert Rig().safety.with_coupled(["HeadYaw"]) == ("HeadYaw",)


def test_a_speed_that_only_the_follower_has_is_that_of_both():
    outcome = Rig().move({"RHipYawPitch": -0.2, "LHipYawPitch": -0.2}, {"RHipYawPitch": 1.0})
    assert outcome.max_speeds == {"LHipYawPitch": 1.0, "RHipYawPitch": 1.0}


def test_the_joints_of_one_motor_are_driven_the_same_and_the_left_wins():
    outcome = Rig().drive({"LHipYawPitch": -0.3, "RHipYawPitch": -0.2})
    assert outcome.velocities == {"LHipYawPitch": -0.3, "RHipYawPitch": -0.3}
    reason = "shares its motor with LHipYawPitch, whose -0.3 it takes"
    assert outcome.limitations == [("RHipYawPitch", reason)]


LINKED = {"grip": 0.4, "pinch": -0.7}
"""Where the joint `pinch`, which is 0.1 - 2 of `grip`, is at 0.4 of that."""


def linked():
    """Return the safety layer and the reading of a body with passive and coupled joints."""
    return safety_of(LINKAGE, SafetyOptions()), FakeRobot(VirtualClock(), body=LINKAGE).read()


@pytest.mark.parametrize("named", ["grip", "pinch"])
def test_the_target_of_a_coupled_joint_is_converted_for_the_other(named):
    safety, reading = linked()
    outcome = safety.safe_goals({named: LINKED[named]}, {}, reading)
    assert outcome.positions == pytest.approx(LINKED)
    assert outcome.max_speeds["pinch"] == pytest.approx(2.0 * outcome.max_speeds["grip"])
    assert outcome.limitations == []


def test_a_follower_goes_no_farther_than_its_leader():
    safety, reading = linked()
    outcome = safety.safe_goals({"pinch": -1.4}, {}, reading)
    assert outcome.accepted == {"pinch": pytest.approx(0.1 - 2.0 * 0.6)}


def test_the_velocity_of_a_follower_is_converted_for_its_leader():
    safety, reading = linked()
    outcome = safety.safe_velocities({"pinch": 0.5}, reading, "c1", 0.0)
    assert (outcome.accepted, safety.velocity("grip")) == ({"pinch": 0.5}, -0.25)


def test_a_follower_is_driven_no_faster_than_its_leader():
    safety, reading = linked()
    fastest = safety.safe_velocities({"grip": 100.0}, reading, "c1", 0.0).accepted["grip"]
    assert safety.velocity("pinch") == pytest.approx(-2.0 * fastest)


def test_both_joints_of_a_coupling_are_made_equally_stiff_whatever_the_ratio():
    assert linked()[0].safe_stiffnesses({"pinch": 0.5}) == {"grip": 0.5, "pinch": 0.5}


@pytest.mark.parametrize(
    "command",
    [
        lambda safety, reading: safety.safe_goals({"drive": 0.1, "swing": 0.1}, {}, reading),
        lambda safety, reading: safety.safe_velocities({"swing": 0.1}, reading, "c1", 0.0),
        lambda safety, _: safety.safe_stiffnesses({"swing": 0.0}),
    ],
)
def test_a_command_to_a_passive_joint_is_refused(command):
    with pytest.raises(InvalidCommand, match="swing has no motor: it moves with what touches it") as refused:
        command(*linked())
    assert refused.value.field == "swing"


def test_a_stop_of_all_joints_leaves_passive_ones_out():
    safety, reading = linked()
    assert safety.hold(LINKAGE.joint_names, reading).velocities.keys() == {"drive", "grip", "pinch"}


# -- what the device is commanded ------------------------------------------------------------------------


def test_a_velocity_goes_to_the_device_as_a_velocity():
    rig = Rig()
    outcome = rig.drive({"HeadYaw": 0.5})
    assert (outcome.velocities, outcome.positions) == ({"HeadYaw": 0.5}, {})


def test_a_velocity_that_has_not_changed_is_commanded_once():
    rig = Rig()
    rig.drive({"HeadYaw": 0.5})
    assert rig.safety.watch(rig.reading(time=0.02), 0.02).velocities == {}


def test_a_renewed_velocity_is_commanded_again():
    rig = Rig()
    rig.drive({"HeadYaw": 0.5})
    assert rig.drive({"HeadYaw": 0.5}).velocities == {"HeadYaw": 0.5}


def test_the_same_target_is_commanded_again():
    rig = Rig()
    rig.move({"LKneePitch": 0.5})
    assert rig.move({"LKneePitch": 0.5}).positions == {"LKneePitch": 0.5}


def test_renewals_at_one_moment_do_not_shorten_the_ramp():
    rig = Rig()
    rig.drive({"HeadYaw": 8.0})
    first_step = LIMITS["HeadYaw"].max_velocity / 0.25 * 0.02
    assert rig.drive({"HeadYaw": 8.0}).velocities == {"HeadYaw": pytest.approx(first_step)}


def test_a_velocity_is_left_by_a_ramp():
    rig = Rig()
    rig.run(0.2, renew={"HeadYaw": 2.0})
    rig.clock.advance(0.02)
    step = LIMITS["HeadYaw"].max_velocity / 0.25 * 0.02
    assert rig.drive({"HeadYaw": 0.0}).velocities == {"HeadYaw": pytest.approx(2.0 - step)}


def test_a_limit_is_looked_for_as_far_ahead_as_the_joint_comes_in_one_and_a_half_periods():
    rig = Rig()
    near = LIMITS["HeadYaw"].upper - 0.5 * 0.04  # 40 ms ahead at 0.5 rad/s; a period and a half is 30 ms
    outcome = rig.safety.safe_velocities({"HeadYaw": 0.5}, rig.reading(HeadYaw=near), "c1", 0.0)
    assert (outcome.velocities, outcome.positions) == ({"HeadYaw": 0.5}, {})


def test_the_last_bit_before_a_limit_is_a_target_at_the_same_speed():
    rig = Rig()
    upper = LIMITS["HeadYaw"].upper
    outcome = rig.safety.safe_velocities({"HeadYaw": 0.5}, rig.reading(HeadYaw=upper - 0.01), "c1", 0.0)
    assert outcome.positions == {"HeadYaw": upper}
    assert outcome.max_speeds == {"HeadYaw": 0.5}


def test_a_goal_is_forgotten_once_the_joint_is_driven():
    rig = Rig()
    rig.move({"HeadYaw": 1.0})
    rig.drive({"HeadYaw": 0.5})
    assert rig.safety.goal("HeadYaw") is None


def test_a_joint_that_was_held_has_a_goal_again_when_it_is_sent_on():
    rig = Rig()
    rig.safety.hold(["LKneePitch"], rig.reading())
    rig.move({"LKneePitch": 0.5}, {"LKneePitch": 1.0})
    assert rig.safety.goal("LKneePitch") == Goal(0.5, 1.0)


def test_a_joint_within_a_thousandth_of_its_goal_has_arrived():
    rig = Rig()
    rig.move({"HeadYaw": 0.001})
    assert rig.safety.next_watch(rig.reading(HeadYaw=0.0), 0.0) is None


# -- at a joint's limit ----------------------------------------------------------------------------------


class AxisRig:
    """A joint with a given range; where `Other` is, at 0, the range table leaves it all of it."""

    def __init__(self, lower, upper, rows=((0.0, -9.0, 9.0),)):
        joints = [JointFacts("Axis", lower, upper, 2.0, 1.0), JointFacts("Other", -9.0, 9.0, 2.0, 1.0)]
        options = SafetyOptions(speed_fraction=1.0)
        self.safety = JointSafety(joints, options, [RangeTable("Other", "Axis", rows)])

    def at(self, setpoint, other=0.0, time=0.0):
        both = (setpoint, other)
        return JointReading(time, both, (0.0,) * 2, both, (0.0,) * 2, (1.0,) * 2, (30.0,) * 2)

    def drive(self, velocity, setpoint, **place):
        return self.safety.safe_velocities({"Axis": velocity}, self.at(setpoint, **place), "c1", 0.0)


@pytest.mark.parametrize(
    ("lower", "upper", "setpoint", "velocity"),
    [(0.0, 1.0, -0.001, 0.1), (0.0, 1.0, 0.0005, 0.1), (-1.0, 0.0, 0.001, -0.1), (-1.0, 0.0, -0.0005, -0.1)],
)
def test_a_joint_within_a_thousandth_of_its_limit_is_driven_away_at_its_velocity(
    lower, upper, setpoint, velocity
):
    outcome = AxisRig(lower, upper).drive(velocity, setpoint)
    assert (outcome.velocities, outcome.positions) == ({"Axis": velocity}, {})


@pytest.mark.parametrize(("setpoint", "edge"), [(-0.0011, 0.0), (1.0011, 1.0)])
def test_a_joint_farther_out_than_that_is_brought_back_at_full_speed(setpoint, edge):
    outcome = AxisRig(0.0, 1.0).drive(0.1, setpoint)
    assert (outcome.positions, outcome.max_speeds) == ({"Axis": edge}, {"Axis": 2.0})


def test_a_joint_that_stands_out_of_its_range_rests_at_its_edge():
    rig = Rig()
    outcome = rig.safety.safe_velocities({"LElbowYaw": 0.0}, rig.reading(LElbowYaw=2.09), "c1", 0.0)
    assert outcome.positions == {"LElbowYaw": LIMITS["LElbowYaw"].upper}


def test_a_joint_a_thousandth_from_its_limit_is_at_it():
    outcome = AxisRig(-1.0, 0.001).drive(0.5, 0.0)
    assert outcome.limitations == [("Axis", "stopped at its limit 0.001")]


def test_a_joint_that_is_pushed_against_its_limit_is_commanded_nothing_more():
    rig = AxisRig(-1.0, 1.0)
    rig.drive(0.1, 1.0)
    outcome = rig.safety.watch(rig.at(1.0, time=0.02), 0.02)
    assert (outcome.velocities, outcome.positions) == ({}, {})


def test_a_joint_goes_on_at_its_velocity_when_the_limit_gives_way():
    rig = AxisRig(-1.0, 1.0, rows=((0.0, -1.0, 0.5), (1.0, -1.0, 1.0)))
    for time in (0.0, 0.02, 0.04, 0.06):
        rig.drive(0.5, 0.5, time=time)
    assert rig.safety.watch(rig.at(0.5, other=0.5, time=0.08), 0.08).velocities == {"Axis": 0.5}


def test_a_joint_at_its_limit_needs_no_ramp_to_stop():
    rig = AxisRig(-1.0, 1.0)
    rig.drive(0.1, 1.0)
    rig.drive(2.0, 1.0, time=0.02)
    assert rig.drive(0.0, 1.0, time=0.04).velocities == {"Axis": 0.0}


def limit_reports(outcome):
    return [joint for joint, reason in outcome.limitations if reason.startswith("stopped at its limit")]


def test_a_limit_is_reported_again_after_the_joint_was_away_from_it():
    rig = AxisRig(-1.0, 1.0)
    assert limit_reports(rig.drive(0.1, 1.0)) == ["Axis"]
    rig.drive(-0.1, 0.5, time=0.1)
    assert limit_reports(rig.drive(0.1, 1.0, time=0.2)) == ["Axis"]


def test_a_limit_is_reported_again_after_a_hold():
    rig = AxisRig(-1.0, 1.0)
    rig.drive(0.1, 1.0)
    rig.safety.hold(["Axis"], rig.at(1.0))
    assert limit_reports(rig.drive(0.1, 1.0)) == ["Axis"]


# -- ranges that depend on another joint -----------------------------------------------------------------


def test_a_command_leaves_the_joints_alone_that_it_does_not_concern():
    rig = Rig()
    clash = rig.reading(HeadYaw=1.526988, HeadPitch=0.5)
    outcome = rig.safety.safe_goals({"LKneePitch": 0.5}, {}, clash)
    assert outcome.positions == {"LKneePitch": 0.5}


def test_pitch_alone_is_clamped_to_what_yaw_leaves_where_it_is():
    outcome = Rig({"HeadYaw": 1.526988}).move({"HeadPitch": 0.5})
    assert outcome.accepted["HeadPitch"] == pytest.approx(0.200015)
    assert [limitation.reason for limitation in outcome.limitations] == [
        "0.5 would hit at this HeadYaw, limited to 0.2"
    ]


def test_a_driven_pitch_is_still_driven_when_yaw_is_sent_somewhere():
    rig = Rig()
    rig.drive({"HeadPitch": 0.2})
    rig.move({"HeadYaw": 0.5})
    assert rig.safety.velocity("HeadPitch") == 0.2


def test_a_range_that_is_the_same_everywhere_slows_nothing_down():
    rig = AxisRig(-1.0, 1.0)
    outcome = rig.safety.safe_goals({"Other": 1.0}, {"Other": 2.0}, rig.at(0.0))
    assert (outcome.limitations, outcome.max_speeds) == ([], {"Other": 2.0})


def test_a_joint_as_fast_as_the_other_can_make_way_is_not_called_limited():
    rig = AxisRig(-1.0, 1.0, rows=((0.0, -1.0, 1.0), (1.0, -1.0, 0.0)))  # steepest: 1
    outcome = rig.safety.safe_goals({"Other": 1.0, "Axis": 0.0}, {"Other": 2.0}, rig.at(1.0))
    assert outcome.limitations == []


def test_the_present_range_is_that_where_a_resting_joint_is():
    assert Rig().move({"HeadPitch": 0.5}).positions == {"HeadPitch": 0.5}


def test_a_slowly_driven_yaw_leaves_a_pitch_alone_that_is_far_from_its_way():
    rig = Rig()
    rig.move({"HeadPitch": 0.5})
    rig.run(3.0)
    assert rig.drive({"HeadYaw": 0.1}).positions == {}


@pytest.mark.parametrize("yaw", [2.08, -2.08])
def test_a_pitch_does_not_make_way_before_a_slow_yaw_comes_near(yaw):
    rig = Rig({"HeadYaw": yaw, "HeadPitch": 0.32})
    outcome = rig.move({"HeadYaw": 0.0, "HeadPitch": 0.5}, {"HeadYaw": 0.1})
    assert outcome.positions["HeadPitch"] > 0.32


def test_what_a_driven_yaw_brings_near_is_reported_once():
    rig = Rig({"HeadPitch": 0.5})
    rig.run(0.6, renew={"HeadYaw": 2.0})
    reports = [limitation for limitation in rig.limitations if limitation.joint == "HeadPitch"]
    assert len(reports) == 1
    assert reports[0].reason.endswith(", clear of what HeadYaw brings near")


def test_what_a_driven_joint_brings_near_again_is_reported_again():
    rig = AxisRig(-1.0, 1.0, rows=((0.0, -1.0, 1.0), (1.0, -1.0, 0.0)))
    rig.safety.safe_goals({"Axis": 1.0}, {}, rig.at(1.0))
    rig.safety.safe_velocities({"Other": 0.1}, rig.at(1.0, other=-0.5), "c1", 0.0)
    reports = [len(rig.safety.watch(rig.at(1.0, other=other), 0.0).limitations) for other in (0.5, -0.5, 0.5)]
    assert reports == [1, 0, 1]


def test_a_yaw_that_is_held_on_its_way_leaves_pitch_the_goal_that_is_clear_there():
    rig = Rig({"HeadYaw": 2.08, "HeadPitch": 0.32})
    rig.move({"HeadYaw": 0.0, "HeadPitch": 0.5}, {"HeadYaw": 8.0, "HeadPitch": 7.0})
    rig.safety.hold(["HeadYaw"], rig.reading(HeadYaw=1.526988))
    goal = rig.safety.goal("HeadPitch")
    assert goal is not None
    assert goal.target == pytest.approx(0.200015)
    assert goal.speed == 7.0


def test_a_sag_of_a_twentieth_is_not_where_the_joint_goes():
    rig = Rig()
    rig.move({"HeadYaw": 0.0, "HeadPitch": 0.51})
    reading = rig.reading(HeadPitch=0.51)
    sagging = replace(reading, positions=(0.05, *reading.positions[1:]))
    assert rig.safety.watch(sagging, 0.0).positions == {}
