"""`visualhfsm grade` and `visualhfsm new --exercise`, as teachers call them: any name, any document, the same marks."""

from __future__ import annotations

import hashlib
import html
import os
import re
import shutil
import signal
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import pytest

from plugins.classes.tests.support.marks import marks_in
from tests.support.commands import run_here
from tests.support.limits import START_LIMIT
from tests.support.places import ROOT
from tests.support.processes import ComponentProcess, module
from tests.support.soak import cases, repeated
from tests.support.waiting import until
from visualhfsm._base.errors import VisualHfsmError
from visualhfsm._commands.app import app

pytestmark = pytest.mark.slow

LOOK: Final = ROOT / "exercises" / "look"
SOLUTION: Final = (LOOK / "solution/solution.xml").read_bytes()
NO_WAY_BACK: Final = (LOOK / "mistakes/no_way_back.xml").read_bytes()
IMPORTS: Final = "<VisualHFSM><SubAutomata id='1' idFather='0'><import>{}</import></SubAutomata></VisualHFSM>"


def visualhfsm(folder: Path, *arguments: str, code: int = 0, answers: bytes = b"") -> str:
    done = run_here(app, "visualhfsm", *arguments, cwd=folder, expected=(VisualHfsmError,), stdin=answers)
    assert done.returncode == code, done.stdout + done.stderr
    return done.stdout if code == 0 else done.stdout + done.stderr


def read(file: Path) -> str:
    return file.read_text("utf-8-sig")


def hand_in(folder: Path, name: str, content: bytes = SOLUTION) -> Path:
    path = folder / "handed-in" / name
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(content)
    return path


def brief(folder: Path) -> str:
    """Write our exercise with one trial and one mistake; return its path in the folder."""
    own = folder / "exercises" / "look"
    shutil.copytree(LOOK, own, ignore=shutil.ignore_patterns("hidden", "__pycache__"))
    file = own / "exercise.toml"
    file.write_text(re.sub("milliseconds = 0\n|same_side = 2\n", "", file.read_text("utf-8")), "utf-8")
    return "exercises/look"


def grade(folder: Path, *options: str, contained: bool = False) -> dict[str, dict[str, str]]:
    walls = () if contained else ("--unsafe",)
    visualhfsm(folder, "grade", "exercises/look", "handed-in", *walls, *options)
    return marks_in(folder / "marks")


BROKEN: Final = {
    "empty.xml": (b"", "error"),
    "open.xml": (b"<VisualHFSM>", "not closed"),
    "binary.xml": (b"\xff\xfe\x00", "error"),
    "paper.pdf": (b"%PDF", "hand in a file that ends in .xml"),
    "deep.xml": (b"<VisualHFSM>" * 20_000, "error"),
    "folder/x.xml": (b"<", "error"),
    "nothing/readme.txt": (b"", "the folder has no document"),
}
REACHES: Final = {
    "ends": ("import os\nos._exit(0)", "error ended"),
    "copies": (f"open({str(LOOK / 'solution/solution.xml')!r}).read()", "FileNotFoundError"),
}
ALSO_REACHES: Final = {
    "spies": ("open('/proc/1/environ').read()", "Error"),
    "connects": ("import socket\nsocket.create_connection(('127.0.0.1', 1), 1)", "Error"),
    "takes": ("x = bytearray(1 << 36)", "MemoryError"),
}
"""plugins/classes/tests/faults/test_grading_attacks.py has these, too."""
NAMES: Final = ("=HYPERLINK(1)", "a..b", "a b", "A-b", "index", "-rf", "caf\udce9", "x\ny")
SCRIPT: Final = "<script>alert(1)<_script>"


@dataclass(frozen=True)
class Class:
    """The marks of a class in which everything is handed in that a teacher could get."""

    folder: Path
    handed_in: int
    rows: Mapping[str, dict[str, str]]

    @property
    def marks(self) -> Path:
        """Where the pages are."""
        return self.folder / "marks"

    def points(self, *names: str) -> list[str]:
        """Return the points of some pupils."""
        return [self.rows[name]["points"] for name in names]


