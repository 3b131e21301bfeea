"""Worlds and bodies for viewers without MuJoCo: what they consist of, and that it is where MuJoCo has it."""

import mujoco
import numpy as np
import pytest

from naoserver.soccer_field import Field
from naoserver_sim._stage import describe_world
from naoserver_sim._surroundings import draw_field
from naoserver_sim.model import build_model
from naoserver_sim.world import load_world, parse_world

pytestmark = pytest.mark.sim


def shapes_of(world):
    return describe_world(build_model(world, skin=False))


def test_room_has_its_walls_boxes_and_ball_but_no_robot():
    shapes = shapes_of(load_world("room"))
    kinds = [shape.kind for shape in shapes]
    assert kinds == ["Plane", *["Box"] * 6, "Sphere", "Box", "Box"]
    assert [shape.object for shape in shapes if shape.object] == ["Ball", "CubeBlue", "CubeYellow"]
    crate = shapes[6]
    assert crate.size == (0.25, 0.2, 0.2)
    assert crate.pose.position == (-1.2, -1.4, 0.2)
    assert crate.pose.heading == pytest.approx(0.4)
    assert crate.color == pytest.approx((0.55, 0.45, 0.35), abs=1e-6)


def test_what_stands_firm_stands_where_mujoco_has_it_wherever_the_robot_starts():
    world = parse_world(
        "[robot]\nposition = [2.0, 1.0]\nheading = 1.0\n[[walls]]\nbegin = [0.0, 0.0]\nend = [1.0, 1.0]", "w"
    )
    model = build_model(world, skin=False)
    data = mujoco.MjData(model.mj)
    mujoco.mj_forward(model.mj, data)
    floor, wall = describe_world(model)
    assert floor.pose.position == (0.0, 0.0, 0.0)
    assert wall.pose.position == pytest.approx(data.geom_xpos[1], abs=1e-5)
    turn = np.zeros(4)
    mujoco.mju_mat2Quat(turn, data.geom_xmat[1])
    assert wall.pose.orientation == pytest.approx(turn)


def test_carried_balls_are_where_the_truth_places_them():
    _, red, green = shapes_of(load_world("balls"))
    assert (red.object, green.object) == ("BallRed", "BallGreen")
    assert red.pose.position == green.pose.position == (0.0, 0.0, 0.0)


def test_lines_of_a_field_lie_where_its_picture_is_white():
    field = Field()
    brightness = draw_field(field).mean(axis=2)
    white, grass = brightness > 230, brightness < 90  # and along the edges neither
    height, width = brightness.shape
    scale = width / (field.length + 2 * field.border)
    x = (np.arange(width) + 0.5) / scale - field.length / 2 - field.border
    y = field.width / 2 + field.border - (np.arange(height) + 0.5) / scale
    covered = np.zeros_like(white)
    for shape in shapes_of(parse_world("[field]", "w")):
        (at_x, at_y, at_z), size = shape.pose.position, shape.size
        if shape.kind == "Ring":
            covered |= np.abs(np.hypot(x, y[:, None]) - size[0]) < size[1]
        elif shape.kind == "Box" and at_z == 0.0:
            covered |= (np.abs(x - at_x) < size[0]) & (np.abs(y[:, None] - at_y) < size[1])
    assert white.sum() > 15_000
    assert np.all(covered[white])
    assert not np.any(covered[grass])


def test_goals_are_white_posts_and_a_net_through_which_one_sees():
    shapes = shapes_of(parse_world("[field]", "w"))
    assert [shape.opacity for shape in shapes if shape.kind == "Capsule"] == [1.0] * 6
    assert len([shape for shape in shapes if shape.opacity == pytest.approx(0.35)]) == 6


def test_floor_with_a_texture_has_its_color_on_average():
    assert shapes_of(load_world("empty"))[0].color == pytest.approx((0.75, 0.77, 0.785), abs=0.01)
