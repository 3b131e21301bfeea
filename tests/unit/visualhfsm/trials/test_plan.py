"""The plan of a series of trials."""

from __future__ import annotations

import random
from pathlib import Path

import pytest

from visualhfsm._base.languages import said
from visualhfsm.trials import Plan, Spread, Success, TrialsError, plan_of, read_plan
from visualhfsm.trials._quantities import draw_all
from visualhfsm.trials._series import Series

PLAN = """
runs = 20
limit = 5

[scene]
BallGreen.pan = { from = -0.5, to = 0.5 }

[parameters]
start = { same = "BallGreen.pan" }

[disturbances.shove]
at = { from = 1, to = 2 }
push = 30
seconds = 0.1

[success]
state = "follow"
"""


@pytest.fixture
def place(tmp_path: Path) -> Path:
    (tmp_path / "follow.xml").write_text("<VisualHFSM/>")
    return tmp_path / "follow.trials.toml"


def test_a_plan_stands_beside_its_document(place: Path) -> None:
    place.write_text(PLAN)
    plan = read_plan(place)
    assert plan.document == str(place.parent / "follow.xml")
    assert (plan.runs, plan.limit, plan.success.state) == (20, 5.0, "follow")
    assert plan == plan_of(place.parent / "follow.xml")


def test_a_document_without_a_plan_varies_nothing(place: Path) -> None:
    plan = plan_of(place.parent / "follow.xml", "follow", runs=3)
    assert plan == Plan(document=str(place.parent / "follow.xml"), runs=3, success=Success(state="follow"))
    assert plan.varying == ()


def test_scene_parameters_and_disturbances_are_drawn_together(place: Path) -> None:
    place.write_text(PLAN)
    plan = read_plan(place)
    values = plan.draw(7)
    assert list(values) == [
        *("BallGreen.pan", "parameters.start"),
        *("shove.at", "shove.seconds", "shove.push", "shove.direction"),
    ]
    assert values["parameters.start"] == values["BallGreen.pan"]
    assert values["shove.push"] == 30
    assert plan.varying == ("BallGreen.pan", "shove.at", "shove.direction")


def test_the_numbers_of_disturbances_are_chosen_from_lists_too(place: Path) -> None:
    place.write_text("[disturbances.shove]\nat = [1, 2]\npush = [30, 60]\nseconds = 0.1")
    plan = read_plan(place)
    assert plan.varying == ("shove.at", "shove.push", "shove.direction")
    assert {plan.draw(number)["shove.push"] for number in range(1, 21)} == {30, 60}


def test_the_places_to_which_a_ball_is_carried_are_numbered(place: Path) -> None:
    place.write_text(
        '[disturbances.carried]\nat = 1\nmove = "BallGreen"\nspeed = [0.5, 1]\n'
        "to = [{ pan = { from = 0.5, to = 1 } }, { pan = -1, height = 0.4 }]"
    )
    plan = read_plan(place)
    assert plan.varying == ("carried.speed", "carried.1.pan")
    values = plan.draw(1)
    assert (values["carried.2.pan"], values["carried.2.height"]) == (-1, 0.4)


def test_part_kind_and_amount_of_a_failure_are_drawn(place: Path) -> None:
    place.write_text(
        '[disturbances.breaks]\nat = 1\nfail = ["HeadYaw", "HeadPitch"]\nkind = ["offset", "noisy"]\n'
        "amount = { from = 0.05, to = 0.1 }"
    )
    plan = read_plan(place)
    assert plan.varying == ("breaks.amount", "breaks.fail", "breaks.kind")
    drawn = [plan.draw(number) for number in range(1, 41)]
    assert {(each["breaks.fail"], each["breaks.kind"]) for each in drawn} == {
        *(("HeadYaw", "offset"), ("HeadYaw", "noisy"), ("HeadPitch", "offset"), ("HeadPitch", "noisy"))
    }
    assert all(0.05 <= float(each["breaks.amount"]) <= 0.1 for each in drawn)
    assert {each["breaks.seconds"] for each in drawn} == {0.0}


def test_a_trial_is_the_same_whatever_is_drawn_beside_it() -> None:
    plan = Plan(document="x.xml", scene={"x": Spread(lowest=0, highest=1)})
    assert plan.draw(3) == plan.draw(3) != plan.draw(4)
    assert plan.seed_of(3) == plan.seed_of(3) != plan.seed_of(4)
    other = Plan(document="x.xml", seed=2, scene=plan.scene)
    assert other.draw(3) != plan.draw(3)


def test_trials_count_from_1_and_draw_what_they_drew_when_they_counted_from_0() -> None:
    plan = Plan(document="x.xml", runs=3, scene={"x": Spread(lowest=0, highest=1)})
    assert [*plan.trials] == [1, 2, 3]
    assert plan.draw(1) == draw_all(plan.quantities, "1/0/0")
    assert plan.seed_of(1) == random.Random("1/0").getrandbits(31)


def test_values_that_are_not_accepted_are_drawn_again() -> None:
    plan = Plan(document="x.xml", scene={"x": Spread(lowest=0, highest=1)})
    assert all(plan.draw(n, lambda values: values["x"] > 0.9)["x"] > 0.9 for n in range(1, 21))  # type: ignore[operator]


