"""ALMotion over a fake robot, in virtual time."""

import math

import pytest
from msgspec.structs import replace

pytest.importorskip("qi")

from naoserver.bodies.capabilities import STILL
from naoserver.bodies.nao import H25
from naoserver.errors import CommandRefused, HardwareFailure, InvalidCommand
from naoserver.fake import FakeRobot
from naoserver_sim.robot import SimulatedRobot
from naoserver_sim.world import load_world
from plugins.naoqi.tests.support.rig import LongCall, Rig
from tests.support.limits import EVENT_LIMIT
from tests.support.robot_server import eventually
from tests.support.soak import cases
from tests.support.stepped_clock import SteppedClock
from visualhfsm_naoqi.programs._behaviors import ALBehaviorManager
from visualhfsm_naoqi.programs._effectors import EffectorMotion


def test_set_angles_moves_at_the_fraction_of_full_speed(rig):
    rig.motion.setAngles("HeadYaw", 1.0, 0.1)
    rig.advance(0.5)
    assert rig.motion.getAngles("HeadYaw", False) == pytest.approx([0.05 * H25.joints[0].max_velocity])


def test_change_angles_begins_at_the_setpoint(rig):
    start = rig.motion.getAngles("Head", False)
    rig.motion.changeAngles(["HeadYaw", "HeadPitch"], [0.2, -0.1], 0.5)
    rig.advance(2.0)
    assert rig.motion.getAngles("Head", False) == pytest.approx([start[0] + 0.2, start[1] - 0.1])


def test_an_interpolation_takes_its_time(rig):
    seconds = rig.complete(
        rig.motion.angleInterpolation, ["HeadYaw", "HeadPitch"], [[0.5, -0.5], 0.2], [[1, 3], 2], True
    )
    assert seconds == pytest.approx(3.0, abs=0.1)
    assert rig.motion.getAngles("Head", False) == pytest.approx([-0.5, 0.2], abs=1e-6)


def test_an_interpolation_is_where_it_should_be_on_the_way(rig):
    call = rig.begin(rig.motion.angleInterpolation, "HeadYaw", [0.6, 0.0], [1.0, 2.0], True)
    rig.advance(1.0)
    assert rig.positions("HeadYaw") == pytest.approx([0.6], abs=0.03)
    rig.advance(2.0)
    call.join()


def test_an_interpolation_from_where_it_is(rig):
    rig.complete(rig.motion.angleInterpolation, "HeadYaw", 0.3, 0.5, True)
    rig.complete(rig.motion.angleInterpolation, "HeadYaw", 0.3, 0.5, False)
    assert rig.motion.getAngles("HeadYaw", False) == pytest.approx([0.6], abs=1e-6)


def test_an_interpolation_that_is_too_fast_takes_longer(rig):
    seconds = rig.complete(rig.motion.angleInterpolation, "LShoulderPitch", 0.2, 0.1, True)
    way = H25.postures["StandInit"].angles["LShoulderPitch"] - 0.2
    assert seconds == pytest.approx(way / rig.access.body.speed_cap("LShoulderPitch"), abs=0.1)
    assert rig.motion.getAngles("LShoulderPitch", False) == pytest.approx([0.2], abs=1e-3)


def test_set_angles_lets_no_joint_of_a_leg_wait_for_another(rig):
    ankle, knee = rig.positions("RAnklePitch", "RKneePitch")
    rig.motion.setAngles(["RAnklePitch", "RKneePitch"], [ankle - 0.1, knee + 1.0], 0.1)
    rig.advance(0.4)
    assert rig.positions("RAnklePitch") == pytest.approx([ankle - 0.1], abs=0.01)
    assert rig.positions("RKneePitch")[0] < knee + 0.9


def test_with_a_speed_the_fastest_moment_has_it(rig):
    seconds = rig.complete(rig.motion.angleInterpolationWithSpeed, "HeadYaw", 1.0, 0.1)
    assert seconds == pytest.approx(1.5 / (0.1 * H25.joints[0].max_velocity), abs=0.1)


