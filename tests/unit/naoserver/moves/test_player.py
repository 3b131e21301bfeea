"""Playing motions: who controls the joints meanwhile, and what stops a motion."""

from dataclasses import replace

import pytest

from interfaces.nao import ActionStatus
from naoserver.errors import CommandRefused, InvalidCommand
from naoserver.fake import FakeRobot
from naoserver.moves.routes import PostureRoute, RouteError
from tests.support.motion_rig import MOTIONS, MotionRig
from zenoh_ice import VirtualClock

GONE = "the client that commanded it is gone"


@pytest.fixture
def rig():
    clock = VirtualClock()
    return MotionRig(FakeRobot(clock=clock), clock)


def lies(rig, pitch):
    """Make the robot feel that it lies: on its belly with a positive pitch."""
    inertial = rig.robot.senses.read().inertial
    rig.robot.senses.feel(inertial=type(inertial)(inertial.acceleration, (0.0, 0.0, 0.0), 0.0, pitch))


def test_a_motion_takes_its_time_and_ends_where_its_file_says(rig):
    begun = rig.clock.now()
    assert rig.play("wave").status is ActionStatus.Done
    assert rig.clock.now() - begun == pytest.approx(MOTIONS["wave"].duration, abs=0.5)
    assert rig.commands()["RShoulderPitch"] == pytest.approx(1.44)


def test_the_setpoints_keep_to_the_path(rig):
    rig.begin("wave")
    begin, start, worst = rig.commands(), rig.clock.now(), 0.0
    while rig.clock.now() - start < MOTIONS["wave"].duration:
        rig.let_go(0.02)
        wanted = MOTIONS["wave"].at(rig.clock.now() - start, begin)
        worst = max(worst, *(abs(rig.commands()[joint] - angle) for joint, angle in wanted.items()))
    assert worst < 0.06


def test_a_pace_makes_it_faster(rig):
    begun = rig.clock.now()
    rig.play("wave", pace=2.0)
    assert rig.clock.now() - begun == pytest.approx(MOTIONS["wave"].duration / 2, abs=0.5)


@pytest.mark.parametrize("slow", [5e-324, 1e-300])
def test_the_slowest_pace_is_a_hundredth(rig, slow):
    rig.begin("wave", pace=slow)
    rig.let_go(MOTIONS["wave"].duration)
    assert rig.player.progress("motion").progress == pytest.approx(0.01, rel=0.1)
    rig.player.begin("posture", "Crouch", PostureRoute(rig.robot.body, "Crouch", MOTIONS.values(), slow))
    rig.let_go(1.0)
    assert 0.0 < rig.player.progress("posture").progress < 0.1


def test_others_may_not_move_its_joints_but_those_that_it_leaves_alone(rig):
    rig.begin("wave")
    rig.let_go(0.5)
    with pytest.raises(InvalidCommand, match="RElbowRoll is moved by the motion wave"):
        rig.assembly.body.move({"RElbowRoll": 0.5}, {})
    rig.assembly.body.move({"LElbowRoll": -0.5}, {})
    rig.player.stop()
    rig.assembly.body.move({"RElbowRoll": 0.5}, {})


def test_a_stop_holds_the_joints_where_they_are(rig):
    rig.begin("wave")
    rig.let_go(1.2)
    rig.player.stop()
    held = rig.commands()
    rig.let_go(2.0)
    assert rig.commands() == held
    assert rig.player.progress("motion").status is ActionStatus.Stopped


def test_a_motion_that_is_refused_at_its_very_beginning_leaves_its_joints_free(rig, monkeypatch):
    body = rig.assembly.body
    body.stiffen(dict.fromkeys(rig.robot.body.postures["Stand"].angles, 0.0), 0.0)
    rig.let_go(0.02)
    rig.assembly.gate.stop("a test")
    answers = iter([lambda _client, **_: None])
    require = rig.assembly.gate.require
    with monkeypatch.context() as patched:  # the stop comes when the gate has been asked already
        patched.setattr(
            rig.assembly.gate, "require", lambda *given, **more: next(answers, require)(*given, **more)
        )
        with pytest.raises(CommandRefused):
            rig.begin("wave")
    rig.assembly.gate.reset(resume=True)
    body.move({"RElbowRoll": 0.5}, {})


