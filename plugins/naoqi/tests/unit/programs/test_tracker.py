"""ALTracker follows what a fake robot sees, in virtual time."""

import math

import numpy as np
import pytest

pytest.importorskip("qi")
pytest.importorskip("cv2")

from naoserver.errors import InvalidCommand
from visualhfsm_naoqi.programs._tracker import ALBasicAwareness, ALTracker
from visualhfsm_naoqi.programs._vision import LOOKING, ALRedBallDetection


@pytest.fixture(autouse=True)
def stands(rig):
    rig.complete(rig.postures.goToPosture, "StandInit", 1.0)


@pytest.fixture
def detector(rig):
    return rig.access.service(ALRedBallDetection)


@pytest.fixture
def tracker(rig):
    return rig.access.service(ALTracker)


def run(rig, tracker, detector, seconds):
    for _ in range(round(seconds / LOOKING)):
        if detector._wanted():
            detector._look()
        tracker._follow()
        rig.walking.renew()
        rig.advance(LOOKING)


def test_the_head_turns_to_the_ball(rig, tracker, detector):
    tracker.registerTarget("RedBall", 0.12)
    tracker.track("RedBall")
    assert tracker.isTargetLost()
    run(rig, tracker, detector, 3.0)
    assert rig.motion.getAngles("HeadYaw", True)[0] == pytest.approx(-0.15, abs=0.03)
    assert tracker.isNewTargetDetected()
    x, y, z = tracker.getTargetPosition(2)
    assert math.hypot(x, y) == pytest.approx(1.0, abs=0.25)
    assert math.atan2(y, x) == pytest.approx(-0.15, abs=0.03)
    assert z == pytest.approx(0.5, abs=0.1)


def test_it_walks_to_the_ball(rig, tracker, detector):
    tracker.registerTarget("RedBall", [0.12])
    tracker.setMode("Move")
    tracker.setRelativePosition([-0.7, 0.0, 0.0, 0.1, 0.1, 0.3])
    tracker.track("RedBall")
    run(rig, tracker, detector, 2.0)
    assert rig.walking.active
    tracker.stopTracker()
    assert not rig.walking.active
    assert rig.motion.getRobotPosition(True)[0] > 0.05


def test_a_target_that_is_gone_is_lost_and_ends_the_walk(rig, tracker, detector):
    tracker.setMode("Move")
    tracker.track("RedBall")
    run(rig, tracker, detector, 1.0)
    assert not tracker.isTargetLost()
    rig.robot.mechanisms[0].place({"BallRedPan": 3.0})
    run(rig, tracker, detector, 1.0)
    assert tracker.isTargetLost()
    assert not rig.walking.active


def test_stopped_it_follows_nothing(rig, tracker, detector):
    tracker.track("RedBall")
    assert (tracker.isActive(), tracker.getActiveTarget()) == (True, "RedBall")
    tracker.unregisterAllTargets()
    assert (tracker.isActive(), tracker.getRegisteredTargets(), tracker.getTargetPosition()) == (
        False,
        [],
        [],
    )
    assert not detector._wanted()


@pytest.mark.parametrize(
    "stop",
    [
        lambda rig: rig.motion.killAll(),
        lambda rig: rig.motion.killTasksUsingResources(["HeadYaw"]),
        lambda rig: rig.assembly.gate.stop("test"),
    ],
    ids=["killAll", "resources", "emergency stop"],
)
def test_what_stops_the_head_ends_the_tracker_for_good(rig, tracker, detector, stop):
    tracker.track("RedBall")
    run(rig, tracker, detector, 0.1)
    assert tracker.isActive()
    stop(rig)
    before = rig.motion.getAngles("HeadYaw", True)
    run(rig, tracker, detector, 1.0)
    assert not tracker.isActive()
    assert rig.motion.getAngles("HeadYaw", True) == pytest.approx(before, abs=0.02)


def test_stop_move_ends_a_tracker_that_walks(rig, tracker, detector):
    tracker.setMode("Move")
    tracker.track("RedBall")
    run(rig, tracker, detector, 1.0)
    assert rig.walking.active
    rig.motion.stopMove()
    run(rig, tracker, detector, 1.0)
    assert not rig.walking.active
    assert not tracker.isActive()


@pytest.mark.parametrize("rest", [(2, 0.5, False), (0.5, False), ()], ids=["frame", "no frame", "alone"])
def test_it_looks_at_a_point(rig, tracker, rest):
    tracker.lookAt([1.0, 0.5, 0.1], *rest)
    rig.advance(2.0)
    assert rig.motion.getAngles("HeadYaw", True)[0] == pytest.approx(math.atan2(0.5, 1.0), abs=0.02)


@pytest.mark.parametrize("rest", [(2, 0.5), (0.5,), ()], ids=["frame", "no frame", "alone"])
@pytest.mark.parametrize(
    ("arm", "point"),
    [("Arms", (1.0, 0.5, 0.6)), ("Arms", (1.0, -0.5, 0.2)), ("LArm", (0.6, -0.1, 0.9))],
    ids=["left", "right", "across"],
)
def test_an_arm_points_at_a_point(rig, tracker, arm, point, rest):
    rig.complete(tracker.pointAt, arm, list(point), *rest)
    side = "R" if arm == "Arms" and point[1] < 0.0 else "L"
    frame = rest[0] if len(rest) == 2 else 0
    elbow, hand = (rig.motion.getPosition(f"{side}{name}", frame, False)[:3] for name in ("ElbowYaw", "Arm"))
    arm, way = np.subtract(hand, elbow), np.subtract(point, elbow)
    assert arm @ way / np.linalg.norm(arm) / np.linalg.norm(way) > math.cos(math.radians(10))


def test_a_point_within_the_robot_is_refused(rig, tracker):
    with pytest.raises(InvalidCommand, match="within the robot"):
        tracker.lookAt([0.0, 0.0, 0.0], 0, 0.5, False)
    with pytest.raises(InvalidCommand, match="within the robot"):
        rig.complete(tracker.pointAt, "LArm", [0.0, 0.0, 0.0], 0, 0.5)


def test_awareness_follows_a_face_until_it_is_stopped(rig, tracker):
    awareness = rig.access.service(ALBasicAwareness)
    awareness.setEngagementMode("FullyEngaged")
    awareness.startAwareness()
    assert awareness.isAwarenessRunning()
    assert tracker.getActiveTarget() == "Face"
    awareness.pauseAwareness()
    assert not awareness.isEnabled()
    awareness.setEnabled(True)
    assert tracker.getActiveTarget() == "Face"
    tracker.track("RedBall")
    awareness.setEnabled(False)
    assert tracker.getActiveTarget() == "RedBall"  # another follower's


def test_what_is_no_target(tracker):
    with pytest.raises(InvalidCommand, match="no target 'Cat'; there are RedBall, Face, LandMark"):
        tracker.track("Cat")
    with pytest.raises(InvalidCommand, match="not a finite number"):
        tracker.lookAt([math.nan, 0, 0], 0, 0.5, False)
