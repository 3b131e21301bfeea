"""Goals of FollowJointTrajectory: what is refused, by which code and name, and where the joints are between points."""

import math
import threading
from typing import Any

import numpy as np
import pytest

from interfaces.nao import JointLimits, JointState
from tests.support.limits import EVENT_LIMIT
from visualhfsm_ros2.gateway._trajectory import (
    INVALID_GOAL,
    INVALID_JOINTS,
    TYPE,
    TrajectoryError,
    TrajectoryFollower,
    read_goal,
)
from zenoh_ice import Sample, TimeoutException
from zenoh_ros2 import Aborted, Canceled, Types

LIMITS = {name: JointLimits(name, -1.0, 1.0, 4.0, 1.0) for name in ("HeadYaw", "HeadPitch", "LHand")}
LIMITS["Toe"] = JointLimits("Toe", -1.0, 1.0, 4.0, 0.0)


@pytest.fixture(scope="module")
def types():
    return Types()


def point(time, *positions, **fields):
    whole, fraction = divmod(round(time * 1e9), 1_000_000_000)
    return {"positions": positions, "time_from_start": {"sec": whole, "nanosec": fraction}, **fields}


def goal(types, names=("HeadYaw",), points=(), **fields):
    trajectory = {"joint_names": [*names], "points": [*points], **fields.pop("trajectory", {})}
    return types.make(f"{TYPE}_Goal", trajectory=trajectory, **fields)


def read(types, *arguments, **fields):
    return read_goal(goal(types, *arguments, **fields), LIMITS)


def test_without_velocities_it_goes_straight_from_point_to_point(types):
    found = read(types, ("HeadYaw", "LHand"), [point(1.0, 0.2, 0.0), point(3.0, 0.6, 1.0)])
    assert found.at(2.0) == pytest.approx([0.4, 0.5])
    assert found.at(0.0) == pytest.approx([0.2, 0.0])
    assert found.at(9.0) == pytest.approx([0.6, 1.0])


def test_with_velocities_it_has_them_at_the_points(types):
    points = [point(0.0, 0.0, velocities=[0.5]), point(2.0, 1.0, velocities=[0.25])]
    found = read(types, ("HeadYaw",), points)
    step = 1e-6
    assert found.at(2.0) == pytest.approx([1.0])
    assert (found.at(step) - found.at(0.0)) / step == pytest.approx([0.5], abs=1e-4)
    assert (found.at(2.0) - found.at(2.0 - step)) / step == pytest.approx([0.25], abs=1e-4)


def test_it_begins_where_the_joints_are(types):
    found = read(types, ("HeadYaw",), [point(2.0, 1.0, velocities=[0.0])]).from_positions([0.5])
    assert found.at(0.0) == pytest.approx([0.5])
    assert found.at(1.0) == pytest.approx([0.75])
    at_once = read(types, ("HeadYaw",), [point(0.0, 1.0)])
    assert at_once.from_positions([0.5]) is at_once


@pytest.mark.slow
@pytest.mark.parametrize(
    ("names", "points", "code", "words"),
    [
        ((), [point(1.0)], INVALID_JOINTS, "there are none"),
        (("Nose",), [point(1.0, 0.0)], INVALID_JOINTS, "'Nose'; there are HeadYaw"),
        (("HeadYaw", "HeadYaw"), [point(1.0, 0.0, 0.0)], INVALID_JOINTS, "HeadYaw stands there twice"),
        (("HeadYaw",) * 5, [point(1.0)], INVALID_JOINTS, "5; there are 4 joints"),
        (("Toe",), [point(1.0, 0.0)], INVALID_JOINTS, "Toe has no motor: it moves with what touches it"),
        (("HeadYaw",), [], INVALID_GOAL, "0 points"),
        (("HeadYaw",), [point(0.1, 0.0)] * 10_001, INVALID_GOAL, "10001 points"),
        (("HeadYaw",), [point(1.0, 0.0), point(1.0, 0.5)], INVALID_GOAL, r"points\[1\].time_from_start: 1 s"),
        (("HeadYaw",), [point(4000.0, 0.0)], INVALID_GOAL, "up to 3600 s"),
        (("HeadYaw",), [point(-1.0, 0.0)], INVALID_GOAL, r"points\[0\].time_from_start"),
        (("HeadYaw",), [point(1.0, 0.0, 0.0)], INVALID_GOAL, "2 numbers for 1 joints"),
        (("HeadYaw", "LHand"), [point(1.0, 0.0, math.nan)], INVALID_GOAL, "LHand is not a finite number"),
        (("HeadYaw",), [point(1.0, 0.0, velocities=[math.inf])], INVALID_GOAL, "velocities: HeadYaw is not"),
        (("LHand", "HeadYaw"), [point(1.0, 0.0, 1.5)], INVALID_GOAL, "HeadYaw at 1.5 rad; -1 to 1"),
    ],
)
def test_what_makes_no_sense_is_refused_by_name(types, names, points, code, words):
    with pytest.raises(TrajectoryError, match=words) as refusal:
        read(types, names, points)
    assert refusal.value.code == code


