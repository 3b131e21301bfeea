"""A robot as the page draws it, from the texts that its server, or any process, describes it with."""

from __future__ import annotations

import base64
import json
import math
from typing import Any

import pytest

from naoserver.bodies import BODY_NAMES, find_body
from naoserver.bodies.description import write_looks
from naoserver.bodies.parts import Joint, Link
from naoserver.body import LARGEST_DESCRIPTION, Body, write_body
from tests.support.drawn import drawn
from visualhfsm._base.errors import VisualHfsmError
from visualhfsm._monitor.realm.description import DescribedRobot, describe, nao
from visualhfsm._monitor.realm.robot import posed_robot

BASE = {"name": "base", "mass": 1.0}
ARM = {"name": "arm", "mass": 1.0}
JOINT = {
    "name": "turn",
    "parent": "base",
    "child": "arm",
    "axis": [0, 0, 1],
    "origin": [0, 0, 0.2],
    "max_velocity": 1.0,
    "max_torque": 1.0,
}
BODY: dict[str, Any] = {"name": "Test", "links": [BASE, ARM], "joints": [JOINT]}
SPHERE = {"link": "arm", "kind": "sphere", "size": [0.1], "color": [1, 0, 0]}
TRIANGLE = {
    "vertices": base64.b64encode(bytes(18)).decode(),
    "indices": base64.b64encode(bytes([0, 0, 1, 0, 2, 0])).decode(),
}


def described(body: object = BODY, looks: object = "") -> DescribedRobot:
    return describe(json.dumps(body), json.dumps(looks) if looks else "")


def page(body: object = BODY, looks: object = "") -> dict[str, Any]:
    found: dict[str, Any] = json.loads(described(body, looks).page)
    return found


@pytest.mark.parametrize("name", BODY_NAMES)
def test_a_body_is_drawn_as_its_server_describes_it(name: str) -> None:
    body, looks = find_body(name), json.loads(write_looks(find_body(name)))
    robot = describe(write_body(body), write_looks(body))
    content = json.loads(robot.page)
    assert (robot.name, robot.title) == (body.name, body.title)
    assert (
        robot.joints
        == set(body.joint_names)
        == {each["joint"] for each in content["links"] if "joint" in each}
    )
    assert [each["name"] for each in content["links"]] == [link.name for link in body.links]
    assert {foot: len(outline) for foot, outline in content["soles"].items()} == {
        sole.link: len(sole.outline) for sole in body.soles
    }
    assert robot.postures == tuple(body.postures)
    assert content["meshes"] == looks["meshes"]
    assert [shape["link"] for shape in content["shapes"]] == [shape["link"] for shape in looks["shapes"]]
    camera = body.cameras[0]
    assert content["eye"] == {"link": camera.link, "position": [*camera.position], "tilt": camera.tilt}


def links_of(*joints: Joint, **parts: Any) -> dict[str, dict[str, Any]]:
    """Return the links of a body with these joints, by name."""
    names = dict.fromkeys(name for joint in joints for name in (joint.parent, joint.child))
    body = Body(name="Test", links=tuple(Link(name=name, mass=1.0) for name in names), **parts)
    return {link["name"]: link for link in drawn(body)["links"]}


def joint(parent: str, child: str, **place: Any) -> Joint:
    facts = {"axis": (0.0, 1.0, 0.0), "origin": (0.0, 0.0, 0.5), "max_velocity": 1.0, "max_torque": 1.0}
    return Joint(**{"name": f"{child} joint", "parent": parent, "child": child, **facts, **place})


def test_a_link_that_is_turned_in_its_parent_says_so() -> None:
    bend = joint("trunk", "thigh", turn=(0.8, 0.0, 0.6, 0.0))
    links = links_of(bend, joints=(bend,))
    assert links["trunk"] == {"name": "trunk"}
    assert links["thigh"] == {
        "name": "thigh",
        "parent": "trunk",
        "origin": [0.0, 0.0, 0.5],
        "turn": [0.0, 0.6, 0.0, 0.8],
        "joint": "thigh joint",
        "axis": [0.0, 1.0, 0.0],
    }


