import sys
import time

import mujoco
import numpy as np
import pytest

from naoserver.errors import RobotError
from naoserver_sim._motors import SetpointController
from naoserver_sim._simulator import Pacer, Physics, SimulationClock, Simulator
from naoserver_sim._stepper import STEPS_PER_TICK
from tests.support.limits import EVENT_LIMIT

pytestmark = pytest.mark.sim

PENDULUM = """
<mujoco>
  <option timestep="0.0025" integrator="implicitfast"/>
  <worldbody><body><joint name="hinge"/><geom size="0.1" pos="0 0 1"/></body></worldbody>
  <actuator><position joint="hinge" kp="100" kv="10" user="100"/></actuator>  <!-- N m for good -->
</mujoco>
"""


@pytest.fixture
def mj():
    return mujoco.MjModel.from_xml_string(PENDULUM)


@pytest.fixture
def data(mj):
    return mujoco.MjData(mj)


def controller():
    return SetpointController(np.zeros(1), np.array([-1.0]), np.array([1.0]), np.array([2.0]))


def move(simulator, target, speed):
    simulator.order(lambda: simulator.setpoints.move(np.array([0]), np.array([target]), np.array([speed])))


def test_time_is_counted_in_ticks(mj, data):
    simulator = Simulator(Physics(mj, data), controller())
    simulator.physics.advance(1_000)
    assert simulator.newest().time == 1_000 * simulator.tick_period  # their sum would be off by 1e-13
    assert simulator.tick_period == pytest.approx(STEPS_PER_TICK * 0.0025)


def test_one_advance_of_many_ticks_equals_many_of_one(mj):
    results = []
    for portions in ([50], [1] * 50, [20, 30]):
        simulator = Simulator(Physics(mj, mujoco.MjData(mj)), controller())
        move(simulator, 0.3, 1.0)
        for portion in portions:
            simulator.physics.advance(portion)
        results.append(simulator.newest())
    assert results[0].qpos == results[1].qpos == results[2].qpos
    assert results[0].setpoints == results[1].setpoints


def test_a_snapshot_stays_as_it_is(mj, data):
    simulator = Simulator(Physics(mj, data), controller())
    before = simulator.newest()
    position = float(before.qpos[0])
    move(simulator, 1.0, 2.0)
    simulator.physics.advance(10)
    assert before.qpos[0] == position
    assert simulator.newest().qpos[0] != position


def test_numbers_that_explode_are_an_error(mj, data, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    simulator = Simulator(Physics(mj, data), controller())
    data.qvel[:] = 1e12
    with pytest.raises(RobotError, match="unstable"):
        simulator.physics.advance(1)
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("error", [RobotError, SystemExit])
def test_a_physics_thread_that_fails_says_why_and_stands_still(mj, data, error, monkeypatch):
    physics = Physics(mj, data)
    paced = SimulationClock(physics, Pacer(1.0))
    if error is SystemExit:
        monkeypatch.setattr(physics, "advance", sys.exit)
    data.qvel[:] = 1e12
    paced.start()
    deadline = time.monotonic() + EVENT_LIMIT
    while paced.failure is None:
        assert time.monotonic() < deadline
        time.sleep(0.01)
    paced.close()
    assert isinstance(paced.failure, error)
    assert paced.rate == 0.0
