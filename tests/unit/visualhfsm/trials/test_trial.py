"""One trial: what it does, how it is judged, and that it is the same each time."""

from __future__ import annotations

from itertools import islice
from pathlib import Path
from typing import Any

import pytest
from msgspec import structs

from tests.support.documents import document, state, sub, transition
from tests.support.soak import repeated
from visualhfsm.trials import Disturbance, Plan, Spread, Success, TrialsError
from visualhfsm.trials._trial import run_trial

FOLLOW = "behaviors/follow_ball.xml"

WAITS = document(
    sub(
        1,
        0,
        state(1, "waiting", "import random\nrolled.append(random.random())", initial=True),
        state(2, "done"),
        transition(1, 1, 2, "len(rolled) > self.patience", name="enough"),
        variables="rolled = []",
    ),
    head="<parameters><parameter><name>patience</name><type>int</type><default>3</default></parameter></parameters>",
)


@pytest.fixture
def waits(tmp_path: Path) -> str:
    path = tmp_path / "waits.xml"
    path.write_text(WAITS, encoding="utf-8")
    return str(path)


def plan(path: str, state: str | None = None, *, upright: bool = True, **fields: Any) -> Plan:
    success = fields.pop("success", Success(state=state, upright=upright))
    return Plan(**{"document": path, "robot": "none", "limit": 2.0, "success": success, **fields})


def test_a_trial_ends_where_its_state_is_reached(waits: str) -> None:
    outcome = run_trial(plan(waits, "done"), 1)
    assert (outcome.success, outcome.reason, outcome.time, outcome.states) == (True, "", 0.4, "done")
    assert [(change.time, change.states) for change in outcome.changes] == [(0.0, "waiting"), (0.4, "done")]
    assert outcome.numbers["cycles"] == 5


def test_a_state_that_is_left_at_once_counts_as_reached(tmp_path: Path) -> None:
    passing = document(
        sub(
            1,
            0,
            state(1, "before", initial=True),
            state(2, "goal"),
            state(3, "after"),
            transition(1, 1, 2, "250", type="time"),
            transition(2, 2, 3, "True"),
            period="20",
        )
    )
    path = tmp_path / "passing.xml"
    path.write_text(passing, encoding="utf-8")
    outcome = run_trial(plan(str(path), "goal"), 1)
    assert outcome.success
    assert outcome.time == pytest.approx(0.26)


def test_a_trial_that_does_not_reach_it_says_where_it_was(waits: str) -> None:
    outcome = run_trial(plan(waits, "done", parameters={"patience": 100}), 1)
    assert (outcome.success, outcome.reason) == (False, "not in done after 2 s")
    assert (outcome.time, outcome.states) == (2.0, "waiting")


def test_without_a_state_it_must_reach_the_limit(waits: str) -> None:
    assert run_trial(plan(waits), 1).success


def test_an_error_of_the_code_fails_with_its_place(tmp_path: Path) -> None:
    path = tmp_path / "broken.xml"
    path.write_text(document(sub(1, 0, state(1, "only", "1 / 0", initial=True))), encoding="utf-8")
    outcome = run_trial(plan(str(path)), 1)
    assert outcome.reason.endswith("raised ZeroDivisionError: division by zero")
    assert "broken.xml" in outcome.error
    assert "timeline of broken" in outcome.error


def test_a_broken_property_fails(tmp_path: Path) -> None:
    stated = document(
        sub(1, 0, state(1, "one", initial=True), state(2, "two"), transition(1, 1, 2, "500", type="time")),
        head='<properties><property kind="never"><name>stays</name><expression>two</expression></property>'
        "</properties>",
    )
    path = tmp_path / "stated.xml"
    path.write_text(stated, encoding="utf-8")
    outcome = run_trial(plan(str(path)), 1)
    assert outcome.reason == "property 'stays' (never two) does not hold"
    assert outcome.time == pytest.approx(0.5, abs=0.11)
    assert run_trial(plan(str(path), success=Success(properties=False)), 1).success


def test_a_state_that_does_not_exist_is_no_goal(waits: str) -> None:
    with pytest.raises(TrialsError, match="there is no state finished; there are waiting, done"):
        run_trial(plan(waits, "finished"), 1)


