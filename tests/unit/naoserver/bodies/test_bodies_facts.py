"""Facts files that make no sense are refused with the file and the entry."""

import json
import math

import pytest

from naoserver.bodies.parts import NOWHERE, Axis, InertialUnit, Wheels
from naoserver.body import read_body, read_description
from naoserver.errors import RobotError

FACTS = {
    "name": "arm",
    "links": [{"name": "base", "mass": 1.0}, {"name": "upper", "mass": 1.0}, {"name": "hand", "mass": 1.0}],
    "joints": [
        {
            "name": name, "parent": parent, "child": child, "axis": [0, 1, 0], "origin": [0, 0, 0.1],
            "lower": -1.0, "upper": 1.0, "max_velocity": 1.0, "max_torque": 1.0, "gear": "servo",
        }
        for name, parent, child in (("shoulder", "base", "upper"), ("elbow", "upper", "hand"))
    ],
    "gears": {"servo": {"stiffness": 10, "damping": 1}},
    "tables": [{"independent": "shoulder", "dependent": "elbow", "rows": [[0, -1, 1]]}],
    "groups": {"left_arm": ["shoulder", "elbow"]},
    "hinges": {"LeftElbow": {"roll": {"joint": "elbow"}}},
    "postures": {"Stand": {"stance": "standing", "angles": {"shoulder": 0.0, "elbow": 0.0}}},
    "rest": "Stand",
    "shapes": [{"link": "hand", "kind": "sphere", "size": [0.1]}],
}  # fmt: skip
SONAR = {"left": {"link": "hand"}, "right": {"link": "claw"}, "cone": 1.0, "nearest": 0.1, "farthest": 2.0}
SOLE = {"link": "hand", "outline": [[0, 0], [1, 0], [0, 1]], "height": 0.1}
SHAPE = {"link": "hand", "kind": "sphere", "size": [0.1], "name": "grip"}
TABLE = {"independent": "shoulder", "dependent": "elbow", "rows": [[0, -1, 1]]}
TURNED = {"independent": "elbow", "dependent": "shoulder"}
PAIR = {"leader": "shoulder", "follower": "elbow"}
LOOP = {"first": "base", "second": "hand", "place": [0, 0, 0], "other": [0, 0, -0.2]}
HULL = {"link": "hand", "kind": "hull", "points": [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]}
PLAY = {"delay": 1, "least_backlash": 0.2, "most_backlash": 0.1}
CAMERA = {
    "name": "Camera", "link": "hand", "position": [0, 0, 0], "tilt": 0.0, "horizontal_fov": 1.0,
    "sizes": [[320, 240]], "rates": [30],
}  # fmt: skip
WHEELS = Wheels(left="shoulder", right="elbow", radius=0.1, distance=0.2, fastest=0.1, fastest_turn=1.0)
FOOTSTEPS = {
    "kind": "footsteps", "com_height": 0.6, "width": 0.2, "sole_middle": [0, 0, 0], "sole_half": [0.1, 0.04],
    "lift": 0.05, "limits": {"forward": 0.3, "left": 0.1, "turn": 0.5},
}  # fmt: skip


def changed(path, value):
    """Return the facts with the entry at a path of keys set to a value, or removed for `...`."""
    facts = json.loads(json.dumps(FACTS))
    *way, last = path
    entry = facts
    for key in way:
        entry = entry[key]
    if value is ...:
        del entry[last]
    elif isinstance(entry, list) and last == len(entry):
        entry.append(value)
    else:
        entry[last] = value
    return json.dumps(facts)


def test_facts_that_make_sense_are_read():
    assert read_body(json.dumps(FACTS), "arm.json").joint_names == ("shoulder", "elbow")


