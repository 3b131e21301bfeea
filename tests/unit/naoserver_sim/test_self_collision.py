"""Tables against self-collision are found from the shapes of a body, and keep them apart."""

import json
import math
import subprocess
import sys

import pytest

from naoserver.bodies import find_body
from naoserver.body import read_body
from naoserver.errors import RobotError
from naoserver_sim.self_collision import MARGIN, BodyShapes, app, find_table, limb_pairs
from tests.support.commands import run_here
from tests.support.limits import RUN_LIMIT
from tests.support.present import present

pytestmark = pytest.mark.sim

RADIUS, LENGTH, HEIGHT = 0.05, 1.0, 0.3
ROUND = {"ixx": 0.01, "iyy": 0.01, "izz": 0.01}
PLATE = {"link": "base", "kind": "box", "size": [2.0, 2.0, 0.05], "position": [0.0, 0.0, -0.05]}
POST = {"link": "base", "kind": "box", "size": [0.1, 0.1, 0.5], "position": [0.6, 0.0, 0.5]}
LIMIT = math.asin((HEIGHT - RADIUS - MARGIN) / LENGTH)
"""The angle at which the end of the arm is so near to the plate."""


def crane(obstacle, posture=None, inertia=ROUND):
    """Return a body with an arm that yaws above an obstacle and pitches down to it; with a wrist, if it has one."""
    posture = posture or {"yaw": 0.0, "pitch": 0.0}
    names, links = list(posture), ["base", "mast", "jib", "claw"][: len(posture) + 1]
    axes = {"yaw": [0, 0, 1], "pitch": [0, 1, 0], "wrist": [0, 1, 0]}
    origins = {"yaw": [0, 0, HEIGHT], "pitch": [0.001, 0, 0], "wrist": [0.9, 0, 0]}
    capsule = {"kind": "capsule", "size": [RADIUS]}
    shapes = [obstacle, {**capsule, "link": "jib", "ends": [[0.1, 0, 0], [LENGTH, 0, 0]]}]
    if "wrist" in posture:
        shapes.append({**capsule, "link": "claw", "ends": [[0, 0, 0], [0.2, 0, 0]]})
    facts = {
        "name": "crane",
        "links": [{"name": name, "mass": 1.0, "inertia": inertia} for name in links],
        "joints": [
            {
                "name": name, "parent": parent, "child": child, "axis": axes[name], "origin": origins[name],
                "lower": -1.0, "upper": 1.0, "max_velocity": 1.0, "max_torque": 1.0, "gear": "servo",
            }
            for name, parent, child in zip(names, links, links[1:], strict=False)
        ],
        "gears": {"servo": {"stiffness": 10, "damping": 1}},
        "groups": {"left_arm": names},
        "postures": {"Stand": {"stance": "standing", "angles": posture}},
        "rest": "Stand",
        "shapes": shapes,
    }  # fmt: skip
    return read_body(json.dumps(facts), "crane.json")


def found(body, **how):
    return find_table(BodyShapes(body), "yaw", "pitch", [body.resting_angles], **how)


def test_a_limit_is_where_the_geometry_puts_it():
    finding = found(crane(PLATE))
    assert finding.touching == (("base", "jib"),)
    for yaw in (-1.0, -0.33, 0.0, 0.5, 1.0):
        lower, upper = finding.table.at(yaw)
        assert lower == -1.0
        assert upper == pytest.approx(LIMIT, abs=0.005)
        assert upper <= LIMIT + 1e-4
    assert len(finding.table.rows) == 2


def test_a_wider_margin_narrows_the_range():
    finding = found(crane(PLATE), margin=0.05)
    assert finding.table.at(0.0)[1] == pytest.approx(math.asin((HEIGHT - RADIUS - 0.05) / LENGTH), abs=0.005)


def test_the_range_holds_also_between_the_angles_that_were_tried():
    low = {**POST, "size": [0.1, 0.1, 0.05], "position": [0.6, 0.0, 0.05]}
    body = crane(low)
    finding, shapes = found(body), BodyShapes(body)
    uppers = {finding.table.at(yaw)[1] for yaw in (0.0, 0.9)}
    assert min(uppers) < 0.45
    assert max(uppers) == 1.0
    pairs = shapes.pairs_moved_by(("yaw", "pitch"))
    for step in range(201):
        yaw = -1.0 + step / 100
        for pitch in finding.table.at(yaw):
            _, touching = shapes.nearest({"yaw": yaw, "pitch": pitch}, pairs, 0.0)
            assert touching is None, (yaw, pitch)


def test_joints_that_nothing_hinders_have_no_table():
    far = {**PLATE, "position": [0.0, 0.0, -2.0]}
    finding = found(crane(far))
    assert finding.table is None
    assert finding.touching == ()
    assert finding.reach == (-1.0, 1.0)


def test_the_table_ends_where_the_other_joint_is_blocked_whatever_its_angle():
    posture = {"yaw": -0.8, "pitch": 0.0}
    finding = found(crane({**POST, "size": [0.1, 0.1, 2.0]}, posture))
    assert finding.reach[0] == -1.0
    assert -0.6 < finding.reach[1] < 0.0
    assert finding.touching == (("base", "jib"),)


