"""The command `visualhfsm new`: make a project of one's own, from the files in `project/`."""

from __future__ import annotations

import shlex
import shutil
from pathlib import Path
from typing import Annotated, Final

import typer

from visualhfsm.errors import VisualHfsmError

EPILOG: Final = """Examples:

visualhfsm new my-robot"""

_PROJECT: Final = Path(__file__).with_name("project")
_NEXT: Final = """\
Next:
  cd {folder}
  pytest                                     test the behavior, without a robot
  nao stack ./stack.toml                     run it: a simulated Nao, the lamp and the behavior
  visualhfsm edit behaviors/blinker.xml      draw, and run what is drawn
  codegen interfaces/*.idl behaviors/*.xml   generate again, after a change"""


def new(
    folder: Annotated[
        Path, typer.Argument(metavar="FOLDER", help="The folder to make; it may exist if it is empty.")
    ],
) -> None:
    """Make a project: an interface, a program that serves it, a behavior, its test and a stack.

    They run at once, and are meant to be changed.
    """
    from codegen.command import generate

    try:
        if folder.exists() and (not folder.is_dir() or any(folder.iterdir())):
            raise VisualHfsmError(f"{folder} is not empty: choose another name, or an empty folder")
        ignored = shutil.ignore_patterns("__pycache__")
        shutil.copytree(_PROJECT, folder, ignore=ignored, copy_function=shutil.copyfile, dirs_exist_ok=True)
    except OSError as error:
        raise VisualHfsmError(f"{folder} cannot be made: {error.strerror or error}") from error
    for path in sorted(each for each in folder.rglob("*") if each.is_file()):
        typer.echo(f"wrote {path}")
    generate([*folder.glob("interfaces/*.idl"), *folder.glob("behaviors/*.xml")])
    typer.echo(_NEXT.format(folder=shlex.quote(str(folder))))