@pytest.fixture(scope="module")
def marked(tmp_path_factory: pytest.TempPathFactory) -> Class:
    folder = tmp_path_factory.mktemp("class")
    brief(folder)
    hand_in(folder, "ana.xml")
    hand_in(folder, "ben/look.xml", NO_WAY_BACK)
    hand_in(folder, "kim/look.xml", IMPORTS.format("rest.xml").encode())
    hand_in(folder, "kim/rest.xml")
    hand_in(folder, "uma.xml", b"")
    hand_in(folder, "uma/look.xml")
    for name, (content, _) in BROKEN.items():
        hand_in(folder, name, content)
    for name, (code, _) in {**REACHES, **repeated(test={}, soak=ALSO_REACHES)}.items():
        text = SOLUTION.decode().replace("<entry>", f"<entry>{html.escape(code)}\n", 1)
        hand_in(folder, f"{name}.xml", text.encode())
    hand_in(folder, "thief.xml", IMPORTS.format("ana.xml").encode())
    handed_in = folder / "handed-in"
    (handed_in / "eve.xml").symlink_to(LOOK / "solution/solution.xml")
    (handed_in / "max").symlink_to(LOOK / "solution")
    (handed_in / "tim").mkdir()
    (handed_in / "tim" / "look.xml").symlink_to(LOOK / "solution/solution.xml")
    os.mkfifo(handed_in / "pip.xml")
    hand_in(folder, f"{SCRIPT}.xml", NO_WAY_BACK)
    try:
        for name in NAMES:
            hand_in(folder, f"{name}.xml", b"")
    except OSError:
        pytest.skip("the file system has no such names")
    number = len([*handed_in.iterdir()])
    return Class(folder, number, grade(folder, "--language", "xx", contained=True))


def test_a_folder_may_have_documents_that_one_imports(marked: Class) -> None:
    assert marked.points("kim") == ["10"]
    assert len(marked.rows) == marked.handed_in


def test_a_document_and_a_folder_of_one_name_have_pages_of_their_own(marked: Class) -> None:
    assert marked.points("uma.xml", "uma") == ["0", "10"]
    index = (marked.marks / "index.html").read_text("utf-8")
    links = [re.search(rf'href="([^"]+)">{re.escape(name)}</a>', index) for name in ("uma.xml", "uma")]
    pages = [(marked.marks / link[1]).read_text("utf-8") for link in links if link is not None]
    assert [f"<h1>{name}</h1>" in page for name, page in zip(("uma.xml", "uma"), pages, strict=True)] == [
        True,
        True,
    ]


def test_a_page_that_cannot_be_written_costs_that_page(tmp_path: Path) -> None:
    brief(tmp_path)
    for name in ("ana", "ben"):
        hand_in(tmp_path, f"{name}.xml", b"")
    in_its_place = tmp_path / "marks" / "ana.html"
    in_its_place.mkdir(parents=True)
    said = visualhfsm(tmp_path, "grade", "exercises/look", "handed-in", "--unsafe", code=1)
    assert f"error: {in_its_place.relative_to(tmp_path)}: the page cannot be written" in said
    assert "the marks are in marks/marks.csv" in said
    assert {path.name for path in in_its_place.parent.iterdir()} >= {"ben.html", "index.html", "marks.csv"}