def test_a_table_holds_in_each_posture():
    body = crane(PLATE, {"yaw": 0.0, "pitch": 0.0, "wrist": 0.0})
    shapes, bent = BodyShapes(body), {"yaw": 0.0, "pitch": 0.0, "wrist": 1.0}
    straight, both, reversed_order = (
        present(find_table(shapes, "yaw", "pitch", postures).table)
        for postures in ([body.resting_angles], [body.resting_angles, bent], [bent, body.resting_angles])
    )
    assert both.at(0.0)[1] < straight.at(0.0)[1] - 0.05
    assert both == reversed_order


def test_a_body_that_is_impossible_is_refused_by_its_name():
    with pytest.raises(RobotError, match=r"body crane cannot be simulated: .*inertia"):
        BodyShapes(crane(PLATE, inertia={}))


@pytest.mark.parametrize(
    ("pair", "reported"),
    [
        (("yaw", "roll"), "there is no joint 'roll'; there are yaw, pitch"),
        (("turn", "pitch"), "no joint 'turn'"),
    ],
)
def test_an_unknown_joint_is_refused(pair, reported):
    body = crane(PLATE)
    with pytest.raises(RobotError, match=reported):
        find_table(BodyShapes(body), pair[0], pair[1], [body.resting_angles])


def test_a_joint_without_end_is_refused():
    body = find_body("Cart")
    with pytest.raises(RobotError, match="LeftWheel turns without end"):
        find_table(BodyShapes(body), "NeckPan", "LeftWheel", [body.resting_angles])


def test_shapes_that_touch_at_the_start_are_refused():
    with pytest.raises(RobotError, match=r"base at jib are nearer than 0\.005 m"):
        found(crane({**PLATE, "position": [0.0, 0.0, HEIGHT - 0.06]}))


@pytest.mark.parametrize(
    ("name", "pairs"),
    [
        ("H25", ["HeadYaw", "LShoulderPitch", "RShoulderPitch", "LAnklePitch", "RAnklePitch"]),
        ("G1", ["left_shoulder_pitch_joint", "right_shoulder_pitch_joint", "left_ankle_pitch_joint",
                "right_ankle_pitch_joint"]),
        ("Cart", ["NeckPan"]),
    ],
)  # fmt: skip
def test_the_pairs_of_a_body_are_head_shoulders_and_ankles(name, pairs):
    assert [independent for independent, _ in limb_pairs(find_body(name))] == pairs


def test_the_other_arm_is_not_considered():
    body = find_body("T1")
    shapes, arm = BodyShapes(body), body.groups.left_arm
    links = {shapes.link_of(shape) for pair in shapes.pairs_moved_by(arm[:2]) for shape in pair}
    assert {"AL3", "Trunk", "Hip_Yaw_Left", "Hip_Yaw_Right"} <= links
    assert links.isdisjoint({"AR1", "AR3", "right_hand_link"})


@pytest.mark.parametrize("name", ["T1", "G1"])
def test_the_tables_of_a_facts_file_keep_its_limbs_apart(name):
    body = find_body(name)
    shapes = BodyShapes(body)
    assert len(body.tables) == 2
    for table in body.tables:
        pairs = shapes.pairs_moved_by((table.independent, table.dependent))
        joint = body.joint[table.independent]
        assert table.rows[0][0] == pytest.approx(joint.lower, abs=1e-3)
        assert table.rows[-1][0] == pytest.approx(joint.upper, abs=1e-3)
        for step in range(41):
            angle = joint.lower + step / 40 * (joint.upper - joint.lower)
            for limit in table.at(angle):
                two = {table.independent: angle, table.dependent: limit}
                _, touching = shapes.nearest({**body.resting_angles, **two}, pairs, 0.0)
                assert touching is None, two


@pytest.mark.parametrize("name", ["T1", "G1"])
def test_nothing_of_a_body_touches_in_its_postures(name):
    body = find_body(name)
    shapes = BodyShapes(body)
    pairs = shapes.pairs_moved_by(body.joint_names)
    for title, posture in body.postures.items():
        _, touching = shapes.nearest(posture.angles, pairs, 0.0)
        assert touching is None, title


def test_the_command_prints_entries_of_a_facts_file(tmp_path):
    done = subprocess.run(
        [sys.executable, "-m", "naoserver_sim.self_collision", "Cart", "--pair", "NeckPan,NeckTilt"],
        capture_output=True, text=True, timeout=RUN_LIMIT, cwd=tmp_path, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert done.stdout == ""
    assert "NeckPan, NeckTilt: nothing touches" in done.stderr


@pytest.mark.parametrize(
    ("arguments", "reported"),
    [
        (["T2"], "there is no body 'T2'"),
        (["T1", "--pair", "Head_pitch"], "--pair Head_pitch: write two joints"),
        (["T1", "--pair", "Head_pitch, Head_pitch"], "--pair Head_pitch, Head_pitch: write two joints"),
        (["T1", "--posture", "Sit"], "there is no posture 'Sit'"),
    ],
)
def test_the_command_refuses_what_it_does_not_know(arguments, reported):
    done = run_here(app, "self_collision", *arguments, expected=(RobotError,))
    assert done.returncode == 1
    assert reported in done.stderr