def test_a_link_that_slides_and_one_that_is_fixed_say_so() -> None:
    slide, weld = joint("trunk", "lift", sliding=True), joint("lift", "tray")
    links = links_of(slide, weld, joints=(slide,), fixed_joints=(weld,))
    assert links["lift"]["sliding"] is True
    assert "turn" not in links["lift"]
    assert links["tray"] == {"name": "tray", "parent": "lift", "origin": [0.0, 0.0, 0.5]}


def test_joints_that_slide_are_named_with_their_places() -> None:
    slide = {**JOINT, "name": "lift", "child": "tray", "sliding": True}
    robot = described({**BODY, "links": [BASE, ARM, {"name": "tray", "mass": 1.0}], "joints": [JOINT, slide]})
    assert robot.sliding == ("lift",)
    assert posed_robot({"lift": 0.1}, robot).sliding == ("lift",)


def test_a_robot_of_a_newer_version_is_drawn_by_what_is_known_of_it() -> None:
    newer = {**BODY, "wings": [2.0], "joints": [{**JOINT, "feathers": 3}]}
    looks = {"shapes": [{**SPHERE, "fur": "long"}], "smell": []}
    assert described(newer, looks).page == described(BODY, {"shapes": [SPHERE]}).page


def test_the_same_description_has_the_same_hash() -> None:
    assert described().hash == described().hash != described({**BODY, "title": "Another"}).hash


def test_the_neck_pans_and_tilts_by_the_joints_that_are_named() -> None:
    neck = {"pan": {"joint": "turn", "sign": -1, "zero": 0.5}, "tilt": {"joint": "nod"}}
    tray = {"name": "tray", "mass": 0.0}
    nod = {**JOINT, "name": "nod", "child": "tray"}
    robot = described({**BODY, "links": [BASE, ARM, tray], "joints": [JOINT, nod], "hinges": {"Neck": neck}})
    assert robot.head({"turn": 0.2, "nod": 0.1}) == pytest.approx((0.3, 0.1))
    assert robot.head({"turn": 0.5}) == (0.0, None)
    assert described().head({"turn": 0.2}) == (None, None)


def test_without_looks_the_contact_shapes_are_drawn() -> None:
    capsule = {"link": "arm", "kind": "capsule", "size": [0.02], "ends": [[0.2, 0, 0], [0, 0, 0]]}
    turn = [0.8, 0, 0, 0.6]
    box = {"link": "base", "kind": "box", "size": [0.1, 0.1, 0.05], "position": [0, 0, 0.05], "turn": turn}
    drawn_box, drawn_capsule = page({**BODY, "shapes": [box, capsule]})["shapes"]
    assert (drawn_box["kind"], drawn_box["position"]) == ("box", [0, 0, 0.05])
    assert drawn_box["quaternion"] == [0, 0, turn[3], turn[0]]
    assert drawn_capsule["size"] == pytest.approx([0.02, 0.1, 0.0])
    assert drawn_capsule["position"] == pytest.approx([0.1, 0, 0])
    assert drawn_capsule["quaternion"] == pytest.approx(
        [0, math.sin(math.pi / 4), 0, math.cos(math.pi / 4)], abs=1e-5
    )


def test_a_hull_is_drawn_as_the_box_around_it() -> None:
    hull = {"link": "arm", "kind": "hull", "points": [[0, 0, 0], [0.2, 0, 0], [0, 0.4, 0], [0, 0, -0.6]]}
    (box,) = page({**BODY, "shapes": [hull]})["shapes"]
    assert (box["kind"], box["size"], box["position"]) == ("box", [0.1, 0.2, 0.3], [0.1, 0.2, -0.3])