# Following

FOLLOWER: Any = TrajectoryFollower  # of stand-ins for a proxy and a goal


class Goal:
    """A goal as the follower sees it."""

    def __init__(self, request):
        self.request, self.canceled, self.feedback = request, False, []

    def publish_feedback(self, fields):
        self.feedback.append(fields)


class Body:
    """Joints that are at once where they are sent; robot time goes by steps."""

    def __init__(self, times):
        self.getJointState, self._times, self.sent = self, iter(times), []
        self._positions = [0.0] * len(LIMITS)
        self.stops = 0

    def getJointNames(self):
        return [*LIMITS]

    def getJointLimits(self):
        return [*LIMITS.values()]

    def wait(self, after=None, timeout=None):
        time = next(self._times, None)
        if time is None:
            raise TimeoutException("paused")
        zero = [0.0] * len(LIMITS)
        state = JointState(time, self._positions, zero, self._positions, zero, zero, zero)
        return Sample(state, 1, time, 0.0)

    def setJointPositions(self, targets, fraction):
        self.sent.append((targets, fraction))
        self._positions = [targets.get(name, 0.0) for name in LIMITS]


def follow(types, body, *points, **fields):
    request = goal(types, ("HeadYaw",), points, **fields)
    sent = Goal(request)
    return FOLLOWER(body, lambda seconds: seconds, lambda: body.stops).execute(sent), sent


def test_setpoints_go_ahead_by_a_step_and_end_at_the_last_point(types):
    body = Body(0.02 * tick for tick in range(200))
    result, sent = follow(types, body, point(0.5, 0.4), point(1.0, -0.4))
    assert result["error_code"] == 0
    assert body.sent[0][0] == {"HeadYaw": pytest.approx(0.4 * 0.04 / 0.5)}
    assert body.sent[-1][0] == {"HeadYaw": -0.4}
    assert len(sent.feedback) == pytest.approx(10, abs=1)


def test_a_point_for_at_once_is_sent(types):
    body = Body([5.0, 5.02])
    follow(types, body, point(0.0, 0.3))
    assert body.sent == [({"HeadYaw": 0.3}, 1.0)]


def test_a_simulation_that_begins_again_ends_it(types):
    with pytest.raises(Aborted, match="began again"):
        follow(types, Body([5.0, 5.02, 0.02]), point(1.0, 0.3))


def test_it_waits_for_its_start(types):
    body = Body(0.5 * tick for tick in range(10))
    follow(types, body, point(1.0, 0.3), trajectory={"header": {"stamp": {"sec": 2}}})
    assert body.sent[0][0] == {}, "whether it may"
    assert body.sent[1][0] == {"HeadYaw": pytest.approx(0.03)}


def test_it_does_not_begin_after_a_stop(types):
    body = Body(0.5 * tick for tick in range(10))
    stops = iter(range(2))
    sent = Goal(goal(types, ("HeadYaw",), [point(1.0, 0.3)], trajectory={"header": {"stamp": {"sec": 2}}}))
    with pytest.raises(Aborted, match="the robot was stopped before it began"):
        FOLLOWER(body, lambda seconds: seconds, lambda: next(stops)).execute(sent)
    assert [targets for targets, _ in body.sent] == [{}]


def test_what_is_paused_can_be_cancelled(types):
    request = goal(types, ("HeadYaw",), [point(1.0, 0.3)])
    body, sent = Body([5.0, 5.02]), Goal(request)
    thread = threading.Timer(0.05, lambda: setattr(sent, "canceled", True))
    thread.start()
    with pytest.raises(Canceled):
        FOLLOWER(body, lambda seconds: seconds, lambda: 0).execute(sent)
    thread.join(EVENT_LIMIT)


def test_what_a_planner_rounds_is_not_refused(types):
    assert read(types, ("HeadYaw",), [point(1.0, 1.005)]).positions == pytest.approx(np.array([[1.005]]))


def test_tolerances_bind_above_0(types):
    tolerances = [{"name": "HeadYaw", "position": 0.1}, {"name": "LHand", "position": -1.0}]
    found = read(
        types,
        ("HeadYaw", "LHand"),
        [point(1.0, 0.0, 0.0)],
        path_tolerance=tolerances,
        goal_tolerance=[{"name": "LHand"}],
        goal_time_tolerance={"sec": 2},
    )
    assert found.path_tolerances == {"HeadYaw": 0.1}
    assert found.goal_tolerances == {}
    assert found.settling == 2.0


@pytest.mark.parametrize(
    "tolerance", [{"name": "Nose", "position": 0.1}, {"name": "HeadYaw", "position": math.nan}]
)
def test_a_tolerance_of_nothing_is_refused(types, tolerance):
    with pytest.raises(TrajectoryError, match=tolerance["name"]):
        read(types, ("HeadYaw",), [point(1.0, 0.0)], path_tolerance=[tolerance])
