"""What happens to the robot at the start and the end, by the options."""

from contextlib import closing
from dataclasses import replace

import pytest

from naoserver.errors import HardwareFailure
from naoserver.hardware.connection import CallFailed
from naoserver.options import ServerOptions
from naoserver.serving.assembly import Assembly
from plugins.naoqi.tests.support.scripted import HASTY, ScriptedNaoqi
from visualhfsm_naoqi.robot._robot import Life, LifecycleOptions, NaoEnd, NaoqiRobot, NaoStart

WAKE, REST, STIFFEN = "ALMotion.wakeUp", "ALMotion.rest", "ALMotion.stiffnessInterpolation"
LIFE = "ALAutonomousLife.setState"


@pytest.fixture
def naoqi():
    return ScriptedNaoqi(speed=4.0)


def test_nothing_moves_unless_it_is_wished(naoqi):
    with naoqi.robot():
        pass
    called = {call[0] for call in naoqi.calls}
    assert called.isdisjoint({WAKE, REST, STIFFEN, "ALMotion.setStiffnesses", "ALMotion.setAngles"})


@pytest.mark.parametrize(
    ("start", "call"), [(NaoStart.STAND, (WAKE,)), (NaoStart.STIFFEN, (STIFFEN, "Body", 1.0, 1.0))]
)
def test_the_start(naoqi, start, call):
    with naoqi.robot(LifecycleOptions(start=start)):
        assert call in naoqi.calls


@pytest.mark.parametrize(
    ("end", "call"), [(NaoEnd.REST, (REST,)), (NaoEnd.LIMP, (STIFFEN, "Body", 0.0, 1.0))]
)
def test_the_end(naoqi, end, call):
    with naoqi.robot(LifecycleOptions(end=end)):
        assert call not in naoqi.calls
    assert call in naoqi.calls


def test_a_robot_that_is_still_stopped_does_not_move_for_the_start(naoqi, caplog):
    options = LifecycleOptions(start=NaoStart.STAND)
    with closing(NaoqiRobot(naoqi.connect, options)) as robot:
        robot.lifecycle.is_stopped = lambda: True
        robot.start()
    assert naoqi.called(WAKE) == []
    assert "still stopped: it stays as it is" in caplog.text


def test_a_robot_that_was_stopped_stays_as_it_is_at_the_end(naoqi):
    with naoqi.robot(LifecycleOptions(end=NaoEnd.REST, life=Life.SUSPEND)) as robot:
        assembly = Assembly(robot, ServerOptions(), robot.clock)
        robot.lifecycle.report_to(assembly)
        assembly.gate.stop("a hand in the way")
    assert naoqi.called(REST) == []
    assert naoqi.called(LIFE) == [("disabled",)], "a robot with its own life would move"


@pytest.mark.slow
@pytest.mark.parametrize(("refused", "releases"), [(False, 1), (True, 0)])
def test_the_dead_mans_switch_is_released_only_when_the_robot_has_stopped(naoqi, refused, releases):
    released = []
    if refused:
        naoqi.limits = replace(HASTY, end=0.2)
    with naoqi.robot() as robot:
        robot.report_to_switch(lambda _link: None, lambda: released.append("released"))
        robot.command_velocities({"HeadYaw": 0.5})
        if refused:
            naoqi.answers["ALMotion.changeAngles"] = refuse
        robot.command_velocities({"HeadYaw": 0.0})
    assert len(released) == releases


def test_the_dead_mans_switch_of_a_robot_that_is_lost_is_not_released(naoqi):
    released = []
    with naoqi.robot() as robot:
        robot.report_to_switch(lambda _link: None, lambda: released.append("released"))
        naoqi.lose()
    assert released == []


def test_autonomous_life_is_switched_off_and_stays_off(naoqi):
    with naoqi.robot():
        pass
    assert naoqi.called(LIFE) == [("disabled",)]


