"""A document earns points in the trials of an exercise, with reasons in words and figures."""

from __future__ import annotations

import re
import shutil
from pathlib import Path

import pytest

from tests.support.documents import document, state, sub, transition
from tests.support.places import ROOT
from visualhfsm_classes import Grader, GradingError, Marks, read_exercise
from visualhfsm_classes._grade import other_exercise
from visualhfsm_classes._page import write_page

EXERCISE = """
title = { en = "Wait", es = "Espera" }

[[criteria]]
asks = { en = "It finishes soon after the ball is gone", es = "Termina poco después" }
points = 4
state = "done"
after = "gone"
within = 0.5

[[criteria]]
asks = { en = "It begins", es = "Empieza" }
points = 2
state = "waiting"

[[criteria]]
asks = { en = "Judged", es = "Evaluado" }
points = 1
judge = "judge.py:good"

[events]
gone = { en = "the ball is gone", es = "desaparece el balón" }
"""
TRIALS = """
robot = "fake"
runs = 1
limit = 3

[disturbances.gone]
at = 1.0
move = "BallGreen"
to = { pan = 3.1 }
"""
JUDGE = """
def good(run):
    assert run.events == {"gone": 1.0}
    return 0.5, {"en": f"{len(run.moments)} moments", "es": f"{len(run.moments)} momentos"}
"""


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    folder = tmp_path / "wait"
    folder.mkdir()
    (folder / "exercise.toml").write_text(EXERCISE, "utf-8")
    (folder / "trials.toml").write_text(TRIALS, "utf-8")
    (folder / "judge.py").write_text(JUDGE, "utf-8")
    for language in ("en", "es"):
        (folder / f"task.{language}.md").write_text("Wait.\n", "utf-8")
    return folder


def grade(folder: Path, text: str, language: str = "en") -> Marks:
    submission = folder.parent / "submission"
    shutil.rmtree(submission, ignore_errors=True)
    submission.mkdir()
    path = submission / "wait.xml"
    path.write_text(text, "utf-8")
    return Grader(read_exercise(folder), path, language, unsafe=True).grade("ana")


def waits(milliseconds: int, code: str = "") -> str:
    return document(
        sub(
            1,
            0,
            state(1, "waiting", code, initial=True),
            state(2, "done"),
            transition(1, 1, 2, str(milliseconds), type="time"),
            period="20",
        )
    )


@pytest.mark.slow
def test_a_state_in_time_earns_its_points_and_the_same_ones_twice(folder: Path) -> None:
    marks = grade(folder, waits(1300))
    assert grade(folder, waits(1300)) == marks
    assert [each.points for each in marks.earned] == [4.0, 2.0, 0.5]
    assert [each.words for each in marks.earned] == [
        "goes to `done` 0.3 s after the ball is gone; asked: within 0.5 s",
        "begins in `waiting`",
        "31 moments",
    ]
    assert (marks.points, marks.of, marks.reason) == (6.5, 7.0, "")


@pytest.mark.slow
def test_the_page_names_the_worst_trial_by_the_number_that_the_command_for_trials_takes(folder: Path) -> None:
    plan = folder / "trials.toml"
    drawn = TRIALS.replace("at = 1.0", "at = [1.0, 2.0]").replace("runs = 1", "runs = 2\nseed = 1")
    plan.write_text(drawn, "utf-8")
    (folder / "judge.py").write_text(
        'def good(run):\n    return float(run.events["gone"] > 1.5), "early"\n', "utf-8"
    )
    submission = folder.parent / "wait.xml"
    submission.write_text(waits(100), "utf-8")
    exercise, page = read_exercise(folder), folder / "page.html"
    grader = Grader(exercise, submission, "en", unsafe=True)
    marks = grader.grade("ana")
    grader.record(marks, folder / "worst.mcap")
    write_page(page, exercise, marks, folder / "worst.mcap")
    assert [exercise.plans["trials"].draw(number)["gone.at"] for number in (1, 2)] == [2.0, 1.0]
    assert "trial 2 of 2" in page.read_text("utf-8")


@pytest.mark.slow
def test_words_are_in_the_language_that_is_asked_for(folder: Path) -> None:
    marks = grade(folder, waits(1300), "es")
    assert [each.words for each in marks.earned] == [
        "pasa a `done` en 0,3 s cuando desaparece el balón; se pide: en 0,5 s como máximo",
        "empieza en `waiting`",
        "31 momentos",
    ]
    assert marks.earned[0].asks == "Termina poco después"


@pytest.mark.slow
@pytest.mark.parametrize(
    ("milliseconds", "words", "states"),
    [
        (
            1800,
            "goes to `done` 0.8 s after the ball is gone; asked: within 0.5 s",
            "`waiting` for 1.8 s, `done` for 1.2 s",
        ),
        (9000, "never goes to `done` after the ball is gone; asked: within 0.5 s", "`waiting` all the time"),
    ],
)
def test_a_state_too_late_earns_nothing_and_is_told_what_it_did(
    folder: Path, milliseconds: int, words: str, states: str
) -> None:
    marks = grade(folder, waits(milliseconds))
    assert (marks.earned[0].points, marks.earned[0].words) == (0.0, words)
    assert marks.did == f"its states in the trial with the fewest points: {states}"
    assert marks.summary.endswith(marks.did)


