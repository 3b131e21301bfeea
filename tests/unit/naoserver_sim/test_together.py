"""Several robots in one model, each on its feet at its place."""

import mujoco
import numpy as np
import pytest

from naoserver.bodies import find_body
from naoserver.errors import RobotError
from naoserver_sim._own_body import read_own_body
from naoserver_sim._together import Placed, stand_together
from naoserver_sim.world import StartPose, load_world, parse_world

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


def test_a_mount_holds_its_robot_where_it_was_put(tmp_path):
    file = tmp_path / "arm.urdf"
    file.write_text(ARM)
    arm = read_own_body(file)
    assert arm.mounted
    models, data = stand_together(
        load_world("empty"), [place("nao"), place("arm", arm, 1.0)], None, skin=False
    )
    mujoco.mj_step(models[0].whole, data, nstep=400)
    base = data.body("arm/" + arm.root.name)
    assert base.xpos[:2] == pytest.approx((1.0, 0.0), abs=0.01)


ARM = """
<robot name="arm">
  <link name="world"/>
  <link name="base">
    <inertial><mass value="2"/><inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial>
    <collision><geometry><cylinder radius="0.1" length="0.1"/></geometry></collision>
  </link>
  <joint name="fixed" type="fixed"><parent link="world"/><child link="base"/></joint>
  <link name="link">
    <inertial><mass value="0.5"/><inertia ixx="0.001" iyy="0.001" izz="0.001" ixy="0" ixz="0" iyz="0"/></inertial>
    <collision>
      <origin xyz="0 0 0.2"/><geometry><cylinder radius="0.03" length="0.2"/></geometry>
    </collision>
  </link>
  <joint name="pan" type="revolute">
    <parent link="base"/><child link="link"/><axis xyz="0 0 1"/>
    <limit lower="-1" upper="1" effort="10" velocity="2"/>
  </joint>
</robot>
"""
