"""The pressure under the feet, compared with the robot's weight, motion and center of mass."""

import mujoco
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from naoserver.bodies.nao import H25
from naoserver.bodies.parts import CORNERS
from naoserver_sim._senses.record import SensorRecord, SoleSensors
from tests.support.physics import GRAVITY, Lab, loose_parts

pytestmark = pytest.mark.sim

WEIGHT = -GRAVITY[2] * sum(link.mass for link in H25.links)


@pytest.mark.parametrize("posture", ["StandInit", "StandZero", "Stand"])
def test_standing_still_they_carry_the_weight_below_the_center_of_mass(posture):
    lab = Lab(H25.postures[posture].angles)
    lab.step(800)
    left, right = lab.record.feet()
    assert left.total + right.total == pytest.approx(WEIGHT, rel=0.005)
    assert (left.total, right.total) == pytest.approx(lab.record.loads())
    center = np.zeros(2)
    for side, foot in (("left", left), ("right", right)):
        body = lab.data.body(f"{side[0]}_foot")
        for name, force in zip(CORNERS, _four(foot), strict=True):
            place = body.xpos + body.xmat.reshape(3, 3) @ H25.soles[side == "right"].pressure[name]
            center += force * place[:2] / (left.total + right.total)
    assert center == pytest.approx(lab.center_of_mass()[:2], abs=0.003)


def test_while_it_moves_they_carry_what_moves_it():
    lab = Lab()
    step = lab.mj.opt.timestep
    parts = (("HipPitch", -1.0), ("KneePitch", 2.0), ("AnklePitch", -1.0))
    motors = [(lab.mj.actuator(side + name).id, part) for side in "LR" for name, part in parts]
    start = lab.data.ctrl.copy()
    loads, heights = [], []
    for at in range(240):
        for motor, part in motors:  # it bobs up and down
            lab.data.ctrl[motor] = start[motor] + part * 0.1 * np.sin(at * step * 12)
        heights.append(lab.center_of_mass()[2])
        lab.step()
        loads.append(sum(lab.record.loads()))
    # Over twenty steps: the sum of the forces is what the momentum changed by, and the weight.
    speeds = np.diff(heights) / step
    momentum = (speeds[40::20] - speeds[20:-20:20]) * WEIGHT / -GRAVITY[2]
    means = [np.mean(loads[first + 1 : first + 21]) for first in range(20, 20 + 20 * len(momentum), 20)]
    assert means == pytest.approx(WEIGHT + momentum / (20 * step), abs=1.0)
    assert max(means) - min(means) > 3.0  # it did bob


def test_in_the_air_they_carry_nothing():
    lab = Lab()
    lab.lift(0.5)
    lab.step(4)
    assert lab.record.loads() == (0.0, 0.0)
    assert all(_four(foot) == (0.0, 0.0, 0.0, 0.0) for foot in lab.record.feet())


def test_leaning_to_a_side_moves_the_load_there():
    lab = Lab()
    before = lab.record.loads()
    for name in ("LHipRoll", "RHipRoll", "LAnkleRoll", "RAnkleRoll"):
        sign = 1.0 if "Hip" in name else -1.0
        lab.data.ctrl[lab.mj.actuator(name).id] += sign * 0.15  # the hips go to the right
    lab.step(300)
    left, right = lab.record.loads()
    assert right > before[1] + 3.0
    assert left + right == pytest.approx(WEIGHT, rel=0.02)


@given(
    load=st.floats(0.1, 200.0),
    forward=st.floats(-0.029, 0.070),
    leftward=st.floats(-0.019, 0.0299),
)
def test_their_center_is_that_of_the_foot(load, forward, leftward):
    four = _pressures(load, forward, leftward)
    assert sum(four) == pytest.approx(load)
    center = sum(
        force / load * np.array(H25.soles[0].pressure[name][:2])
        for name, force in zip(CORNERS, four, strict=True)
    )
    assert center == pytest.approx([forward, leftward], abs=0.0005)


@given(load=st.floats(0.1, 200.0), forward=st.floats(-0.2, 0.2), leftward=st.floats(-0.1, 0.1))
def test_wherever_it_is_they_carry_the_load_and_never_pull(load, forward, leftward):
    four = _pressures(load, forward, leftward)
    assert sum(four) == pytest.approx(load)
    assert min(four) >= 0.0


def test_a_foot_on_a_block_and_one_on_the_floor_feel_alike():
    """The sign does not depend on which of the two that touch MuJoCo counts first."""
    step = 0.05
    mj = loose_parts((np.array([0.02, -0.1, step / 2]), np.array([0.2, 0.08, step / 2]))).compile()
    data = mujoco.MjData(mj)
    data.qpos[7 + 2] += step
    mujoco.mj_step(mj, data, nstep=400)
    pairs = [contact.geom.tolist() for contact in data.contact[: data.ncon]]
    feet = {mj.body(f"{side}_foot").geomadr[0] for side in "lr"}
    assert {pair.index(foot) for pair in pairs for foot in feet if foot in pair} == {0, 1}
    assert SensorRecord(mj, H25, data).loads() == pytest.approx((9.81, 9.81), rel=0.01)


def _pressures(load, forward, leftward):
    """Return what the left sole's sensors feel of a force straight down at a point of a level sole."""
    down = [0.0, 0.0, -load]
    level = [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0]
    return SoleSensors(H25.soles[0]).pressures(
        [*down, 0.0, 0.0, 0.0, forward + 0.3, leftward + 0.2, 0.01, 0.3, 0.2, 0.01, *level]
    )


def _four(foot):
    return (foot.front_left, foot.front_right, foot.rear_left, foot.rear_right)