def test_without_any_shapes_sticks_lead_from_joint_to_joint() -> None:
    shapes = page()["shapes"]
    assert [(shape["link"], shape["kind"]) for shape in shapes] == [
        ("base", "ellipsoid"),
        ("arm", "ellipsoid"),
        ("base", "capsule"),
    ]
    assert shapes[-1]["position"] == [0, 0, 0.1]


def test_a_nao_whose_server_knows_no_looks_is_drawn_as_one() -> None:
    body = find_body("H21")
    shown, usual = json.loads(describe(write_body(body), "").page), json.loads(nao().page)
    assert shown["shapes"] == usual["shapes"]
    assert shown["meshes"] == usual["meshes"]
    assert shown["links"] != usual["links"]  # its hands do not move


def test_a_cart_without_soles_and_a_robot_without_a_camera_have_none() -> None:
    content = page()
    assert content["soles"] == {}
    assert "eye" not in content


@pytest.mark.parametrize(
    "looks",
    [
        {"shapes": [{**SPHERE, "link": "leg"}]},
        {"shapes": [{**SPHERE, "kind": "teapot"}]},
        {"shapes": [{**SPHERE, "size": [-1.0]}]},
        {"shapes": [{**SPHERE, "size": [1e300]}]},
        {"shapes": [{**SPHERE, "color": [2, 0, 0]}]},
        {"shapes": [{**SPHERE, "position": [0, 0]}]},
        {"shapes": [{**SPHERE, "kind": "mesh", "mesh": 1}], "meshes": [TRIANGLE]},
        {"shapes": [], "meshes": [{**TRIANGLE, "vertices": "AAAA"}]},
        {"shapes": [], "meshes": [{**TRIANGLE, "indices": base64.b64encode(bytes([9] * 6)).decode()}]},
        {"shapes": [], "meshes": [{**TRIANGLE, "indices": "<script>"}]},
        {"shapes": [SPHERE] * 5001},
        {"shapes": "all"},
        {"shapes": [SPHERE], "meshUnit": 0.0},
        [[]],
    ],
    ids=range(14),
)
def test_looks_that_cannot_be_drawn_are_replaced(looks: object, caplog: pytest.LogCaptureFixture) -> None:
    assert page(BODY, looks)["shapes"] == page()["shapes"]
    assert "Test is drawn by its contact shapes" in caplog.text


def test_looks_that_are_too_large_are_not_decoded(caplog: pytest.LogCaptureFixture) -> None:
    robot = describe(json.dumps(BODY), " " * (LARGEST_DESCRIPTION + 1))
    assert robot.hash == described().hash
    assert "1048513 characters, and at most 1048512 are read" in caplog.text


@pytest.mark.parametrize(
    "changes",
    [
        {"links": []},
        {"links": [BASE, BASE]},
        {"links": [BASE, ARM, ARM]},
        {"links": [ARM, BASE]},
        {"joints": []},
        {"joints": [{**JOINT, "parent": "arm"}]},
        {"joints": [{**JOINT, "origin": [0, 0, 1e9]}]},
        {"joints": [{**JOINT, "axis": "z"}]},
        {"name": "x" * 65},
        {"soles": [{"link": "foot", "outline": [[0, 0], [1, 0], [1, 1]], "height": 0.1}]},
    ],
    ids=range(10),
)
def test_a_body_that_is_not_sound_is_refused(changes: dict[str, Any]) -> None:
    with pytest.raises(VisualHfsmError, match="the robot's body"):
        described({**BODY, **changes})


@pytest.mark.parametrize(
    ("text", "times"),
    [
        ("", 1),
        ("nothing", 1),
        ("[", 100_000),
        ("NaN", 1),
        (" ", LARGEST_DESCRIPTION + 1),
    ],  # pytest keeps parameters
    ids=range(5),
)
def test_a_text_that_is_no_body_is_refused(text: str, times: int) -> None:
    with pytest.raises(VisualHfsmError, match="the robot's body"):
        describe(text * times, "")
