"""`visualhfsm verdict`: texts, JSON by its published schema, and exit codes."""

from __future__ import annotations

import json
import re
import signal
from pathlib import Path

import jsonschema  # type: ignore[import-untyped]
import msgspec
import pytest

from tests.support.commands import run_here
from tests.support.documents import document, state, sub, transition
from tests.support.limits import RUN_LIMIT
from tests.support.pages import DOCS
from tests.support.places import ROOT
from tests.support.processes import ComponentProcess, module
from tests.support.waiting import until
from visualhfsm import Verdict
from visualhfsm._commands.app import app

pytestmark = pytest.mark.slow


def moves(code: str = "") -> str:
    return document(
        sub(
            1,
            0,
            state(1, "wait", initial=True),
            state(2, "go", code),
            transition(3, 1, 2, "500", type="time"),
        )
    )


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "good.xml").write_text(moves())
    (tmp_path / "bad.xml").write_text(moves("x = 1\nraise ValueError('no')"))
    return tmp_path


def test_all_documents_of_a_folder_are_judged_and_one_that_is_not_ready_is_an_error(folder: Path) -> None:
    done = run_here(app, "visualhfsm", "verdict", ".", "--seconds", "1", cwd=folder)
    assert done.returncode == 1
    assert done.stdout.splitlines() == [
        "bad.xml: not ready",
        "  1. bad.xml:5: a run in virtual time failed: the code of bad raised ValueError: no (go)",
        *(line for line in done.stdout.splitlines() if line.startswith("       ")),
        "     > see it in a dry run: visualhfsm edit bad.xml",
        "  warning: bad.xml:4: the variable `x` is never read [W521] (code of go)",
        "good.xml: runs, and is not tested yet: ran 1 s, 0 proved, 0 tests",
        "  without a test or a proved property nothing shows that it does what it should",
    ]
    assert run_here(app, "visualhfsm", "verdict", "good.xml", "--seconds", "1", cwd=folder).returncode == 0


def test_what_it_survives_and_what_was_never_tried_is_said(folder: Path) -> None:
    config = (
        "<iceinterface><nameinterface>Battery</nameinterface><nameproxy>Battery</nameproxy>"
        "<interface>Battery</interface></iceinterface>"
    )
    stops, hangs = (
        document(
            sub(
                1,
                0,
                state(1, "awake", initial=True),
                state(2, "tired", code),
                transition(3, 1, 2, "self.Battery.getBatteryReading().charge < 0.1"),
            ),
            config=config,
            head='\n<survives part="Battery" kind="low"/>',
        )
        for code in ("", "self.sleep(60.0)")
    )
    (folder / "stops.xml").write_text(stops)
    (folder / "hangs.xml").write_text(hangs)
    command = ("verdict", "stops.xml", "--seconds", "3")
    done = run_here(app, "visualhfsm", *command, cwd=folder)
    assert done.returncode == 0
    shown = done.stdout.splitlines()
    assert shown[0].endswith("ran 3 s, 0 proved, 0 tests, 1 survived")
    assert "  survived: with Battery low it stopped at 2.0 s" in shown
    never = r"  never tried: \d+ of the \d+ failures that its robot can have: visualhfsm sweep stops.xml"
    assert re.fullmatch(never, shown[-1])
    done = run_here(app, "visualhfsm", "verdict", "hangs.xml", "--seconds", "3", cwd=folder)
    assert done.returncode == 1
    why = "  1. hangs.xml:2: it does not survive: with Battery low it hung at 2.0 s (tired)"
    assert why in done.stdout.splitlines()


def test_the_robot_of_the_run_is_chosen(folder: Path) -> None:
    options = ("verdict", "good.xml", "--seconds", "1", "--body")
    assert run_here(app, "visualhfsm", *options, "T1", cwd=folder).returncode == 0
    unknown = run_here(app, "visualhfsm", *options, "T9", cwd=folder)
    assert (unknown.returncode, unknown.stdout) == (2, "")
    assert "there is no body 'T9'" in unknown.stderr


def test_ctrl_c_leaves_no_file(folder: Path) -> None:
    files = folder / "temporary"
    files.mkdir()
    (folder / "slow.xml").write_text(moves("while self:\n    pass"))
    command = module("visualhfsm", "verdict", "slow.xml")
    with ComponentProcess(command, {"TMPDIR": str(files), "PYTHONPATH": str(ROOT)}, folder) as judging:
        until(
            lambda: all(any(files.glob(f"visualhfsm-{each}-*")) for each in ("trials", "verdict")), RUN_LIMIT
        )
        judging.process.send_signal(signal.SIGINT)
        assert judging.wait() == 130, judging.output
    assert not any(files.iterdir())


def test_json_is_valid_by_the_published_schema(folder: Path) -> None:
    done = run_here(
        app, "visualhfsm", "verdict", "good.xml", "bad.xml", "--json", "--seconds", "1", cwd=folder
    )
    assert done.returncode == 1
    jsonschema.validate(json.loads(done.stdout), published())
    good, bad = msgspec.json.decode(done.stdout, type=list[Verdict])
    assert (good.document, good.ready, bad.document, bad.ready) == ("good.xml", True, "bad.xml", False)
    assert [(reason.found, reason.line, reason.state) for reason in bad.reasons] == [("run", 5, "go")]


@pytest.mark.parametrize("text", ["", "hello", "<VisualHFSM/>"])
def test_json_is_printed_of_what_is_no_document(text: str, folder: Path) -> None:
    (folder / "none.xml").write_text(text)
    command = ("verdict", "none.xml", "good.xml", "--json", "--seconds", "1")
    done = run_here(app, "visualhfsm", *command, cwd=folder)
    assert done.returncode == 1
    none, good = msgspec.json.decode(done.stdout, type=list[Verdict])
    assert (none.document, none.ready, good.ready) == ("none.xml", False, True)
    assert none.reasons[0].found == "checks"


def test_the_published_schema_is_that_of_the_command() -> None:
    shown = json.loads(run_here(app, "visualhfsm", "verdict", "--schema").stdout)
    assert without_indentation(shown) == without_indentation(published())


@pytest.mark.parametrize(
    ("words", "said"),
    [((), "give a document, or --schema"), (("empty",), "no document found"), (("good.txt",), "good.txt")],
)
def test_without_a_document_it_is_used_wrongly(folder: Path, words: tuple[str, ...], said: str) -> None:
    (folder / "empty").mkdir()
    (folder / "good.txt").touch()
    done = run_here(app, "visualhfsm", "verdict", *words, cwd=folder)
    assert done.returncode == 2
    assert said in done.stderr


def without_indentation(schema: object) -> str:
    """Return a schema whose docstrings are the same on all Pythons: 3.13 takes their indentation away."""
    return re.sub(r"(\\n|\s)+", " ", json.dumps(schema))


def published() -> dict[str, object]:
    schema: dict[str, object] = json.loads((DOCS / "reference" / "verdict.schema.json").read_text("utf-8"))
    return schema