def test_autonomous_life_that_is_off_is_left_alone(naoqi):
    naoqi.answers["ALAutonomousLife.getState"] = "disabled"
    with naoqi.robot(LifecycleOptions(life=Life.SUSPEND)):
        pass
    assert naoqi.called(LIFE) == []


def test_autonomous_life_comes_back_as_the_last_thing(naoqi):
    with naoqi.robot(LifecycleOptions(end=NaoEnd.REST, life=Life.SUSPEND)):
        pass
    assert naoqi.called(LIFE) == [("disabled",), ("solitary",)]
    names = [call[0] for call in naoqi.calls]
    assert names.index(REST) < len(names) - 1 - names[::-1].index(LIFE)


def test_autonomous_life_goes_on_where_it_is_wished(naoqi):
    with naoqi.robot(LifecycleOptions(life=Life.LEAVE)):
        assert naoqi.called("ALAutonomousLife.getState") == []


def test_a_robot_without_autonomous_life_is_served(naoqi):
    def missing():
        raise CallFailed("Cannot find service 'ALAutonomousLife' in index")

    naoqi.answers["ALAutonomousLife.getState"] = missing
    with naoqi.robot() as robot:
        assert robot.read().positions


def test_an_end_that_fails_is_reported_and_the_rest_is_done(naoqi, caplog):
    def fail():
        raise CallFailed("ALMotion::rest: the robot hangs in the air")

    naoqi.answers[REST] = fail
    naoqi.answers["ALVideoDevice.getImageRemote"] = "no picture, but a subscription"
    with naoqi.robot(LifecycleOptions(end=NaoEnd.REST)) as robot, pytest.raises(HardwareFailure):
        robot.capture("Camera", 320, 240)
    assert "hangs in the air" in caplog.text
    assert naoqi.called("ALVideoDevice.unsubscribe") == [("handle",)]


def test_another_robot_than_a_nao_is_refused_by_what_it_lacks(naoqi):
    naoqi.memory = {key: value for key, value in naoqi.memory.items() if "HipPitch" not in key}
    naoqi.memory["RobotConfig/Body/Type"] = "pepper"
    robot = NaoqiRobot(naoqi.connect)
    with pytest.raises(HardwareFailure, match="pepper, has no joint LHipPitch, as a Nao H25 has"):
        robot.start()
    robot.close()
    assert naoqi.links[0].lost.is_set(), "the connection is closed"


def test_the_sonar_is_on_while_the_robot_is_served(naoqi):
    with naoqi.robot():
        assert len(naoqi.called("ALSonar.subscribe")) == 1
        assert naoqi.called("ALSonar.unsubscribe") == []
    assert naoqi.called("ALSonar.unsubscribe") == naoqi.called("ALSonar.subscribe")


def refuse(*_arguments):
    raise CallFailed("there is no such service")


def served(naoqi):
    """Return the identities of what is served of a robot."""
    with naoqi.robot() as robot:
        return set(Assembly(robot, ServerOptions(), robot.clock).servants)


def test_all_that_the_robot_has_is_served(naoqi):
    assert {"Sonar", "Camera", "CameraBottom"} <= served(naoqi)


@pytest.mark.parametrize(
    ("without", "missing"),
    [
        ({"ALSonar.subscribe": refuse}, {"Sonar"}),
        ({"ALVideoDevice.hasCamera": lambda index: index == 0}, {"CameraBottom"}),
        (
            {"ALVideoDevice.hasCamera": refuse, "ALVideoDevice.getActiveCamera": refuse},
            {"Camera", "CameraBottom"},
        ),
        ({"ALVideoDevice.hasCamera": refuse, "ALVideoDevice.getActiveCamera": 0}, set()),
    ],
)
def test_what_the_robot_lacks_is_not_served(naoqi, without, missing):
    naoqi.answers |= without
    assert {"Sonar", "Camera", "CameraBottom"} - served(naoqi) == missing
