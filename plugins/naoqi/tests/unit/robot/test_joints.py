"""Joint commands as NAOqi gets them."""

from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from naoserver.bodies.nao import H25
from naoserver.hardware.connection import CallFailed
from plugins.naoqi.tests.support.scripted import PATIENT, ScriptedNaoqi
from tests.support.limits import FOREVER
from tests.support.robot_server import eventually
from tests.support.waiting import at_once
from visualhfsm_naoqi.robot._moves import Order, calls_of

SET, CHANGE = "ALMotion.setAngles", "ALMotion.changeAngles"
FULL = {joint.name: joint.max_velocity for joint in H25.joints}


@pytest.fixture
def naoqi():
    return ScriptedNaoqi(PATIENT)


def test_joints_of_one_speed_go_in_one_call():
    orders = {"HeadYaw": Order(0.5, 0.2), "HeadPitch": Order(0.1, 0.2), "LHand": Order(1.0, 0.3)}
    assert calls_of(orders) == [
        (SET, ["HeadYaw", "HeadPitch"], [0.5, 0.1], 0.2),
        (SET, ["LHand"], [1.0], 0.3),
    ]


def test_what_is_held_stays_where_the_robot_has_it():
    assert calls_of({"HeadYaw": Order()}) == [(CHANGE, ["HeadYaw"], [0.0], 0.1)]


@given(
    st.dictionaries(
        st.sampled_from(H25.joint_names),
        st.builds(Order, st.none() | st.floats(-2.0, 2.0), st.floats(0.0, 2.0)),
        min_size=1,
    )
)
def test_every_order_is_carried_out_once_and_no_faster_than_asked_for(orders):
    calls = calls_of(orders)
    assert sorted(joint for _, joints, _, _ in calls for joint in joints) == sorted(orders)
    assert sum(call[0] == SET for call in calls) <= 70  # steps of a tenth from the slowest to full speed
    for method, joints, values, fraction in calls:
        assert 0.0 < fraction <= 1.0
        for joint, value in zip(joints, values, strict=True):
            order = orders[joint]
            if method == CHANGE:
                assert (order.target, value) == (None, 0.0)
            else:
                assert value == order.target
                assert fraction <= max(order.fraction, 0.002) * (1 + 1e-9)
                assert fraction >= min(1.0, order.fraction) / 1.11


def test_a_command_goes_out_at_once_as_a_fraction_of_the_joints_speed(naoqi):
    with naoqi.robot() as robot:
        robot.command_positions({"HeadYaw": 0.5}, {"HeadYaw": 0.25 * FULL["HeadYaw"]})
        assert naoqi.called(SET) == [(["HeadYaw"], [0.5], pytest.approx(0.25))]


def test_a_velocity_goes_to_the_limit_and_zero_holds(naoqi):
    with naoqi.robot() as robot:
        robot.command_velocities({"HeadYaw": -0.5 * FULL["HeadYaw"]})
        robot.command_velocities({"HeadYaw": 0.0})
        assert naoqi.called(SET) == [(["HeadYaw"], [H25.joints[0].lower], pytest.approx(0.5))]
        assert naoqi.wait_for_call(CHANGE) == (["HeadYaw"], [0.0], 0.1)


def test_the_setpoint_is_known_before_the_robot_reports_it(naoqi):
    with naoqi.robot() as robot:
        before = robot.read().commands[0]
        robot.command_velocities({"HeadYaw": 1.0})
        eventually(lambda: robot.read().commands[0] > before + 0.02)


def test_a_joint_that_is_where_it_is_sent_to_is_not_sent(naoqi):
    with naoqi.robot() as robot:
        robot.command_positions({"HeadYaw": robot.read().commands[0]}, {"HeadYaw": 1.0})
        assert naoqi.called(SET) == []


def test_of_what_comes_while_the_robot_is_busy_the_newest_counts(naoqi):
    naoqi.held.add(SET)
    with naoqi.robot() as robot:
        for target in (0.1, 0.2, 0.3, 0.4):
            robot.command_positions({"HeadYaw": target}, {"HeadYaw": FULL["HeadYaw"]})
        assert [call[1] for call in naoqi.called(SET)] == [[0.1]]
        naoqi.let_go(SET)
        assert naoqi.wait_for_call(SET, 2)[1] == [0.4]