@pytest.mark.slow
def test_only_the_first_of_many_states_are_told(folder: Path) -> None:
    back = transition(2, 2, 1, "100", type="time")
    text = waits(100).replace("<iteration_time>", f"{back}<iteration_time>")
    assert grade(folder, text, "es").did == (
        "sus estados en el ensayo con menos puntos: `waiting` durante 0,1 s, `done` durante 0,1 s, `waiting` "
        "durante 0,1 s, `done` durante 0,1 s, y así sucesivamente, 29 cambios en 3 s"
    )


@pytest.mark.parametrize(("handed_in", "other"), [("nod", "nod"), ("walk", "walk"), ("look", "")])
def test_a_document_of_another_exercise_is_recognized(handed_in: str, other: str) -> None:
    path = ROOT / "exercises" / handed_in / "solution/solution.xml"
    assert other_exercise(read_exercise(ROOT / "exercises/look"), path) == other


@pytest.mark.slow
def test_a_state_that_is_current_already_counts_at_once(folder: Path) -> None:
    earned = grade(folder, waits(500)).earned[0]
    assert (earned.points, earned.words) == (4.0, "is in `done` when the ball is gone; asked: within 0.5 s")


@pytest.mark.slow
def test_what_the_plan_asks_pupils_for_does_not_end_a_trial(folder: Path) -> None:
    with (folder / "trials.toml").open("a", encoding="utf-8") as file:
        file.write('\n[success]\nstate = "done"\n')
    marks = grade(folder, waits(1300))
    assert marks.earned[2].words == "31 moments"


@pytest.mark.slow
def test_code_that_fails_ends_a_trial_without_points(folder: Path) -> None:
    marks = grade(folder, waits(1300, "1 / 0"))
    assert marks.points == 0.0
    assert {each.words for each in marks.earned} == {"an error ended the trial"}
    said = r"ZeroDivisionError: division by zero, in state waiting, line \d+ of wait.xml$"
    assert re.search(said, marks.error)


@pytest.mark.slow
def test_the_state_whose_entry_fails_is_among_the_states_that_are_told(folder: Path) -> None:
    states = state(1, "waiting", initial=True), state(2, "done", "1 / 0")
    text = document(sub(1, 0, *states, transition(1, 1, 2, "500", type="time"), period="20"))
    marks = grade(folder, text)
    assert "ZeroDivisionError: division by zero, in state done" in marks.error
    assert marks.did.endswith("`waiting` for 0.5 s, `done` for 0 s")


@pytest.mark.slow
@pytest.mark.parametrize("replaced", ["len = lambda _: 0", "isinstance = lambda *_: True"])
def test_code_that_replaces_what_is_built_in_is_told_so(folder: Path, replaced: str) -> None:
    marks = grade(folder, waits(1300, f"import builtins\nbuiltins.{replaced}"))
    assert marks.points == 0.0
    assert "in state waiting" in marks.error
    assert "are builtins replaced?" in marks.error


@pytest.mark.slow
def test_what_a_submission_writes_into_reasons_controls_no_terminal(folder: Path) -> None:
    (folder / "judge.py").write_text("def good(run):\n    return 0.5, run.calls()[0].text\n", "utf-8")
    speech = "<iceinterface><nameinterface>Speech</nameinterface><interface>Speech</interface></iceinterface>"
    text = waits(1300, r"self.Speech.say('\x1b[2J \u202e')").replace("<config>", f"<config>{speech}")
    marks = grade(folder, text)
    assert marks.earned[2].points == 0.5
    assert marks.summary.isprintable()


@pytest.mark.slow
def test_a_document_that_cannot_be_run_has_no_points_and_a_reason(folder: Path) -> None:
    marks = grade(folder, waits(1300, "if :"))
    assert (marks.points, marks.of) == (0.0, 7.0)
    assert marks.reason.startswith("wait.xml:")
    assert str(folder.parent) not in marks.reason


def test_a_reason_in_one_line_has_no_excerpt_of_the_document(folder: Path) -> None:
    marks = grade(folder, waits(1300).replace("</SubAutomata>", "</Sub>"))
    assert "    </Sub>\n" in marks.reason
    assert re.fullmatch(
        r"It cannot be run, so there are no points: wait\.xml:\d+:\d+: error\[E502\]: .*mismatched tag",
        marks.summary,
    )


@pytest.mark.slow
def test_a_judge_that_fails_is_a_fault_of_the_exercise_and_no_end(folder: Path) -> None:
    (folder / "judge.py").write_text("def good(run):\n    return run.nothing\n", "utf-8")
    marks = grade(folder, waits(1300))
    assert [each.points for each in marks.earned] == [4.0, 2.0, 0.0]
    assert [each.failed for each in marks.earned] == [False, False, True]
    assert "AttributeError" in marks.earned[2].words


@pytest.mark.slow
def test_a_judge_that_returns_something_else_is_refused(folder: Path) -> None:
    (folder / "judge.py").write_text("def good(run):\n    return 2.0, 'well'\n", "utf-8")
    with pytest.raises(GradingError, match=r"judge.py:good: it must return a share from 0 to 1"):
        grade(folder, waits(1300))


@pytest.mark.slow
def test_a_robot_that_cannot_be_made_is_no_fault_of_a_submission(folder: Path) -> None:
    plan = TRIALS.replace('robot = "fake"', 'robot = "sim"\nscene.body = "Nao"')
    (folder / "trials.toml").write_text(plan, "utf-8")
    with pytest.raises(GradingError, match="trial 1 is not possible"):
        grade(folder, waits(1300))
