"""The hand-written extension of a component: how it is found, loaded and kept."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from codegen.diagnostics import Diagnostics
from codegen.hfsm import compile_document
from hfsm_runtime import Component, ComponentError, run
from tests.support.codegen_command import ROOT, codegen
from tests.support.documents import compile_to, document, load, problems, state, sub
from tests.support.limits import RUN_LIMIT

TEXT = document(sub(1, 0, state(1, "a", "self.greet()", initial=True)))
EXTENSION = "class FollowBallExtension:\n    greeted = 0\n\n    def greet(self):\n        self.greeted += 1\n"


def extend(directory: Path, text: str = EXTENSION) -> Path:
    path = directory / "follow_ball_ext.py"
    path.write_text(text)
    return path


def test_the_extension_is_a_base_of_the_component(tmp_path: Path) -> None:
    extend(tmp_path)
    made = load(compile_to(tmp_path, TEXT, "follow_ball"))
    assert [base.__name__ for base in type(made).__bases__] == ["FollowBallExtension", "Component"]
    run(made, 0.2)
    assert made.greeted == 3  # type: ignore[attr-defined]


def test_the_document_has_the_last_word(tmp_path: Path) -> None:
    extend(tmp_path)
    functions = "def greet(self):\n    super(type(self), self).greet()\n    self.greeted += 10"
    text = document(sub(1, 0, state(1, "a", "self.greet()", initial=True), functions=functions))
    made = load(compile_to(tmp_path, text, "follow_ball"))
    run(made, 0)
    assert made.greeted == 11  # type: ignore[attr-defined]


def test_extensions_of_one_name_in_two_directories_are_distinguished(tmp_path: Path) -> None:
    made: list[Component] = []
    for number in (1, 2):
        directory = tmp_path / str(number)
        directory.mkdir()
        extend(directory, EXTENSION.replace("greeted = 0", f"greeted = {number}00"))
        made.append(load(compile_to(directory, TEXT, "follow_ball")))
    assert [component.greeted for component in made] == [100, 200]  # type: ignore[attr-defined]


def test_the_extension_survives_and_may_come_and_go(tmp_path: Path) -> None:
    component = compile_to(tmp_path, TEXT, "follow_ball")
    assert "Extension" not in component.read_text()
    path = extend(tmp_path)
    compile_to(tmp_path, TEXT, "follow_ball")
    assert "FollowBallExtension" in component.read_text()
    assert path.read_text() == EXTENSION
    path.unlink()
    with pytest.raises((ComponentError, OSError), match="follow_ball_ext"):
        load(component)
    compile_to(tmp_path, TEXT, "follow_ball")
    assert run(load(component), 0).errors[0].message.startswith("AttributeError")


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("class Other: pass\n", "there is no class `FollowBallExtension`"),
        ("def FollowBallExtension(): pass\n", "there is no class"),
        ("class FollowBallExtension\n", "not valid Python"),
        ("\0", "not valid Python"),
    ],
)
def test_an_extension_without_its_class_is_an_error(tmp_path: Path, text: str, message: str) -> None:
    extend(tmp_path, text)
    (tmp_path / "follow_ball.xml").write_text(TEXT)
    diagnostics = Diagnostics()
    assert compile_document(tmp_path / "follow_ball.xml", None, diagnostics) is None
    (error,) = diagnostics.errors
    assert (error.code, error.location.path.name) == ("E541", "follow_ball_ext.py")
    assert message in error.message


def test_the_extension_lies_beside_the_component(tmp_path: Path) -> None:
    extend(tmp_path)
    (tmp_path / "out").mkdir()
    (tmp_path / "follow_ball.xml").write_text(TEXT)
    for output, extended in ((tmp_path, True), (tmp_path / "out", False)):
        diagnostics = Diagnostics()
        files = compile_document(tmp_path / "follow_ball.xml", output, diagnostics)
        assert files is not None
        assert ("FollowBallExtension" in files[0].text) == extended
        # Only there does it give the component what the code uses.
        assert (len(diagnostics) == 0) == extended, diagnostics.render()


def test_the_extension_is_never_overwritten(tmp_path: Path) -> None:
    extend(tmp_path)
    assert any("E540" in problem for problem in problems(tmp_path / "follow_ball_ext.xml", TEXT))
    assert (tmp_path / "follow_ball_ext.py").read_text() == EXTENSION


def test_nothing_of_the_extension_runs_when_it_is_found(tmp_path: Path) -> None:
    extend(tmp_path, EXTENSION + "raise SystemExit('ran')\n")
    compile_to(tmp_path, TEXT, "follow_ball")


@pytest.mark.slow
@pytest.mark.parametrize("as_module", [True, False])
def test_the_component_is_run_with_its_extension(tmp_path: Path, as_module: bool) -> None:
    package = tmp_path / "behaviors_of_mine"
    package.mkdir()
    (package / "__init__.py").touch()
    extend(package)
    (package / "follow_ball.xml").write_text(TEXT)
    assert codegen("behaviors_of_mine/follow_ball.xml", cwd=tmp_path).returncode == 0
    command = ["-m", "behaviors_of_mine.follow_ball"] if as_module else ["behaviors_of_mine/follow_ball.py"]
    done = subprocess.run(
        [sys.executable, *command, "--help"],
        cwd=tmp_path,
        env={"PYTHONPATH": str(ROOT)},
        capture_output=True,
        text=True,
        timeout=RUN_LIMIT,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    assert "--stay-halted" in done.stdout


@pytest.mark.slow
@pytest.mark.parametrize(
    ("text", "problem"),
    [
        (None, "follow_ball_ext.py is gone, which follow_ball.py extends: bring it back, or run codegen"),
        (
            "x = 1\n",
            "follow_ball_ext.py has no class FollowBallExtension: write it, or remove the file and run codegen",
        ),
    ],
)
@pytest.mark.parametrize("as_module", [False, True])
def test_an_extension_that_is_gone_is_reported_in_one_line(
    tmp_path: Path, text: str | None, problem: str, as_module: bool
) -> None:
    file = extend(tmp_path)
    compile_to(tmp_path, TEXT, "follow_ball")
    file.unlink()
    if text:
        file.write_text(text)
    command = [sys.executable, *(["-m", "follow_ball"] if as_module else ["follow_ball.py"])]
    environment = {"PYTHONPATH": str(ROOT)}
    done = subprocess.run(
        command, cwd=tmp_path, env=environment, capture_output=True, text=True, timeout=RUN_LIMIT, check=False
    )
    assert (done.returncode, done.stderr) == (1, f"follow_ball.py: error: {problem}\n")
