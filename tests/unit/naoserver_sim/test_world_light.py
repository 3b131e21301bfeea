"""The light of a world: what its file says, and what the cameras see of it."""

from contextlib import closing

import mujoco
import numpy as np
import pytest

from naoserver.errors import RobotError
from naoserver_sim.model import build_model
from naoserver_sim.robot import SimulatedRobot
from naoserver_sim.world import bundled_worlds, load_world, parse_world
from tests.support.pages import DOCS
from zenoh_ice import VirtualClock

pytestmark = pytest.mark.sim

BALL = '[[balls]]\nname = "Ball"\nposition = [0.6, 0.1]\n'


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("brightness = -0.1", r"light\.brightness"),
        ("color = [1.0, 2.0, 1.0]", r"light\.color"),
        ("shadow = true", r"light\.shadow: there is no such key"),
        ("direction = [0.0, 0.0, 1.0]", "light: the direction does not go down"),
        ("direction = [0.0, 0.0, 0.0]", "light: the direction does not go down"),
        ("position = [0.0, 0.0, -2.0]", r"light\.position"),
    ],
)
def test_a_mistake_in_the_light_is_reported(text, message):
    with pytest.raises(RobotError, match=message):
        parse_world(f"[light]\n{text}\n", "w.toml")


@pytest.mark.parametrize("name", bundled_worlds())
def test_a_world_without_the_table_has_the_light_of_the_scene(name):
    lit = build_model(load_world(name), skin=False).mj
    scene = mujoco.MjModel.from_xml_path(str(DOCS.parent / "naoserver_sim/scene.xml"))
    assert lit.nlight == scene.nlight == 1
    placed = ("light_poscom0",)  # from the center of mass of the robot and all else
    for field in (field for field in dir(scene) if field.startswith("light_") and field not in placed):
        assert np.array_equal(getattr(lit, field), getattr(scene, field)), field
    for field in ("ambient", "diffuse", "specular", "active"):
        assert np.array_equal(getattr(lit.vis.headlight, field), getattr(scene.vis.headlight, field)), field
    assert np.array_equal(lit.tex("sky").data, scene.tex("sky").data)
    assert not lit.light_castshadow.any()
    assert lit.vis.quality.shadowsize == 0


def pictures(light, camera="Camera"):
    """Return what a camera sees in a world with a ball and a light."""
    world = parse_world(f"{BALL}{light}", "w")
    with closing(SimulatedRobot(clock=VirtualClock(), world=world, skin=False)) as robot:
        return robot.capture(camera, 320, 240).pixels.astype(int)


@pytest.mark.gl
def test_a_dimmer_and_warmer_light_makes_all_of_a_picture_dimmer_and_warmer():
    plain = pictures("[light]\n")
    other = pictures("[light]\nbrightness = 0.35\nambient = 0.2\ncolor = [1.0, 0.8, 0.5]\n")
    red, green, blue = (other / plain.clip(1)).reshape(-1, 3).mean(axis=0)
    assert (red, green, blue) == pytest.approx((0.5, 0.4, 0.25), abs=0.05)
    assert (other <= plain + 1).all()  # the sky, too


@pytest.mark.gl
@pytest.mark.parametrize("source", ["direction = [-0.5, 0.3, -1.0]", "position = [0.5, 0.0, 2.4]"])
def test_shadows_darken_some_of_the_floor_where_the_world_asks_for_them(source):
    without, with_shadows = (pictures(f"[light]\n{source}\nshadows = {on}\n") for on in ("false", "true"))
    darker = (without - with_shadows).min(axis=-1) > 40
    assert 0.0005 < darker.mean() < 0.05
    assert np.abs(without - with_shadows)[:80].max() == 0  # the sky


@pytest.mark.gl
def test_a_lamp_shines_more_on_what_is_near():
    bright = pictures("[light]\nposition = [1.5, 1.0, 1.0]\nambient = 0.1\n").sum(axis=-1)
    assert bright[150:, :80].mean() > 1.2 * bright[150:, 240:].mean()