def test_an_unknown_parameter_is_refused(waits: str) -> None:
    with pytest.raises(TrialsError, match=r"trial 3 is not possible: .*speed"):
        run_trial(plan(waits, parameters={"speed": 1.0}), 3)


def test_random_numbers_of_the_code_belong_to_the_trial(waits: str) -> None:
    judged = plan(waits, numbers={"first": "judge.py:first"})
    Path(waits).with_name("judge.py").write_text(
        "def first(run):\n    return run.variables('waits')['rolled'][0]\n", encoding="utf-8"
    )
    once, again, other = (run_trial(judged, number).numbers["first"] for number in (5, 5, 6))
    assert once == again != other


@pytest.mark.parametrize(
    ("code", "reason"),
    [
        ("return True", ""),
        ("return None", ""),
        ("return False", "judged not good"),
        ("return 'too slow'", "too slow"),
        ("return 1 / 0", "judge.py:judge: ZeroDivisionError: division by zero"),
        ("raise SystemExit(0)", "judge.py:judge: SystemExit: 0"),
        ("import pytest; pytest.fail('late')", "judge.py:judge: Failed: late"),
        (
            "class Torn:\n        __bool__ = lambda _: 1 / 0\n    return Torn()",
            "judge.py:judge: ZeroDivisionError: division by zero",
        ),
        ("return 'no \\udcff'", r"no \udcff"),
        ("raise ValueError('no \\udcff')", r"judge.py:judge: ValueError: no \udcff"),
    ],
)
def test_a_function_of_the_run_judges(waits: str, code: str, reason: str) -> None:
    Path(waits).with_name("judge.py").write_text(f"def judge(run):\n    {code}\n", encoding="utf-8")
    outcome = run_trial(plan(waits, success=Success(function="judge.py:judge")), 1)
    assert (outcome.success, outcome.reason) == (not reason, reason)


def test_numbers_and_groups_are_noted_of_a_trial_that_ends_with_an_error_too(tmp_path: Path) -> None:
    path = tmp_path / "broken.xml"
    path.write_text(document(sub(1, 0, state(1, "only", "1 / 0", initial=True))), encoding="utf-8")
    (tmp_path / "judge.py").write_text(
        "def errors(run):\n    return len(run.errors)\ndef last(run):\n    return run.active\n",
        encoding="utf-8",
    )
    noted = plan(str(path), numbers={"errors": "judge.py:errors"}, groups={"last": "judge.py:last"})
    outcome = run_trial(noted, 1)
    assert outcome.reason.endswith("division by zero")
    assert (outcome.numbers["errors"], outcome.groups) == (1, {"last": "only"})


def test_what_is_no_number_fails_the_trial(waits: str) -> None:
    Path(waits).with_name("judge.py").write_text("def n(run):\n    return None\n", encoding="utf-8")
    outcome = run_trial(plan(waits, numbers={"n": "judge.py:n"}), 1)
    assert outcome.reason.startswith("judge.py:n: TypeError: float() argument")


@pytest.mark.parametrize("code", ["1 / 0", "raise SystemExit(0)"])
def test_a_function_that_fails_to_accept_is_said(waits: str, code: str) -> None:
    Path(waits).with_name("judge.py").write_text(f"def accept(values):\n    {code}\n", encoding="utf-8")
    with pytest.raises(TrialsError, match=r"no trial can be drawn: judge\.py:accept: "):
        run_trial(plan(waits, accept="judge.py:accept"), 1)


def test_a_function_that_cannot_measure_fails_the_trial(waits: str) -> None:
    Path(waits).with_name("judge.py").write_text("def n(run):\n    return run.nothing\n", encoding="utf-8")
    outcome = run_trial(plan(waits, groups={"n": "judge.py:n"}), 1)
    assert outcome.reason.startswith("judge.py:n: AttributeError")


def test_samples_are_taken_ten_times_a_second(waits: str) -> None:
    Path(waits).with_name("judge.py").write_text("def passed(run):\n    return run.time\n", encoding="utf-8")
    numbers = run_trial(plan(waits, samples={"passed": "judge.py:passed"}), 1).numbers
    assert numbers["passed mean"] == pytest.approx(1.0)
    assert numbers["passed max"] == pytest.approx(2.0)


