"""`visualhfsm grade` and `visualhfsm new --exercise`, as teachers call them: any name, any document, the same marks."""

from __future__ import annotations

import csv
import html
import os
import re
import signal
import subprocess
from pathlib import Path

import pytest

from tests.support.limits import RUN_LIMIT, START_LIMIT
from tests.support.places import ROOT
from tests.support.processes import ComponentProcess, module
from tests.support.waiting import until

pytestmark = pytest.mark.slow

LOOK = ROOT / "exercises" / "look"


def visualhfsm(folder: Path, *arguments: str, code: int = 0, **environment: str) -> str:
    done = subprocess.run(
        module("visualhfsm", *arguments),
        cwd=folder,
        capture_output=True,
        text=True,
        timeout=RUN_LIMIT,
        check=False,
        env={"PYTHONPATH": str(ROOT), "PATH": "/usr/bin:/bin", "COLUMNS": "120", **environment},
    )
    assert done.returncode == code, done.stdout + done.stderr
    return done.stdout if code == 0 else done.stdout + done.stderr


def hand_in(folder: Path, name: str, document: str = "solution/solution.xml") -> Path:
    path = folder / "handed-in" / name
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes((LOOK / document).read_bytes())
    return path


def grade(folder: Path, *options: str, contained: bool = False) -> dict[str, dict[str, str]]:
    walls = () if contained else ("--unsafe",)
    visualhfsm(folder, "grade", "look", "handed-in", *walls, *options)
    with (folder / "marks" / "marks.csv").open(encoding="utf-8-sig", newline="") as file:
        return {row["name"]: row for row in csv.DictReader(file)}


def test_a_class_gets_marks_reasons_and_pages(tmp_path: Path) -> None:
    hand_in(tmp_path, "ana.xml")
    hand_in(tmp_path, "ben/look.xml", "mistakes/no_way_back.xml")
    rows = grade(tmp_path)
    assert {name: row["points"] for name, row in rows.items()} == {"ana": "10", "ben": "7"}
    assert rows["ben"]["reasons"] == "changes of side in 9 s: 1; asked: at least 3"
    page = (tmp_path / "marks" / "ben.html").read_text("utf-8")
    assert "changes of side in 9 s: 1; asked: at least 3" in page
    assert "<iframe" in page
    assert "ben.html" in (tmp_path / "marks" / "index.html").read_text("utf-8")


def test_a_folder_may_have_documents_that_one_imports(tmp_path: Path) -> None:
    hand_in(tmp_path, "ana/look.xml").write_text(
        "<VisualHFSM><SubAutomata id='1' idFather='0'><import>rest.xml</import></SubAutomata></VisualHFSM>"
    )
    hand_in(tmp_path, "ana/rest.xml")
    assert grade(tmp_path)["ana"]["points"] == "10"


def test_marks_are_the_same_byte_for_byte_with_any_number_of_workers(tmp_path: Path) -> None:
    for number, mistake in enumerate(("milliseconds", "no_way_back", "same_side")):
        hand_in(tmp_path, f"pupil {number}.xml", f"mistakes/{mistake}.xml")
    table, index = tmp_path / "marks" / "marks.csv", tmp_path / "marks" / "index.html"
    grade(tmp_path, "--workers", "1")
    first = table.read_bytes(), index.read_bytes()
    grade(tmp_path, "--workers", "3")
    assert (table.read_bytes(), index.read_bytes()) == first


@pytest.mark.parametrize(
    ("name", "content", "reason"),
    [
        ("a.xml", b"", "error"),
        ("a.xml", b"<VisualHFSM>", "not closed"),
        ("a.xml", b"\xff\xfe\x00", "error"),
        ("a.pdf", b"%PDF", "hand in a file that ends in .xml"),
        ("a.xml", b"<VisualHFSM>" * 20_000, "error"),
        ("a/x.xml", b"<", "error"),
        ("a/readme.txt", b"", "the folder has no document"),
    ],
)
def test_what_cannot_be_run_has_no_points_and_a_reason(
    tmp_path: Path, name: str, content: bytes, reason: str
) -> None:
    hand_in(tmp_path, "zoe.xml")
    hand_in(tmp_path, name).write_bytes(content)
    rows = grade(tmp_path)
    (broken,) = (row for row in rows.values() if row["name"] != "zoe")
    assert broken["points"] == "0"
    assert "It cannot be run, so there are no points" in broken["reasons"]
    assert reason in broken["reasons"]
    assert rows["zoe"]["points"] == "10"


