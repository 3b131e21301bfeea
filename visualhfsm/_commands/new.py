"""The command `visualhfsm new`: make a project of one's own, from the files in `template/`."""

from __future__ import annotations

import shlex
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Final

import typer

from visualhfsm._base.errors import VisualHfsmError
from visualhfsm._base.options import examples
from zenoh_ice.plugins import NotInstalledError, optional

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
    hardware: Annotated[
        bool,
        typer.Option("--hardware", help="Make a robot of your own instead: a server of servos on a bus."),
    ] = False,
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
) -> None:
    """Make a project: an interface, a program that serves it, a behavior, its test, a stack, files for Git.

    They run at once, and are meant to be changed. With --hardware it is a robot: its server, its description,
    its test, its stack. Files that are there are never overwritten.

    With --exercise it is a pupil's folder: a task, a document to draw in, the trials that pupils see.
    """
    if exercise is not None and hardware:
        raise typer.BadParameter("give either --hardware or --exercise")
    if exercise is None and language is not None:
        raise typer.BadParameter("--language needs --exercise EXERCISE")
    if exercise is not None:
        with VisualHfsmError.in_place_of(NotInstalledError):
            classes = optional("visualhfsm_classes", "visualhfsm[classes]")
        files, said = classes.pupils_folder(exercise, language)
        _write(folder, files)
        typer.echo(said(folder))
    else:
        _make_project(folder, hardware=hardware)


def _make_project(folder: Path, *, hardware: bool) -> None:
    from codegen.command import generate

    template = _HARDWARE if hardware else _TEMPLATE
    paths = {path.relative_to(template): path for path in template.rglob("*")}
    paths |= {Path(name): _TEMPLATE / name for name in _HIDDEN}
    files = {
        str(name.with_name(_name_of(path))): path.read_bytes()
        for name, path in paths.items()
        if path.is_file() and "__pycache__" not in path.parts
    }
    _write(folder, files)
    for target in sorted(folder / name for name in files):
        typer.echo(f"wrote {target}")
    if not hardware:
        generate([*folder.glob("interfaces/*.idl"), *folder.glob("behaviors/*.xml")])
    typer.echo((_NEXT_HARDWARE if hardware else _NEXT).format(folder=shlex.quote(str(folder))))


def _write(folder: Path, files: Mapping[str, bytes]) -> None:
    """Write files, by their names, into a new folder."""
    with VisualHfsmError.in_place_of(OSError, _UNMADE, folder=str(folder)):
        _require_empty(folder)
        for name, content in files.items():
            target = folder / name
            target.parent.mkdir(parents=True, exist_ok=True)
            target.write_bytes(content)


def _require_empty(folder: Path) -> None:
    """Raise VisualHfsmError if there are files of others."""
    if folder.exists() and (not folder.is_dir() or any(each.name not in _KEPT for each in folder.iterdir())):
        raise VisualHfsmError.because(
            "{folder} is not empty: choose another name, or an empty folder", folder=str(folder)
        )


def _name_of(path: Path) -> str:
    """Return the name of a file in a project."""
    return path.name.replace("_", ".", 1) if path.name in _HIDDEN else path.name