@pytest.mark.parametrize("error", [OSError("no bus"), SystemExit("no bus")])
def test_a_driver_that_fails_ends_it_for_good(rig, monkeypatch, caplog, error):
    def fails(*_):
        monkeypatch.undo()
        raise error

    rig.begin("wave")
    rig.let_go(1.2)
    monkeypatch.setattr(rig.robot, "command_positions", fails)
    rig.let_go(0.1)
    held = rig.commands()
    rig.let_go(2.0)
    assert rig.commands() == pytest.approx(held, abs=0.01)
    progress = rig.player.progress("motion")
    assert (progress.status, progress.message) == (ActionStatus.Failed, "no bus")
    assert "the motion wave ended: no bus" in caplog.text
    assert "in fails" in caplog.text
    rig.assembly.body.move({"RElbowRoll": 0.5}, {})


@pytest.mark.parametrize("error", [OSError("no bus"), SystemExit("no bus")])
def test_a_driver_that_fails_at_the_beginning_leaves_the_joints_free(rig, monkeypatch, error):
    def fails(*_):
        raise error

    body = rig.assembly.body
    body.stiffen(dict.fromkeys(rig.robot.body.postures["Stand"].angles, 0.0), 0.0)
    rig.let_go(0.02)
    with monkeypatch.context() as broken:
        broken.setattr(rig.robot, "command_stiffnesses", fails)
        with pytest.raises(type(error)):
            rig.begin("wave")
    body.move({"RElbowRoll": 0.5}, {})


def test_an_emergency_stop_ends_it_and_refuses_the_next(rig):
    rig.begin("wave")
    rig.let_go(1.2)
    rig.assembly.gate.stop("a test")
    held = rig.commands()
    rig.let_go(2.0)
    assert rig.commands() == held
    assert rig.player.progress("motion").status is ActionStatus.Stopped
    with pytest.raises(CommandRefused):
        rig.begin("wave")
    rig.assembly.gate.reset()
    rig.let_go(1.0)
    assert rig.commands() == held


def test_a_lease_that_somebody_else_takes_ends_it(rig):
    rig.begin("wave")
    rig.let_go(0.5)
    rig.assembly.gate.acquire("somebody", "Somebody", 10.0)
    rig.let_go(0.1)
    progress = rig.player.progress("motion")
    assert (progress.status, "Somebody" in progress.message) == (ActionStatus.Stopped, True)


def test_a_new_action_ends_the_one_before_but_a_refused_one_does_not(rig):
    rig.begin("wave")
    rig.let_go(0.5)
    with pytest.raises(RouteError, match="stand_up_from_belly begins lying on its belly"):
        rig.begin("stand_up_from_belly")
    assert rig.player.progress("motion").name == "wave"
    rig.go("Crouch")
    assert rig.player.progress("motion").status is ActionStatus.Stopped
    assert rig.player.progress("posture").status is ActionStatus.Done


def test_a_motion_begins_in_its_posture_wherever_the_joints_are(rig):
    rig.go("StandZero")
    assert rig.play("kick").status is ActionStatus.Done
    assert rig.posture == "StandInit"


def test_limp_motors_become_stiff_first(rig):
    rig.robot.command_stiffnesses(dict.fromkeys(rig.commands(), 0.0), 0.0)
    rig.let_go(0.1)
    assert rig.play("wave").status is ActionStatus.Done
    stiff = dict(zip(rig.commands(), rig.robot.read().stiffnesses, strict=True))
    assert stiff["RElbowRoll"] == 1.0
    assert stiff["LKneePitch"] == 0.0, "the motion does not move it"


def test_a_motor_that_goes_limp_ends_it(rig):
    rig.begin("dance")
    rig.let_go(1.0)
    rig.robot.command_stiffnesses({"LKneePitch": 0.0}, 0.0)
    rig.let_go(0.1)
    progress = rig.player.progress("motion")
    assert (progress.status, progress.message) == (ActionStatus.Failed, "LKneePitch has gone limp")


def test_a_fall_ends_what_is_danced(rig):
    rig.begin("dance")
    rig.let_go(1.0)
    lies(rig, 1.5)
    rig.let_go(0.1)
    progress = rig.player.progress("motion")
    assert (progress.status, progress.message) == (ActionStatus.Failed, "the robot has fallen")


@pytest.mark.parametrize("posture", ["Stand", "StandInit", "StandZero", "Crouch"])
def test_a_standing_robot_goes_straight_to_a_standing_posture(rig, posture):
    assert rig.go(posture).status is ActionStatus.Done
    assert rig.posture == posture
    assert rig.commands() == pytest.approx(dict(rig.robot.body.postures[posture].angles), abs=1e-6)


def test_a_slower_way_takes_longer(rig):
    begun = rig.clock.now()
    rig.go("Crouch")
    fast = rig.clock.now() - begun
    rig.go("Stand")
    begun = rig.clock.now()
    rig.go("Crouch", fraction=0.5)
    assert rig.clock.now() - begun > 1.5 * fast


