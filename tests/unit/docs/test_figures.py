"""Pages about robots: their tables, figures, options and files are those of the code."""

from __future__ import annotations

import re
import tomllib

import msgspec
import pytest

from naoserver.bodies import BODY_NAMES, find_body
from naoserver.bodies.footsteps import Footsteps
from naoserver.bodies.parts import Wheels
from naoserver.moves.motion_file import MotionError, load_motions, parse_motion
from naoserver.options import SafetyOptions
from naoserver.protocol.expression import SOUNDS
from naoserver.soccer_field import Field
from naoserver_sim._walk.walker import LIMITS
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
from tests.support.pages import DOCS, blocks_of
from tests.support.places import ROOT
from zenoh_ice import VirtualClock

BODIES, GAINS, MOTIONS, RECORDING, SOUND_PAGE, WALK, WORLDS = (
    (DOCS / f"{page}.md").read_text("utf-8")
    for page in (
        *("reference/bodies", "how-to/gains", "how-to/motions", "how-to/recording"),
        *("how-to/sounds", "how-to/walk", "how-to/worlds"),
    )
)
WORLD, ROBOTS = (block.text for block in blocks_of(WORLDS) if block.language == "toml")
TABLES: dict[str, type[msgspec.Struct]] = {
    "robot": StartPose,
    "carried_balls": CarriedBall,
    "balls": LooseBall,
    "boxes": Box,
    "walls": Wall,
    "field": Field,
    "light": Light,
}


def test_all_bodies_are_listed():
    assert tuple(re.findall(r"^\| `(\w+)` \| [^|]+ \| \d+ \|", BODIES, re.MULTILINE)) == BODY_NAMES


@pytest.mark.parametrize("name", BODY_NAMES)
def test_the_figures_of_a_body_are_its_own(name):
    body = find_body(name)
    row = next(line for line in BODIES.splitlines() if line.startswith(f"| `{name}`"))
    _, _, _, joints, mass, way, _, postures, _ = (cell.strip() for cell in row.split("|"))
    assert int(joints) == len(body.joints)
    assert mass == f"{body.mass:.1f} kg"
    assert postures in (", ".join(body.postures) or "none", str(len(body.postures)))
    if isinstance(body.walk, Wheels):
        assert way == f"wheels: {body.walk.fastest:g} m/s, {body.walk.fastest_turn:g} rad/s"
    if isinstance(body.walk, Footsteps):
        assert way == f"footsteps: {body.walk.limits.forward:g} m/s, {body.walk.limits.turn:g} rad/s"


def test_each_hinge_of_a_humanoid_is_explained():
    explained = set(re.findall(r"`(\w+)`", BODIES.split("## Axes of the hinges")[1].split("##")[0]))
    for name in ("T1", "G1"):
        assert find_body(name).hinges.keys() - {"LeftWrist", "RightWrist"} <= explained


def test_figures_in_the_text_are_those_of_the_code():
    options = SafetyOptions()
    assert f"lasts for {options.gains_timeout:g} s of wall time" in GAINS
    assert f"damped for {options.damping_time:g} s" in GAINS
    limits = f"{LIMITS.forward:g} m/s forwards and back, {LIMITS.left:g} m/s sideways, {LIMITS.turn:g} rad/s"
    assert limits in WALK


def test_all_sounds_are_listed():
    rows = re.findall(r"^\| `(\w+)` \| (.*?) \| ([\d.]+) \|$", SOUND_PAGE, re.MULTILINE)
    assert rows == [(of.name, of.description, f"{of.duration:.2f}") for of in SOUNDS.values()]


@pytest.mark.parametrize(("body", "column"), [("H25", ""), ("T1", r"T1 \| "), ("G1", r"G1 \| ")])
def test_all_motions_are_listed(body, column):
    rows = re.findall(rf"^\| {column}(`.*?`) \| (.*?) \| (.*?) \| ([\d.]+) \|$", MOTIONS, re.MULTILINE)
    reported: dict[str, object] = {
        name: (begin, end, float(seconds))
        for names, begin, end, seconds in rows
        for name in re.findall(r"`(\w+)`", names)
    }
    assert reported == {
        name: (of.start or "any posture", of.end or "as it began", pytest.approx(of.duration, abs=0.06))
        for name, of in load_motions(find_body(body)).items()
    }


def test_the_file_of_a_motion_is_one_and_what_is_wrong_is_reported_as_the_page_says():
    *_, file, error = blocks_of(MOTIONS)
    body = find_body("H25")
    assert parse_motion(file.text, "nod", "nod.toml", body).duration == 1.0
    with pytest.raises(MotionError) as reported:
        parse_motion(file.text.replace("HeadPitch = 0.3", "HeadPitch = 0.9"), "nod", "nod.toml", body)
    assert f"{reported.value}\n" == error.text


def test_the_world_has_every_key_with_its_default():
    assert parse_world(WORLD, "worlds.md").names == ("BallBlue", "Ball", "Crate")
    tables = tomllib.loads(WORLD)
    assert tables.keys() | {"robots"} == {field.name for field in msgspec.structs.fields(World)}
    (place,) = tomllib.loads(ROBOTS)["robots"]
    assert place.keys() == {field.name for field in msgspec.structs.fields(RobotPlace)}
    assert [robot.name for robot in parse_world(ROBOTS, "worlds.md").robots] == ["red1"]
    for name, kind in TABLES.items():
        table = tables[name] if isinstance(tables[name], dict) else tables[name][0]
        assert table.keys() == {field.name for field in msgspec.structs.fields(kind)}
    assert msgspec.convert(tables["field"], Field) == Field()


def test_all_worlds_that_come_along_are_listed():
    assert set(bundled_worlds()) == {"balls", "empty", "soccer", "match", "league", "room"}
    assert re.findall(r"^\| `(\w+)` \|", WORLDS, flags=re.M) == [
        "balls",
        "empty",
        "soccer",
        "match",
        "league",
        "room",
    ]


@pytest.mark.sim
def test_the_world_stands_still():
    clock = VirtualClock()
    robot = SimulatedRobot(clock=clock, skin=False, world=parse_world(WORLD, "worlds.md"))
    before = robot.stage.truth().objects["Crate"].position
    clock.advance(1.0)
    assert robot.stage.truth().objects["Crate"].position == pytest.approx(before, abs=0.002)
    assert not robot.state().fallen
    robot.close()


def test_every_topic_of_a_recording_is_written_and_every_option_is_there():
    writers = ("hfsm_runtime/_recording", "hfsm_runtime/recording_file", "visualhfsm/_monitor")
    sources = "".join(path.read_text("utf-8") for folder in writers for path in (ROOT / folder).glob("*.py"))
    topics = {topic.split("/")[1] for topic in re.findall(r"`(/[a-z]+[^`]*)`", RECORDING)}
    assert [topic for topic in sorted(topics) if f'"/{topic}' not in sources] == []
    for option in ("--from", "--until", "--json", "--record-images", "--record"):
        assert option in RECORDING