@pytest.mark.parametrize(
    ("reference", "message"),
    [
        ("nothing.py:f", "there is no file"),
        ("judge.py:absent", "judge.py defines no function absent"),
        ("broken.py:f", "cannot be loaded: SyntaxError"),
    ],
)
def test_a_function_that_is_not_there_is_refused(waits: str, reference: str, message: str) -> None:
    Path(waits).with_name("judge.py").write_text("value = 3\n", encoding="utf-8")
    Path(waits).with_name("broken.py").write_text("def f(:\n", encoding="utf-8")
    with pytest.raises(TrialsError, match=message):
        run_trial(plan(waits, numbers={"n": reference}), 1)


@pytest.mark.sim
def test_a_fall_fails_and_the_same_trial_falls_the_same_way() -> None:
    pushed = plan(
        FOLLOW,
        robot="sim",
        camera="drawn",
        scene={"noise": True, "BallGreen.pan": Spread(lowest=-0.5, highest=0.5)},
        disturbances={"shove": Disturbance(at=0.5, push=200.0, seconds=0.2)},
    )
    outcome = run_trial(pushed, 3)
    assert (outcome.success, outcome.reason) == (False, "fell")
    assert run_trial(pushed, 3) == outcome
    lies = plan(FOLLOW, upright=False, robot="sim", camera="drawn", disturbances=pushed.disturbances)
    assert run_trial(lies, 3).success


@pytest.mark.sim
def test_a_carried_ball_of_the_simulation_is_where_the_plan_says_whatever_the_seed(waits: str) -> None:
    Path(waits).with_name("judge.py").write_text(
        "def pan(run):\n    return run.robot.ball('green').position[0]\n"
        "def distance(run):\n    return run.robot.ball('green').position[1]\n",
        encoding="utf-8",
    )
    placed = plan(
        waits,
        robot="sim",
        camera="drawn",
        limit=0.2,
        scene={"BallGreen.pan": -0.7},
        numbers={name: f"judge.py:{name}" for name in ("pan", "distance")},
    )
    for number in islice(placed.trials, repeated(test=2, soak=placed.runs)):
        noted = run_trial(placed, number).numbers
        assert (noted["pan"], noted["distance"]) == pytest.approx((-0.7, 1.0), abs=1e-3)


def test_a_ball_that_is_carried_away_is_lost() -> None:
    away = {"away": Disturbance(at=1.0, move="BallGreen", to={"pan": 3.1})}
    outcome = run_trial(plan(FOLLOW, "search", robot="fake", limit=4.0, disturbances=away), 1)
    assert outcome.success
    assert 1.5 < outcome.time < 2.0


def test_a_ball_is_carried_to_and_fro_at_a_speed(tmp_path: Path) -> None:
    (tmp_path / "follow_ball.xml").write_bytes(Path(FOLLOW).read_bytes())
    (tmp_path / "judge.py").write_text(
        "def pan(run):\n    return run.robot.ball('green').position[0]\n"
        "def at_2(run):\n    return pan(run) if abs(run.time - 2.0) < 0.05 else None\n"
        "def at_4(run):\n    return pan(run) if abs(run.time - 4.0) < 0.05 else None\n",
        encoding="utf-8",
    )
    carried = Disturbance(at=1.0, move="BallGreen", to=({"pan": 0.5}, {"pan": -0.5}), speed=0.5)
    numbers = run_trial(
        plan(
            str(tmp_path / "follow_ball.xml"),
            robot="fake",
            limit=8.0,
            scene={"BallGreen.pan": 0.0},
            disturbances={"carried": carried},
            samples={name: f"judge.py:{name}" for name in ("pan", "at_2", "at_4")},
        ),
        1,
    ).numbers
    assert numbers["at_2 mean"] == pytest.approx(0.5, abs=0.05)
    assert numbers["at_4 mean"] == pytest.approx(-0.5, abs=0.05)
    assert numbers["pan max"] == pytest.approx(0.5, abs=0.05)