def test_a_plan_that_accepts_nothing_is_refused() -> None:
    plan = Plan(document="x.xml", accept="legal.py:legal", scene={"x": Spread(lowest=0, highest=1)})
    with pytest.raises(TrialsError, match=r"legal\.py:legal accepted none of 10000 draws: widen the ranges"):
        plan.draw(1, lambda values: False)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("runs = 0", ":1: runs = 0"),
        ("run = 3", ":1: run: there is no such key; there is document, runs"),
        ("limit = 'long'", ":1: limit = 'long': write a number"),
        ('robot = "nao"', ":1: robot = 'nao'"),
        ('document = "other.xml"', "there is no document"),
        ('[parameters]\nx = { same = "y" }', "parameters.x: there is no quantity y that has its own value"),
        (
            '[scene]\nworld = "soccer"\n[parameters]\nx = { same = "world", deviation = 1 }',
            "parameters.x: world is no number, so it has no deviation",
        ),
        ('[success]\nfunction = "judge"', ":2: success.function = 'judge': write FILE.py:FUNCTION"),
        ("[disturbances.a]\nat = 1", "a disturbance has one of push, move, offline, late, fail; here: none"),
        ("[disturbances.a]\nat = 1\npush = 3", "say how long: seconds = 1.0, for push"),
        ('[disturbances.a]\nat = 1\nmove = "Ball"', "say where Ball is put"),
        (
            '[disturbances.a]\nat = 1\nmove = "B"\nto = [{ pan = 1 }]',
            "say how fast B is carried from place to place",
        ),
        ('[disturbances.a]\nat = 1\nmove = "B"\nto = { x = 1 }\nspeed = 1', "a speed is for a carried ball"),
        ("[disturbances.a]\nat = 1\npush = 3\nseconds = 1\nspeed = 1", "a speed is for a carried ball"),
        (
            '[disturbances.a]\nat = 1\nmove = "B"\nto = { pan = 1 }\nspeed = { from = 0, to = 1 }',
            "the speed may become 0",
        ),
        ("[disturbances.a]\nat = []\npush = 3\nseconds = 1", "disturbances.a.at"),
        ("[disturbances.a]\nat = -1\npush = 3\nseconds = 1", "disturbances.a.at = -1"),
        ('[disturbances.a]\nat = 1\nfail = "HeadYaw"', "a failure has a part and a kind"),
        ('[disturbances.a]\nat = 1\nkind = "stuck"', "here: none"),
        (
            '[disturbances.a]\nat = 1\nlate = 0.3\nseconds = 1\nkind = "stuck"',
            "a failure has a part and a kind",
        ),
        (
            "[disturbances.a]\nat = 1\npush = 3\nseconds = 1\namount = 0.1",
            "a failure has a part and a kind",
        ),
        (
            '[disturbances.a]\nat = 1\nlate = 0.3\nfail = "Camera"\nkind = "late"',
            "one of push, move, offline, late, fail; here: late, fail",
        ),
        ('[disturbances.a]\nat = 1\nfail = []\nkind = "stuck"', "disturbances.a.fail"),
        ('[disturbances.a]\nat = 1\nfail = "HeadYaw"\nkind = []', "disturbances.a.kind"),
        (
            '[disturbances.a]\nat = 1\nfail = "HeadYaw"\nkind = "offset"\namount = "much"',
            "disturbances.a.amount",
        ),
        ("x = [", "not TOML"),
    ],
)
def test_a_plan_that_makes_no_sense_is_refused_with_its_place(place: Path, text: str, message: str) -> None:
    place.write_text(text)
    with pytest.raises(TrialsError) as caught:
        read_plan(place)
    assert message in str(caught.value)
    assert str(place) in str(caught.value)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("runs = 0", "1: runs = 0: se espera `int` >= 1"),
        ("runs = 'x'", "1: runs = 'x': se espera `int`, y es `str`"),
        ("document = 3", "1: document = 3: escribe un texto"),
        ("robot = 'x'", "1: robot = 'x': escribe uno de estos: fake, sim"),
        ("[scene]\nx = {from = 1}", "2: scene.x: escribe from y to, o mean y deviation"),
        ("[scene]\nx = {values = []}", ": la lista está vacía; escribe los valores entre los que se elige"),
        ("runs = [", " no es TOML: "),
    ],
)
def test_a_plan_is_refused_in_the_language_of_the_page(place: Path, text: str, message: str) -> None:
    place.write_text(text, "utf-8")
    with pytest.raises(TrialsError) as refused:
        read_plan(place)
    assert message in said(refused.value.message, "es")


@pytest.mark.parametrize(
    ("written", "where", "column"),
    [
        ('[numbers]\nreason = "judge.py:aim"', ":2: numbers.reason", "reason"),
        ('[numbers]\nsuccess = "judge.py:aim"', ":2: numbers.success", "success"),
        ('[numbers]\ntime = "judge.py:aim"', ":2: numbers.time", "time"),
        ('scene.robot.x = 1\n[groups]\n"robot.x" = "judge.py:aim"', ":3: groups.", "robot.x"),
        ('groups.side = "judge.py:aim"\n[numbers]\nside = "judge.py:aim"', ":3: numbers.side", "side"),
        ('numbers."aim max" = "judge.py:aim"\n[samples]\naim = "judge.py:aim"', ":3: samples.aim", "aim max"),
    ],
)
def test_a_name_that_the_table_has_already_is_refused(
    place: Path, written: str, where: str, column: str
) -> None:
    place.write_text(written)
    with pytest.raises(TrialsError) as refused:
        read_plan(place)
    assert where in str(refused.value)
    assert f"has a column {column} already: write another name" in str(refused.value)


def test_a_plan_made_in_python_has_such_names_neither(place: Path) -> None:
    plan = Plan(document=str(place.parent / "follow.xml"), numbers={"reason": "judge.py:aim"})
    with pytest.raises(
        TrialsError, match=r"numbers\.reason: the table of trials has a column reason already"
    ):
        Series(plan)
