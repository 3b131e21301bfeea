"""The walk and its odometry as clients use them: over Zenoh, on a robot without legs."""

import math

import pytest

from interfaces.jderobot import EncodersPrx, InvalidValueException, MotorsPrx
from interfaces.nao import ActionStatus, HealthPrx, JointsPrx, WalkPrx
from naoserver.fake import FakeRobot
from naoserver.fake.robot import LIMITS
from naoserver.options import SafetyOptions, ServerOptions
from tests.support.limits import FOREVER
from tests.support.robot_server import eventually, served, served_to_client, wait_for

PATIENT = ServerOptions(safety=SafetyOptions(velocity_timeout=FOREVER))
"""For tests in which a velocity is to last."""


@pytest.fixture
def nao():
    with served_to_client(FakeRobot(), PATIENT) as nao:
        yield nao


def test_velocities_are_taken_in_si_units_both_ways(nao):
    motors = nao.proxy(MotorsPrx, "Motors")
    assert (motors.setV(0.2), motors.setW(-0.5), motors.setL(0.1)) == (0, 0, 0)
    assert (motors.getV(), motors.getW(), motors.getL()) == pytest.approx((0.2, -0.5, 0.1))


def test_what_is_too_fast_is_limited_and_said_so(nao):
    motors = nao.proxy(MotorsPrx, "Motors")
    assert (motors.setV(2.0), motors.setW(-5.0), motors.setL(1.0)) == (1, 1, 1)
    velocities = (motors.getV(), motors.getW(), motors.getL())
    assert velocities == pytest.approx((LIMITS.forward, -LIMITS.turn, LIMITS.left))


@pytest.mark.parametrize("operation", ["setV", "setW", "setL"])
def test_what_is_not_finite_is_refused_by_name(nao, operation):
    motors = nao.proxy(MotorsPrx, "Motors")
    with pytest.raises(InvalidValueException) as refusal:
        getattr(motors, operation)(math.nan)
    assert refusal.value.field == operation[-1].lower()


def test_the_odometry_reports_where_it_has_got_to_in_calls_and_as_a_stream(nao):
    motors, encoders = nao.proxy(MotorsPrx, "Motors"), nao.proxy(EncodersPrx, "Encoders")
    assert encoders.getEncodersData().robotx == 0.0
    motors.setV(0.3)
    motors.setW(0.9)
    there = wait_for(encoders.getEncodersData, lambda data: data.robottheta > 0.1)
    motors.setV(0.0)
    motors.setW(0.0)
    here = encoders.getEncodersData()
    assert here.robotx > 0.0
    assert here.robottheta >= there.robottheta
    assert (here.robotcos, here.robotsin) == pytest.approx(
        (math.cos(here.robottheta), math.sin(here.robottheta)), abs=1e-6
    )
    assert encoders.getEncodersData() == here


def test_it_walks_to_a_place_and_streams_how_far_it_is(nao):
    walk, encoders = nao.proxy(WalkPrx, "Walk"), nao.proxy(EncodersPrx, "Encoders")
    shares = []
    walk.getWalkState.subscribe(lambda sample: shares.append(sample.value.progress))
    walk.walkTo(0.2, 0.0, 0.5)
    wait_for(walk.getWalkState, lambda state: state.status is ActionStatus.Done)
    there = encoders.getEncodersData()
    assert (there.robotx, there.robottheta) == pytest.approx((0.2, 0.5), abs=0.05)
    eventually(lambda: shares[-1:] == [1.0])
    assert any(0.0 < share < 1.0 for share in shares)


@pytest.mark.parametrize("place", [(math.nan, 0.0, 0.0), (0.0, 101.0, 0.0), (0.0, 0.0, 7.0)])
def test_a_place_out_of_reach_is_refused(nao, place):
    with pytest.raises(InvalidValueException):
        nao.proxy(WalkPrx, "Walk").walkTo(*place)


def test_a_walk_to_a_place_ends_with_its_client():
    with served(FakeRobot(), PATIENT) as server, server.client() as nao:
        walk, motors = nao.proxy(WalkPrx, "Walk"), nao.proxy(MotorsPrx, "Motors")
        with server.client() as other:
            other.proxy(WalkPrx, "Walk").walkTo(5.0, 0.0, 0.0)
            assert motors.getV() > 0.0
        wait_for(walk.getWalkState, lambda state: state.status is ActionStatus.Stopped)
        assert motors.getV() == 0.0


def test_the_legs_of_a_robot_that_walks_are_refused_by_the_name_of_the_walk(nao):
    motors, body = nao.proxy(MotorsPrx, "Motors"), nao.proxy(JointsPrx, "Body")
    motors.setV(0.1)
    with pytest.raises(InvalidValueException, match="LKneePitch is moved by the walk"):
        body.setJointPositions({"LKneePitch": 0.5}, 0.5)
    body.setJointPositions({"HeadYaw": 0.5}, 0.5)
    motors.setV(0.0)

    def moves():
        try:
            body.setJointPositions({"LKneePitch": 0.5}, 0.5)
        except InvalidValueException:
            return False
        return True

    eventually(moves)


def test_to_stop_the_body_stops_the_walk(nao):
    motors = nao.proxy(MotorsPrx, "Motors")
    motors.setV(0.1)
    nao.proxy(JointsPrx, "Body").stop()
    assert motors.getV() == 0.0


def test_a_velocity_that_is_not_renewed_stops_and_is_reported():
    with served_to_client(FakeRobot()) as nao:
        motors = nao.proxy(MotorsPrx, "Motors")
        motors.setV(0.1)
        eventually(lambda: motors.getV() == 0.0)
        report = wait_for(nao.proxy(HealthPrx, "Health").getHealth, lambda report: report.events != [])
        assert report.velocityTimeouts == 1
        assert "not renewed" in report.events[-1].message


def test_the_death_of_a_client_stops_what_it_drove_and_no_more(nao):
    motors = nao.proxy(MotorsPrx, "Motors")
    with nao.client() as other:
        theirs = other.proxy(MotorsPrx, "Motors")
        theirs.setV(0.1)
        motors.setW(0.4)
        assert motors.getV() == pytest.approx(0.1)
    eventually(lambda: motors.getV() == 0.0)
    assert motors.getW() == pytest.approx(0.4)
