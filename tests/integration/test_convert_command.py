"""The command `visualhfsm convert`: what it writes, what it reports, and what it never does."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest
from typer.testing import CliRunner, Result

from tests.support.codegen_command import ROOT, files_in
from tests.support.commands import run_here
from tests.support.limits import RUN_LIMIT
from tests.support.plugins import OLD_DOCUMENTS
from visualhfsm._base.errors import VisualHfsmError
from visualhfsm._commands.app import app

pytestmark = OLD_DOCUMENTS

OLD = """<VisualStates>
  <config type="1"><plugins><plugin id="0"><name>/scan</name></plugin></plugins></config>
  <state id="0" initial="True"><name>root</name><timestep>50</timestep>
    <state id="1" initial="True"><name>wait</name><code>print "waiting"</code><timestep>50</timestep></state>
  </state>
</VisualStates>
"""

NEW = """<?xml version="1.0" encoding="UTF-8"?>
<VisualHFSM>
  <dialect>VisualStates</dialect>
  <SubAutomata id="1" idFather="0">
    <state initial="true" id="1">
      <posx>0</posx>
      <posy>0</posy>
      <name>wait</name>
      <idSubautomataSon>0</idSubautomataSon>
      <code>print "waiting"</code>
      <timestep>50</timestep>
    </state>
    <iteration_time>50</iteration_time>
    <variables></variables>
    <functions></functions>
  </SubAutomata>
  <libraries/>
  <config type="1">
    <plugins>
      <plugin id="0">
        <name>/scan</name>
      </plugin>
    </plugins>
  </config>
  <pseudostate id="0" initial="True">
    <name>root</name>
  </pseudostate>
