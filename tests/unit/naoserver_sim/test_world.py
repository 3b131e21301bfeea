"""Worlds from files: what they contain, and how mistakes in them are reported."""

import contextlib
import math
from functools import cache

import mujoco
import numpy as np
import pytest
from hypothesis import given

from naoserver.errors import RobotError
from naoserver.soccer_field import Field
from naoserver_sim._surroundings import draw_field
from naoserver_sim.model import build_model
from naoserver_sim.world import bundled_worlds, load_world, parse_world, scattered
from tests.support.any_text import any_text

pytestmark = pytest.mark.sim


@pytest.mark.parametrize("name", bundled_worlds())
def test_world_that_comes_along_says_what_it_is(name):
    assert load_world(name).description


def test_worlds_that_come_along():
    assert set(bundled_worlds()) == {"balls", "empty", "league", "match", "room", "soccer"}


def test_world_is_read_from_a_file(tmp_path):
    file = tmp_path / "mine.toml"
    file.write_text('[[balls]]\nname = "Ball"\nposition = [1.0, 0.0]\n')
    assert load_world(str(file)).names == ("Ball",)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("x = 1\ny = !", "w.toml: .*line 2"),
        ("speed = 1", "w.toml:1: speed: there is no such key; there is description, robot"),
        ("[robot]\nposition = [1.0]", r"robot\.position"),
        ('[[balls]]\nname = "ball"\nposition = [0.0, 0.0]', r"balls\[0\]\.name"),
        ('[[balls]]\nname = "A\\n"\nposition = [0.0, 0.0]', r"balls\[0\]\.name"),
        ('[[balls]]\nname = "A"\nposition = [nan, 0.0]', r"balls\[0\]\.position"),
        ('[[balls]]\nname = "A"\nposition = [0.0, 0.0]\nradius = -1.0', r"balls\[0\]\.radius"),
        ('[[boxes]]\nname = "A"\nposition = [0.0, 0.0]', r"w.toml:1: boxes\[0\]: size is missing"),
        ('[[balls]]\nname = "A"\nposition = [0.0, 0.0]\n' * 2, "A appears 2 times"),
        ("[[walls]]\nbegin = [1.0, 1.0]\nend = [1.0, 1.0]", r"walls\[0\]: the wall is shorter"),
        ('[[carried_balls]]\nname = "BallX"\ncolor = [1, 1, 1]\nstart = [0, 9, 1]', "start of BallX: 9"),
        ("[[walls]]\nbegin = [0, 0]\nend = [1, 1]\n" * 101, "more than 100"),
    ],
)
def test_mistake_is_reported_with_its_place(text, message):
    with pytest.raises(RobotError, match=message):
        parse_world(text, "w.toml")


@pytest.mark.parametrize(("content", "times"), [(b"\xff\xfe", 1), (b"#", 1 << 21)])
def test_file_that_is_no_world_is_refused(tmp_path, content, times):
    file = tmp_path / "w.toml"
    file.write_bytes(content * times)
    with pytest.raises(RobotError, match=r"w\.toml"):
        load_world(str(file))


def test_file_that_is_missing_is_reported_with_what_there_is():
    with pytest.raises(
        RobotError, match=r"socer: cannot be read: No such file.*balls, empty, league, match, room, soccer"
    ):
        load_world("socer")


@given(any_text())
def test_no_text_leads_to_another_error(text):
    with contextlib.suppress(RobotError):
        parse_world(text, "w.toml")


def test_scattered_balls_are_the_same_by_the_same_numbers():
    world = load_world("balls")
    first, same, other = (scattered(world, np.random.default_rng(seed)) for seed in (1, 1, 2))
    assert first == same != other