def test_a_ball_that_is_carried_once_stays_there() -> None:
    once = Disturbance(at=0.5, move="BallGreen", to={"pan": 2.0}, speed=6.0)
    assert run_trial(plan(FOLLOW, "search", robot="fake", limit=4.0, disturbances={"once": once}), 1).success


@pytest.mark.slow
@pytest.mark.parametrize(
    ("disturbance", "message"),
    [
        (Disturbance(at=1.0, move="Bal", to={"pan": 1.0}), "Bal cannot be carried: .* there are BallRed"),
        (
            Disturbance(at=1.0, move="BallGreen", to={"x": 1.0}),
            "the fake robot has no BallGreen with x, y and z",
        ),
        (
            Disturbance(at=1.0, move="BallGreen", to={"far": 1.0}),
            "cannot be moved to far: write x, y and z, or pan",
        ),
        (Disturbance(at=1.0, push=30.0, seconds=0.1), "only the simulated robot can be pushed"),
        (Disturbance(at=1.0, fail="Knee", kind="stuck"), "Knee cannot fail: .* there are HeadYaw, HeadPitch"),
        (Disturbance(at=1.0, fail="HeadYaw", kind="black"), "HeadYaw cannot be 'black': it can be stuck"),
        (Disturbance(at=1.0, fail="HeadYaw", kind="weak"), "HeadYaw cannot be 'weak'"),  # without forces
        (
            Disturbance(at=1.0, fail="HeadYaw", kind="offset", amount=2.0),
            "the amount is 2, and must be from -0.5 to 0.5 rad",
        ),
    ],
)
def test_a_disturbance_that_cannot_happen_is_refused_at_once(disturbance: Disturbance, message: str) -> None:
    late = structs.replace(disturbance, at=100.0)
    with pytest.raises(TrialsError, match=message):
        run_trial(plan(FOLLOW, robot="fake", limit=0.1, disturbances={"one": late}), 1)


@pytest.mark.sim
def test_a_thing_that_is_not_in_the_world_is_not_moved() -> None:
    moved = {"one": Disturbance(at=100.0, move="Ball", to={"x": 1.0})}
    with pytest.raises(TrialsError, match="no such thing in the world; there are BallRed, BallGreen"):
        run_trial(plan(FOLLOW, robot="sim", camera="drawn", limit=0.1, disturbances=moved), 1)


def test_a_server_that_is_offline_is_back_later() -> None:
    gone = {"gone": Disturbance(at=0.5, offline=("Sight",), seconds=0.4)}
    outcome = run_trial(plan(FOLLOW, robot="fake", disturbances=gone), 1)
    assert outcome.success, outcome.error


def test_a_servant_that_there_is_not_cannot_be_offline() -> None:
    gone = {"gone": Disturbance(at=0.5, offline=("Camra",), seconds=0.4)}
    with pytest.raises(
        TrialsError, match=r"Camra cannot be offline: there is no such servant; there are .*Camera"
    ):
        run_trial(plan(FOLLOW, robot="fake", disturbances=gone), 1)


PIXELS = """image = self.Camera.getImageData("RGB8")
width, height = image.description.width, image.description.height
pixels = np.frombuffer(image.pixelData, np.uint8).reshape(height, width, 3).astype(int)
columns = np.nonzero(pixels[..., 1] - pixels[..., 0] > 100)[1]
left = 0.5 - columns.mean() / width"""
SEEN = """(left,) = [it.left for it in self.Sight.getSight().things if it.name == "green" and it.camera == "Camera"]"""
STREAMED = SEEN.replace("getSight()", "getSight.wait().value")


