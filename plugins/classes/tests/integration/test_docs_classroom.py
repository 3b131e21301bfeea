"""docs/how-to/classroom.md: its scripts, on a machine whose accounts are folders, with pupils who mean no good."""

from __future__ import annotations

import os
import shlex
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import pytest

from plugins.classes.tests.support.marks import marks_in
from tests.support.commands import run_here
from tests.support.limits import RUN_LIMIT
from tests.support.pages import DOCS, blocks_of
from tests.support.places import ROOT
from visualhfsm._commands.app import app

pytestmark = pytest.mark.slow

LOOK = ROOT / "exercises" / "look"
NOBODY = 65534
SUDO = """#!/bin/sh
test "$1" = --user || exit 2
shift 2
exec {become} "$@"
"""
VISUALHFSM = f"""#!/bin/sh
PYTHONPATH={shlex.quote(str(ROOT))} exec {shlex.quote(sys.executable)} -m visualhfsm "$@"
"""


@dataclass
class Machine:
    """A server with pupils; commands run with the rights of none of them, where the tests may give up theirs."""

    folder: Path
    homes: Path
    environment: dict[str, str]

    def pupil(self, name: str) -> Path:
        """Return the folder of a new pupil."""
        home = self.homes / f"jupyter-{name}"
        home.mkdir()
        own(home)
        return home

    def run(self, script: str, *arguments: str) -> str:
        """Run a script of the page as the teacher, and return what it writes."""
        (text,) = (
            each.text for each in blocks_of((DOCS / "how-to/classroom.md").read_text()) if each.name == script
        )
        assert "/home/jupyter-" in text
        text = text.replace("/home/jupyter-", f"{self.homes}/jupyter-").replace("timeout 10", "timeout 1")
        done = subprocess.run(
            ["sh", "-c", text, script, *arguments],
            cwd=self.folder,
            env=self.environment,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            timeout=RUN_LIMIT,
            check=False,
        )
        return done.stdout


def own(path: Path) -> None:
    """Give a pupil what they have made."""
    if os.geteuid() == 0:
        for each in (path, *path.rglob("*")):
            os.chown(each, NOBODY, NOBODY, follow_symlinks=False)


@pytest.fixture
def machine() -> Iterator[Machine]:
    folder = Path(tempfile.mkdtemp(prefix="visualhfsm-class-", dir="/tmp"))  # everybody may enter its parents
    try:
        folder.chmod(0o755)
        programs, homes, teacher = (folder / name for name in ("bin", "home", "teacher"))
        for each in (programs, homes, teacher):
            each.mkdir()
        become = f"setpriv --reuid={NOBODY} --regid={NOBODY} --clear-groups" if os.geteuid() == 0 else ""
        for name, text in (("sudo", SUDO.format(become=become)), ("visualhfsm", VISUALHFSM)):
            (programs / name).write_text(text)
            (programs / name).chmod(0o755)
        environment = {"PATH": f"{programs}:/usr/bin:/bin", "TMPDIR": str(folder), "COLUMNS": "120"}
        yield Machine(teacher, homes, environment)
    finally:
        shutil.rmtree(folder)


def test_everybody_gets_the_exercise_and_keeps_what_is_there(machine: Machine) -> None:
    ana, ben = machine.pupil("ana"), machine.pupil("ben")
    (ben / "look").mkdir()
    (ben / "look/look.xml").write_text("mine")
    own(ben)
    machine.run("hand_out.sh", str(LOOK))
    assert (ana / "look/task.md").is_file()
    handed_out = {each.name for each in (ana / "look").iterdir()}
    assert handed_out == {"task.md", "task.es.md", "look.xml", "look.trials.toml"}
    assert (ana / "hand-in").is_dir()
    assert (ana / "look/look.xml").stat().st_uid == (NOBODY if os.geteuid() == 0 else os.getuid())
    assert (ben / "look/look.xml").read_text() == "mine"
    assert (ben / "look/task.md").is_file()
    assert list(machine.folder.parent.glob("tmp*")) == []  # nothing stays


def test_documents_are_collected_and_graded(machine: Machine) -> None:
    ana = machine.pupil("ana")
    machine.pupil("ben")
    (ana / "look").mkdir()
    shutil.copy(LOOK / "solution/solution.xml", ana / "look/look.xml")
    machine.run("collect.sh", "look")
    assert sorted(each.name for each in (machine.folder / "handed-in/look").iterdir()) == [
        "ana.xml",
        "ben.xml",
    ]
    done = run_here(
        app, "visualhfsm", "grade", "look", "handed-in/look", "--unsafe", "--workers", "1", cwd=machine.folder
    )
    assert done.returncode == 0, done.stderr
    points = {name: row["points"] for name, row in marks_in(machine.folder / "marks").items()}
    assert points == {"ana": "10", "ben": "0"}


def test_what_was_handed_in_is_collected_and_marks_come_back(machine: Machine) -> None:
    """A copy in `hand-in` counts, not what is drawn later."""
    ana = machine.pupil("ana")
    machine.run("hand_out.sh", str(LOOK))
    shutil.copy(LOOK / "solution/solution.xml", ana / "hand-in/look.xml")
    own(ana)
    machine.run("collect.sh", "look")
    handed_in = machine.folder / "handed-in/look/ana.xml"
    assert handed_in.read_bytes() == (LOOK / "solution/solution.xml").read_bytes()
    (machine.folder / "marks").mkdir()
    (machine.folder / "marks/ana.md").write_text("**10 of 10**\n")
    machine.run("give_back.sh", "look")
    assert (ana / "look/marks.md").read_text() == "**10 of 10**\n"


@pytest.mark.skipif(os.geteuid() != 0, reason="needs another user")
def test_a_link_in_a_pupils_folder_leads_to_nothing_of_others(machine: Machine) -> None:
    secret = machine.folder / "marks.xml"
    secret.write_text("of the teacher")
    secret.chmod(0o600)
    home = machine.pupil("eva")
    (home / "look").mkdir()
    (home / "look/look.xml").symlink_to(secret)
    assert "Permission denied" in machine.run("collect.sh", "look")
    assert (machine.folder / "handed-in/look/eva.xml").read_bytes() == b""


@pytest.mark.parametrize("kind", ["pipe", "endless"])
def test_what_never_ends_stops_neither_the_script_nor_the_others(machine: Machine, kind: str) -> None:
    for name in ("ana", "eva"):
        (machine.pupil(name) / "look").mkdir()
    document = machine.homes / "jupyter-ana/look/look.xml"
    if kind == "pipe":
        os.mkfifo(document)
    else:
        document.symlink_to("/dev/zero")
    (machine.homes / "jupyter-eva/look/look.xml").write_text("<VisualHFSM/>")
    own(machine.homes)
    machine.run("collect.sh", "look")
    assert (machine.folder / "handed-in/look/ana.xml").stat().st_size <= 2_000_000
    assert (machine.folder / "handed-in/look/eva.xml").read_text() == "<VisualHFSM/>"
