"""What a pupil gets of an exercise: the task, the document to begin with, and the trials that pupils see."""

from __future__ import annotations

import os
import shlex
from collections.abc import Callable
from mimetypes import guess_type
from pathlib import Path
from typing import Final

from codegen.hfsm import write_document
from codegen.hfsm.document import Automaton, Document
from visualhfsm.plugins import system_languages
from visualhfsm.trials import SUFFIX, documents_of
from visualhfsm_classes._errors import GradingError
from visualhfsm_classes._exercise import FILE, VISIBLE, Exercise, read_exercise
from visualhfsm_classes._words import figure, say

_OURS: Final = "exercises"
_PACKAGE: Final = Path(__file__).parent


def our_exercises() -> Path:
    """Return the folder of the exercises that come with us: in the wheel, or in a checkout."""
    installed = _PACKAGE / "_shipped" / _OURS
    return installed if installed.is_dir() else _PACKAGE.parents[3] / _OURS


def find_exercise(name: str) -> Path:
    """Return the folder of an exercise: a path, or the name of one of ours. Raises GradingError."""
    path = Path(name)
    if (path / FILE).is_file():
        return path
    ours = {each.parent.name: each.parent for each in sorted(our_exercises().glob(f"*/{FILE}"))}
    if name not in ours:
        raise GradingError.because(
            "there is no exercise {name}: write a folder with {file}, or one of ours: {ours}",
            name=name,
            file=FILE,
            ours=", ".join(ours),
        )
    return ours[name]


def pupils_folder(exercise: str, language: str | None) -> tuple[dict[str, bytes], Callable[[Path], str]]:
    """Return the files for a pupil, by name, and what is said when they are in a folder.

    Without a `language` it is one of the system's. Raises GradingError.
    """
    found = read_exercise(find_exercise(exercise))
    spoken = chosen_language(found, language)
    files = handout(found, spoken)

    def said(folder: Path) -> str:
        wrote = [say(spoken, "wrote", file=str(folder / file)) for file in files]
        next_ = say(spoken, "next", folder=shlex.quote(str(folder)), document=f"{found.name}.xml")
        return "\n".join([*wrote, next_])

    return files, said


def chosen_language(exercise: Exercise, given: str | None) -> str:
    """Return the language of an exercise that a user gave, or else one of the system's."""
    wanted = system_languages(os.environ) if given is None else [given]
    return exercise.language(next((each for each in wanted if each in exercise.languages), ""))


def handout(exercise: Exercise, language: str) -> dict[str, bytes]:
    """Return the files that a pupil gets, by name: neither hidden trials, nor judges, nor the solution.

    The task is there in each language, with its pictures; `task.md` is the one in `language`. So are the
    documents and the worlds of the trials that pupils see, with what these documents import.
    """
    start = exercise.start
    empty = Document(automata=(Automaton(id=1),))
    document = write_document(empty).encode() if start is None else start.read_bytes()
    others = {f"task.{each}.md": _task(exercise, each) for each in exercise.languages if each != language}
    files = sorted(exercise.folder.iterdir())
    pictures = [each for each in files if "image/" in str(guess_type(each.name, strict=False))]
    named = [exercise.folder / each for each in exercise.plans[VISIBLE].files]
    imported = documents_of(*(each for each in named if each.suffix == ".xml"))
    needed = [*named, *sorted(each for each in imported.difference(named) if each.is_file())]
    return {
        "task.md": _task(exercise, language),
        f"{exercise.name}.xml": document,
        f"{exercise.name}{SUFFIX}": (exercise.folder / f"{VISIBLE}.toml").read_bytes(),
        **others,
        **{each.name: each.read_bytes() for each in (*pictures, *needed)},
    }


def _task(exercise: Exercise, language: str) -> bytes:
    text = exercise.task(language).read_text("utf-8").rstrip()
    return f"{text}\n\n{points_table(exercise, language)}\n".encode()


def points_table(exercise: Exercise, language: str) -> str:
    """Return what earns points, and the robots for which an exercise is made, as Markdown."""
    language = exercise.language(language)
    rows = [
        f"| {criterion.asks[language]} | {figure(language, criterion.points)} |"
        for criterion in exercise.criteria
    ]
    head = f"| {say(language, 'counts')} | {say(language, 'points')} |\n|---|---|"
    robots = [say(language, "robots", robots=", ".join(exercise.robots)), ""] if exercise.robots else []
    return "\n".join([*robots, head, *rows])