@pytest.mark.parametrize(
    ("path", "value", "reported"),
    [
        (("name",), ..., "name"),
        (("links",), ..., "links"),
        (("joints", 0, "axis"), ..., "axis"),
        (("colour",), "red", "colour"),
        (("joints", 1, "speed"), 1.0, "speed"),
        (("links", 3), {"name": "hand", "mass": 1.0}, "link hand: there are two"),
        (("joints", 1, "name"), "shoulder", "joint shoulder: there are two"),
        (("joints", 1, "child"), "upper", "joint elbow: upper is moved by shoulder, too"),
        (("joints", 0, "parent"), "hand", "joint shoulder: upper must come after hand"),
        (("joints", 0, "child"), "base", "joint shoulder: base must come after base"),
        (("joints", 1, "parent"), "claw", "joint elbow: there is no link 'claw'"),
        (("links", 3), {"name": "claw", "mass": 1.0}, "link claw: no joint carries it"),
        (("joints", 0, "lower"), 1.5, "joint shoulder: its range from 1.5 to 1.0 is empty"),
        (("joints", 0, "lower"), math.nan, "joint shoulder: its range from nan to 1.0 is empty"),
        (("joints", 0, "axis"), [0, 1, 1], "joint shoulder: its axis"),
        (("joints", 0, "axis"), [0, 1], "axis"),
        (("joints", 0, "turn"), [1, 1, 0, 0], "joint shoulder: its turn"),
        (("joints", 0, "gear"), "belt", "joint shoulder: there is no gear 'belt'"),
        (("joints", 0, "origin"), [0, math.inf, 0], "joints[0].origin[1] = inf: write m"),
        (("joints", 0, "origin"), [0, 120, 1001], "joints[0].origin[2] = 1001: write m, from -1000 to 1000"),
        (("links", 1, "com"), [math.nan, 0, 0], "links[1].com[0] = nan: write m"),
        (("postures", "Stand", "angles", "elbow"), math.inf, "arm.postures.Stand.angles.elbow is inf"),
        (("hinges", "LeftElbow", "roll", "zero"), math.nan, "arm.hinges.LeftElbow.roll.zero is nan"),
        (("links", 1, "mass"), -1.0, "mass"),
        (("links", 1, "mass"), "heavy", "mass"),
        (("gears", "servo", "stiffness"), 0, "joint shoulder: its gear 'servo' has the stiffness 0"),
        (("tables", 0, "rows"), [], "range table of elbow: no rows"),
        (("tables", 0, "rows"), [[0, 1, -1]], "range table of elbow: empty range at 0"),
        (("tables", 0, "independent"), "wrist", "table: there is no joint 'wrist'"),
        (("kicks",), {"kick": {"x": [0.3, 0.2], "y": [0, 0.1]}}, "kick kick: its x from 0.3 to 0.2 is empty"),
        (("groups", "left_arm"), ["wrist"], "group left_arm: there is no joint 'wrist'"),
        (("groups", "tail"), ["elbow"], "tail"),
        (("hinges", "LeftElbow", "roll", "joint"), "wrist", "hinge LeftElbow: there is no joint 'wrist'"),
        (("hinges", "LeftElbow", "roll", "sign"), 2, "sign"),
        (("hinges", "LeftElbow", "bend"), {"joint": "elbow"}, "bend"),
        (("postures", "Stand", "angles", "elbow"), ..., "posture Stand: no angle of elbow"),
        (("postures", "Stand", "angles", "wrist"), 0.0, "posture Stand: there is no joint 'wrist'"),
        (("postures", "Stand", "stance"), "hanging", "stance"),
        (("rest",), "Sit", "rest: there is no posture 'Sit'"),
        (("shapes", 0, "link"), "claw", "shape: there is no link 'claw'"),
        (("shapes", 0, "kind"), "cone", "kind"),
        (("soles",), [SOLE], "soles: 1 soles"),
        (("soles",), [SOLE | {"outline": [[0, 0], [1, 0]]}] * 2, "outline"),
        (("joints", 0, "max_torque"), -1.0, "joint shoulder: its highest velocity must be above 0, and so must"),
        (("joints", 0, "max_velocity"), -1.0, "joint shoulder: its highest velocity must be above 0"),
        (("joints", 0, "max_torque"), 0.0, "table: shoulder has no motor (max_torque = 0): give it one"),
        (("tables", 0, "dependent"), "shoulder", "table: shoulder is there twice"),
        (("tables", 0, "rows"), [[0, 2, 3]], "range table of elbow: at 0.0 rad it is outside its own range"),
        (("tables", 1), TABLE, "table: elbow depends on shoulder, so it must be in no other table"),
        (("tables", 1), TABLE | TURNED, "table: elbow depends on shoulder, so it must be in no other table"),
        (("couplings",), [PAIR, PAIR], "coupling: elbow depends on shoulder, so it must be in no other coupling"),
        (("couplings",), [PAIR | {"ratio": 0.0}], "coupling of elbow: with the ratio 0 it does not follow"),
        (
            ("couplings",), [PAIR | {"ratio": -2.0, "offset": 0.5}],
            "coupling of elbow: shoulder takes it from -1.5 to 2.5, outside its own range from -1 to 1",
        ),
        (("loops",), [LOOP | {"second": "claw"}], "loop: there is no link 'claw'"),
        (("shapes",), [HULL | {"points": [[0, 0, 0]]}], "a hull of hand: 1 points, at least 4"),
        (("shapes",), [HULL | {"position": [0, 0, 1]}], "a hull of hand: its points say where it is"),
        (("shapes",), [SHAPE | {"points": [[0, 0, 0]]}], "a sphere of hand: only a hull has points"),
        (("groups", "left_arm"), ["elbow", "elbow"], "group left_arm: elbow is there twice"),
        (("groups", "head"), ["elbow"], "groups: elbow is there twice"),
        (("hinges", "LeftElbow", "tilt"), {"joint": "elbow"}, "hinge LeftElbow: elbow is there twice"),
        (("shapes",), [SHAPE, SHAPE], "shape grip: there are two"),
        (("cameras",), [CAMERA, CAMERA], "camera Camera: there are two"),
        (("cameras",), [CAMERA | {"rates": []}], "camera Camera: 1 sizes, but 0 rates"),
        (("cameras",), [CAMERA | {"sizes": [], "rates": []}], "sizes"),
        (("cameras",), [CAMERA | {"sizes": [[320, 0]]}], "write a number of pixels"),
        (("cameras",), [CAMERA | {"horizontal_fov": math.pi}], "write rad above 0, below pi"),
        (("sonar",), SONAR | {"farthest": 0.1}, "sonar: its range from 0.1 to 0.1 m is empty"),
        (("play",), PLAY, "play: its backlash from 0.2 to 0.1 rad is empty"),
        (("sonar",), SONAR, "sonar: there is no link 'claw'"),
        (("walk",), {"kind": "hover"}, "walk"),
        (("walk",), {"kind": "steps"}, "walk: it takes steps, but the body has no soles"),
        (("walk",), FOOTSTEPS, "walk: it takes steps, but the body has no soles"),
    ],
)  # fmt: skip
def test_a_fault_is_refused_with_file_and_entry(path, value, reported):
    with pytest.raises(RobotError) as refused:
        read_body(changed(path, value), "arm.json")
    assert str(refused.value).startswith("arm.json: ")
    assert str(refused.value).count("arm.json") == 1
    assert reported in str(refused.value)


