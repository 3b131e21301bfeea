"""A robot's share of a model in which others stand."""

import mujoco
import numpy as np
import pytest

from naoserver.bodies import find_body
from naoserver_sim._share import PLACES, STATE, RobotData
from naoserver_sim._surroundings import add_surroundings
from naoserver_sim._together import Placed, stand_together
from naoserver_sim.model import add_robot, new_spec
from naoserver_sim.standing import build_standing
from naoserver_sim.world import StartPose, World, load_world
from tests.support.linkage import LINKAGE

pytestmark = pytest.mark.sim

BODIES = ("H25", "T1", "Cart")


@pytest.fixture(scope="module")
def standing():
    placed = [
        Placed(name, find_body(name), StartPose(position=(1.0 * at, 0.0)), None)
        for at, name in enumerate(BODIES)
    ]
    return stand_together(load_world("soccer"), placed, None, skin=False)


@pytest.mark.parametrize("number", range(len(BODIES)), ids=BODIES)
def test_what_a_robot_finds_in_its_share_is_its_own(standing, number):
    models, data = standing
    model, part = models[number], RobotData(data, models[number].share)
    whole, own, prefix = model.whole, model.mj, model.share.prefix
    for joint in model.body.joint_names:
        assert part.qpos[own.joint(joint).qposadr[0]] == data.joint(prefix + joint).qpos[0]
        motor = own.joint(joint).name if joint in model.body.motors else None
        if motor:
            assert own.actuator(motor).id + whole.actuator(prefix + own.actuator(0).name).id == (
                whole.actuator(prefix + motor).id
            )
    for link in model.body.links:
        assert part.xpos[own.body(link.name).id] == pytest.approx(data.body(prefix + link.name).xpos)
    sensor = own.sensor(own.nsensor - 1)
    there = whole.sensor(prefix + sensor.name)
    begin, size = int(sensor.adr[0]), int(sensor.dim[0])
    wanted = data.sensordata[there.adr[0] : there.adr[0] + size]
    assert part.sensordata[begin : begin + size] == pytest.approx(wanted)


def test_a_part_shows_what_is_written_to_the_whole(standing):
    models, data = standing
    part = RobotData(data, models[1].share)
    part.ctrl[0] = 0.125
    prefix = models[1].share.prefix
    assert data.actuator(prefix + models[1].mj.actuator(0).name).ctrl[0] == 0.125


def compiled(world, body):
    """Return a model as the compiler leaves it."""
    spec = new_spec()
    add_surroundings(spec, world)
    add_robot(spec, world, body, skin=False)
    return spec.compile()


def components(model, data):
    """Return all that MuJoCo integrates from, by the names of the arrays."""
    found = {}
    for name, kind in mujoco.mjtState.__members__.items():
        if kind.value.bit_count() == 1 and kind.value & mujoco.mjtState.mjSTATE_INTEGRATION.value:
            array = name.removeprefix("mjSTATE_").lower().replace("warmstart", "qacc_warmstart")
            found[array] = np.zeros(mujoco.mj_stateSize(model, kind.value))
            mujoco.mj_getState(model, data, found[array], kind.value)
    return found


def test_all_that_is_set_of_a_robot_that_stands_alone_is_on_the_lists_of_what_moves_in():
    states, places = set(), set()
    for body in (*map(find_body, BODIES), LINKAGE):
        model, state = build_standing(World(), None, skin=False, body=body)
        before, after = (components(model.mj, each) for each in (mujoco.MjData(model.mj), state))
        states |= {name for name in after if not np.array_equal(before[name], after[name])}
        fresh = compiled(World(), body)
        arrays = [name for name in dir(fresh) if isinstance(getattr(fresh, name), np.ndarray)]
        places |= {
            name for name in arrays if not np.array_equal(getattr(fresh, name), getattr(model.mj, name))
        }
    assert (states, places) == ({*STATE}, {*PLACES})


def test_a_robot_moves_in_as_it_stands_alone():
    placed = [
        Placed(f"robot {at}", body, StartPose(position=(1.5 * at, 0.0)))
        for at, body in enumerate((find_body("T1"), LINKAGE))
    ]
    models, data = stand_together(World(), placed, None, skin=False)
    for model, robot in zip(models, placed, strict=True):
        _, state = build_standing(World(robot=robot.start), None, skin=False, body=robot.body)
        for array, part in STATE.items():
            if array != "qacc_warmstart":  # which the first step of the whole computes again
                assert getattr(data, array)[getattr(model.share, part)] == pytest.approx(
                    getattr(state, array)
                )
        for array, kind in PLACES.items():
            for row, values in enumerate(getattr(model.mj, array)):
                if name := mujoco.mj_id2name(model.mj, kind, row):
                    there = mujoco.mj_name2id(model.whole, kind, model.share.prefix + name)
                    assert there >= 0
                    assert getattr(model.whole, array)[there] == pytest.approx(values), name
