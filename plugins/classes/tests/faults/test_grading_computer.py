"""A computer that cannot grade is named, and no pupil gets marks for that: `visualhfsm grade` as teachers call it.

A file `sitecustomize.py`, which every Python of the command loads, breaks the computer for some of its processes.
"""

from __future__ import annotations

import os
import shutil
import subprocess
from collections.abc import Mapping
from pathlib import Path
from typing import Final, NamedTuple

import pytest

from plugins.classes.tests.support.marks import marks_in
from tests.support.documents import document, state, sub
from tests.support.limits import RUN_LIMIT
from tests.support.places import ROOT
from tests.support.processes import module
from tests.support.soak import cases

pytestmark = pytest.mark.slow

LOOK: Final = ROOT / "exercises" / "look"
SIMULATED: Final = """
title = { en = "Look" }

[[criteria]]
asks = { en = "It goes on" }
points = 1
state = "looks"
"""
"""An exercise whose robot is simulated."""
IN_THE_GRADER: Final = """
import errno, os, signal, sys
def breaks(event, arguments):
    {what}
if "visualhfsm_classes._worker" in sys.orig_argv:
    sys.addaudithook(breaks)
"""
ILLEGAL: Final = "import os, signal; os.kill(os.getpid(), signal.SIGILL)"
"""What a package does that needs another processor."""


class Fault(NamedTuple):
    """A fault of a computer, and what the command says of it."""

    said: str
    breaks: str = ""
    """The body of an audit hook in the process that grades."""
    files: Mapping[str, str] = {}
    """Modules of Python that come before those that are installed."""
    walls: str = ""
    """What bubblewrap says, and ends, if its arguments have a word."""
    word: str = ""
    environment: Mapping[str, str] = {}
    simulated: bool = False


FAULTS: Final = {
    "a processor without AVX": Fault(
        "with a document that does nothing, the program that grades: it was ended by SIGILL (the processor of this "
        "computer lacks an instruction that a package needs, such as those of AVX)",
        files={"mujoco/__init__.py": ILLEGAL}, simulated=True,
    ),
    "a package that does not load": Fault(
        "the program that grades: it was ended by SIGILL (the processor of this computer lacks an instruction that a "
        "package needs, such as those of AVX) before it was ready",
        breaks="if event == 'import' and arguments[0] == 'msgspec': os.kill(os.getpid(), signal.SIGILL)",
    ),
    "a grader that cannot be imported": Fault(
        "the program that grades: it has ended before it was ready", breaks="raise ImportError",
    ),
    "a full disk": Fault(
        "No space left on device",
        breaks="if event == 'tempfile.mkdtemp': raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))",
    ),
    "no more processes": Fault(
        "no process can be started: Resource temporarily unavailable",
        breaks="if event == 'subprocess.Popen' and 'visualhfsm_classes.contained' in arguments[1]: "
        "raise BlockingIOError(errno.EAGAIN, os.strerror(errno.EAGAIN))",
    ),
    "no more namespaces for code": Fault(
        "the program that is to run their code ended with exit code 1: bwrap: Creating new namespace failed",
        walls="bwrap: Creating new namespace failed", word="visualhfsm_classes.contained",
    ),
    "no more namespaces for the compiler": Fault(
        "the program that is to run their code ended with exit code 1: bwrap: Creating new namespace failed",
        walls="bwrap: Creating new namespace failed", word="/packages/compile.py look.xml",
    ),
    "no GL": Fault(
        "the cameras are off: rendering is switched off by MUJOCO_GL=disable: unset it",
        environment={"MUJOCO_GL": "disable"}, simulated=True,
    ),
}  # fmt: skip


def looks() -> str:
    """Return a document that looks with a camera, and goes on if it sees nothing."""
    interface = (
        "<iceinterface><nameinterface>Camera</nameinterface><nameproxy>Camera</nameproxy>"
        "<interface>Camera</interface></iceinterface>"
    )
    code = "try:\n    self.Camera.getImageData('RGB8')\nexcept Exception:\n    pass"
    return document(sub(1, 0, state(1, "looks", code, initial=True)), config=interface)


