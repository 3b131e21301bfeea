"""`visualhfsm diff` and `codegen diff`: what changed, with the exit codes of `diff`."""

from __future__ import annotations

import json
import os
import shlex
import subprocess
import sys
from pathlib import Path

import pytest

from tests.support.commands import run_here
from tests.support.documents import document, state, sub, transition
from tests.support.limits import RUN_LIMIT
from visualhfsm._commands.app import app

WALK = "speed = 1\nself.log.info(speed)"
BEFORE = document(
    sub(1, 0, state(1, "walk", WALK, initial=True), state(2, "rest"), transition(1, 1, 2, "True", name="tired")),
    libraries=("math",),
)  # fmt: skip
AFTER = document(
    sub(1, 0, state(1, "walk", WALK.replace("1", "2"), initial=True), state(2, "sleep"), state(3, "run")),
    libraries=("math", "time"),
)


def diff(*arguments: str | Path, cwd: Path) -> subprocess.CompletedProcess[str]:
    return run_here(app, "visualhfsm", "diff", *arguments, cwd=cwd)


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A folder with two versions of a document."""
    (tmp_path / "old.xml").write_text(BEFORE)
    (tmp_path / "new.xml").write_text(AFTER)
    return tmp_path


@pytest.fixture
def repository(folder: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The folder, with the former version in Git."""
    monkeypatch.setenv("GIT_CONFIG_GLOBAL", os.devnull)
    monkeypatch.setenv("GIT_CONFIG_SYSTEM", os.devnull)
    (folder / "new.xml").rename(folder / "later.xml")
    git(folder, "init")
    git(folder, "add", "old.xml")
    git(folder, "commit", "-m", "first")
    return folder


def git(folder: Path, *arguments: str) -> str:
    command = ["git", "-c", "user.name=A", "-c", "user.email=a@b", *arguments]
    return subprocess.run(
        command, cwd=folder, capture_output=True, text=True, timeout=RUN_LIMIT, check=True
    ).stdout


def test_differences_are_listed_element_by_element(folder: Path) -> None:
    done = diff("old.xml", "new.xml", cwd=folder)
    assert (done.returncode, done.stderr) == (1, "")
    assert done.stdout.splitlines() == [
        "state `walk` of automaton 1: code changed",
        "    -speed = 1",
        "    +speed = 2",
        "     self.log.info(speed)",
        'state `sleep` of automaton 1: name changed: "rest" -> "sleep"',
        "state `run` of automaton 1 added",
        "transition `tired` of automaton 1 removed",
        "the document: libraries `time` added",
    ]


def test_programs_get_what_the_page_gets(folder: Path) -> None:
    done = diff("--format", "json", "old.xml", "new.xml", cwd=folder)
    assert done.returncode == 1
    found = json.loads(done.stdout)
    assert found[2] == {"kind": "added", "place": {"kind": "state", "automaton": 1, "id": 3}, "after": "run"}
    same = diff("--format", "json", "old.xml", "old.xml", cwd=folder)
    assert (same.returncode, json.loads(same.stdout)) == (0, [])


def test_equal_documents_are_the_same_whatever_their_white_space(folder: Path) -> None:
    (folder / "new.xml").write_text(BEFORE.replace("</state>", "</state>\n\n"))
    done = diff("old.xml", "new.xml", cwd=folder)
    assert (done.returncode, done.stdout) == (0, "")


def test_positions_can_be_ignored(folder: Path) -> None:
    (folder / "new.xml").write_text(BEFORE.replace("<name>walk", "<posx>5</posx><posy>6</posy><name>walk"))
    done = diff("old.xml", "new.xml", cwd=folder)
    assert (done.returncode, done.stdout) == (1, "state `walk` of automaton 1 moved: 0, 0 -> 5, 6\n")
    assert diff("--ignore-moves", "old.xml", "new.xml", cwd=folder).returncode == 0


@pytest.mark.parametrize(
    ("text", "problem"),
    [(None, "cannot be read"), ("<VisualHFSM>", "malformed XML"), ("<<<<<<< HEAD\n", "conflict of a merge")],
)
def test_a_file_that_cannot_be_read_is_trouble(folder: Path, text: str | None, problem: str) -> None:
    if text is not None:
        (folder / "bad.xml").write_text(text)
    for pair in (("old.xml", "bad.xml"), ("bad.xml", "old.xml"), ("bad.xml",)):
        done = diff(*pair, cwd=folder)
        assert done.returncode == 2
        assert problem in done.stderr
    assert diff("old.xml", "notes.txt", cwd=folder).returncode == 2


@pytest.mark.slow
def test_one_document_is_compared_with_the_one_of_the_last_commit(repository: Path) -> None:
    assert diff("old.xml", cwd=repository).returncode == 0
    (repository / "later.xml").rename(repository / "old.xml")
    assert "state `run` of automaton 1 added" in diff("old.xml", cwd=repository).stdout
    (repository / "other.xml").write_text(AFTER)
    done = diff("other.xml", cwd=repository)
    assert done.returncode == 2
    assert "git has no version of other.xml in HEAD" in done.stderr


@pytest.mark.slow
def test_without_a_repository_it_says_so(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("GIT_CEILING_DIRECTORIES", str(folder.parent))
    done = diff("old.xml", cwd=folder)
    assert done.returncode == 2
    assert "not a git repository" in done.stderr
    monkeypatch.setenv("PATH", "")
    assert "git is not installed: name two files" in diff("old.xml", cwd=folder).stderr


@pytest.mark.slow
def test_git_shows_differences_with_it(repository: Path) -> None:
    (repository / "later.xml").rename(repository / "old.xml")
    (repository / "added.xml").write_text(BEFORE)
    git(repository, "add", "added.xml")
    tool = Path(sys.executable).with_name("visualhfsm")
    shown = git(repository, "difftool", "--no-prompt", "--extcmd", f"{shlex.quote(str(tool))} diff", "HEAD")
    assert "state `run` of automaton 1 added" in shown
    assert "automaton 1 added" in shown  # the whole document is new
