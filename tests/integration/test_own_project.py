"""A project of one's own, as `visualhfsm new` makes it: its interface in the compiler, the editor and in tests."""

from __future__ import annotations

import asyncio
import contextlib
import os
import shutil
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import pytest

from codegen.diagnostics import Diagnostics
from codegen.hfsm import read_document
from naoserver.fake import FakeRobot
from tests.support.codegen_command import codegen
from tests.support.commands import run_here
from tests.support.editing import find_problems
from tests.support.editor import editor
from tests.support.limits import EVENT_LIMIT, RUN_LIMIT, SHORT_RUN, START_LIMIT
from tests.support.processes import REPOSITORY, ComponentProcess, free_endpoint
from tests.support.pushes import Pushes
from tests.support.robot_server import served
from tests.support.soak import cases
from visualhfsm._base.errors import VisualHfsmError
from visualhfsm._commands.app import app
from visualhfsm._commands.new import new
from visualhfsm._document.places import Place
from visualhfsm._monitor.messages import Output, Source, StartedPush
from visualhfsm._processes.components import StartedComponents
from visualhfsm.project._code_help.service import CodeHelp
from zenoh_ice import Settings

pytest_plugins = "pytester"

LEFT = Place(kind="state", automaton=1, id=1, part="entry")
SOURCES = ("interfaces/lamp.idl", "behaviors/blinker.xml")


@pytest.fixture
def project(tmp_path: Path) -> Path:
    """A new project."""
    folder = tmp_path / "my-robot"
    new(folder)
    return folder


def opened(project: Path) -> Source:
    path = project / "behaviors" / "blinker.xml"
    document = read_document(path, Diagnostics())
    assert document is not None
    return Source(1, 1, document, path, False)


def run(*command: str | Path, cwd: Path) -> subprocess.CompletedProcess[str]:
    environment = {**os.environ, "PYTHONPATH": str(REPOSITORY)}
    return subprocess.run(
        [sys.executable, *map(str, command)],
        cwd=cwd,
        env=environment,
        capture_output=True,
        text=True,
        timeout=RUN_LIMIT,
        check=False,
    )


def remove_generated(project: Path) -> None:
    shutil.rmtree(project / "interfaces" / "home")
    (project / "behaviors" / "blinker.py").unlink()


def test_interface_and_behavior_are_generated_in_one_call(project: Path) -> None:
    remove_generated(project)
    done = codegen("--check", *SOURCES, cwd=project)
    assert done.returncode == 1
    assert "5 of 5 files are out of date" in done.stderr
    done = codegen(*SOURCES, cwd=project)
    assert (done.returncode, done.stderr) == (0, "")
    assert codegen("--check", *SOURCES, cwd=project).returncode == 0


def test_a_folder_with_files_is_left_alone(project: Path) -> None:
    before = (project / "lamp.py").read_text()
    (project / "lamp.py").write_text(f"{before}# mine\n")
    with pytest.raises(VisualHfsmError, match="not empty"):
        new(project)
    assert (project / "lamp.py").read_text().endswith("# mine\n")


def test_a_new_repository_may_be_there_and_gets_only_what_belongs_into_it(tmp_path: Path) -> None:
    folder = tmp_path / "my-robot"

    def git(*arguments: str) -> list[str]:
        command = ["git", *arguments]
        done = subprocess.run(
            command, cwd=folder, capture_output=True, text=True, timeout=RUN_LIMIT, check=True
        )
        return done.stdout.splitlines()

    folder.mkdir()
    git("init")
    done = run_here(app, "visualhfsm", "new", folder)
    assert ".git/" not in done.stdout
    for path in ("logs/lamp.log", "run.mcap", "behaviors/__pycache__/blinker.pyc", ".venv/bin/python"):
        (folder / path).parent.mkdir(parents=True, exist_ok=True)
        (folder / path).touch()
    (folder / "behaviors" / "blinker_ext.py").touch()
    kept = git("ls-files", "--others", "--exclude-standard")
    assert set(kept) == {
        line.removeprefix(f"wrote {folder}/")
        for line in done.stdout.splitlines()
        if line.startswith("wrote ")
    } | {"behaviors/blinker_ext.py"}
    marked = git("check-attr", "linguist-generated", "--", *kept)
    generated = {line.partition(":")[0] for line in marked if line.endswith(": set")}
    written_by_codegen = {path for path in kept if path.startswith("interfaces/home/")} | {
        "behaviors/blinker.py"
    }
    assert generated == written_by_codegen
    ends = git("check-attr", "eol", "--", *sorted(written_by_codegen - {"interfaces/home/py.typed"}))
    assert all(line.endswith(": lf") for line in ends)


