"""The command `visualhfsm new`: make a project of one's own, from the files in `template/`."""

from __future__ import annotations

import shlex
import shutil
from pathlib import Path
from typing import Annotated, Final

import typer

from visualhfsm._errors import VisualHfsmError

EPILOG: Final = """Examples:

visualhfsm new my-robot"""

_TEMPLATE: Final = Path(__file__).with_name("template")
_HIDDEN: Final = ("_gitattributes", "_gitignore")
"""Files whose names begin with a dot in a project; here Git and packagers would obey them."""
_KEPT: Final = frozenset({".git"})
"""What a folder may contain: one may make a repository first."""
_NEXT: Final = """\
Next:
  cd {folder}
  pytest                                     test the behavior, without a robot
  nao stack ./stack.toml                     run it: a simulated Nao, the lamp and the behavior
  visualhfsm edit behaviors/blinker.xml      draw, and run what is drawn
  codegen interfaces/*.idl behaviors/*.xml   generate again, after a change"""


def new(
    folder: Annotated[
        Path,
        typer.Argument(
            metavar="FOLDER", help="The folder to make; it may exist if it is empty, or a new repository."
        ),
    ],
) -> None:
    """Make a project: an interface, a program that serves it, a behavior, its test, a stack, files for Git.

    They run at once, and are meant to be changed. Files that are there are never overwritten.
    """
    from codegen.command import generate

    made = {
        path: folder / path.relative_to(_TEMPLATE).with_name(_name_of(path))
        for path in sorted(_TEMPLATE.rglob("*"))
        if path.is_file() and "__pycache__" not in path.parts
    }
    try:
        if folder.exists() and (
            not folder.is_dir() or any(each.name not in _KEPT for each in folder.iterdir())
        ):
            raise VisualHfsmError(f"{folder} is not empty: choose another name, or an empty folder")
        for path, target in made.items():
            target.parent.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(path, target)
    except OSError as error:
        raise VisualHfsmError(f"{folder} cannot be made: {error.strerror or error}") from error
    for target in sorted(made.values()):
        typer.echo(f"wrote {target}")
    generate([*folder.glob("interfaces/*.idl"), *folder.glob("behaviors/*.xml")])
    typer.echo(_NEXT.format(folder=shlex.quote(str(folder))))


def _name_of(path: Path) -> str:
    """Return the name of a file in a project."""
    return path.name.replace("_", ".", 1) if path.name in _HIDDEN else path.name