def test_bezier_as_choregraphe_exports_it(rig):
    points = [[[0.4, [3, -0.2, 0.0], [3, 0.2, 0.0]], [0.1, [3, -0.2, 0.0], [3, 0.0, 0.0]]]]
    seconds = rig.complete(rig.motion.angleInterpolationBezier, ["HeadYaw"], [[0.6, 1.2]], points)
    assert seconds == pytest.approx(1.2, abs=0.1)
    assert rig.motion.getAngles("HeadYaw", False) == pytest.approx([0.1], abs=1e-6)


class LateClock(SteppedClock):
    """A clock on which a thread that waits for its next step is two seconds late."""

    def wait(self, event, timeout):
        return super().wait(event, timeout if timeout > 0.1 else 2.0)


def test_an_interpolation_whose_thread_is_late_still_arrives():
    rig = Rig(clock=LateClock(limit=EVENT_LIMIT))
    rig.complete(rig.motion.angleInterpolation, "HeadYaw", 0.5, 1.0, True)
    assert rig.motion.getAngles("HeadYaw", False) == pytest.approx([0.5])
    rig.close()


def test_of_two_interpolations_of_a_joint_the_later_waits(rig):
    first = rig.begin(rig.motion.angleInterpolation, "HeadYaw", 0.5, 1.0, True)
    second = rig.begin(rig.motion.angleInterpolation, "HeadPitch", 0.1, 1.0, True)
    assert [task[3] for task in rig.motion.getTaskList()] == [["HeadYaw"], ["HeadPitch"]]
    assert not rig.motion.areResourcesAvailable("Head")
    rig.advance(1.5)
    first.join()
    second.join()
    assert rig.motion.getTaskList() == []


def test_an_interpolation_that_is_broken_off_while_it_waits_takes_no_joint_away(rig):
    first = rig.begin(rig.motion.angleInterpolation, "HeadYaw", 0.5, 1.0, True)
    arguments = "HeadYaw", -0.5, 1.0, True
    arrived = rig.arrive(rig.motion.angleInterpolation, *arguments)
    second = LongCall(arrived, rig.motion.angleInterpolation, *arguments)
    eventually(lambda: len(rig.motion.getTaskList()) == 2)
    second.call.stopped.set()
    second.join()
    rig.advance(2.0)
    first.join()
    assert rig.motion.getAngles("HeadYaw", False) == pytest.approx([0.5], abs=1e-6)


def test_set_angles_takes_a_joint_from_an_interpolation(rig):
    call = rig.begin(rig.motion.angleInterpolation, ["HeadYaw", "HeadPitch"], [1.0, 0.2], 1.0, True)
    rig.advance(0.2)
    rig.motion.setAngles("HeadYaw", -0.3, 1.0)
    rig.advance(2.0)
    call.join()
    assert rig.motion.getAngles("Head", False) == pytest.approx([-0.3, 0.2], abs=1e-6)


def test_a_call_that_is_broken_off_leaves_its_joints_where_they_are(rig):
    call = rig.begin(rig.motion.angleInterpolation, "HeadYaw", 1.0, 1.0, True)
    rig.advance(0.5)
    call.call.stopped.set()
    rig.advance(0.1)
    call.join()
    reached = rig.motion.getAngles("HeadYaw", False)
    rig.advance(1.0)
    assert rig.motion.getAngles("HeadYaw", False) == reached
    assert 0.3 < reached[0] < 0.8


@pytest.mark.parametrize("how", ["killTask", "killTasksUsingResources", "killAll"])
def test_tasks_can_be_killed(rig, how):
    call = rig.begin(rig.motion.angleInterpolation, "HeadYaw", 1.0, 5.0, True)
    arguments = {"killTask": [rig.motion.getTaskList()[0][1]], "killTasksUsingResources": ["Head"]}
    getattr(rig.motion, how)(*arguments.get(how, []))
    rig.advance(0.1)
    call.join()
    assert rig.motion.getTaskList() == []