@pytest.mark.parametrize("look", [PIXELS, SEEN, STREAMED], ids=["pixels", "seen", "streamed"])
def test_late_pictures_are_as_old_as_they_are_said_to_be(tmp_path: Path, look: str) -> None:
    # The ball jumps at 1.0 s; a robot that sees it 0.6 s late turns its head 0.6 s later.
    code = f"{look}\nself.Head.setSpeed(left, 0.0)"
    config = "".join(
        f"<iceinterface><nameinterface>{name}</nameinterface><interface>{interface}</interface></iceinterface>"
        for name, interface in (("Camera", "Camera"), ("Sight", "Sight"), ("Head", "PoseHead"))
    )
    (tmp_path / "turns.xml").write_text(
        document(sub(1, 0, state(1, "turns", code, initial=True)), libraries=("numpy as np",), config=config),
        "utf-8",
    )
    (tmp_path / "judge.py").write_text(
        "def turned(run):\n"
        "    speeds = [c.time for c in run.calls('Head.setSpeed') if c.time > 1.0 and abs(c.pan) > 0.3]\n"
        "    return speeds[0] if speeds else 99.0\n",
        encoding="utf-8",
    )
    jump = Disturbance(at=1.0, move="BallGreen", to={"pan": 0.4, "distance": 1.0})
    late = Disturbance(at=0.2, late=0.6, seconds=5.0)
    seen = [
        run_trial(
            plan(
                str(tmp_path / "turns.xml"),
                robot="fake",
                limit=3.0,
                scene={"BallGreen.pan": 0.0, "BallGreen.distance": 1.0},
                disturbances=disturbances,
                numbers={"turned": "judge.py:turned"},
            ),
            1,
        ).numbers["turned"]
        for disturbances in ({"jump": jump}, {"jump": jump, "late": late})
    ]
    assert seen[1] - seen[0] == pytest.approx(0.6, abs=0.15)


def test_what_fails_is_drawn_from_several_parts_and_kinds(tmp_path: Path) -> None:
    (tmp_path / "follow_ball.xml").write_bytes(Path(FOLLOW).read_bytes())
    (tmp_path / "judge.py").write_text(
        "def turned(run):\n    return abs(run.robot.head[0] - 0.4) < 0.1\n", encoding="utf-8"
    )
    drawn = plan(
        str(tmp_path / "follow_ball.xml"),
        robot="fake",
        success=Success(function="judge.py:turned"),
        scene={"BallGreen.pan": 0.0, "BallGreen.distance": 1.0},
        disturbances={
            "breaks": Disturbance(at=0.2, fail=("HeadYaw", "HeadPitch"), kind=("stuck", "slow")),
            "jump": Disturbance(at=0.5, move="BallGreen", to={"pan": 0.4}),
        },
    )
    assert drawn.varying == ("breaks.fail", "breaks.kind")
    successes: dict[tuple[object, object], set[bool]] = {}
    for number in range(1, 9):
        outcome = run_trial(drawn, number)
        assert outcome.error == ""
        failure = outcome.values["breaks.fail"], outcome.values["breaks.kind"]
        successes.setdefault(failure, set()).add(outcome.success)
    assert successes == {
        ("HeadYaw", "stuck"): {False},
        ("HeadYaw", "slow"): {True},
        ("HeadPitch", "stuck"): {True},
        ("HeadPitch", "slow"): {True},
    }


def test_a_failure_with_an_end_is_over_then() -> None:
    # It searches half a second after it has lost the ball.
    outcomes = [
        run_trial(
            plan(
                FOLLOW,
                "search",
                robot="fake",
                limit=4.0,
                disturbances={"blind": Disturbance(at=0.5, fail="Camera", kind="black", seconds=seconds)},
            ),
            1,
        )
        for seconds in (0.3, 3.0)
    ]
    assert [outcome.success for outcome in outcomes] == [False, True]


def test_while_code_sleeps_the_trial_is_looked_at_and_ends_at_its_limit(tmp_path: Path) -> None:
    path = tmp_path / "sleeps.xml"
    code = "since = self.clock.now()\nself.sleep(2.0)\nsince = self.clock.now()\nself.sleep(60.0)"
    path.write_text(
        document(sub(1, 0, state(1, "only", code, initial=True), variables="since = 0.0")), "utf-8"
    )
    (tmp_path / "judge.py").write_text(
        "def since(run):\n    return run.variables('sleeps')['since']\n", encoding="utf-8"
    )
    outcome = run_trial(plan(str(path), samples={"since": "judge.py:since"}, limit=4.0), 1)
    assert (outcome.success, outcome.time) == (True, 4.0)
    # 20 of 41 looks come before the end of the first sleep, and the one at its moment after it.
    assert outcome.numbers["since mean"] == pytest.approx(2.0 * 21 / 41)
