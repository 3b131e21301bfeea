"""The limbs of a robot, by the names of its joints, their places, and the shapes at their ends."""

import pytest

from tests.support.models import MODELS, joint, link, robot
from visualhfsm_own_robots._limbs import Limbs
from visualhfsm_own_robots._model_file import read_model
from visualhfsm_own_robots._parts import OwnFile, parts_of

pytestmark = pytest.mark.sim

BOX = '<box size="0.1 0.1 0.1"/>'


@pytest.fixture
def read(tmp_path):
    """Return the limbs of a URDF."""

    def limbs(model):
        (tmp_path / "robot.urdf").write_text(model)
        return Limbs(
            parts_of(
                read_model(tmp_path / "robot.urdf", tmp_path), OwnFile(model="robot.urdf"), mounted=False
            )
        )

    return limbs


def chain(*names, y=0.0, up=0.0):
    """Return links in a row below `base`, moved by joints of some names."""
    parts, before, at = [], "base", f"0 {y} {up}"
    for name in names:
        parts += [link(f"{name} link", 1.0, BOX, "0 0 0.1"), joint(name, before, f"{name} link", at)]
        before, at = f"{name} link", "0 0 0.2"
    return "".join(parts)


BASE = link("base", 3.0, '<box size="0.4 0.4 0.1"/>')


@pytest.mark.parametrize(
    ("names", "side"),
    [
        (("left_shoulder", "left_elbow"), "left"),
        (("LShoulderPitch", "LElbowRoll"), "left"),
        (("r_shoulder_pan", "r_elbow"), "right"),
        (("shoulder_R", "elbow_R"), "right"),
        (("arm-right 1", "arm-right 2"), "right"),
        (("RF_arm", "RF_hand"), "right"),
        (("upper_arm", "lower_arm"), "left"),  # by its place
        (("relay_arm", "roller_arm"), "left"),
    ],
)
def test_the_side_is_that_of_the_names_or_else_of_the_place(read, names, side):
    (limb,) = read(robot(BASE, chain(*names, y=0.15))).limbs
    assert (limb.kind, limb.side) == ("arm", side)


@pytest.mark.parametrize(
    ("names", "kind"),
    [
        (("shoulder_pan_joint", "elbow_joint"), "arm"),
        (("head_pan", "head_tilt"), "head"),
        (("ptu_a", "ptu_b"), "head"),
        (("hip_x", "knee"), "leg"),
        (("FL_thigh_shoulder", "FL_calf"), "leg"),
        (("charm", "ship"), "arm"),  # a chain; no word in these names counts
        (("alarm",), ""),
    ],
)
def test_the_kind_is_that_of_words_in_the_names(read, names, kind):
    (limb,) = read(robot(BASE, chain(*names))).limbs
    assert limb.kind == kind


def test_joints_before_a_fork_to_both_sides_are_the_trunk(read):
    (trunk,) = read(MODELS["humanoid"]).of("trunk")
    assert trunk.joints == ("waist",)


def test_head_and_arm_branch_off_a_trunk(read):
    lift = link("lift", 1.0, BOX) + joint("lift", "base", "lift", at="0 0 0.2")
    limbs = read(
        robot(
            BASE,
            lift,
            chain("shoulder", "elbow").replace('"base"', '"lift"'),
            chain("neck").replace('"base"', '"lift"'),
        )
    )
    assert {(limb.kind, limb.joints) for limb in limbs.limbs} == {
        ("arm", ("shoulder", "elbow")),
        ("head", ("neck",)),
        ("trunk", ("lift",)),
    }


def test_fingers_of_a_hand_do_not_make_its_arm_a_trunk(read):
    fingers = "".join(
        link(f"{name}{part}", 0.01, '<sphere radius="0.01"/>')
        + joint(f"{name}_{part}", "b link" if part == 1 else f"{name}1", f"{name}{part}", f"0 {y} 0.2")
        for name, y in (("thumb", 0.03), ("index", -0.03))
        for part in (1, 2)
    )
    (limb,) = read(robot(BASE, chain("a", "b"), fingers)).limbs
    assert (limb.kind, len(limb.joints)) == ("arm", 6)


def test_a_wheel_is_round_and_on_the_floor(read):
    left, right = read(MODELS["carrier"]).wheels
    assert (left.joint, left.radius) == ("left_wheel_joint", pytest.approx(0.04))
    assert left.place == pytest.approx((0.0, 0.12, 0.04), abs=1e-4)
    assert (left.axis[1], right.axis[1]) == (pytest.approx(1.0), pytest.approx(-1.0))


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ('<cylinder radius="0.04" length="0.02"/>', '<box size="0.01 0.08 0.02"/>'),  # a paddle
        ('0.03" rpy', '0.3" rpy'),  # above the floor
        ('type="continuous"', 'type="revolute"'),  # it cannot turn
    ],
)
def test_nothing_else_is_a_wheel(read, old, new):
    carrier = MODELS["carrier"]
    assert old in carrier
    model = carrier.replace(old, new).replace(
        'type="revolute">', 'type="revolute"><limit lower="-1" upper="1"/>'
    )
    assert read(model).wheels == []


def test_a_chain_may_have_as_many_joints_as_a_robot_has_links(read):
    (limb,) = read(robot(BASE, chain(*(f"joint {number}" for number in range(600))))).limbs
    assert len(limb.joints) == 600