@pytest.mark.parametrize("name", [".gitignore", "README.md", ".github/workflows/ci.yml"])
def test_files_of_a_person_are_never_overwritten(tmp_path: Path, name: str) -> None:
    (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
    (tmp_path / name).write_text("mine")
    before = sorted(tmp_path.rglob("*"))
    with pytest.raises(VisualHfsmError, match="not empty"):
        new(tmp_path)
    assert (tmp_path / name).read_text() == "mine"
    assert sorted(tmp_path.rglob("*")) == before


def test_the_component_finds_its_interfaces_wherever_it_is_started(project: Path, tmp_path: Path) -> None:
    done = run(project / "behaviors" / "blinker.py", "--help", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert run("-m", "behaviors.blinker", "--help", cwd=project).returncode == 0
    remove_generated_package = project / "interfaces" / "home"
    shutil.rmtree(remove_generated_package)
    done = run(project / "behaviors" / "blinker.py", "--help", cwd=tmp_path)
    assert done.returncode == 1
    assert (
        "blinker.py: No module named 'interfaces.home': generate the package and the component" in done.stderr
    )
    assert "Traceback" not in done.stderr


def test_its_test_passes_wherever_pytest_is_started(
    project: Path, pytester: pytest.Pytester, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name in [each for each in sys.modules if each == "lamp" or each.startswith("interfaces.home")]:
        monkeypatch.delitem(sys.modules, name)  # of another project, which an earlier test used
    for folder in (project, project / "tests"):
        os.chdir(folder)
        pytester.runpytest_inprocess("-p", "no:cacheprovider", "-p", "no:anyio").assert_outcomes(passed=1)


def test_packages_of_tests_are_named_by_texts(project: Path, pytester: pytest.Pytester) -> None:
    (project / "api").mkdir()
    (project / "interfaces" / "home").rename(project / "api" / "home")
    (project / "tests" / "test_blinker.py").write_text(
        "import pytest\n\n"
        "def test_the_package_is_found(behavior):\n"
        "    stubs = {'Lamp': {'setOn': None}}\n"
        "    b = behavior('behaviors/blinker.xml', robot='fake', stubs=stubs, include=['api'])\n"
        "    b.run_until('right')\n"
        "    with pytest.raises(FileNotFoundError, match='no directory nowhere'):\n"
        "        behavior('behaviors/blinker.xml', include=['nowhere'])\n"
    )
    os.chdir(project)
    pytester.runpytest_inprocess("-p", "no:cacheprovider", "-p", "no:anyio").assert_outcomes(passed=1)


def test_the_editor_finds_no_problem_with_the_interface(project: Path) -> None:
    path = project / "behaviors" / "blinker.xml"
    assert find_problems(path.read_text(), path) == []
    (project / "interfaces").rename(project / "api")
    assert "E532" in [each.code for each in find_problems(path.read_text(), path)]
    assert find_problems(path.read_text(), path, [project / "api"]) == []


def test_the_editor_lists_its_documents_below_its_folder(project: Path) -> None:
    (project / ".venv" / "lib").mkdir(parents=True)
    shutil.copy(project / "behaviors" / "blinker.xml", project / ".venv" / "lib")
    with editor(project) as running, running.window() as window:
        listed = window.ask("listFiles", below=True)["entries"]
        documents = [(each["name"], each["path"]) for each in listed if each["kind"] == "document"]
        assert documents == [("behaviors/blinker.xml", "behaviors/blinker.xml")]
        (listed,) = window.ask("listFiles", directory="behaviors", below=True)["entries"]
        assert (listed["name"], listed["path"]) == ("blinker.xml", "behaviors/blinker.xml")


@pytest.mark.parametrize("folder", ["interfaces", "api"])
def test_the_editor_completes_the_operations_of_the_interface(project: Path, folder: str) -> None:
    (project / "interfaces").rename(project / folder)
    include = [] if folder == "interfaces" else [project / folder]

    source, code = opened(project), "self.Lamp."
    with contextlib.closing(CodeHelp(START_LIMIT, include)) as helper:
        found = helper.ask("complete", source.document, source.path, LEFT, code, line=1, column=len(code))
        known = helper.interfaces(project)
    assert {"setOn", "isOn"} <= {each["label"] for each in found["options"]}
    assert {"home::Lamp", "nao::PoseHead"} <= {each["scoped"] for each in known}


@pytest.fixture
def endpoint(project: Path) -> Iterator[str]:
    """A fake robot and the project's lamp run at this endpoint."""
    where = free_endpoint()
    lamp = ComponentProcess([sys.executable, str(project / "lamp.py")], {"VISUALHFSM_CONNECT": where})
    with served(FakeRobot(), realm="nao", endpoint=where), lamp:
        lamp.wait_for("^ready")
        yield where
        lamp.wait_for("^on")


# `test_a_recording_of_it_is_replayed` runs the one that is saved.
@pytest.mark.parametrize("unsaved", cases([True], [False]))
def test_the_editor_runs_the_behavior(project: Path, endpoint: str, *, unsaved: bool) -> None:
    async def go() -> None:
        pushes = Pushes()
        service = StartedComponents(pushes, Settings(connect=(endpoint,)))
        source = replace(opened(project), dirty=unsaved)
        try:
            await service.start(source, ["--seconds", str(SHORT_RUN), "--clock", "wall"])
            end = await pushes.until(
                lambda: next((each for each in pushes.of(StartedPush) if each.status == "ended"), None)
            )
        finally:
            await service.close()
        assert end.exit_code == 0, end.message

    asyncio.run(asyncio.wait_for(go(), RUN_LIMIT + EVENT_LIMIT))


def test_the_editor_tries_the_behavior_without_robot_and_lamp(project: Path) -> None:
    async def go() -> None:
        pushes = Pushes()
        service = StartedComponents(pushes, Settings(connect=(free_endpoint(),)))
        try:
            await service.start(opened(project), ["--seconds", str(SHORT_RUN)], dry_run="")
            end = await pushes.next(StartedPush, lambda push: push.status == "ended")
        finally:
            await service.close()
        assert end.exit_code == 0, end.message
        lines = [line.text for push in pushes.of(Output) for line in push.lines]
        assert any("self.Lamp is a stand-in" in line for line in lines), lines

    asyncio.run(asyncio.wait_for(go(), RUN_LIMIT + EVENT_LIMIT))


def test_a_recording_of_it_is_replayed(project: Path, endpoint: str) -> None:
    flags = ("--seconds", str(SHORT_RUN), "--clock", "wall", "--connect", endpoint, "--record", "run.mcap")
    done = run("behaviors/blinker.py", *flags, cwd=project)
    assert done.returncode == 0, done.stderr
    for document in ([], ["behaviors/blinker.xml"]):
        done = run_here(app, "visualhfsm", "replay", "run.mcap", *document, cwd=project)
        assert done.returncode == 0, done.stderr
        assert "identical" in done.stdout
