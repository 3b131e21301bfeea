"""`visualhfsm trials`, as a user calls it: kept outcomes, a trial again, a comparison, a page."""

from __future__ import annotations

import csv
import re
import shutil
import signal
import sys
from pathlib import Path

import pytest

from tests.support.commands import run_here
from tests.support.documents import document, state, sub, transition
from tests.support.limits import RUN_LIMIT
from tests.support.places import ROOT
from tests.support.processes import ComponentProcess, module
from tests.support.waiting import until
from visualhfsm._base.errors import VisualHfsmError
from visualhfsm._commands.app import app
from visualhfsm._monitor.recordings import open_recording
from visualhfsm_trials._record import read_outcomes

pytestmark = pytest.mark.slow

PLAN = """
robot = "fake"
runs = 12
limit = 3

[scene]
BallGreen.pan = { from = -0.4, to = 0.4 }

[disturbances.carried]
at = { from = 1, to = 3 }
move = "BallGreen"
to = { pan = 3.1 }

[success]
state = "search"
"""


def write_into(folder: Path) -> Path:
    """Write a document and its plan into a folder."""
    (folder / "follow_ball.xml").write_bytes((ROOT / "behaviors" / "follow_ball.xml").read_bytes())
    (folder / "follow_ball.trials.toml").write_text(PLAN, encoding="utf-8")
    return folder


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    return write_into(tmp_path)


