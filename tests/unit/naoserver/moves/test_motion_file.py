"""Files of motions: what they mean, and what is reported of invalid ones."""

from contextlib import suppress

import pytest
from hypothesis import given

from naoserver.bodies import find_body
from naoserver.moves.motion_file import MotionError, parse_motion
from tests.support.any_text import any_text

H25 = find_body("H25")
FRAME = "[[frame]]\nafter = 1.0\n"


def parse(text):
    return parse_motion(text, "nod", "nod.toml", H25)


def refusal(text):
    with pytest.raises(MotionError) as reported:
        parse(text)
    return str(reported.value)


def test_a_joint_goes_from_where_it_is_from_key_to_key():
    motion = parse("[[frame]]\ntime = 1.0\nHeadYaw = 0.4\n[[frame]]\ntime = 3.0\nHeadYaw = -0.4\n")
    begin = {"HeadYaw": 0.2}
    angles = [motion.at(time, begin)["HeadYaw"] for time in (0.0, 0.5, 1.0, 2.0, 3.0, 9.0)]
    assert angles == pytest.approx([0.2, 0.3, 0.4, 0.0, -0.4, -0.4])
    assert motion.duration == 3.0


def test_a_frame_that_does_not_give_a_joint_lets_it_go_on():
    motion = parse(
        "[[frame]]\nafter = 1.0\nHeadYaw = 0.0\nHeadPitch = 0.1\n"
        "[[frame]]\nafter = 1.0\nHeadPitch = 0.2\n"
        "[[frame]]\nafter = 1.0\nHeadYaw = 0.8\n"
    )
    assert motion.at(2.0, {"HeadYaw": 0.0, "HeadPitch": 0.0})["HeadYaw"] == pytest.approx(0.4)


def test_a_smooth_way_starts_and_ends_at_rest_and_a_linear_one_does_not():
    smooth = parse(FRAME + "HeadYaw = 1.0\n")
    linear = parse(FRAME + 'interpolation = "linear"\nHeadYaw = 1.0\n')
    assert smooth.at(0.01, {"HeadYaw": 0.0})["HeadYaw"] < 1e-4
    assert linear.at(0.01, {"HeadYaw": 0.0})["HeadYaw"] == pytest.approx(0.01)


def test_a_name_without_a_side_mirrors_the_left_side():
    motion = parse(FRAME + "ShoulderRoll = 0.3\nShoulderPitch = 0.5\nElbowYaw = -0.2\n")
    assert motion.at(1.0, dict.fromkeys(motion.keys, 0.0)) == pytest.approx(
        {
            "LShoulderRoll": 0.3, "RShoulderRoll": -0.3, "LShoulderPitch": 0.5, "RShoulderPitch": 0.5,
            "LElbowYaw": -0.2, "RElbowYaw": 0.2,
        }
    )  # fmt: skip


def test_the_joints_of_one_motor_are_one():
    assert list(parse(FRAME + "HipYawPitch = -0.3\n").keys) == ["LHipYawPitch"]


def test_a_posture_gives_every_joint_and_those_beside_it_win():
    motion = parse(FRAME + 'posture = "Crouch"\nHeadYaw = 0.3\n')
    end = motion.at(1.0, dict.fromkeys(H25.joint_names, 0.0))
    assert end["LKneePitch"] == H25.postures["Crouch"].angles["LKneePitch"]
    assert end["HeadYaw"] == 0.3


@pytest.mark.parametrize(
    ("text", "line", "words"),
    [
        ("[[frame]]\n\nafter = 1.0\nHeadYaw = 9.0\n", 4, ["HeadYaw", "9", "-2.08567 to 2.08567"]),
        (FRAME + "Tail = 0.1\n", 3, ["Tail"]),
        (FRAME + "HeadYaw = true\n", 3, ["HeadYaw", "write a number"]),
        (FRAME + "HeadYaw = nan\n", 3, ["HeadYaw", "write a number"]),
        (FRAME + "HeadYaw = 0.1\n[[frame]]\ntime = 0.5\n", 5, ["0.5", "above 1"]),
        ("[[frame]]\nHeadYaw = 0.1\n", 1, ["time", "after"]),
        ("[[frame]]\ntime = 1.0\nafter = 1.0\n", 1, ["either"]),
        (FRAME + 'posture = "Handstand"\n', 3, ["Handstand", "StandInit"]),
        (FRAME + 'interpolation = "cubic"\n', 3, ["smooth", "cubic"]),
        ('start = "Handstand"\n' + FRAME, 1, ["Handstand"]),
        ("speed = 2\n" + FRAME, 1, ["speed"]),
        (FRAME + "LHipYawPitch = 0.1\n", 3, ["HipYawPitch"]),
        (FRAME + "ShoulderPitch = 0.1\nRShoulderPitch = 0.2\n", 3, ["RShoulderPitch", "too"]),
        (FRAME + "HeadYaw = 0.0\n[[frame]]\nafter = 0.1\nHeadYaw = 1.0\n", 6, ["HeadYaw", "rad/s", "8.27"]),
        ('start = "StandZero"\n[[frame]]\nafter = 0.1\nKneePitch = 1.0\n', 4, ["KneePitch", "rad/s"]),
        ("description = 3\n" + FRAME, 1, ["description"]),
    ],
)  # fmt: skip
def test_what_is_wrong_is_reported_with_file_line_and_joint(text, line, words):
    message = refusal(text)
    assert message.startswith(f"nod.toml:{line}: ")
    for word in words:
        assert word in message


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("description = 'nothing'\n", "nod.toml: frame is missing"),
        ("frame = []\n", "nod.toml:1: frame = []: write 1 to 2000 [[frame]]"),
        (FRAME, "nod.toml: no frame names a joint"),
    ],
)
def test_a_motion_without_frames_or_joints_is_refused(text, message):
    assert refusal(text) == message


def test_what_is_no_toml_is_reported_with_its_line():
    assert "line 2" in refusal("[[frame]]\nafter = \n")


@given(any_text(max_size=200))
def test_any_text_is_a_motion_or_refused(text):
    with suppress(MotionError):
        parse(text)


def test_a_joint_that_is_held_stays_where_it_is_up_to_that_frame():
    motion = parse(
        '[[frame]]\nafter = 1.0\nhold = ["HeadYaw"]\n[[frame]]\nafter = 1.0\nHeadYaw = 0.0\n'
        '[[frame]]\nafter = 1.0\nhold = ["HeadYaw"]\n'
    )
    angles = [motion.at(time, {"HeadYaw": 0.5})["HeadYaw"] for time in (0.0, 0.6, 1.0, 1.5, 2.0, 2.5, 3.0)]
    assert angles == pytest.approx([0.5, 0.5, 0.5, 0.25, 0.0, 0.0, 0.0])


@pytest.mark.parametrize("hold", ['"HeadYaw"', '["Tail"]', "[1]"])
def test_what_cannot_be_held_is_reported_with_its_line(hold):
    assert refusal(FRAME + f"hold = {hold}\n").startswith("nod.toml:3: ")