def messages(rig):
    """Return the events of the health report."""
    events, _, _ = rig.assembly.events.snapshot()
    return [(event.level.name, event.message) for event in events]


def test_a_gesture_of_a_lost_client_stops_at_once(rig):
    rig.begin("dance", client="anna")
    rig.let_go(1.0)
    rig.lose("ben")
    assert rig.player.busy
    rig.lose("anna")
    held = rig.commands()
    progress = rig.player.progress("motion")
    assert (progress.status, progress.message) == (ActionStatus.Stopped, GONE)
    assert ("Warning", f"the motion dance stopped: {GONE}") in messages(rig)
    rig.let_go(2.0)
    assert rig.commands() == held


def test_an_action_without_a_client_loses_none(rig):
    rig.begin("wave")
    rig.assembly.drop_client("")
    assert rig.player.busy


def test_on_the_way_to_a_posture_a_robot_whose_client_is_lost_crouches(rig):
    rig.begin_posture("StandZero", client="anna", fraction=0.2)
    rig.let_go(0.5)
    rig.lose("anna")
    assert (
        "Warning",
        f"the posture StandZero will end in the safest posture that it reaches: {GONE}",
    ) in messages(rig)
    rig.finish()
    progress = rig.player.progress("posture")
    assert (progress.status, progress.message) == (ActionStatus.Stopped, GONE)
    assert rig.posture == "Crouch"


@pytest.mark.parametrize("begin", ["begin", "begin_posture"])
def test_who_lies_when_its_client_is_lost_ends_its_leg_and_stays_where_it_lies(rig, begin):
    name = "stand_up_from_belly" if begin == "begin" else "Stand"
    lies(rig, 1.5)
    getattr(rig, begin)(name, client="anna")
    rig.let_go(2.0)
    rig.lose("anna")
    rig.let_go(MOTIONS["stand_up_from_belly"].duration - 2.5)
    assert rig.player.busy, "half way up it may not let go"
    rig.finish()
    assert rig.player.progress("motion" if begin == "begin" else "posture").message == GONE
    assert rig.posture != "Crouch"
    assert rig.commands()["LKneePitch"] == pytest.approx(
        rig.robot.body.postures["StandInit"].angles["LKneePitch"], abs=1e-6
    )


def test_an_emergency_stop_ends_also_what_has_lost_its_client(rig):
    rig.begin_posture("Crouch", client="anna", fraction=0.2)
    rig.let_go(0.5)
    rig.lose("anna")
    rig.assembly.gate.stop("a test")
    held = rig.commands()
    rig.let_go(2.0)
    assert rig.commands() == held
    assert not rig.player.busy


def test_who_commands_after_the_loss_gets_the_joints(rig):
    rig.begin_posture("Crouch", client="anna", fraction=0.2)
    rig.let_go(0.5)
    rig.lose("anna")
    rig.go("Stand")
    progress = rig.player.progress("posture")
    assert (progress.name, progress.status, progress.message) == ("Stand", ActionStatus.Done, "")


class Hot(FakeRobot):
    """A robot one of whose motors is hot."""

    joint, degrees = "LShoulderPitch", 84.6

    def read(self):
        reading = super().read()
        temperatures = list(reading.temperatures)
        temperatures[self.body.joint_names.index(self.joint)] = self.degrees
        return replace(reading, temperatures=tuple(temperatures))


@pytest.fixture
def hot():
    clock = VirtualClock()
    return MotionRig(Hot(clock=clock), clock)


@pytest.mark.parametrize("begin", [lambda rig: rig.begin("stand_up_from_belly"), lambda rig: rig.go("Stand")])
def test_it_does_not_get_up_with_a_hot_motor(hot, begin):
    hot.begin("wave")
    lies(hot, 1.5)
    with pytest.raises(RouteError, match="LShoulderPitch is at 85 degrees: let it cool below 75"):
        begin(hot)
    assert hot.player.progress("motion").name == "wave"
    assert hot.player.busy, "what is refused ends nothing"


def test_a_motor_that_gets_hot_ends_the_tries(hot):
    hot.robot.degrees = 74.0
    lies(hot, 1.5)
    hot.begin_posture("Stand")
    hot.let_go(1.0)
    hot.robot.degrees = 75.0
    hot.finish()
    progress = hot.player.progress("posture")
    assert progress.status is ActionStatus.Failed
    assert progress.message == "LShoulderPitch is at 75 degrees: let it cool below 75"


def test_a_hot_motor_keeps_it_from_nothing_else(hot):
    assert hot.go("Crouch").status is ActionStatus.Done
    assert hot.play("wave").status is ActionStatus.Done
