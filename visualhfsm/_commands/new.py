"""The command `visualhfsm new`: make a project of one's own, from the files in `template/`."""

from __future__ import annotations

import shlex
import shutil
from pathlib import Path
from typing import Annotated, Final

import typer

from visualhfsm._base.errors import VisualHfsmError
from visualhfsm._base.options import examples

EPILOG: Final = examples("new my-robot", "new my-bust --hardware", "new ana --exercise look --language es")

_TEMPLATE: Final = Path(__file__).with_name("template")
_HARDWARE: Final = Path(__file__).with_name("template_hardware")
_HIDDEN: Final = ("_gitattributes", "_gitignore")
"""Files whose names begin with a dot in a project; here Git and packagers would obey them."""
_KEPT: Final = frozenset({".git"})
"""The names that a folder may contain: one may make a repository first."""
_UNMADE: Final = "{folder} cannot be made: {reason}"
_NEXT: Final = """\
Next:
  cd {folder}
  pytest                                     test the behavior, without a robot
  nao stack ./stack.toml                     run it: a simulated Nao, the lamp and the behavior
  visualhfsm edit behaviors/blinker.xml      draw, and run what is drawn
  codegen interfaces/*.idl behaviors/*.xml   generate again, after a change"""
_NEXT_HARDWARE: Final = """\
Next:
  cd {folder}
  pytest                      test the robot, on a bus of simulated servos
  nao stack ./stack.toml      run it, and a behavior that follows a ball
  visualhfsm edit             see it
Then write the packets of your servos into server.py, and what your robot is into bust.toml."""


def new(
    folder: Annotated[
        Path,
        typer.Argument(
            metavar="FOLDER", help="The folder to make; it may exist if it is empty, or a new repository."
        ),
    ],
    *,
    exercise: Annotated[
        str | None,
        typer.Option(
            metavar="EXERCISE",
            help="Make a pupil's folder instead: of an exercise, or the name of one of ours.",
        ),
    ] = None,
    language: Annotated[
        str | None,
        typer.Option(metavar="CODE", help="Language of the task.", show_default="the system's"),
    ] = None,
    hardware: Annotated[
        bool,
        typer.Option("--hardware", help="Make a robot of your own instead: a server of servos on a bus."),
    ] = False,
) -> None:
    """Make a project: an interface, a program that serves it, a behavior, its test, a stack, files for Git.

    They run at once, and are meant to be changed. With --exercise it is a pupil's folder: a task, a document
    to draw in, and the trials that pupils see; with --hardware it is a robot: its server, its description,
    its test, its stack. Files that are there are never overwritten.
    """
    if hardware and exercise is not None:
        raise typer.BadParameter("give either --hardware or --exercise")
    if exercise is not None:
        _make_exercise(folder, exercise, language)
        return
    if language is not None:
        raise typer.BadParameter("--language needs --exercise EXERCISE")
    from codegen.command import generate

    template = _HARDWARE if hardware else _TEMPLATE
    files = {path: path.relative_to(template) for path in template.rglob("*")}
    files |= {_TEMPLATE / name: Path(name) for name in _HIDDEN}
    made = {
        path: folder / name.with_name(_name_of(path))
        for path, name in sorted(files.items())
        if path.is_file() and "__pycache__" not in path.parts
    }
    with VisualHfsmError.in_place_of(OSError, _UNMADE, folder=str(folder)):
        _require_empty(folder)
        for path, target in made.items():
            target.parent.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(path, target)
    for target in sorted(made.values()):
        typer.echo(f"wrote {target}")
    if not hardware:
        generate([*folder.glob("interfaces/*.idl"), *folder.glob("behaviors/*.xml")])
    typer.echo((_NEXT_HARDWARE if hardware else _NEXT).format(folder=shlex.quote(str(folder))))


def _make_exercise(folder: Path, name: str, language: str | None) -> None:
    """Make the folder of a pupil."""
    from visualhfsm_classes import read_exercise
    from visualhfsm_classes._handout import chosen_language, find_exercise, handout
    from visualhfsm_classes._words import say

    exercise = read_exercise(find_exercise(name))
    spoken = chosen_language(exercise, language)
    files = handout(exercise, spoken)
    with VisualHfsmError.in_place_of(OSError, _UNMADE, folder=str(folder)):
        _require_empty(folder)
        folder.mkdir(parents=True, exist_ok=True)
        for file, content in files.items():
            (folder / file).write_bytes(content)
    for file in files:
        typer.echo(say(spoken, "wrote", file=str(folder / file)))
    typer.echo(say(spoken, "next", folder=shlex.quote(str(folder)), document=f"{exercise.name}.xml"))


def _require_empty(folder: Path) -> None:
    """Raise VisualHfsmError if there are files of others."""
    if folder.exists() and (not folder.is_dir() or any(each.name not in _KEPT for each in folder.iterdir())):
        raise VisualHfsmError.because(
            "{folder} is not empty: choose another name, or an empty folder", folder=str(folder)
        )


def _name_of(path: Path) -> str:
    """Return the name of a file in a project."""
    return path.name.replace("_", ".", 1) if path.name in _HIDDEN else path.name
