"""Several robots in one model, each on its feet at its place."""

import mujoco
import numpy as np
import pytest

from naoserver.bodies import find_body
from naoserver.bodies.parts import Gear, Inertia, Joint, Link, Shape
from naoserver.body import Body
from naoserver.errors import RobotError
from naoserver_sim._together import Placed, stand_together
from naoserver_sim.named_body import named_body
from naoserver_sim.world import StartPose, load_world, parse_world
from tests.support.models import FOLDER
from tests.support.plugins import OWN_ROBOTS

pytestmark = pytest.mark.sim

NAO, T1 = find_body("H25"), find_body("T1")


def place(name, body=NAO, x=0.0, shirt=None):
    return Placed(name, body, StartPose(position=(x, 0.0)), shirt)


def test_a_robot_alone_has_the_model_that_it_always_has():
    (model,), _ = stand_together(load_world("soccer"), [place("one")], None, skin=False)
    assert model.whole is model.mj
    assert not model.others


def test_each_stands_as_it_does_alone():
    robots = [place("one"), place("two", T1, 1.0), place("three", NAO, 2.0)]
    models, data = stand_together(load_world("empty"), robots, None, skin=False)
    for model, robot in zip(models, robots, strict=True):
        (alone,), state = stand_together(load_world("empty"), [robot], None, skin=False)
        assert data.qpos[model.share.qpos][model.robot.qpos] == pytest.approx(state.qpos[alone.robot.qpos])
        assert data.body(model.share.prefix + robot.body.root.name).xpos == pytest.approx(
            state.body(robot.body.root.name).xpos
        )
    assert np.count_nonzero(data.contact.dist < -0.001) == 0


def test_a_shirt_colors_the_trunk():
    robots = [place("one", shirt=(1.0, 0.0, 0.0)), place("two", x=1.0)]
    (first, second), _ = stand_together(load_world("empty"), robots, None, skin=False)
    whole = first.whole
    for model, red in ((first, True), (second, False)):
        trunk = whole.body(model.share.prefix + "torso").id
        colors = whole.geom_rgba[(whole.geom_bodyid == trunk) & (whole.geom_group == 1)]
        assert (colors == (1.0, 0.0, 0.0, 1.0)).all(axis=1).any() == red


@pytest.mark.parametrize(
    ("robots", "world", "message"),
    [
        ([place("red"), place("blue")], "", "red has no room where it starts: it overlaps blue"),
        (
            [place("red"), place("blue", x=2.0)],
            "[[walls]]\nbegin = [2.0, -1.0]\nend = [2.0, 1.0]",
            "blue has no room where it starts: it overlaps something there",
        ),
    ],
)
def test_robots_without_room_are_refused(robots, world, message):
    with pytest.raises(RobotError, match=message):
        stand_together(parse_world(world, "w"), robots, None, skin=False)


def test_the_floor_is_not_in_the_way_of_robots_that_sink_into_it():
    def link(name, mass):
        return Link(name=name, mass=mass, inertia=Inertia(ixx=0.1 * mass, iyy=0.1 * mass, izz=0.1 * mass))

    leg = Joint(
        name="leg", parent="block", child="foot", axis=(0.0, 0.0, 1.0), origin=(0.0, 0.0, -0.2), gear="leg",
        sliding=True, lower=-0.1, upper=0.1, max_velocity=1.0, max_torque=2000.0,
    )  # fmt: skip
    heavy = Body(
        name="heavy",
        links=(link("block", 40.0), link("foot", 1.0)),
        joints=(leg,),
        gears={"leg": Gear(stiffness=50_000.0, damping=1000.0)},
        shapes=(Shape(kind="box", link="foot", size=(0.2, 0.2, 0.02)),),
    )
    (first, *_), data = stand_together(
        load_world("empty"), [place("one", heavy), place("two", heavy, 1.0)], None, skin=False
    )
    floor = first.whole.geom("floor").id
    assert {int(contact.geom1) for contact in data.contact if contact.dist < -0.001} == {floor}


@OWN_ROBOTS
def test_a_mount_holds_its_robot_where_it_was_put():
    rail = named_body(FOLDER / "rail.urdf")
    assert rail.mounted
    models, data = stand_together(
        load_world("empty"), [place("nao"), place("rail", rail, 1.0)], None, skin=False
    )
    mujoco.mj_step(models[0].whole, data, nstep=400)
    base = data.body("rail/" + rail.root.name)
    assert base.xpos[:2] == pytest.approx((1.0, 0.0), abs=0.01)
