"""The robot's lamps have the colors of its lights."""

from contextlib import closing

import numpy as np
import pytest

from naoserver.bodies.looks import look_of
from naoserver.bodies.nao import H25
from naoserver_sim.appearance import Lamps, lamp_material
from naoserver_sim.model import build_model
from naoserver_sim.robot import SimulatedRobot
from tests.support.looks import COLORS, model_of
from zenoh_ice import VirtualClock

pytestmark = pytest.mark.sim

START = {name: lamp.start for name, lamp in H25.lights.items()}


def test_every_group_of_lights_has_lamps_on_the_shell():
    mj = build_model().mj
    for light in START:
        material = mj.material(lamp_material(light)).id
        assert (mj.geom_matid == material).any(), light


def test_lamps_take_their_colors_and_only_theirs():
    mj = build_model().mj
    colors = START.copy()
    lamps = Lamps(mj, lambda: colors)
    eyes = [mj.material(lamp_material(f"{side}Eye")) for side in ("Left", "Right")]
    before = np.array(eyes[1].rgba)
    colors["LeftEye"] = (1.0, 0.0, 0.0)
    lamps.show()
    red, green, blue, _ = eyes[0].rgba
    assert red > 2 * max(green, blue)
    assert eyes[1].rgba == pytest.approx(before)


@pytest.mark.parametrize("light", [(1.0, 1.0, 1.0), (0.0, 0.0, 1.0), (0.5, 0.2, 0.0)])
def test_a_brighter_light_shines_more(light):
    dim = tuple(value / 2 for value in light)
    assert look_of(light).emission > look_of(dim).emission > look_of((0.0, 0.0, 0.0)).emission == 0.0
    assert all(0.0 <= value <= 1.0 for value in look_of(light).color)


def test_lights_without_lamps_change_nothing_that_is_seen():
    mj = model_of("booster_t1")
    colors, emissions = mj.mat_rgba.copy(), mj.mat_emission.copy()
    Lamps(mj, lambda: dict.fromkeys(("LeftEye", "Chest"), (1.0, 0.0, 0.0))).show()
    assert np.array_equal(mj.mat_rgba, colors)
    assert np.array_equal(mj.mat_emission, emissions)


@pytest.mark.parametrize(
    ("name", "light"), [("booster_t1", "Head"), ("unitree_g1", "Head"), ("cart", "Ring")]
)
def test_lamps_of_other_robots_shine_in_the_color_after_the_start_and_then_in_another(name, light):
    mj = model_of(name)
    lamp = mj.material(lamp_material(light))
    assert lamp.rgba[:3] == pytest.approx(look_of(COLORS[light]).color)
    assert (mj.geom_matid == lamp.id).any()
    Lamps(mj, lambda: {light: (0.0, 1.0, 0.0)}).show()
    red, green, blue, _ = lamp.rgba
    assert green > 2 * max(red, blue)
    assert lamp.emission > 0.5


@pytest.mark.gl
def test_a_camera_sees_the_lights_change():
    with closing(SimulatedRobot(clock=VirtualClock())) as robot:
        before = np.asarray(robot.capture("CameraOutside", 640, 480).pixels).astype(int)
        for eye in ("LeftEye", "RightEye"):
            robot.lights.set(eye, (1.0, 0.0, 0.0), 0.0)
        after = np.asarray(robot.capture("CameraOutside", 640, 480).pixels).astype(int)
    assert 0 < (np.abs(after - before).max(axis=-1) > 40).sum() < 500