def test_an_emergency_stop_ends_an_interpolation_and_refuses_the_next(rig):
    call = rig.begin(rig.motion.angleInterpolation, "HeadYaw", 1.0, 5.0, True)
    rig.assembly.gate.stop("the button was pressed")
    rig.advance(0.1)
    call.join()
    assert isinstance(call.error, CommandRefused)
    with pytest.raises(CommandRefused, match="the button was pressed"):
        rig.motion.setAngles("HeadYaw", 0.1, 0.1)


def test_a_lease_of_somebody_else_refuses_every_command(rig):
    rig.assembly.gate.acquire("somebody", "Ada", 60.0)
    for command in (
        lambda: rig.motion.setAngles("HeadYaw", 0.1, 0.1),
        lambda: rig.motion.setStiffnesses("Body", 1.0),
        lambda: rig.motion.moveToward(1.0, 0.0, 0.0),
        lambda: rig.complete(rig.motion.angleInterpolation, "HeadYaw", 1.0, 1.0, True),
        lambda: rig.complete(rig.motion.angleInterpolation, "HeadYaw", 0.0, 1.0, True),  # where it is
    ):
        with pytest.raises(CommandRefused, match="Ada"):
            command()


@pytest.mark.parametrize(
    ("command", "message"),
    [
        (lambda motion: motion.setAngles("Nose", 0.0, 0.1), "no joint or chain 'Nose'"),
        (lambda motion: motion.setAngles(["HeadYaw"], [0.0, 1.0], 0.1), "angles has 2 entries, not 1"),
        (lambda motion: motion.setAngles("HeadYaw", math.nan, 0.1), "not a finite number"),
        (lambda motion: motion.setAngles("HeadYaw", 0.0, 0.0), "above 0 and at most 1"),
        (lambda motion: motion.setStiffnesses("Head", 1.5), "not from 0 to 1"),
        (lambda motion: motion.moveToward(1.5, 0.0, 0.0), "from -1 to 1"),
        (lambda motion: motion.move(0.1, 0.0, 0.0, [["MaxStep", 0.1]]), "no parameter 'MaxStep'"),
    ],
)
def test_what_is_wrong_is_refused(rig, command, message):
    with pytest.raises(InvalidCommand, match=message):
        command(rig.motion)


def test_angles_out_of_range_are_clamped(rig):
    rig.motion.setAngles("HeadYaw", 10.0, 1.0)
    rig.advance(2.0)
    assert rig.motion.getAngles("HeadYaw", False) == pytest.approx([H25.joints[0].upper])


# -- stiffness -------------------------------------------------------------------------------------------


def test_stiffness_changes_key_by_key(rig):
    seconds = rig.complete(
        rig.motion.stiffnessInterpolation, ["HeadYaw", "HeadPitch"], [[0.5, 0.0], 0.2], [[1, 2], 1]
    )
    assert seconds == pytest.approx(2.0, abs=0.05)
    rig.advance(0.1)
    assert rig.motion.getStiffnesses("Head") == pytest.approx([0.0, 0.2])


def test_a_chain_has_the_stiffness_of_its_name(rig):
    rig.complete(rig.motion.stiffnessInterpolation, ["Head", "LArm"], [[0.5], [0.25]], [[0.2], [0.2]])
    rig.advance(0.1)
    assert rig.motion.getStiffnesses(["HeadYaw", "HeadPitch", "LElbowYaw"]) == pytest.approx([0.5, 0.5, 0.25])
    rig.motion.setStiffnesses(["Head", "LArm"], [1.0, 0.75])
    rig.advance(0.1)
    assert rig.motion.getStiffnesses(["HeadYaw", "LElbowYaw"]) == pytest.approx([1.0, 0.75])


