"""The command `visualhfsm grade`: marks with reasons for what a class handed in."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Final

import typer

from codegen.messages import Message
from codegen.reasons import reason
from visualhfsm import VisualHfsmError
from visualhfsm.plugins import examples

if TYPE_CHECKING:
    from rich.console import Console

    from visualhfsm_classes._class import Graders
    from visualhfsm_classes._exercise import Exercise
    from visualhfsm_classes._folder import MarksFolder

_EPILOG: Final = examples(
    "grade look handed-in",
    "grade exercises/mine handed-in --out marks --language es",
    "grade exercises/mine --check",
    notes="Exit codes: 0 done, 1 an error, or --check found something, 2 wrong usage, 130 Ctrl-C.",
)

_INDEX: Final = "index.html"

app: Final = typer.Typer(add_completion=False)


@app.command(epilog=_EPILOG)
def grade(
    exercise: Annotated[
        str, typer.Argument(metavar="EXERCISE", help="The folder of an exercise, or the name of ours.")
    ],
    submissions: Annotated[
        Path | None,
        typer.Argument(
            metavar="SUBMISSIONS",
            exists=True,
            file_okay=False,
            help="A folder with a document, or a folder, for each pupil.",
        ),
    ] = None,
    *,
    out: Annotated[
        Path,
        typer.Option(metavar="DIR", file_okay=False, help="Where marks.csv and the pages are written."),
    ] = Path("marks"),
    language: Annotated[
        str | None,
        typer.Option(metavar="CODE", help="Language of the marks.", show_default="the system's"),
    ] = None,
    workers: Annotated[
        int | None,
        typer.Option(
            metavar="N", min=1, max=1000, help="Submissions at a time.", show_default="one a processor"
        ),
    ] = None,
    check: Annotated[
        bool,
        typer.Option("--check", help="Grade the exercise's own solution and mistakes, and compare."),
    ] = False,
    again: Annotated[
        bool,
        typer.Option("--again", help="Ask whether to replace what you changed in marks written earlier."),
    ] = False,
    unsafe: Annotated[
        bool,
        typer.Option("--unsafe", help="Run code of submissions as you, where nothing can contain it."),
    ] = False,
) -> None:
    """Grade the documents of a class in virtual time: a page for each, and a table for the teacher.

    The same documents get the same marks. Their code runs in a process that reaches neither files nor
    network. A document that cannot be run has no points, with the reason. What you changed in marks that
    were written earlier stays, and is named.
    """
    if (submissions is None) is not check:
        raise typer.BadParameter("give either SUBMISSIONS or --check", param_hint="SUBMISSIONS")
    from rich.console import Console

    from visualhfsm_classes._exercise import read_exercise
    from visualhfsm_classes._handout import chosen_language, find_exercise

    console = Console()
    found = read_exercise(find_exercise(exercise))
    spoken = chosen_language(found, language)
    if submissions is None:
        _check(console, found, spoken, workers, unsafe=unsafe)
        return
    from visualhfsm_classes._folder import TABLE, MarksFolder
    from visualhfsm_classes._marks import table_of
    from visualhfsm_classes._page import index_page
    from visualhfsm_classes._submissions import find_submissions
    from visualhfsm_classes._terminal import show

    handed_in = find_submissions(submissions)
    folder = MarksFolder(out, spoken)
    if again:
        _ask(folder, [_INDEX, *(f"{each.page}{kind}" for each in handed_in for kind in (".html", ".md"))])
    problems: list[Message] = []
    with _graders(console, found, spoken, workers, 2 * len(handed_in), unsafe=unsafe) as (graders, done):
        marks = graders.grade(handed_in, done)
        rows = list(zip(handed_in, marks, strict=False))
        if len(rows) == len(handed_in):  # no signal has come
            pages = {marks.name: each.page for each, marks in rows}
            # The table first: a disk may be too full for pages.
            listed = folder.write_table(table_of(found, spoken, marks), pages)
            problems = graders.write_pages(rows, folder, done)
    show(console, found, spoken, marks)
    try:
        folder.write(_INDEX, index_page(found, spoken, listed).encode())
    except VisualHfsmError as error:
        problems.append(reason(error))
    if folder.kept:
        console.print(
            f"\nkept, because somebody changed it: {', '.join(sorted(folder.kept))}; --again asks about each",
            style="yellow",
            markup=False,
            soft_wrap=True,
        )
    for problem in problems:
        console.print(f"error: {problem}", style="red", markup=False, soft_wrap=True)
    if problems:
        console.print(f"\nthe marks are in {out / TABLE}", soft_wrap=True)
        raise typer.Exit(1)
    console.print(f"\n{out / _INDEX} has a page for each, {out / TABLE} is the table", soft_wrap=True)


def _check(console: Console, exercise: Exercise, language: str, workers: int | None, *, unsafe: bool) -> None:
    """Grade what the exercise brings along, and exit with 1 if something earns other points than expected."""
    from visualhfsm_classes._errors import GradingError
    from visualhfsm_classes._exercise import SOLUTION
    from visualhfsm_classes._submissions import Submission
    from visualhfsm_classes._terminal import show_check

    if not exercise.solution.is_file():
        raise GradingError.because(
            "{folder}: there is no {solution}, which should earn all points",
            folder=str(exercise.folder),
            solution=SOLUTION,
        )
    expected = {"solution": exercise.points, **exercise.mistakes}
    paths = {"solution": exercise.solution, **{name: exercise.mistake(name) for name in exercise.mistakes}}
    own = [Submission(name, path, "") for name, path in paths.items()]
    with _graders(console, exercise, language, workers, len(own), unsafe=unsafe) as (graders, done):
        marks = graders.grade(own, done)
    if not show_check(console, exercise, marks, expected):
        raise typer.Exit(1)


@contextmanager
def _graders(
    console: Console, exercise: Exercise, language: str, workers: int | None, total: int, *, unsafe: bool
) -> Iterator[tuple[Graders, Callable[[], object]]]:
    """Yield what grades, and what moves the bar that is shown meanwhile. Raises SystemExit after Ctrl-C."""
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

    from visualhfsm_classes._class import Graders
    from zenoh_ice.application.cli import stop_on_signals

    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn())
    with (
        stop_on_signals() as stop,
        Progress(*columns, console=console, transient=True) as progress,
        Graders(exercise, language, stop, workers, unsafe=unsafe) as graders,
    ):
        bar = progress.add_task(exercise.name, total=total)
        yield graders, lambda: progress.advance(bar)


def _ask(folder: MarksFolder, files: Sequence[str]) -> None:
    """Ask about each thing that somebody changed whether it may be replaced; no answer means no."""
    for item in folder.changed(files):
        with suppress(typer.Abort):
            if typer.confirm(f"{folder.path}: {item} was changed since it was written: replace it?"):
                folder.replace(item)