def test_stiffness_changes_at_once_or_slowly(naoqi):
    with naoqi.robot() as robot:
        robot.command_stiffnesses({"HeadYaw": 0.0, "HeadPitch": 0.5}, 0.0)
        assert naoqi.wait_for_call("ALMotion.setStiffnesses") == (["HeadYaw", "HeadPitch"], [0.0, 0.5])
        robot.command_stiffnesses({"HeadYaw": 1.0, "HeadPitch": 1.0}, 2.0)
        assert naoqi.wait_for_call("ALMotion.stiffnessInterpolation") == (
            ["HeadYaw", "HeadPitch"],
            [[1.0], [1.0]],
            [[2.0], [2.0]],
        )


def test_of_slow_changes_of_stiffness_that_overlap_the_newest_counts(naoqi):
    slowly = "ALMotion.stiffnessInterpolation"
    naoqi.held.add(slowly)
    with naoqi.robot() as robot:
        robot.command_stiffnesses({"HeadYaw": 1.0, "HeadPitch": 1.0}, 0.5)
        robot.command_stiffnesses({"HeadYaw": 0.0}, 0.1)  # NAOqi may run the two in either order
        naoqi.wait_for_call(slowly, 2)
        assert naoqi.called("ALMotion.setStiffnesses") == []
        naoqi.let_go(slowly)
        assert naoqi.wait_for_call("ALMotion.setStiffnesses") == (["HeadYaw"], [0.0])


def test_a_refusal_is_reported_once_and_the_next_command_goes_out(naoqi, caplog):
    def refuse(*_arguments):
        raise CallFailed("ALMotion::setAngles: the joint is hot")

    naoqi.answers[SET] = refuse
    with naoqi.robot() as robot:
        for target in (0.1, 0.2, 0.3):
            robot.command_positions({"HeadYaw": target}, {"HeadYaw": FULL["HeadYaw"]})
            eventually(lambda: robot._commands.orders.idle)
    assert caplog.text.count("the joint is hot") == 1
    assert len(naoqi.called(SET)) == 3


HOLD = "ALMotion.changeAngles"


def refuse_first(naoqi, operation):
    """Let the first call of an operation be refused."""

    def answer(*_arguments):
        if len(naoqi.called(operation)) == 1:
            raise CallFailed(f"{operation}: busy")

    naoqi.answers[operation] = answer


@pytest.mark.slow
def test_a_hold_that_is_refused_is_repeated(naoqi, caplog):
    refuse_first(naoqi, HOLD)
    with naoqi.robot() as robot:
        robot.command_velocities({"HeadYaw": 0.5, "LElbowYaw": 0.5})
        robot.command_velocities({"HeadYaw": 0.0})
        assert naoqi.wait_for_call(HOLD, 2)[0] == ["HeadYaw"]
        eventually(lambda: robot._commands.orders.idle)
    assert len(naoqi.called(HOLD)) == 2
    assert "a stop (joints) is repeated until the robot carries it out" in caplog.text


@at_once
def test_a_hold_waits_for_no_unanswered_call_and_is_repeated_after_it(naoqi):
    naoqi.limits = replace(naoqi.limits, answer=FOREVER)
    naoqi.held.add(SET)
    with naoqi.robot() as robot:
        robot.command_positions({"HeadYaw": 0.7}, {"HeadYaw": FULL["HeadYaw"]})
        robot.command_velocities({"HeadYaw": 0.0})
        robot.command_velocities({"HeadYaw": 0.0})
        assert [call[0] for call in naoqi.called(HOLD)] == [["HeadYaw"]]
        naoqi.let_go(SET)
        assert naoqi.wait_for_call(HOLD, 2)[0] == ["HeadYaw"]
        eventually(lambda: robot._commands.orders.idle)


def test_a_hold_that_is_refused_does_not_undo_a_newer_command(naoqi):
    refuse_first(naoqi, HOLD)
    naoqi.held.add(HOLD)
    with naoqi.robot() as robot:
        robot.command_velocities({"HeadYaw": 0.5, "LElbowYaw": 0.5})
        robot.command_velocities({"HeadYaw": 0.0, "LElbowYaw": 0.0})
        naoqi.wait_for_call(HOLD)
        robot.command_positions({"HeadYaw": 0.7}, {"HeadYaw": FULL["HeadYaw"]})
        naoqi.let_go(HOLD)
        assert naoqi.wait_for_call(HOLD, 2)[0] == ["LElbowYaw"]
        eventually(lambda: robot._commands.orders.idle)
        assert naoqi.called(SET)[-1][:2] == (["HeadYaw"], [0.7])


@pytest.mark.slow
def test_a_robot_that_is_closed_before_it_has_stopped_is_stopped_first(naoqi):
    refuse_first(naoqi, HOLD)
    with naoqi.robot() as robot:
        robot.command_velocities({"HeadYaw": 0.5})
        robot.command_velocities({"HeadYaw": 0.0})
    assert len(naoqi.called(HOLD)) == 2
