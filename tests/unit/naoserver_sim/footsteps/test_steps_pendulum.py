"""The pendulum in a step, compared with one that is integrated numerically."""

import pytest

from naoserver_sim._footsteps.steps import Pendulum

PENDULUM = Pendulum(frequency=4.0, double_support=0.06, step_time=0.45)
OLD, NEW = 0.1 - 0.2j, 0.2 + 0.1j


def integrated(point, time):
    """Return where the capture point is at the end of the step."""
    step = 1e-5
    while time < PENDULUM.step_time:
        share = min(time / PENDULUM.double_support, 1.0)
        point += PENDULUM.frequency * (point - (OLD + share * (NEW - OLD))) * step
        time += step
    return point


@pytest.mark.parametrize("time", [0.0, 0.03, 0.2])
def test_it_foretells_the_end_of_a_step(time):
    point = 0.15 + 0.02j
    assert PENDULUM.end(point, time, OLD, NEW) == pytest.approx(integrated(point, time), abs=1e-4)


@pytest.mark.parametrize("time", [0.0, 0.03, 0.2])
def test_it_knows_where_a_step_has_to_begin(time):
    end = PENDULUM.end(0.15 + 0.02j, time, OLD, NEW)
    assert PENDULUM.start(end, time, OLD, NEW) == pytest.approx(0.15 + 0.02j)


def test_with_its_offset_every_step_is_like_the_last():
    width, stride = 0.22, 0.1 + 0.02j
    left, right = 1j * width / 2, -1j * width / 2
    point = right + PENDULUM.offset(width, stride)
    # On the right foot, then on the left one, which goes on by the stride.
    end = PENDULUM.end(point, 0.0, left - stride, right)
    assert end == pytest.approx(left + stride + PENDULUM.offset(-width, stride))
