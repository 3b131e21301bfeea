"""`codegen` with documents that import others and have extensions."""

from __future__ import annotations

import re
import sys
from pathlib import Path

import pytest

from tests.support.codegen_command import ROOT, codegen
from tests.support.commands import run_file_here
from tests.support.documents import document, state, sub, transition
from tests.support.limits import END_LIMIT
from tests.support.processes import ComponentProcess
from tests.support.waiting import until

PARAMETERS = """<parameters>
  <parameter><name>top_speed</name><type>float</type><default>0.5</default><description>In m/s.</description></parameter>
  <parameter><name>loud</name><type>bool</type><default>False</default></parameter>
</parameters>"""
LIBRARY = document(sub(1, 0, state(1, "look", "x = 1", initial=True)))
MAIN = document(
    sub(1, 0, state(1, "search", initial=True, child=2)),
    '<SubAutomata id="2" idFather="1"><import>parts/library.xml</import></SubAutomata>',
    head=PARAMETERS,
)


@pytest.fixture
def home(tmp_path: Path) -> Path:
    (tmp_path / "parts").mkdir()
    (tmp_path / "parts" / "library.xml").write_text(LIBRARY)
    (tmp_path / "main.xml").write_text(MAIN)
    return tmp_path


def test_a_change_of_an_imported_file_makes_the_component_stale(home: Path) -> None:
    assert codegen("main.xml", cwd=home).returncode == 0
    assert codegen("--check", "main.xml", cwd=home).returncode == 0
    (home / "parts" / "library.xml").write_text(LIBRARY.replace("x = 1", "x = 2"))
    done = codegen("--check", "main.xml", cwd=home)
    assert done.returncode == 1
    assert "+            x = 2\n" in done.stdout


def test_an_imported_file_may_lie_in_a_directory_that_is_searched(home: Path) -> None:
    (home / "parts").rename(home / "elsewhere")
    assert codegen("main.xml", cwd=home).returncode == 1
    (home / "include").mkdir()
    (home / "elsewhere").rename(home / "include" / "parts")
    assert codegen("-I", "include", "main.xml", cwd=home).returncode == 0


def test_a_property_that_is_violated_keeps_the_component_from_being_written(home: Path) -> None:
    never = '<properties><property kind="never"><name>no search</name><expression>{}</expression></property></properties>'
    (home / "main.xml").write_text(MAIN.replace(PARAMETERS, never.format("search/look")))
    done = codegen("main.xml", cwd=home)
    assert done.returncode == 1
    assert "error[E610]: `no search` is violated: never search/look" in done.stderr
    assert not (home / "main.py").exists()
    (home / "main.xml").write_text(MAIN.replace(PARAMETERS, never.format("ghost(search)")))
    assert codegen("main.xml", cwd=home).returncode == 0


def test_what_needs_no_change_is_not_reported_each_time(home: Path) -> None:
    there = transition(1, 1, 2, "100", type="time")
    (home / "main.xml").write_text(
        document(sub(1, 0, state(1, "go", initial=True), state(2, "there"), there))
    )
    done = codegen("main.xml", cwd=home)
    assert (done.returncode, done.stderr) == (0, "")


def test_watching_looks_at_imported_files_and_extensions(home: Path) -> None:
    environment = {"PYTHONPATH": str(ROOT), "PYTHONUNBUFFERED": "1"}
    command = [sys.executable, "-m", "codegen", "--watch", str(home / "main.xml")]
    with ComponentProcess(command, environment) as watching:
        watching.wait_for(r"wrote .*main\.py")
        (home / "parts" / "library.xml").write_text(LIBRARY.replace("x = 1", "x = ="))
        watching.wait_for(r"library\.xml:3:\d+: .*not valid Python")
        (home / "parts" / "library.xml").write_text(LIBRARY)
        watching.wait_for(r"1 file up to date")
        (home / "main_ext.py").write_text("class Other:\n    pass\n")
        watching.wait_for(r"there is no class `MainExtension`")
        (home / "main_ext.py").write_text("class MainExtension:\n    settled = True\n")
        until(lambda: "MainExtension" in (home / "main.py").read_text())
        watching.process.send_signal(2)
        assert watching.wait(END_LIMIT) == 130


def test_the_component_lists_its_parameters_and_checks_them(
    home: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert codegen("main.xml", cwd=home).returncode == 0

    monkeypatch.setenv("COLUMNS", "140")
    shown = run_file_here(home / "main.py", "--help").stdout
    assert re.search(r"--top-speed\s+\S+\s+In m/s\.\s+\[default: 0\.5\]", shown)
    assert re.search(r"--loud\b.*--no-loud\b", shown)
    wrong = run_file_here(home / "main.py", "--top-speed", "fast")
    assert wrong.returncode == 2
    assert "--top-speed" in wrong.stdout
