"""A robot's share of a model in which others stand."""

import pytest

from naoserver.bodies import find_body
from naoserver_sim._share import Part
from naoserver_sim._together import Placed, stand_together
from naoserver_sim.world import StartPose, load_world

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
    model, part = models[number], Part(data, models[number].share)
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
    part = Part(data, models[1].share)
    part.ctrl[0] = 0.125
    prefix = models[1].share.prefix
    assert data.actuator(prefix + models[1].mj.actuator(0).name).ctrl[0] == 0.125