def test_what_a_teacher_changed_stays_and_is_named_until_asked_about(tmp_path: Path) -> None:
    brief(tmp_path)
    marks = tmp_path / "marks"
    command = ("grade", "exercises/look", "handed-in", "--unsafe", "--language", "en")
    for name in ("ana", "ben", "eva", "tom"):
        hand_in(tmp_path, f"{name}.xml", b"")
    visualhfsm(tmp_path, *command)
    first = marks_in(marks)
    assert first["ana"]["document"] == hashlib.sha256(b"").hexdigest()[:12]
    assert f"Document {first['ana']['document']} of {first['ana']['handed in']}" in read(marks / "ana.html")

    table = marks / "marks.csv"
    table.write_text(read(table).replace("ana,0,", "ana,9,").replace("tom,0,", "tom,8,"), "utf-8")
    comment = read(marks / "ana.md") + "Well drawn."
    (marks / "ana.md").write_text(comment, "utf-8")
    for name in ("ana", "eva"):
        hand_in(tmp_path, f"{name}.xml", b"<")
    for name in ("ben", "tom"):
        (tmp_path / "handed-in" / f"{name}.xml").unlink()
    for _ in range(2):  # what stays once stays
        said = visualhfsm(tmp_path, *command)
        assert "changed it: ana.md, marks.csv: ana, marks.csv: tom; --again" in said
        assert read(marks / "ana.md") == comment
        now = marks_in(marks)
        assert {name: row["points"] for name, row in now.items()} == {
            "ana": "9",
            "eva": "0",
            "ben": "0",
            "tom": "8",
        }
        second = hashlib.sha256(b"<").hexdigest()[:12]
        assert now["ana"]["document"] == first["ana"]["document"]
        assert now["ana"]["note"] == f"changed by hand; the document {second} earns 0"
        assert now["eva"]["document"] == second
        assert now["ben"]["note"] == now["tom"]["note"] != now["eva"]["note"] == ""
        assert now["ben"]["note"] in read(marks / "index.html")

    for answers, points in ((b"n\n" * 3, "9"), (b"", "9"), (b"y\ny\nn\n", "0")):
        visualhfsm(tmp_path, *command, "--again", answers=answers)
        assert marks_in(marks)["ana"]["points"] == points
    assert marks_in(marks)["tom"]["points"] == "8"
    assert read(marks / "ana.md") == comment


def test_a_table_of_a_teachers_own_columns_stays_whole(tmp_path: Path) -> None:
    brief(tmp_path)
    hand_in(tmp_path, "ana.xml", b"")
    grade(tmp_path)
    table = tmp_path / "marks" / "marks.csv"
    own = read(table).replace(",", ";")
    table.write_text(own, "utf-8")
    for option in ((), ("--language", "es")):
        said = visualhfsm(tmp_path, "grade", "exercises/look", "handed-in", "--unsafe", *option)
        assert "changed it: marks.csv; --again" in said
        assert read(table) == own


def test_marks_in_another_language_keep_who_has_gone(tmp_path: Path) -> None:
    brief(tmp_path)
    hand_in(tmp_path, "ana.xml", b"")
    hand_in(tmp_path, "ben.xml", b"")
    grade(tmp_path, "--language", "en")
    (tmp_path / "handed-in" / "ben.xml").unlink()
    rows = grade(tmp_path, "--language", "es")
    assert rows["ben"]["points"] == "0"
    assert rows["ben"]["note"]


def test_marks_are_the_same_byte_for_byte_with_any_number_of_workers(tmp_path: Path) -> None:
    brief(tmp_path)
    others = repeated(
        test=[b"", b"<"],
        soak=[(LOOK / f"mistakes/{name}.xml").read_bytes() for name in ("milliseconds", "same_side")],
    )
    for number, content in enumerate((NO_WAY_BACK, *others)):
        hand_in(tmp_path, f"pupil {number}.xml", content)
    table, index = tmp_path / "marks" / "marks.csv", tmp_path / "marks" / "index.html"
    rows = grade(tmp_path, "--workers", "1", "--language", "es")
    assert rows["pupil 0"]["reasons"].startswith("cambios de lado en 9 s: 1")
    first = table.read_bytes(), index.read_bytes()
    grade(tmp_path, "--workers", repeated(test="2", soak="3"), "--language", "es")
    assert (table.read_bytes(), index.read_bytes()) == first


@pytest.mark.parametrize("file", BROKEN)
def test_what_cannot_be_run_has_no_points_and_a_reason(marked: Class, file: str) -> None:
    row = marked.rows[file.partition("/")[0].removesuffix(".xml")]
    assert row["points"] == "0"
    assert "It cannot be run, so there are no points" in row["reasons"]
    assert BROKEN[file][1] in row["reasons"]