@pytest.mark.parametrize(
    ("code", "reason"),
    [
        ("import os\nos._exit(0)", "error ended"),
        ("open('/proc/1/environ').read()", "Error"),
        (f"open({str(LOOK / 'solution/solution.xml')!r}).read()", "FileNotFoundError"),
        ("import socket\nsocket.create_connection(('127.0.0.1', 1), 1)", "Error"),
        ("x = bytearray(1 << 36)", "MemoryError"),
    ],
)
def test_code_that_reaches_for_more_has_no_points_and_a_reason(
    tmp_path: Path, code: str, reason: str
) -> None:
    hand_in(tmp_path, "ana.xml")
    text = (LOOK / "solution/solution.xml").read_text("utf-8")
    bad = text.replace("<entry>", f"<entry>{html.escape(code)}\n", 1)
    hand_in(tmp_path, "eve.xml").write_text(bad, "utf-8")
    rows = grade(tmp_path, contained=True)
    assert rows["ana"]["points"] == "10"
    assert rows["eve"]["points"] == "0"
    assert reason in rows["eve"]["reasons"]


def test_a_signal_ends_grading_and_its_processes(tmp_path: Path) -> None:
    text = (LOOK / "solution/solution.xml").read_text("utf-8")
    hand_in(tmp_path, "eve.xml").write_text(text.replace("<entry>", "<entry>while True: pass\n", 1), "utf-8")
    command = module("visualhfsm", "grade", "look", "handed-in", "--unsafe")
    with ComponentProcess(command, {"PYTHONPATH": str(ROOT)}, cwd=tmp_path) as grading:
        until(lambda: children(grading.process.pid), START_LIMIT)
        begun = children(grading.process.pid)
        grading.process.send_signal(signal.SIGINT)
        assert grading.wait() == 130
        until(lambda: not any(Path(f"/proc/{each}").exists() for each in begun))
    assert not (tmp_path / "marks" / "marks.csv").exists()


def children(process: int) -> list[str]:
    """Return the ids of the processes that the threads of a process have started."""
    tasks = Path(f"/proc/{process}/task").glob("*/children")
    return [each for task in tasks for each in task.read_text().split()]


def test_a_link_to_the_solution_is_not_followed(tmp_path: Path) -> None:
    hand_in(tmp_path, "ana.xml")
    (tmp_path / "handed-in" / "eve.xml").symlink_to(LOOK / "solution/solution.xml")
    (tmp_path / "handed-in" / "max").symlink_to(LOOK / "solution")
    (tmp_path / "handed-in" / "tim").mkdir()
    (tmp_path / "handed-in" / "tim" / "look.xml").symlink_to(LOOK / "solution/solution.xml")
    os.mkfifo(tmp_path / "handed-in" / "pip.xml")
    rows = grade(tmp_path)
    assert {name: row["points"] for name, row in rows.items()} == {
        "ana": "10", "eve": "0", "max": "0", "pip": "0", "tim": "0",
    }  # fmt: skip


def test_nobody_imports_the_document_of_somebody_else(tmp_path: Path) -> None:
    hand_in(tmp_path, "ana.xml")
    hand_in(tmp_path, "eve.xml").write_text(
        "<VisualHFSM><SubAutomata id='1' idFather='0'><import>ana.xml</import></SubAutomata></VisualHFSM>"
    )
    assert grade(tmp_path)["eve"]["points"] == "0"


def test_a_name_is_data(tmp_path: Path) -> None:
    names = [
        "=HYPERLINK(1)",
        "<script>alert(1)</script>",
        "a..b",
        "a b",
        "A-b",
        "index",
        "-rf",
        "caf\udce9",
        "x\ny",
    ]
    for name in names:
        try:
            hand_in(tmp_path, f"{name.replace('/', '_')}.xml", "mistakes/same_side.xml")
        except OSError:
            pytest.skip("the file system has no such names")
    rows = grade(tmp_path)
    assert len(rows) == len(names)
    assert "'=HYPERLINK(1)" in rows
    assert "'-rf" in rows
    assert r"caf\udce9" in rows
    marks = tmp_path / "marks"
    pages = sorted(path.name for path in marks.glob("*.html"))
    assert len(pages) == len(names) + 1
    assert all(re.fullmatch(r"[A-Za-z0-9_.-]+", page) for page in pages)
    assert all("<script>alert" not in path.read_text("utf-8") for path in marks.glob("*.html"))
    assert sorted(path.name for path in tmp_path.iterdir()) == ["handed-in", "marks"]