def prepare(folder: Path, *, simulated: bool = False) -> Path:
    """Write an exercise with one trial, and two documents that are handed in; return the exercise."""
    exercise = folder / "look"
    handed_in = folder / "handed-in"
    handed_in.mkdir()
    if simulated:
        exercise.mkdir()
        (exercise / "exercise.toml").write_text(SIMULATED, "utf-8")
        (exercise / "trials.toml").write_text(
            'robot = "sim"\ncamera = "rendered"\nruns = 1\nlimit = 0.2\n', "utf-8"
        )
        (exercise / "task.en.md").write_text("Look.\n", "utf-8")
        text = looks()
    else:
        shutil.copytree(LOOK, exercise, ignore=shutil.ignore_patterns("hidden", "__pycache__"))
        text = (LOOK / "solution/solution.xml").read_text("utf-8")
    for name in ("ana", "ben"):
        (handed_in / f"{name}.xml").write_text(text, "utf-8")
    return exercise


def grade(folder: Path, fault: Fault) -> subprocess.CompletedProcess[str]:
    modules = folder / "modules"
    modules.mkdir()
    files = {**fault.files}
    if fault.breaks:
        files["sitecustomize.py"] = IN_THE_GRADER.format(what=fault.breaks)
    for name, text in files.items():
        (modules / name).parent.mkdir(exist_ok=True)
        (modules / name).write_text(text, "utf-8")
    if fault.walls:
        walls = folder / "bin" / "bwrap"
        walls.parent.mkdir()
        real = shutil.which("bwrap")
        assert real is not None
        walls.write_text(
            f'#!/bin/sh\ncase "$*" in *"{fault.word}"*) echo "{fault.walls}" >&2; exit 1;; esac\nexec {real} "$@"\n'
        )
        walls.chmod(0o755)
    environment = {
        **os.environ,
        "PYTHONPATH": os.pathsep.join([str(modules), str(ROOT)]),
        "PATH": os.pathsep.join([str(folder / "bin"), os.environ["PATH"]]),
        "TMPDIR": str(folder),
        **fault.environment,
    }
    command = module("visualhfsm", "grade", "look", "handed-in", "--workers", "1", "--language", "en")
    return subprocess.run(
        command, cwd=folder, env=environment, capture_output=True, text=True, timeout=RUN_LIMIT, check=False
    )


@pytest.mark.parametrize(
    "name",
    cases(
        ["a processor without AVX", "a package that does not load", "a full disk", "no more namespaces for code", "no GL"],
        soak=["a grader that cannot be imported", "no more processes", "no more namespaces for the compiler"],
    ),
)  # fmt: skip
def test_a_computer_that_cannot_grade_gives_no_marks_and_is_named(tmp_path: Path, name: str) -> None:
    fault = FAULTS[name]
    prepare(tmp_path, simulated=fault.simulated)
    done = grade(tmp_path, fault)
    words = " ".join(done.stderr.split())
    assert (done.returncode, fault.said in words) == (1, True), done.stdout + done.stderr
    assert "this computer cannot grade, which is no fault of a submission" in words
    assert [*(tmp_path / "marks").iterdir(), *tmp_path.glob("visualhfsm-*")] == []


def test_a_judge_that_ends_the_program_that_grades_is_named(tmp_path: Path) -> None:
    exercise = prepare(tmp_path)
    with (exercise / "judge.py").open("a", encoding="utf-8") as judge:
        judge.write("\n\ndef left_first(run):\n    import os\n    os._exit(0)\n")
    done = grade(tmp_path, Fault(""))
    words = " ".join(done.stderr.split())
    assert done.returncode == 1, done.stdout + done.stderr
    assert "it has ended; a judge of the exercise that hangs, or ends its process, does that, too" in words


ENDS_THE_READER: Final = Fault(
    "", breaks="if event == 'open' and 'bad.xml' in str(arguments[0]): os.kill(os.getpid(), signal.SIGSEGV)"
)


def test_a_document_that_ends_the_program_that_grades_costs_its_own_marks(tmp_path: Path) -> None:
    prepare(tmp_path)
    (tmp_path / "handed-in/ana.xml").rename(tmp_path / "handed-in/bad.xml")
    done = grade(tmp_path, ENDS_THE_READER)
    assert done.returncode == 0, done.stderr
    rows = marks_in(tmp_path / "marks")
    assert (rows["bad"]["points"], rows["ben"]["points"]) == ("0", "10")
    assert "reading it ended the program that grades: it was ended by SIGSEGV" in rows["bad"]["reasons"]
    assert [*tmp_path.glob("visualhfsm-*")] == []
