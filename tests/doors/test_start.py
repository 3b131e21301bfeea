"""The first minutes: the demo, a project of one's own, and help."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

import psutil
import pytest

from codegen.command import app as codegen_app
from tests.doors.conftest import ServedRobot
from tests.support.commands import run_here
from tests.support.limits import RUN_LIMIT
from tests.support.nao_command import at, nao
from tests.support.pages import DOCS, blocks_of
from tests.support.places import ROOT
from tests.support.processes import ComponentProcess, assert_gone, free_endpoint, module
from tests.support.programs import PROGRAMS, app_of
from tests.support.reader import commands_of
from tests.support.watching import content
from visualhfsm._commands.app import app
from visualhfsm._commands.new import new


@pytest.fixture
def demo(tmp_path: Path) -> Iterator[ComponentProcess]:
    """The demo for four seconds, which leaves its files in a folder of the test's."""
    stack = tmp_path / "demo.toml"
    text = (ROOT / "deploy" / "demo.toml").read_text("utf-8")
    stack.write_text(text.replace('log_dir = "demo/logs"', f'log_dir = "{tmp_path}/logs"'))
    command = module(
        "nao_tools", "stack", str(stack), "--seconds", "4",
        "--set", f"report={tmp_path / 'report.html'}", "--set", f"endpoint={free_endpoint()}",
    )  # fmt: skip
    with ComponentProcess(command) as demo:
        yield demo


@pytest.mark.gl
@pytest.mark.promise("a simulated Nao follows a ball and dances; then see demo/report.html")
def test_the_demo_ends_by_itself_with_a_report(demo: ComponentProcess, tmp_path: Path) -> None:
    demo.wait_for(r"images/s", RUN_LIMIT)
    running = list(psutil.Process(demo.process.pid).children(recursive=True))
    assert len(running) == 5

    assert demo.wait(RUN_LIMIT) == 0, demo.output
    assert_gone(running)
    assert re.search(r"watched +\d+\.\d s", demo.output)
    page = (tmp_path / "report.html").read_text(encoding="utf-8")
    found, _ = content(page)
    assert found["pictures"]["Camera"]
    assert found["world"]
    assert {log.name for log in (tmp_path / "logs").iterdir()} == {
        "naoserver.log", "ball-red.log", "ball-green.log", "dance_and_follow.log",
    }  # fmt: skip


@pytest.mark.promise("creates a project of your own, with an interface, a behavior and its test")
def test_the_commands_of_the_readme_of_a_new_project_work(tmp_path: Path) -> None:
    project = tmp_path / "my-robot"
    new(project)
    shown = [
        command.text
        for block in blocks_of((project / "README.md").read_text("utf-8"))
        for command in commands_of(block.text, block.language)
    ]
    typed = {
        command.text
        for page in ("own-project.md", "version-control.md")
        for block in blocks_of((DOCS / "how-to" / page).read_text("utf-8"))
        for command in commands_of(block.text, block.language)
    }
    quick = {
        "codegen interfaces/*.idl behaviors/*.xml": (codegen_app, 0),
        "codegen --check interfaces/*.idl behaviors/*.xml": (codegen_app, 0),
        "visualhfsm check behaviors": (app, 0),
        "visualhfsm diff behaviors/blinker.xml": (app, 2),  # nothing has been committed
    }
    # Those that go on until Ctrl-C are typed by the tests of docs/, there with an end.
    lasting = {"visualhfsm edit behaviors/blinker.xml", "nao stack ./stack.toml"}
    assert lasting <= set(shown)
    assert set(shown) - quick.keys() - lasting <= typed
    for command, (program, code) in quick.items():
        assert command in shown
        name, *words = command.split()
        files = [path for word in words for path in sorted(project.glob(word)) if not word.startswith("-")]
        flags = [word for word in words if word.startswith("-") or word in ("check", "diff")]
        done = run_here(program, name, *flags, *(file.relative_to(project) for file in files), cwd=project)
        assert done.returncode == code, done.stderr


@pytest.mark.promise("Every command has `--help`")
def test_every_command_has_help() -> None:
    for program in PROGRAMS:
        if program == "naoserver-naoqi":
            pytest.importorskip("qi", reason="libqi has no package for this Python")
        done = run_here(app_of(program), program, "--help")
        assert done.returncode == 0, done.stderr
        assert "Usage: " in done.stdout


@pytest.mark.gl
@pytest.mark.promise("`nao doctor` diagnoses problems")
def test_the_doctor_finds_a_robot_and_says_how_to_start_one(fake: ServedRobot) -> None:
    with at(fake.endpoint, "nao"):
        found = nao("doctor")
    assert found.code == 0, found.text
    assert re.search(r"ok +realm nao: \d+ servants of 1 process", found.out)
    with at(free_endpoint(), "nao"):
        missing = nao("doctor", "--timeout", "0.1")
    assert missing.code == 1
    assert "naoserver-sim" in missing.text