@pytest.mark.parametrize("name", cases(REACHES, soak=ALSO_REACHES))
def test_code_that_reaches_for_more_has_no_points_and_a_reason(marked: Class, name: str) -> None:
    assert marked.points(name) == ["0"]
    assert {**REACHES, **ALSO_REACHES}[name][1] in marked.rows[name]["reasons"]


def test_a_link_to_the_solution_is_not_followed(marked: Class) -> None:
    assert marked.points("ana", "eve", "max", "pip", "tim") == ["10", "0", "0", "0", "0"]


def test_nobody_imports_the_document_of_somebody_else(marked: Class) -> None:
    assert marked.points("ana", "thief") == ["10", "0"]


def test_a_name_is_data(marked: Class) -> None:
    assert {"'=HYPERLINK(1)", "'-rf", r"caf\udce9", SCRIPT} <= {*marked.rows}
    pages = sorted(path.name for path in marked.marks.glob("*.html"))
    assert len(pages) == marked.handed_in + 1
    assert all(re.fullmatch(r"[A-Za-z0-9_.-]+", page) for page in pages)
    assert all("<script>alert" not in path.read_text("utf-8") for path in marked.marks.glob("*.html"))
    assert sorted(path.name for path in marked.folder.iterdir()) == ["exercises", "handed-in", "marks"]


def test_a_signal_ends_grading_and_its_processes(tmp_path: Path) -> None:
    hangs = SOLUTION.replace(b"<entry>", b"<entry>import threading; threading.Event().wait()\n", 1)
    hand_in(tmp_path, "eve.xml", hangs)
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


def test_an_exercise_checks_itself_and_finds_what_does_not_earn_what_it_says(tmp_path: Path) -> None:
    own = brief(tmp_path)
    assert "no_way_back" in visualhfsm(tmp_path, "grade", own, "--check", "--unsafe", "--workers", "1")
    file = tmp_path / own / "exercise.toml"
    file.write_text(file.read_text("utf-8").replace("no_way_back = 7", "no_way_back = 6"), "utf-8")
    assert "no_way_back" in visualhfsm(
        tmp_path, "grade", own, "--check", "--unsafe", "--workers", "1", code=1
    )


def test_an_exercise_is_given_in_the_language_of_the_system_whose_locale_is_not_there(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name in ("LANGUAGE", "LC_ALL", "LC_MESSAGES"):
        monkeypatch.delenv(name, raising=False)
    for language, words, task in (
        ("es_XX.UTF-8", "Ahora: lee task.md", "# Mira"),
        ("C", "Next: read", "# Look"),
    ):
        monkeypatch.setenv("LANG", language)
        assert words in visualhfsm(tmp_path, "new", language, "--exercise", "look")
        assert (tmp_path / language / "task.md").read_text().startswith(task)


def test_a_pupil_gets_the_task_and_nothing_hidden(tmp_path: Path) -> None:
    visualhfsm(tmp_path, "new", "ana", "--exercise", "nod", "--language", "es")
    folder = tmp_path / "ana"
    files = sorted(path.name for path in folder.iterdir())
    assert files == ["nod.trials.toml", "nod.xml", "task.en.md", "task.md"]
    task = (folder / "task.md").read_text("utf-8")
    assert task.startswith("# Di que sí tres veces")
    assert "| Después pasa a `done` | 2 |" in task
    assert (folder / "nod.xml").read_bytes() == (ROOT / "exercises/nod/start.xml").read_bytes()
    (folder / "nod.xml").write_bytes((ROOT / "exercises/nod/solution/solution.xml").read_bytes())
    assert "1 of 1 succeed" in visualhfsm(folder, "trials", "nod.xml", "--workers", "1")


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
        (["new", "ana", "--hardware", "--exercise", "look"], "give either --hardware or --exercise"),
        (["grade", "look", "empty"], "there are no submissions"),
    ],
)
def test_what_is_wrong_is_named(tmp_path: Path, arguments: list[str], error: str) -> None:
    hand_in(tmp_path, "ana.xml")
    (tmp_path / "empty").mkdir()
    code = 2 if "either" in error or "needs" in error else 1
    assert re.search(error, " ".join(visualhfsm(tmp_path, *arguments, code=code).split()))