def test_marks_are_in_the_language_of_the_system(tmp_path: Path) -> None:
    hand_in(tmp_path, "ana.xml", "mistakes/no_way_back.xml")
    assert grade(tmp_path, "--language", "es")["ana"]["reasons"].startswith("cambios de lado en 9 s: 1")
    assert grade(tmp_path, "--language", "xx")["ana"]["reasons"].startswith("changes of side in 9 s: 1")


def test_an_exercise_checks_itself(tmp_path: Path) -> None:
    assert "no_way_back" in visualhfsm(tmp_path, "grade", "look", "--check", "--unsafe")


def test_an_exercise_that_does_not_earn_what_it_says_is_found(tmp_path: Path) -> None:
    own = tmp_path / "own"
    visualhfsm(tmp_path, "new", "pupil", "--exercise", "look")
    own.mkdir()
    for path in LOOK.rglob("*"):
        if path.is_file() and "__pycache__" not in path.parts:
            target = own / path.relative_to(LOOK)
            target.parent.mkdir(parents=True, exist_ok=True)
            target.write_bytes(path.read_bytes())
    file = own / "exercise.toml"
    file.write_text(file.read_text("utf-8").replace("no_way_back = 7", "no_way_back = 6"), "utf-8")
    assert "no_way_back" in visualhfsm(tmp_path, "grade", "own", "--check", "--unsafe", code=1)


def test_a_pupil_gets_the_task_and_nothing_hidden(tmp_path: Path) -> None:
    visualhfsm(tmp_path, "new", "ana", "--exercise", "nod", "--language", "es")
    folder = tmp_path / "ana"
    assert sorted(path.name for path in folder.iterdir()) == ["nod.trials.toml", "nod.xml", "task.md"]
    task = (folder / "task.md").read_text("utf-8")
    assert task.startswith("# Di que sí tres veces")
    assert "| Después pasa a `done` | 2 |" in task
    assert (folder / "nod.xml").read_bytes() == (ROOT / "exercises/nod/start.xml").read_bytes()
    (folder / "nod.xml").write_bytes((ROOT / "exercises/nod/solution/solution.xml").read_bytes())
    assert "1 of 1 succeed" in visualhfsm(folder, "trials", "nod.xml")


def test_an_exercise_without_a_start_begins_with_an_empty_document(tmp_path: Path) -> None:
    own = tmp_path / "own"
    (own).mkdir()
    for name in ("exercise.toml", "trials.toml", "task.en.md", "task.es.md", "judge.py"):
        (own / name).write_bytes((LOOK / name).read_bytes())
    text = (own / "exercise.toml").read_text("utf-8")
    (own / "exercise.toml").write_text(text.partition("# The points")[0], "utf-8")
    visualhfsm(tmp_path, "new", "ana", "--exercise", "own")
    assert b"<SubAutomata" in (tmp_path / "ana" / "own.xml").read_bytes()


@pytest.mark.parametrize(
    ("arguments", "error"),
    [
        (["grade", "lok", "handed-in"], "there is no exercise lok: .*one of ours: .*look"),
        (["grade", "look"], "give either SUBMISSIONS or --check"),
        (["new", "handed-in", "--exercise", "look"], "handed-in is not empty"),
        (["new", "ana", "--language", "es"], "--language needs --exercise"),
        (["grade", "look", "empty"], "there are no submissions"),
    ],
)
def test_what_is_wrong_is_named(tmp_path: Path, arguments: list[str], error: str) -> None:
    hand_in(tmp_path, "ana.xml")
    (tmp_path / "empty").mkdir()
    code = 2 if "either" in error or "needs" in error else 1
    assert re.search(error, " ".join(visualhfsm(tmp_path, *arguments, code=code).split()))
