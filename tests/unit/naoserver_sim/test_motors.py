import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from naoserver_sim._motors import SetpointController

PERIOD = 0.01


def make(initial=(0.0, 0.0), max_speeds=(2.0, 2.0)):
    return SetpointController(
        np.array(initial), np.array([-1.0, -1.0]), np.array([1.0, 1.0]), np.array(max_speeds)
    )


def position(motor, target, speed):
    return lambda controller: controller.move(np.array([motor]), np.array([target]), np.array([speed]))


def velocity(motor, value):
    return lambda controller: controller.move(
        np.array([motor]), np.array([math.copysign(math.inf, value)]), np.array([abs(value)])
    )


def run(controller, ticks):
    out = controller.setpoints.copy()
    for _ in range(ticks):
        controller.tick(PERIOD, out)
    return out


def test_setpoint_moves_at_the_speed_of_the_command():
    controller = make()
    position(0, 0.5, 1.0)(controller)
    assert run(controller, 10) == pytest.approx([0.1, 0.0])


def test_setpoint_arrives_exactly_and_rests():
    controller = make()
    position(0, 0.123, 1.0)(controller)
    assert run(controller, 20)[0] == 0.123
    assert run(controller, 20)[0] == 0.123


def test_speed_of_the_motor_limits_that_of_the_command():
    controller = make(max_speeds=(0.5, 0.5))
    position(0, 1.0, 100.0)(controller)
    assert run(controller, 10)[0] == pytest.approx(0.05)


def test_velocity_goes_on_until_the_limit():
    controller = make()
    velocity(0, -1.0)(controller)
    assert run(controller, 50)[0] == pytest.approx(-0.5)
    assert run(controller, 100)[0] == -1.0


def test_velocity_zero_holds_the_setpoint_where_it_is():
    controller = make()
    position(0, 1.0, 1.0)(controller)
    before = run(controller, 10)[0]
    velocity(0, 0.0)(controller)
    assert run(controller, 10)[0] == before


def test_newest_command_of_a_motor_wins():
    controller = make()
    position(0, 1.0, 1.0)(controller)
    velocity(0, -1.0)(controller)
    assert run(controller, 10)[0] == pytest.approx(-0.1)


def test_motors_that_a_command_does_not_name_go_on():
    controller = make()
    position(0, 1.0, 1.0)(controller)
    run(controller, 5)
    position(1, -1.0, 1.0)(controller)
    assert run(controller, 5) == pytest.approx([0.1, -0.05])


numbers = st.floats(-1e6, 1e6)
commands = st.one_of(
    st.builds(position, st.integers(0, 1), numbers, st.floats(0, 1e6)),
    st.builds(velocity, st.integers(0, 1), numbers),
)


@given(st.lists(st.tuples(commands, st.integers(1, 5)), max_size=20))
def test_setpoints_stay_in_range_and_below_the_speed_of_the_motors(program):
    controller = make()
    last = controller.setpoints
    for command, ticks in program:
        command(controller)
        for _ in range(ticks):
            now = run(controller, 1)
            assert np.all(np.abs(now) <= 1.0)
            assert np.all(np.abs(now - last) <= 2.0 * PERIOD + 1e-12)
            last = now
