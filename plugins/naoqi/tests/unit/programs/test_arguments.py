"""Values from clients of libqi are converted to the required type, or refused."""

from contextlib import suppress

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from naoserver.bodies.nao import H25
from naoserver.errors import InvalidCommand
from tests.support.any_text import any_text
from tests.support.examples import examples
from visualhfsm_naoqi.programs._arguments import (
    JointNames,
    fraction,
    keepable,
    number,
    number_lists,
    numbers,
    text,
)

NAMES = JointNames(H25)

foreign = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | any_text(max_size=5) | st.binary(max_size=5),
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(any_text(max_size=2), inner, max_size=2),
)


@settings(max_examples=examples(50))
@given(foreign, st.integers(1, 3))
def test_anything_is_numbers_for_each_joint_or_refused(value, count):
    for take in (lambda: numbers(value, "angles", count), lambda: number_lists(value, "angles", count)):
        with suppress(InvalidCommand):
            assert len(take()) == count


@settings(max_examples=examples(50))
@given(foreign)
def test_plain_values_are_kept_as_they_are(value):
    assert keepable(value, "value") is value


@pytest.mark.parametrize(
    "value",
    [
        "a" * 10_001,
        [b"a" * 6000, b"b" * 6000],
        [0] * 10_001,
        [["a" * 4000]] * 3,
        {"a": "b" * 10_001},
        object(),
    ],
)
def test_what_is_too_large_or_alive_is_not_kept(value):
    with pytest.raises(InvalidCommand, match="value"):
        keepable(value, "value")


@settings(max_examples=examples(50))
@given(foreign)
def test_anything_is_joints_or_refused(value):
    with suppress(InvalidCommand):
        assert set(NAMES.of(value)) <= set(H25.joint_names)


@pytest.mark.parametrize(
    ("value", "count", "lists"),
    [
        (1, 2, [[1.0], [1.0]]),
        ([1, 2], 2, [[1.0], [2.0]]),
        ([1, 2], 1, [[1.0, 2.0]]),
        ([[1, 2]], 1, [[1.0, 2.0]]),
        ([[1, 2], 3], 2, [[1.0, 2.0], [3.0]]),
    ],
)
def test_the_ways_to_write_lists(value, count, lists):
    assert number_lists(value, "angles", count) == lists


@pytest.mark.parametrize("value", [float("nan"), float("inf"), "1", None, [1]])
def test_what_is_no_number(value):
    with pytest.raises(InvalidCommand, match=r"x is .*, not a finite number"):
        number(value, "x")


@pytest.mark.parametrize("value", [0.0, -0.1, 1.1])
def test_what_is_no_fraction(value):
    with pytest.raises(InvalidCommand, match="above 0 and at most 1"):
        fraction(value, "x")


def test_a_text_that_is_too_long():
    with pytest.raises(InvalidCommand, match="characters"):
        text("a" * 20_000, "x")


def test_a_list_that_is_too_long():
    with pytest.raises(InvalidCommand, match="entries"):
        NAMES.of(["HeadYaw"] * 2000)


def test_chains():
    assert NAMES.chains["Body"] == H25.joint_names
    assert NAMES.chains["LArm"] == (
        *("LShoulderPitch", "LShoulderRoll", "LElbowYaw", "LElbowRoll"),
        *("LWristYaw", "LHand"),
    )
    assert NAMES.chains["RLeg"] == (
        *("RHipYawPitch", "RHipRoll", "RHipPitch", "RKneePitch"),
        *("RAnklePitch", "RAnkleRoll"),
    )
    parts = ("Head", "LArm", "LLeg", "RLeg", "RArm")
    assert tuple(joint for part in parts for joint in NAMES.chains[part]) == H25.joint_names


def test_names_of_chains_and_joints_together():
    assert NAMES.of(["Head", "LHand"]) == ("HeadYaw", "HeadPitch", "LHand")
