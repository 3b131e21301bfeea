"""docs/how-to/worlds.md: its world loads and lists every key with its default, its program runs."""

import re
import tomllib

import msgspec
import pytest

from naoserver.soccer_field.model import Field
from naoserver_sim.robot import SimulatedRobot
from naoserver_sim.world import (
    Box,
    CarriedBall,
    Light,
    LooseBall,
    RobotPlace,
    StartPose,
    Wall,
    World,
    bundled_worlds,
    parse_world,
)
from tests.support.pages import DOCS
from tests.support.robot_server import served
from zenoh_ice import VirtualClock

pytestmark = pytest.mark.sim

PAGE = (DOCS / "how-to/worlds.md").read_text()
TABLES: dict[str, type[msgspec.Struct]] = {
    "robot": StartPose,
    "carried_balls": CarriedBall,
    "balls": LooseBall,
    "boxes": Box,
    "walls": Wall,
    "field": Field,
    "light": Light,
}


def block(language):
    """The first block of a language, and the ones after it."""
    return re.findall(rf"^```{language}\n(.*?)^```", PAGE, flags=re.M | re.S)


def test_its_world_is_one_with_every_key():
    text, robots = block("toml")
    assert parse_world(text, "worlds.md").names == ("BallBlue", "Ball", "Crate")
    tables = tomllib.loads(text)
    assert tables.keys() | {"robots"} == {field.name for field in msgspec.structs.fields(World)}
    (place,) = tomllib.loads(robots)["robots"]
    assert place.keys() == {field.name for field in msgspec.structs.fields(RobotPlace)}
    assert [robot.name for robot in parse_world(robots, "worlds.md").robots] == ["red1"]
    for name, kind in TABLES.items():
        table = tables[name] if isinstance(tables[name], dict) else tables[name][0]
        assert table.keys() == {field.name for field in msgspec.structs.fields(kind)}


def test_its_defaults_of_a_field_are_the_defaults():
    tables = tomllib.loads(block("toml")[0])
    assert msgspec.convert(tables["field"], Field) == Field()


def test_it_names_the_worlds_that_come_along():
    assert set(bundled_worlds()) == {"balls", "empty", "soccer", "match", "room"}
    assert re.findall(r"^\| `(\w+)` \|", PAGE, flags=re.M) == ["balls", "empty", "soccer", "match", "room"]


def test_its_program_runs(monkeypatch, capsys):
    with served(SimulatedRobot(skin=False)) as server:
        monkeypatch.setenv("VISUALHFSM_REALM", server.realm)
        monkeypatch.setenv("VISUALHFSM_CONNECT", server.endpoint)
        exec(compile(block("python")[0], "worlds.md", "exec"), {})
    assert "['BallRed', 'BallGreen']" in capsys.readouterr().out


def test_its_world_stands_still():
    clock = VirtualClock()
    robot = SimulatedRobot(clock=clock, skin=False, world=parse_world(block("toml")[0], "worlds.md"))
    before = robot.stage.truth().objects["Crate"].position
    clock.advance(1.0)
    assert robot.stage.truth().objects["Crate"].position == pytest.approx(before, abs=0.002)
    assert not robot.state().fallen
    robot.close()