def test_things_touch_the_robot_and_the_floor_and_carried_balls_nothing():
    mj = build_model(load_world("room"), skin=False).mj
    body = mj.body("l_foot").geomadr[0]

    def touches(first, second):
        return bool(mj.geom_contype[first] & mj.geom_conaffinity[second]) or bool(
            mj.geom_contype[second] & mj.geom_conaffinity[first]
        )

    for name in ("Ball", "CubeBlue", "Table"):
        assert touches(mj.body(name).geomadr[0], body)
    assert touches(mj.body("Ball").geomadr[0], mj.geom("floor").id)
    assert not touches(mj.body("Table").geomadr[0], mj.geom("floor").id)
    carried = build_model(skin=False).mj
    assert carried.geom_contype[carried.body("BallRed").geomadr[0]] == 0


def test_spectator_stands_by_the_robot():
    model = build_model(parse_world("[robot]\nposition = [3.0, 1.0]\nheading = 1.5707963", "w"), skin=False)
    data = mujoco.MjData(model.mj)
    mujoco.mj_forward(model.mj, data)
    assert data.camera("CameraOutside").xpos == pytest.approx((3.0 + 1.6, 1.0 + 1.15, 0.75))


class TestField:
    """The picture of a field, with 100 pixels in a metre."""

    FIELD = Field()

    @staticmethod
    @cache
    def image():
        return draw_field(TestField.FIELD).astype(float).mean(axis=2)

    def whiteness(self, x, y):
        """The brightness at a place on the field."""
        scale = self.image().shape[1] / (self.FIELD.length + 2 * self.FIELD.border)
        row = int((self.FIELD.width / 2 + self.FIELD.border - y) * scale)
        column = int((x + self.FIELD.length / 2 + self.FIELD.border) * scale)
        return self.image()[row, column]

    def test_shape_is_that_of_the_field_with_its_border(self):
        height, width = self.image().shape
        assert width / height == pytest.approx(10.4 / 7.4, rel=1e-3)

    @pytest.mark.parametrize(
        ("x", "y"),
        [
            (0.0, 2.0),
            (4.5, 0.0),
            (-4.5, 2.9),
            (1.0, -3.0),
            (0.75 * math.cos(1), 0.75 * math.sin(1)),
            (4.5 - 1.65, 1.0),
            (-(4.5 - 0.6), -0.5),
            (4.5 - 1.0, 2.0),
            (4.5 - 1.3, 0.0),
            (0.0, 0.0),
        ],
    )
    def test_lines_are_white(self, x, y):
        assert self.whiteness(x, y) > 200

    @pytest.mark.parametrize("x", [1.5, -1.5, 4.8, 3.6])
    def test_grass_is_not(self, x):
        assert self.whiteness(x, 0.3) < 120

    def test_line_is_as_wide_as_it_says(self):
        scale = self.image().shape[1] / (self.FIELD.length + 2 * self.FIELD.border)
        row = self.image()[int((self.FIELD.width / 2 + self.FIELD.border - 2.5) * scale)]
        middle = row[len(row) // 2 - 30 : len(row) // 2 + 30]
        grass = np.median(middle)
        assert ((middle - grass) / (245 - grass)).sum() / scale == pytest.approx(0.05, abs=0.005)

    def test_ball_rolls_to_a_stop_as_on_a_carpet(self):
        model = build_model(load_world("soccer"), skin=False)
        data = mujoco.MjData(model.mj)
        ball = model.loose["Ball"]
        data.qpos[ball.qpos : ball.qpos + 3] = -3.0, 2.0, 0.05
        data.qvel[ball.dof], data.qvel[ball.dof + 4] = 1.0, 1.0 / 0.05
        mujoco.mj_step(model.mj, data, nstep=400)
        assert data.qvel[ball.dof] == pytest.approx(1.0 - 0.35, abs=0.05)

    def test_ball_does_not_leave_through_the_net(self):
        model = build_model(load_world("soccer"), skin=False)
        data = mujoco.MjData(model.mj)
        ball = model.loose["Ball"]
        data.qpos[ball.qpos : ball.qpos + 3] = 4.2, 0.0, 0.05
        data.qvel[ball.dof] = 4.0
        mujoco.mj_step(model.mj, data, nstep=400)
        assert 4.5 < data.qpos[ball.qpos] < 5.0