</VisualHFSM>
"""


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    (tmp_path / "old.xml").write_text(OLD)
    monkeypatch.chdir(tmp_path)
    return tmp_path


def convert(*arguments: str) -> Result:
    return CliRunner().invoke(app, ["convert", *arguments])


def test_an_old_document_is_written_in_the_format_of_today(folder: Path) -> None:
    done = convert("old.xml", "new.xml")
    assert done.exit_code == 0, done.stderr
    assert done.stdout == ""
    assert done.stderr.splitlines()[-1] == "wrote new.xml"
    assert files_in(folder) == {"old.xml": OLD, "new.xml": NEW}


def test_what_is_kept_without_use_and_what_is_python_2_is_reported_with_its_line(folder: Path) -> None:
    done = convert("old.xml", "new.xml")
    reported = [line for line in done.stderr.splitlines() if line.startswith("old.xml")]
    assert reported == [
        "old.xml:2:20: note[N501]: `plugins` is unknown: it is kept, but not used",
        'old.xml:4:57: warning[W506]: Python 2: `print "waiting"` is `print("waiting")` in Python 3',
    ]


def test_python_2_is_fixed_on_request(folder: Path) -> None:
    done = convert("--fix-python2", "old.xml", "new.xml")
    assert done.exit_code == 0
    assert (folder / "new.xml").read_text() == NEW.replace('print "waiting"', 'print("waiting")')
    assert 'note[N503]: fixed: `print "waiting"` is `print("waiting")` in Python 3' in done.stderr


def test_the_package_of_jderobot_is_replaced_and_that_is_said(folder: Path) -> None:
    old = NEW.replace("<libraries/>", "<libraries>\n    <lib>jderobot</lib>\n  </libraries>")
    (folder / "old.xml").write_text(old)
    line = old[: old.index("jderobot")].count("\n") + 1
    done = convert("old.xml", "new.xml")
    assert done.exit_code == 0
    assert (folder / "new.xml").read_text() == old.replace("jderobot", "from interfaces import jderobot")
    assert (
        f"old.xml:{line}:10: note[N504]: `jderobot` is `from interfaces import jderobot` now" in done.stderr
    )


def test_code_in_another_language_is_kept_and_marked(folder: Path) -> None:
    (folder / "old.xml").write_text(OLD.replace('print "waiting"', "motors-&gt;setV(0777);\nprintf(x);"))
    done = convert("--fix-python2", "old.xml", "-")
    assert "<language>C++</language>" in done.stdout
    assert "<code>motors-&gt;setV(0777);\nprintf(x);</code>" in done.stdout
    assert done.stderr.count("N502") == 1
    assert "N503" not in done.stderr


def test_the_new_document_goes_to_stdout_and_diagnostics_are_json(folder: Path) -> None:
    done = convert("--error-format", "json", "old.xml", "-")
    assert done.exit_code == 0
    assert done.stdout == NEW
    assert [(each["code"], each["line"]) for each in json.loads(done.stderr)] == [("N501", 2), ("W506", 4)]
    assert files_in(folder) == {"old.xml": OLD}


def test_nothing_is_overwritten_unless_it_is_wanted(folder: Path) -> None:
    (folder / "new.xml").write_text("mine")
    refused = convert("old.xml", "new.xml")
    assert refused.exit_code == 2
    assert "--force" in refused.stderr
    assert (folder / "new.xml").read_text() == "mine"
    assert convert("old.xml", "old.xml").exit_code == 2
    assert convert("--force", "old.xml", "new.xml").exit_code == 0
    assert convert("--force", "old.xml", "old.xml").exit_code == 0
    assert files_in(folder) == {"old.xml": NEW, "new.xml": NEW}


def test_nothing_is_written_of_what_cannot_be_understood(folder: Path) -> None:
    (folder / "old.xml").write_text(OLD.replace('id="1" initial', 'id="one" initial'))
    (folder / "new.xml").write_text("mine")
    done = convert("--force", "old.xml", "new.xml")
    assert done.exit_code == 1
    assert "error[E506]" in done.stderr
    assert "nothing was written" in done.stderr
    assert (folder / "new.xml").read_text() == "mine"
    assert convert("absent.xml", "-").exit_code == 1


@pytest.mark.parametrize("names", [("old.txt", "new.xml"), ("old.xml", "new.txt"), ("old.xml", "new")])
def test_a_format_that_is_unknown_is_wrong_usage(names: tuple[str, str], folder: Path) -> None:
    assert convert(*names).exit_code == 2
    assert files_in(folder) == {"old.xml": OLD}


@pytest.mark.skipif(os.geteuid() == 0, reason="root may write everywhere")
def test_a_folder_that_cannot_be_written_is_reported(folder: Path) -> None:
    (folder / "closed").mkdir(mode=0o500)
    done = convert("old.xml", "closed/new.xml")
    assert done.exit_code == 1


def test_a_place_that_is_no_folder_is_reported_in_one_line(folder: Path) -> None:
    (folder / "file").write_text("")
    done = run_here(
        app, "visualhfsm", "convert", "old.xml", "file/new.xml", cwd=folder, expected=(VisualHfsmError,)
    )
    assert done.returncode == 1
    assert "file/new.xml: cannot be written: Not a directory" in done.stderr.splitlines()[-1]
    assert "Traceback" not in done.stderr


def test_the_command_runs_on_its_own_and_reports_an_output_without_room_in_one_line(folder: Path) -> None:
    command = [sys.executable, "-m", "visualhfsm", "convert", "old.xml", "-"]
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    with Path("/dev/full").open("wb") as full:
        done = subprocess.run(
            command,
            cwd=folder,
            env=environment,
            stdout=full,
            stderr=subprocess.PIPE,
            text=True,
            timeout=RUN_LIMIT,
            check=False,
        )
    assert done.returncode == 1
    assert done.stderr.splitlines()[-1] == "visualhfsm: error: cannot write: No space left on device"
    assert "Traceback" not in done.stderr


LOSSY = """<scxml xmlns="http://www.w3.org/2005/07/scxml" version="1.0" datamodel="python">
  <state id="a"><invoke src="b.scxml"/><transition event="e" target="a"/></state>
</scxml>
"""


@pytest.mark.parametrize("target", ["new.xml", "-"])
@pytest.mark.parametrize("error_format", ["text", "json"])
def test_a_file_that_lacks_a_part_is_written_and_the_code_says_so(
    folder: Path, target: str, error_format: str
) -> None:
    (folder / "old.scxml").write_text(LOSSY)
    done = convert("--error-format", error_format, "old.scxml", target)
    assert done.exit_code == 1
    assert "W561" in done.stderr
    written = done.stdout if target == "-" else (folder / target).read_text()
    assert '<trans type="event">e</trans>' in written


def test_what_an_old_document_loses_is_counted_too(folder: Path) -> None:
    (folder / "old.xml").write_text(OLD.replace("<name>root</name>", "<name>root<!-- x --></name> by hand"))
    done = convert("old.xml", "new.xml")
    assert done.exit_code == 1
    assert done.stderr.splitlines()[-1] == "not all of old.xml is in it: see W501 and W561 above (1)"


def test_what_is_only_not_the_same_is_no_failure(folder: Path) -> None:
    (folder / "old.scxml").write_text(LOSSY.replace('<invoke src="b.scxml"/>', "").replace('"e"', '"e.*"'))
    done = convert("old.scxml", "new.xml")
    assert done.exit_code == 0
    assert "W562" in done.stderr