def test_an_interpolation_of_a_limp_joint_ends_in_time(rig):
    rig.motion.setStiffnesses("HeadYaw", 0.0)
    rig.advance(0.1)
    assert rig.complete(rig.motion.angleInterpolation, "HeadYaw", 0.5, 1.0, True) == pytest.approx(
        1.0, abs=0.1
    )


def test_the_chains_have_names(rig):
    assert rig.motion.getBodyNames("Chains") == ["Head", "LArm", "LLeg", "RLeg", "RArm"]


def test_rest_crouches_and_lets_go_and_wake_up_stands(rig):
    posture = rig.postures
    rig.complete(rig.motion.rest)
    rig.advance(0.1)
    assert (posture.getPosture(), rig.motion.robotIsWakeUp()) == ("Crouch", False)
    rig.complete(rig.motion.wakeUp)
    rig.advance(0.1)
    assert (posture.getPosture(), rig.motion.robotIsWakeUp()) == ("Stand", True)


@pytest.mark.sim
@pytest.mark.parametrize("before", cases(["Sit"], ["StandInit"]))
def test_it_rests_where_it_crouched_until_it_wakes_up(before):
    rig = Rig(lambda clock: SimulatedRobot(clock=clock, world=load_world("empty"), skin=False, noise=True))
    rig.complete(rig.postures.goToPosture, before, 0.8)
    rig.complete(rig.motion.rest)
    rig.clock.advance(30.0)
    reading = rig.robot.read()
    assert not any((*reading.stiffnesses, *reading.torques))
    assert rig.postures.getPosture() == "Crouch"
    rig.complete(rig.motion.wakeUp)
    assert rig.postures.getPosture() == "Stand"
    rig.close()


# -- the walk --------------------------------------------------------------------------------------------


def test_shares_of_the_highest_velocities(rig):
    rig.motion.moveToward(0.5, 0.0, -1.0)
    assert rig.motion.getRobotVelocity() == pytest.approx([0.5 * 0.04 / 0.42, 0.0, -0.349 / 0.42])
    assert rig.motion.moveIsActive()


@pytest.mark.parametrize(
    ("walk", "forward"),
    [
        (lambda motion: motion.moveToward(1.0, 0.0, 0.0), 0.04 / 0.42),
        (lambda motion: motion.moveToward(1.0, 0.0, 0.0, [["MaxStepX", 0.08]]), 0.08 / 0.42),
        (lambda motion: motion.moveToward(1.0, 0.0, 0.0, [["MaxStepX", 0.2]]), 0.08 / 0.42),
        (lambda motion: motion.moveToward(1.0, 0.0, 0.0, [["MaxStepFrequency", 0.0]]), 0.04 / 0.6),
        (lambda motion: motion.setWalkTargetVelocity(1.0, 0.0, 0.0, 0.0), 0.04 / 0.6),
        (lambda motion: motion.move(0.3, 0.0, 0.0), 0.04 / 0.42),
        (
            lambda motion: motion.move(0.3, 0.0, 0.0, [["LeftMaxStepX", 0.02]], [["RightMaxStepX", 0.02]]),
            0.02 / 0.42,
        ),
        (lambda motion: motion.move(0.05, 0.0, 0.0), 0.05),
    ],
)
def test_the_parameters_of_the_gait_limit_the_walk_as_that_of_a_nao(rig, walk, forward):
    walk(rig.motion)
    assert rig.motion.getRobotVelocity() == pytest.approx([forward, 0.0, 0.0])


def test_our_own_interface_walks_as_fast_as_the_robot_can(rig):
    rig.access.walk.drive({"forward": 0.3}, "somebody")
    assert rig.motion.getRobotVelocity()[0] == rig.access.walk.limits.forward == 0.3


def test_move_to_walks_as_fast_as_its_configurations_say(rig):
    feet = [["MaxStepX", 0.04]], [["MaxStepX", 0.04]]
    assert rig.complete(rig.motion.moveTo, 0.2, 0.0, 0.0, *feet) > 0.2 / (0.04 / 0.42)
    assert rig.motion.getRobotPosition(True)[0] == pytest.approx(0.2, abs=0.03)


