"""What `visualhfsm new --exercise` makes: the folder of a pupil."""

from __future__ import annotations

import shlex
from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Final

import typer

app: Final = typer.Typer(add_completion=False)


@app.command(epilog="visualhfsm new ana --exercise look --language es")
def pupil(
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
) -> tuple[dict[str, bytes], Callable[[Path], str]]:
    """With --exercise it is a pupil's folder: a task, a document to draw in, the trials that pupils see."""
    if exercise is None:
        raise typer.BadParameter("--language needs --exercise EXERCISE")
    from visualhfsm_classes._exercise import read_exercise
    from visualhfsm_classes._handout import chosen_language, find_exercise, handout
    from visualhfsm_classes._words import say

    found = read_exercise(find_exercise(exercise))
    spoken = chosen_language(found, language)
    files = handout(found, spoken)

    def said(folder: Path) -> str:
        wrote = [say(spoken, "wrote", file=str(folder / file)) for file in files]
        next_ = say(spoken, "next", folder=shlex.quote(str(folder)), document=f"{found.name}.xml")
        return "\n".join([*wrote, next_])

    return files, said
