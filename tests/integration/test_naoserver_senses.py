"""The senses of a served robot over the wire."""

import math
from dataclasses import replace

import pytest

from interfaces.nao import BatteryPrx, FootPressurePrx, InertialUnitPrx, SonarPrx, TouchPrx
from naoserver.bodies.capabilities import BatteryReading, FootReading, InertialReading, SonarReading
from naoserver.bodies.nao import H25
from naoserver.fake import FakeRobot
from tests.support.robot_server import served_to_client, wait_for


@pytest.fixture(scope="module")
def client():
    with served_to_client(FakeRobot()) as client:
        yield client


def test_the_inertial_unit(client):
    unit = client.proxy(InertialUnitPrx, "InertialUnit")
    client.robot.senses.feel(
        inertial=InertialReading(
            acceleration=(1.0, 2.0, 3.0), angular_velocity=(0.1, 0.2, 0.3), roll=0.4, pitch=-0.5
        )
    )
    called = unit.getInertialReading()
    streamed = wait_for(unit.getInertialReading, lambda reading: reading.roll == 0.4)
    for reading in (called, streamed):
        assert (reading.acceleration.x, reading.acceleration.y, reading.acceleration.z) == (1.0, 2.0, 3.0)
        angular = reading.angularVelocity
        assert (angular.x, angular.y, angular.z, reading.pitch) == (0.1, 0.2, 0.3, -0.5)
    assert called.time <= streamed.time


def test_the_feet_with_their_centers_of_pressure(client):
    feet = client.proxy(FootPressurePrx, "FootPressure")
    client.robot.senses.feel(
        left_foot=FootReading(3.0, 0.0, 1.0, 0.0), right_foot=FootReading(0.0, 0.0, 0.0, 0.0)
    )
    reading = wait_for(feet.getFeetReading, lambda reading: reading.left.total == 4.0)
    front, rear = (H25.soles[0].pressure[sensor] for sensor in ("FrontLeft", "RearLeft"))
    assert reading.left.frontLeft == 3.0
    assert reading.left.rearLeft == 1.0
    assert reading.left.centerX == pytest.approx((3 * front[0] + rear[0]) / 4)
    assert reading.left.centerY == pytest.approx((3 * front[1] + rear[1]) / 4)
    assert (reading.right.total, reading.right.centerX, reading.right.centerY) == (0.0, 0.0, 0.0)


def test_the_sonar_also_when_it_hears_nothing(client):
    sonar = client.proxy(SonarPrx, "Sonar")
    client.robot.senses.feel(sonar=SonarReading(left=0.7))
    reading = wait_for(sonar.getSonarReading, lambda reading: reading.left == 0.7)
    assert reading.right == math.inf
    limits, facts = sonar.getSonarLimits(), H25.sonar
    assert facts is not None
    assert 0.0 < limits.nearest < limits.farthest
    assert limits.cone == pytest.approx(facts.cone)


def test_what_is_touched_in_the_order_of_the_names(client):
    touch = client.proxy(TouchPrx, "Touch")
    assert touch.getTouchReading().touched == []
    client.robot.senses.feel(touched=frozenset({"RFootBumperLeft", "ChestButton"}))
    reading = wait_for(touch.getTouchReading, lambda reading: len(reading.touched) == 2)
    assert reading.touched == ["ChestButton", "RFootBumperLeft"]
    assert {"HeadFront", "LHandBack", "LFootBumperRight"} < set(touch.getTouchNames())


def test_the_battery(client):
    battery = client.proxy(BatteryPrx, "Battery")
    full = BatteryReading(charge=1.0, current=0.2, temperature=21.0, plugged=True)
    client.robot.senses.feel(battery=full)
    reading = wait_for(battery.getBatteryReading, lambda reading: reading.plugged)
    assert (reading.charge, reading.current, reading.temperature) == (1.0, 0.2, 21.0)
    client.robot.senses.feel(battery=replace(full, charge=0.5))
    wait_for(battery.getBatteryReading, lambda reading: reading.charge == 0.5)
