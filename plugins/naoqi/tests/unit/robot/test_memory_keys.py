"""Reading ALMemory: keys in the spelling of the robot, and units."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from naoserver.bodies.nao import H25
from plugins.naoqi.tests.support.scripted import DEVICES, nao_memory
from tests.support.any_text import any_text
from visualhfsm_naoqi.robot._state import MemoryLayout


def read(memory, **changes):
    memory = memory | changes
    layout = MemoryLayout(memory, H25)
    return layout.read([memory[key] for key in layout.keys], time=5.0)


@pytest.mark.parametrize("newer", [True, False])
def test_both_spellings_of_the_inertial_unit_are_understood(newer):
    assert read(nao_memory(newer=newer)).senses.inertial.acceleration == pytest.approx((0.0, 0.0, 9.8))


@pytest.mark.parametrize(
    ("nao6", "force", "rate"),
    [(True, (3.4, 0.4, 9.2), (0.1, 0.2, 0.3)), (False, (3.4, -0.4, 9.2), (0.1, 0.2, -0.3))],
)
def test_the_signs_of_the_inertial_unit_are_those_of_the_generation(nao6, force, rate):
    unit, memory = f"{DEVICES}InertialSensor/", nao_memory()
    for axis, pull, turning in zip("XYZ", (-3.4, -0.4, -9.2), (0.1, 0.2, 0.3), strict=True):
        memory[f"{unit}Accelerometer{axis}/Sensor/Value"] = pull
        memory[f"{unit}Gyroscope{axis}/Sensor/Value"] = turning
    layout = MemoryLayout(memory, H25, nao6=nao6)
    inertial = layout.read([memory[key] for key in layout.keys], time=5.0).senses.inertial
    assert inertial.acceleration == force
    assert inertial.angular_velocity == rate


def test_joints_come_in_the_order_of_the_body():
    measured = read(nao_memory())
    assert measured.joints.positions == tuple(
        H25.postures["StandInit"].angles[name] for name in H25.joint_names
    )
    assert measured.joints.commands == measured.joints.positions
    assert set(measured.joints.stiffnesses) == {1.0}
    assert set(measured.joints.temperatures) == {40.0}


def test_torques_are_what_the_robot_estimates_and_otherwise_none():
    assert set(read(nao_memory()).joints.torques) == {0.0}
    assert read(nao_memory(), **{"Motion/Torque/Sensor/HeadPitch": -0.3}).joints.torques[1] == -0.3


def test_what_presses_on_a_foot_is_a_force():
    feet = read(nao_memory(), **{f"{DEVICES}LFoot/FSR/RearLeft/Sensor/Value": 1.2}).senses
    assert feet.left_foot.rear_left == pytest.approx(1.2 * 9.81)
    assert feet.right_foot.total == pytest.approx(4 * 0.5 * 9.81)


def test_a_foot_that_hangs_presses_with_nothing():
    feet = read(nao_memory(), **{f"{DEVICES}LFoot/FSR/RearLeft/Sensor/Value": -0.1}).senses
    assert feet.left_foot.rear_left == 0.0


@pytest.mark.parametrize(
    ("reported", "distance"), [(0.0, math.inf), (0.7, 0.7), (2.55, 2.55), (5.0, math.inf), (None, math.inf)]
)
def test_the_sonar_reports_what_is_near(reported, distance):
    assert read(nao_memory(), **{f"{DEVICES}US/Left/Sensor/Value": reported}).senses.sonar.left == distance


@pytest.mark.parametrize(
    ("key", "name"),
    [
        ("ChestBoard/Button", "ChestButton"),
        ("Head/Touch/Rear", "HeadRear"),
        ("RHand/Touch/Back", "RHandBack"),
        ("LFoot/Bumper/Left", "LFootBumperLeft"),
    ],
)
def test_touch_sensors_have_the_names_of_the_body(key, name):
    assert read(nao_memory(), **{f"{DEVICES}{key}/Sensor/Value": 1.0}).senses.touched == {name}


def test_a_battery_that_is_charged_is_plugged_in_also_where_no_key_says_so():
    current = f"{DEVICES}Battery/Current/Sensor/Value"
    assert not read(nao_memory()).senses.battery.plugged
    assert read(nao_memory(), **{current: 1.1}).senses.battery.plugged
    assert not read(
        nao_memory(), **{current: 1.1, "BatteryPowerPluggedChanged": False}
    ).senses.battery.plugged


def test_joints_of_one_motor_share_its_values():
    memory = {key: value for key, value in nao_memory().items() if "RHipYawPitch" not in key}
    measured = read(memory, **{f"{DEVICES}LHipYawPitch/Position/Sensor/Value": -0.3})
    assert measured.joints.positions[H25.joint_names.index("RHipYawPitch")] == -0.3


def test_a_robot_without_a_joint_is_reported_by_its_name():
    memory = {key: value for key, value in nao_memory().items() if "/LHand/Position" not in key}
    with pytest.raises(KeyError, match="LHand"):
        MemoryLayout(memory, H25)


def test_what_is_missing_reads_as_at_rest():
    memory = {key: value for key, value in nao_memory().items() if "/Position/" in key}
    senses = read(memory).senses
    assert senses.inertial.acceleration == (0.0, 0.0, 9.81)
    assert senses.touched == frozenset()
    assert math.isnan(senses.battery.charge)


@given(
    st.dictionaries(
        st.integers(0, 120),
        st.none() | st.floats(allow_nan=True) | any_text(max_size=3) | st.booleans() | st.just([]),
        max_size=5,
    )
)
def test_whatever_a_robot_answers_reads_as_numbers_or_is_refused(strange):
    memory = nao_memory()
    layout = MemoryLayout(memory, H25)
    answer = [strange.get(index, memory[key]) for index, key in enumerate(layout.keys)]
    try:
        measured = layout.read(answer, time=0.0)
    except ValueError:
        assert min(strange) < 26, "a joint has no position"
        return
    assert all(
        map(
            math.isfinite,
            (*measured.joints.positions, *measured.joints.commands, *measured.joints.stiffnesses),
        )
    )


def test_an_answer_of_another_length_is_refused():
    layout = MemoryLayout(nao_memory(), H25)
    with pytest.raises(ValueError, match="2 values came"):
        layout.read([0.0, 0.0], time=0.0)


@pytest.mark.parametrize("charge", ["full", [0.8], None])
def test_a_charge_that_is_no_number_is_not_called_empty(charge):
    battery = read(nao_memory(), **{f"{DEVICES}Battery/Charge/Sensor/Value": charge}).senses.battery
    assert math.isnan(battery.charge)


@pytest.mark.parametrize("angle", [1e9, -1e9, 3.2])
def test_an_angle_where_the_joint_cannot_be_is_refused(angle):
    with pytest.raises(ValueError, match=r"LKneePitch is at .*, out of its range"):
        read(nao_memory(), **{f"{DEVICES}LKneePitch/Position/Sensor/Value": angle})