def test_a_walk_goes_on_until_it_is_stopped(rig):
    rig.motion.move(0.09, 0.0, 0.0)
    rig.advance(3.0)
    assert rig.motion.getRobotPosition(True)[0] == pytest.approx(0.27, abs=0.05)
    rig.motion.stopMove()
    assert not rig.motion.moveIsActive()


def test_a_walk_that_somebody_ended_is_not_restarted(rig):
    rig.motion.move(0.1, 0.0, 0.0)
    rig.access.walk.stop()
    rig.walking.renew()
    assert rig.access.walk.commanded() == STILL


def test_a_walk_that_was_stopped_before_it_began_does_not_begin(rig):
    waiting = rig.arrive(rig.motion.moveTo, 0.2, 0.0, 0.0)
    rig.motion.stopMove()
    assert not rig.motion.moveTo(waiting, 0.2, 0.0, 0.0)
    assert not rig.motion.moveIsActive()
    assert rig.complete(rig.motion.moveTo, 0.02, 0.0, 0.0) > 0.0


def test_move_to_arrives(rig):
    rig.complete(rig.motion.moveTo, 0.3, -0.1, 0.5)
    rig.advance(0.5)
    assert rig.motion.getRobotPosition(True) == pytest.approx([0.3, -0.1, 0.5], abs=0.05)


def test_move_to_goes_through_places_in_the_frame_of_its_start(rig):
    rig.complete(rig.motion.moveTo, 0.0, 0.0, math.pi / 2)
    rig.complete(rig.motion.moveTo, [[0.2, 0.0, 0.0], [0.2, 0.1, 0.0]])
    x, y, heading = rig.motion.getRobotPosition(True)
    assert (x, y) == pytest.approx((-0.1, 0.2), abs=0.06)
    assert heading == pytest.approx(math.pi / 2, abs=0.06)


def test_a_posture_ends_the_walk_first(rig):
    rig.motion.move(0.1, 0.0, 0.0)
    rig.advance(1.0)
    assert rig.complete(rig.postures.goToPosture, "StandZero", 0.8) < 10.0
    assert rig.postures.getPosture() == "StandZero"


def test_a_posture_that_is_stopped_while_it_waits_for_the_end_of_the_walk_is_not_gone_to(rig):
    rig.motion.move(0.1, 0.0, 0.0)
    rig.advance(1.0)
    call = rig.begin(rig.postures.goToPosture, "StandZero", 0.8)
    rig.postures.stopMove()
    rig.advance(10.0)
    call.join()
    assert not call.result
    assert rig.postures.getPosture() != "StandZero"


def test_a_cancelled_posture_leaves_the_next_one_that_waits(rig):
    first = rig.begin(rig.postures.goToPosture, "Crouch", 0.8)
    waiting = rig.arrive(rig.postures.goToPosture, "StandZero", 0.8)
    first.call.stopped.set()
    rig.advance(0.5)
    first.join()
    second = LongCall(waiting, rig.postures.goToPosture, "StandZero", 0.8)
    while not second.ended:
        rig.advance(0.02)
    assert second.result


def test_joints_have_one_fraction_up_to_full_speed(rig):
    for fraction in (1.5, [0.1, 0.2]):
        with pytest.raises(InvalidCommand, match="the fraction is"):
            rig.motion.setAngles(["HeadYaw", "HeadPitch"], [0.1, 0.1], fraction)


def test_no_chain_collides(rig):
    assert rig.motion.isCollision("LArm") == "none"
    with pytest.raises(InvalidCommand, match="no chain 'Tail'"):
        rig.motion.isCollision("Tail")


# -- behaviors -------------------------------------------------------------------------------------------