def test_of_a_server_of_a_newer_version_what_is_known_is_read():
    newer = changed(("wings",), [{"span": 2.0}])
    described = json.loads(newer)
    described["joints"][0]["feathers"] = 3
    described["hinges"]["LeftElbow"]["roll"]["oil"] = {"left": 1.0}
    described["inertial_unit"] = {"accelerometer": [0, 0, 0], "gyrometer": [0, 0, 0], "compass": [0, 0, 0]}
    described["walk"] = {
        "kind": "wheels",
        "left": "shoulder",
        "right": "elbow",
        "tires": 2,
        "radius": 0.1,
        "distance": 0.2,
        "fastest": 0.1,
        "fastest_turn": 1.0,
    }
    with pytest.raises(RobotError, match="there is no such key"):
        read_body(json.dumps(described), "arm.json")
    body = read_description(json.dumps(described))
    assert body.joint_names == ("shoulder", "elbow")
    assert body.hinges["LeftElbow"][Axis.ROLL].joint == "elbow"
    assert (body.inertial_unit, body.walk) == (InertialUnit(accelerometer=NOWHERE, gyrometer=NOWHERE), WHEELS)


@pytest.mark.parametrize(
    ("path", "value", "reported"),
    [
        (("walk",), {"kind": "hover"}, "Description: walk"),
        (("links", 1, "name"), ..., "Description: links[1]: name is missing"),
        (("shapes",), [SHAPE | {"link": "claw"}], "Description: shape: there is no link 'claw'"),
    ],
)
def test_of_what_a_server_describes_a_fault_is_one_sentence(path, value, reported):
    with pytest.raises(RobotError) as refused:
        read_description(changed(path, value))
    assert str(refused.value).startswith(reported)


def test_a_doubled_key_is_refused():
    text = json.dumps(FACTS).replace('"rest":', '"rest": "Sit", "rest":')
    with pytest.raises(RobotError, match=r"^arm\.json: 'rest' is there twice$"):
        read_body(text, "arm.json")


def test_a_key_that_is_not_printable_is_refused():
    text = json.dumps(FACTS).replace('"rest":', rf'"{"x" * 59}\n{"y" * 9}": 1, "rest":')
    with pytest.raises(RobotError) as refused:
        read_body(text, "arm.json")
    assert str(refused.value) == rf"arm.json: the key '{'x' * 59}\n' is not printable"


@pytest.mark.parametrize("text", ["", "{", "[]", "null", "3", "[" * 100_000, b"\xff\xfe"])
def test_a_file_that_is_no_description_is_refused(text):
    with pytest.raises(RobotError, match=r"^arm\.json"):
        read_body(text, "arm.json")