@pytest.fixture(scope="module")
def once(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder in which the trials have run once."""
    folder = write_into(tmp_path_factory.mktemp("once"))
    trials(folder, "follow_ball.xml", "--workers", "1")
    return folder


@pytest.fixture
def ran(tmp_path: Path, once: Path) -> Path:
    """A copy of it for a test that changes it; outcomes are of a folder with its name."""
    return shutil.copytree(once, tmp_path / once.name)


def trials(folder: Path, *arguments: str, code: int = 0) -> str:
    done = run_here(
        app, "visualhfsm", "trials", *arguments, cwd=folder, expected=(VisualHfsmError,), columns=100
    )
    assert done.returncode == code, done.stderr
    return done.stdout if code == 0 else done.stderr


def test_without_a_state_to_reach_it_says_what_success_is(tmp_path: Path) -> None:
    idle = document(sub(1, 0, state(1, "upright", initial=True)))
    (tmp_path / "idle.xml").write_text(idle, encoding="utf-8")
    asked = ("idle.xml", "--runs", "2", "--robot", "fake", "--limit", "1", "--workers", "1")
    shown = " ".join(trials(tmp_path, *asked).split())
    success = (
        "Success: no error ends it within 1 s, the robot does not fall, the properties of the document hold"
    )
    assert f"{success}; --success STATE asks for more." in shown
    assert "The 2 trials are equal" in shown
    shown = trials(tmp_path, *asked, "--success", "upright", "--again")
    assert "Success is true from the start in 2 of 2: that says nothing." in shown
    assert "--success STATE" not in shown


def test_a_trial_is_run_again_and_recorded_for_the_editor(folder: Path) -> None:
    document = folder / "follow_ball.xml"
    camera = "<iceinterface><nameinterface>Camera</nameinterface><interface>Camera</interface></iceinterface>"
    text = document.read_text(encoding="utf-8").replace("<config>", f"<config>{camera}")
    look = 'self.Camera.getImageData("RGB8")\nball = self.find_ball(color)'
    document.write_text(text.replace("<code>ball = self.find_ball(color)", f"<code>{look}"), "utf-8")
    text = trials(folder, "follow_ball.xml", "--only", "4", "--record", "4.mcap")
    assert trials(folder, "follow_ball.xml", "--only", "4") in text.replace("Recorded in 4.mcap", "")
    run = open_recording(folder / "4.mcap")
    ended = re.search(r"at ([\d.]+) s\n", text)
    assert ended
    assert run.log.newest is not None
    assert run.log.newest.component.time == pytest.approx(float(ended[1]), abs=0.06)
    assert run.pictures.cameras == ["Camera"]
    assert run.log.newest.robot.joints


def test_the_first_trial_is_1_in_the_table_in_the_terminal_and_for_only(ran: Path) -> None:
    shown = trials(ran, "follow_ball.xml", "--runs", "3")
    worst = re.search(r"The worst: (\d+), (\d+), (\d+)", shown)
    assert worst
    assert sorted(worst.groups()) == ["1", "2", "3"]
    with (ran / "follow_ball.outcomes.csv").open(encoding="utf-8-sig", newline="") as file:
        rows = {row["number"]: row for row in csv.DictReader(file)}
    assert [*rows] == ["1", "2", "3"]
    for number, row in rows.items():
        again = trials(ran, "follow_ball.xml", "--only", number)
        assert f"BallGreen.pan = {row['BallGreen.pan']}\n" in again
        assert f"trial {number} of follow_ball.xml: {row['reason'] or 'success'} at " in again
    assert "0 is not in the range x>=1" in trials(ran, "follow_ball.xml", "--only", "0", code=2)


def test_ctrl_c_keeps_what_is_done(folder: Path) -> None:
    plan = folder / "follow_ball.trials.toml"
    plan.write_text(PLAN.replace("runs = 12", "runs = 5000"), encoding="utf-8")
    outcomes = folder / "follow_ball.outcomes.jsonl"
    command = module("visualhfsm", "trials", "follow_ball.xml", "--workers", "1")
    with ComponentProcess(command, {"PYTHONPATH": str(ROOT)}, cwd=folder) as process:
        until(lambda: outcomes.exists() and len([*read_outcomes(outcomes)]) > 2, RUN_LIMIT)
        process.process.send_signal(signal.SIGINT)
        assert process.wait() == 130, process.output
    assert "of 5000 are done; the same command goes on" in process.output
    kept = len([*read_outcomes(outcomes)])
    plan.write_text(PLAN.replace("runs = 12", f"runs = {kept + 2}"), encoding="utf-8")
    assert f"goes on with the {kept} outcomes there" in trials(folder, "follow_ball.xml", "--workers", "1")


def test_two_documents_are_compared_on_the_same_trials(ran: Path) -> None:
    folder = ran
    text = (folder / "follow_ball.xml").read_text(encoding="utf-8")
    (folder / "slow.xml").write_text(text.replace("missed &gt; 10", "missed &gt; 30"), encoding="utf-8")
    shown = trials(folder, "follow_ball.xml", "slow.xml", "--workers", "1")
    assert re.search(r"0 gained, \d+ lost", shown)
    assert re.search(r"only follow_ball succeeds in \d+: ", shown)
    assert (folder / "slow.outcomes.csv").exists()


def test_parameters_are_tuned_and_tried_on_fresh_trials(folder: Path) -> None:
    text = (folder / "follow_ball.xml").read_text(encoding="utf-8")
    declared = "<parameters><parameter><name>patience</name><type>float</type><default>3</default></parameter></parameters>"
    tunable = text.replace("missed &gt; 10", "missed &gt; 20 * self.patience").replace(
        "<SubAutomata", declared + "<SubAutomata", 1
    )
    (folder / "tunable.xml").write_text(tunable, encoding="utf-8")
    ranges = "[parameters]\npatience = { from = 0.1, to = 3 }\n"
    (folder / "tunable.trials.toml").write_text(PLAN + ranges, encoding="utf-8")
    tune = ("tunable.xml", "--tune", "--settings", "6", "--runs", "4", "--workers", "1")
    shown = trials(folder, *tune)
    found = re.search(r"^patience = ([\d.]+)$", shown, re.M)
    assert found
    assert float(found[1]) < 1.5
    assert re.search(r"\d gained, 0 lost", shown)
    assert "goes on with the 4 outcomes there" in trials(folder, *tune)


def test_the_page_has_those_of_the_worst_trials_beside_it(ran: Path) -> None:
    folder = ran
    trials(folder, "follow_ball.xml", "--runs", "4", "--report", "pages/ball.html")
    pages = sorted(path.name for path in (folder / "pages" / "ball").iterdir())
    assert pages == ["1.html", "2.html", "3.html", "4.html"]
    assert (folder / "pages" / "ball.html").stat().st_size < 2e6


@pytest.mark.parametrize(
    ("arguments", "code", "message"),
    [
        (["follow_ball.xml", "--success", "found"], 1, "there is no state found; there are follow, search"),
        (["follow_ball.xml", "--record", "x.mcap"], 2, "--record needs --only NUMBER"),
        (["absent.xml"], 2, "absent.xml"),
        (["follow_ball.xml", "--tune"], 1, "no parameter has a range"),
        (["follow_ball.xml", "--tune", "--only", "3"], 2, "without --only"),
        (["follow_ball.xml"] * 3, 2, "at most two documents are compared"),
        (["follow_ball.xml", "--cluster", "no://127.0.0.1:1"], 1, "the cluster at no://127.0.0.1:1 cannot"),
        pytest.param(  # Dask tries that for 10 s
            ["follow_ball.xml", "--cluster", "tcp://127.0.0.1:1"],
            1,
            "the cluster at tcp://127.0.0.1:1 cannot",
            marks=pytest.mark.soak,
        ),
    ],
)
def test_what_is_not_possible_is_said_in_a_line(
    folder: Path, arguments: list[str], code: int, message: str
) -> None:
    assert message in trials(folder, *arguments, code=code)


def test_the_page_and_one_trial_again_end_though_trials_hang(folder: Path) -> None:
    hangs = document(
        sub(
            1,
            0,
            state(1, "waiting", "if self.turns == 2:\n    threading.Event().wait()", initial=True),
            state(2, "done"),
            transition(1, 1, 2, "100", type="time"),
        ),
        libraries=("threading",),
        head="<parameters><parameter><name>turns</name><type>int</type><default>1</default></parameter></parameters>",
    )
    (folder / "hangs.xml").write_text(hangs, encoding="utf-8")
    plan = 'robot = "none"\nruns = 4\nseed = 2\nlimit = 1\npatience = 5\n[parameters]\nturns = [1, 1, 2]\n[success]\nstate = "done"\n'
    (folder / "hangs.trials.toml").write_text(plan, encoding="utf-8")
    shown = trials(folder, "hangs.xml", "--report", "hangs.html")
    hung = [int(each) for each in re.findall(r"\d+", found_after("took more than 5 s", shown))]
    assert 0 < len(hung) < 4
    pages = {int(path.stem) for path in (folder / "hangs").iterdir()}
    assert pages == {1, 2, 3, 4} - {*hung}
    said = trials(folder, "hangs.xml", "--only", str(hung[0]), "--record", "hung.mcap")
    assert f"trial {hung[0]} of hangs.xml: took more than 5 s" in said
    assert not {*folder.glob("hung.mcap*")}


def test_a_missing_package_is_named_before_the_first_trial(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    shutil.copy(folder / "follow_ball.xml", folder / "other.xml")
    monkeypatch.setitem(sys.modules, "scipy", None)
    said = trials(folder, "follow_ball.xml", "other.xml", code=1)
    assert "pip install 'visualhfsm[trials]'" in said
    assert not {*folder.glob("*.jsonl")}


def found_after(words: str, text: str) -> str:
    """Return the rest of the line in which some words are."""
    return text[text.index(words) + len(words) :].partition("\n")[0]
