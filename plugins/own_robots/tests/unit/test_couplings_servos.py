"""The gains of servos of which the model says nothing, and those that it says."""

import math

import mujoco
import pytest

from visualhfsm_own_robots._couplings import Pull, gear_of
from visualhfsm_own_robots._figure import Figure

pytestmark = pytest.mark.sim

ARM = """<mujoco><worldbody><body name="arm" pos="0 0 1">
  <joint name="lift" axis="0 1 0" {joint}/><geom type="sphere" size="0.05" pos="{length} 0 0" mass="{mass}"/>
  </body></worldbody>{more}</mujoco>"""


def gear(torque, *, length=0.5, mass=2.0, joint="", more="", pulls=()):
    model = mujoco.MjModel.from_xml_string(ARM.format(length=length, mass=mass, joint=joint, more=more))
    return gear_of(Figure(model), 0, pulls, torque, mounted=True)


def test_the_weight_of_an_arm_bends_its_servo_by_little():
    assert 9.81 * 2.0 * 0.5 / gear(20.0)["stiffness"] <= 0.01


@pytest.mark.parametrize(
    ("length", "mass", "torque"), [(0.5, 2.0, 20.0), (0.01, 0.01, 1000.0), (2.0, 50.0, 10.0)]
)
def test_no_servo_is_quicker_than_the_physics(length, mass, torque):
    found = gear(torque, length=length, mass=mass)
    inertia = mass * (length**2 + 0.4 * 0.05**2) + found["inertia"]
    assert 10.0 <= math.sqrt(found["stiffness"] / inertia) <= 151.0


def test_a_large_torque_does_not_make_a_light_link_stiff():
    assert gear(1000.0, length=0.01, mass=0.01)["stiffness"] < 30.0


def test_the_gains_of_a_position_servo_are_those_of_the_model_behind_its_gear():
    more = '<actuator><position joint="lift" kp="20" kv="1" gear="3"/></actuator>'
    found = gear(20.0, more=more, pulls=[Pull(0)])
    assert (found["stiffness"], found["damping"]) == (180.0, 9.0)


def test_a_servo_of_the_model_that_cannot_hold_its_joint_does_not_count():
    more = '<actuator><position joint="lift" kp="20" kv="1"/></actuator>'
    assert gear(20.0, more=more, pulls=[Pull(0)]) == gear(20.0)


def test_without_a_torque_there_are_a_spring_and_bearings():
    found = gear(0.0, joint='stiffness="3" springref="30" damping="0.2" frictionloss="0.1" armature="0.05"')
    assert found == pytest.approx(
        {
            "stiffness": 3.0,
            "rest": math.radians(30),
            "friction_damping": 0.2,
            "friction": 0.1,
            "inertia": 0.05,
        }
    )


def test_the_lightest_link_without_a_motor_gets_some_inertia():
    assert gear(0.0, length=0.0, mass=1e-6)["inertia"] == pytest.approx(1e-4, rel=0.01)
