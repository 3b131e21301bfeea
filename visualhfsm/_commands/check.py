"""`visualhfsm check FILES...`: report problems of documents before they run."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Final

import typer

from codegen.diagnostics import Diagnostics, Severity, shown_path
from codegen.options import DOCUMENTS, ErrorFormat, require_directories, require_extensions, show
from visualhfsm._base.options import ErrorsAs, Include, examples

if TYPE_CHECKING:
    from codegen.hfsm.model_checker import ModelReport

EPILOG: Final = examples(
    "check behaviors",
    "check follow_ball.xml dance.xml --strict",
    "check --error-format github --no-model behaviors",
    notes="Exit codes: 0 nothing is wrong, 1 errors, or warnings with --strict, 2 wrong usage.",
)


def check(
    files: Annotated[
        list[Path],
        typer.Argument(metavar="FILES", help="Documents (.xml), or directories that contain some."),
    ],
    include: Include = None,
    *,
    strict: Annotated[bool, typer.Option("--strict", help="Treat warnings as errors.")] = False,
    model: Annotated[
        bool,
        typer.Option(
            "--model/--no-model", help="Run the model checker: what automata can do, and properties."
        ),
    ] = True,
    error_format: ErrorsAs = ErrorFormat.TEXT,
) -> None:
    """Check documents before they run: structure, code, and what automata can do.

    This reports everything that generation would report. Nothing is generated, and no code is run. The model
    checker assumes that each condition may be true or false, and proves properties or shows how they are
    violated.
    """
    from codegen.hfsm.loading import check_document
    from codegen.hfsm.model_checker import ASSUMPTIONS, DEFAULT_LIMIT

    documents = list(documents_of(files))
    directories = require_directories(include)
    diagnostics = Diagnostics()
    reports = [
        check_document(path, diagnostics, directories, limit=DEFAULT_LIMIT if model else 0)
        for path in documents
    ]
    show(diagnostics, error_format, outcome=None)
    counts = Counter(found.severity for found in diagnostics)
    if error_format is ErrorFormat.TEXT:
        for path, report in zip(documents, reports, strict=True):
            for line in _properties(report):
                typer.echo(f"{shown_path(path)}: {line}")
        if any(map(_has_proof, reports)) and not diagnostics.assumptions:  # which are said below them
            typer.echo(ASSUMPTIONS)
        typer.echo(_summary(len(documents), counts))
    if counts[Severity.ERROR] or (strict and counts[Severity.WARNING]):
        raise typer.Exit(1)


def documents_of(paths: Iterable[Path]) -> Iterator[Path]:
    """Yield the given documents, and those in given directories; refuse others as wrong usage."""
    from visualhfsm.project._root import find_documents

    found = False
    for path in paths:
        if not path.is_dir():
            require_extensions([path], DOCUMENTS)
            found = True
            yield path
            continue
        for file in find_documents(path):
            found = True
            yield file
    if not found:
        raise typer.BadParameter("no document found", param_hint="FILES")


def _properties(report: ModelReport | None) -> Iterator[str]:
    from codegen.hfsm.model_checker import Verdict

    marks = {Verdict.HOLDS: "holds", Verdict.VIOLATED: "is violated", Verdict.UNDECIDED: "is undecided"}
    for result in report.properties if report else ():
        if result.verdict in marks:
            stated = result.property
            name = stated.name.strip() or " ".join(stated.expression.text.split())
            yield f"`{name}` {marks[result.verdict]}"


def _has_proof(report: ModelReport | None) -> bool:
    from codegen.hfsm.model_checker import Verdict

    return report is not None and any(result.verdict is Verdict.HOLDS for result in report.properties)


def _summary(documents: int, counts: Counter[Severity]) -> str:
    parts = [
        f"{counts[severity]} {severity}{'' if counts[severity] == 1 else 's'}"
        for severity in Severity
        if counts[severity]
    ]
    files = f"{documents} document{'' if documents == 1 else 's'}"
    return f"{files}: {', '.join(parts) or 'nothing to report'}"