def test_default_behaviors_are_remembered(rig):
    behaviors = rig.access.service(ALBehaviorManager)
    behaviors.setDefaultBehaviors(["wave"])
    behaviors.addDefaultBehavior("bow")
    behaviors.addDefaultBehavior("wave")
    behaviors.removeDefaultBehavior("bow")
    assert behaviors.getDefaultBehaviors() == ["wave"]


def test_a_behavior_runs_to_its_end(rig):
    behaviors = rig.access.service(ALBehaviorManager)
    call = rig.begin(behaviors.runBehavior, "wave")
    assert behaviors.getRunningBehaviors() == ["wave"]
    with pytest.raises(InvalidCommand, match="moved by the motion wave"):
        rig.motion.setAngles("RShoulderPitch", 0.0, 0.1)
    rig.advance(20.0)
    call.join()
    assert call.error is None
    assert behaviors.getRunningBehaviors() == []


def test_a_behavior_can_be_stopped(rig):
    behaviors = rig.access.service(ALBehaviorManager)
    behaviors.startBehavior("wave")
    rig.advance(0.5)
    behaviors.stopBehavior("wave")
    assert not behaviors.isBehaviorRunning("wave")
    rig.motion.setAngles("RShoulderPitch", 0.0, 0.1)


@pytest.mark.parametrize(("stopped", "runs"), [("every", False), ("wave", False), ("dance", True)])
def test_a_behavior_that_is_stopped_while_it_waits_for_the_end_of_the_walk_does_not_start(rig, stopped, runs):
    behaviors = rig.access.service(ALBehaviorManager)
    rig.motion.move(0.1, 0.0, 0.0)
    rig.advance(1.0)
    call = rig.begin(behaviors.runBehavior, "wave")
    assert behaviors.getRunningBehaviors() == []
    if stopped == "every":
        behaviors.stopAllBehaviors()
    else:
        behaviors.stopBehavior(stopped)
    rig.advance(2.0)
    assert behaviors.isBehaviorRunning("wave") == runs
    behaviors.stopAllBehaviors()
    rig.advance(2.0)
    call.join()


def test_a_behavior_that_is_not_there(rig):
    with pytest.raises(InvalidCommand, match=r"no behavior 'fly'; there are .*wave"):
        rig.access.service(ALBehaviorManager).startBehavior("fly")


def test_a_robot_without_a_walk_says_so():
    rig = Rig(lambda clock: FakeRobot(clock, body=replace(H25, walk=None)))
    with pytest.raises(HardwareFailure, match="does not walk"):
        rig.motion.moveToward(1.0, 0.0, 0.0)
    rig.motion.stopMove()
    rig.close()


@pytest.mark.parametrize(
    ("legs", "steps", "x", "y"),
    [
        (["LLeg", "RLeg"], [[0.06, 0.1, 0.0], [0.0, -0.1, 0.0]], 0.06, 0.0),
        (["RLeg", "LLeg"], [[0.0, -0.14, 0.0], [0.0, 0.1, 0.0]], 0.0, -0.04),
    ],
    ids=["forward", "right"],
)
def test_foot_steps_lead_to_a_place(rig, legs, steps, x, y):
    rig.complete(rig.access.service(EffectorMotion).setFootSteps, legs, steps, [0.6, 1.2], False)
    assert rig.motion.getRobotPosition(True) == pytest.approx([x, y, 0.0], abs=0.03)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ((["LLeg"], [], [1.0], True), "0 steps for 1 legs"),
        ((["LArm"], [[0, 0.1, 0]], [1.0], True), "no leg 'LArm'"),
        ((["LLeg"], [[9, 0.1, 0]], [1.0], True), "longer than 1 m"),
        ((["LLeg"], [[0, 0.1, 0]], [0.0], True), "must be above 0"),
    ],
)
def test_what_are_no_foot_steps(rig, arguments, message):
    call = rig.begin(rig.access.service(EffectorMotion).setFootStepsWithSpeed, *arguments)
    call.join()
    assert message in str(call.error)
