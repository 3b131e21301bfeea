"""A plan in words."""

from __future__ import annotations

import pytest

from visualhfsm._base.languages import said
from visualhfsm.trials import Disturbance, Plan, Quantity, Same, Spread, Success
from visualhfsm_trials._facts import facts_of, in_words


@pytest.mark.parametrize(
    ("quantity", "words"),
    [
        (0.5, "0.5"),
        (True, "yes"),
        ("soccer", "soccer"),
        ((0.3, 0.5, 1.0), "0.3, 0.5 or 1"),
        (tuple(range(20)), "0, 1, 2, 3, 4, 5, 6, 7, … (20 values)"),
        (Spread(lowest=0, highest=2), "0 to 2"),
        (Spread(lowest=1, highest=6, whole=True), "1 to 6, whole"),
        (Spread(lowest=0.01, highest=1, log=True), "0.01 to 1, by powers of ten"),
        (Spread(mean=1, deviation=0.2, lowest=0), "normal, 1 ± 0.2, at least 0"),
        (Same("robot.x"), "as robot.x"),
    ],
)
def test_a_quantity_is_said_in_words(quantity: Quantity, words: str) -> None:
    assert in_words(quantity) == words


def test_numbers_of_a_quantity_have_the_comma_of_spanish() -> None:
    assert said(in_words(Spread(lowest=-0.5, highest=1.25)), "es") == "de -0,5 a 1,25"


@pytest.mark.parametrize(
    ("disturbance", "words"),
    [
        (Disturbance(at=2, push=60, seconds=0.1), "at 2 s: a push of 60 N for 0.1 s"),
        (Disturbance(at=1, move="Ball", to={"x": 1.0}), "at 1 s: Ball is put elsewhere: x 1"),
        (
            Disturbance(at=1, move="Ball", to={"pan": 1.0}, speed=Spread(lowest=0.25, highest=2.0)),
            "at 1 s: Ball is carried at 0.25 to 2 rad/s: pan 1",
        ),
        (Disturbance(at=1, offline=(), seconds=2), "at 1 s: all servants offline for 2 s"),
        (Disturbance(at=1, late=0.3, seconds=2), "at 1 s: pictures 0.3 s late for 2 s"),
        (
            Disturbance(at=1, fail="Camera", kind="frozen", seconds=2),
            "at 1 s: Camera fails, frozen, for 2 s",
        ),
        (
            Disturbance(at=1, fail=("HeadYaw", "LKneePitch"), kind=("stuck", "limp")),
            "at 1 s: HeadYaw or LKneePitch fails, stuck or limp",
        ),
        (
            Disturbance(at=1, fail="HeadYaw", kind="offset", amount=Spread(lowest=-0.1, highest=0.25)),
            "at 1 s: HeadYaw fails, offset -0.1 to 0.25",
        ),
    ],
)
def test_a_disturbance_is_said_in_words(disturbance: Disturbance, words: str) -> None:
    facts = facts_of(Plan(disturbances={"it": disturbance}), "plan.trials.toml")
    assert [each.words for each in facts.happens] == [words]


def test_what_varies_is_apart_from_what_stays() -> None:
    scene: dict[str, Quantity] = {"robot.x": Spread(lowest=0, highest=2), "noise": True}
    facts = facts_of(Plan(scene=scene, parameters={"speed": (0.1, 0.2)}, numbers={"goals": "j.py:goals"}), "")
    assert [each.name for each in facts.varies] == ["robot.x", "speed"]
    assert [(each.name, each.words) for each in facts.fixed] == [("body", "H25"), ("noise", "yes")]
    assert facts.measures == ["goals"]


def test_what_counts_is_what_the_plan_asks() -> None:
    facts = facts_of(Plan(robot="none", success=Success(state="done", function="j.py:good")), "")
    assert facts.state == "done"
    assert facts.counts == ["the properties of the document hold", "j.py:good calls it good"]
    assert "the robot does not fall" in facts_of(Plan(), "").counts


def test_texts_of_a_plan_are_of_limited_length() -> None:
    facts = facts_of(Plan(scene={"x" * 5000: "y" * 5000, **{f"q{n}": n for n in range(500)}}), "")
    assert len(facts.fixed) == 60
    assert len(facts.fixed[0].name) < 200
    assert len(facts.fixed[0].words) < 200
