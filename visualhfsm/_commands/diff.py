"""The command `visualhfsm diff`: compare two versions of a document element by element."""

from __future__ import annotations

import json
import os
import subprocess
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Final, NoReturn

import typer

from codegen.diagnostics import Diagnostics
from codegen.options import DOCUMENTS, DiffFormat, DiffResult, ErrorFormat, require_extensions, show

if TYPE_CHECKING:
    from codegen.hfsm.document import Annotation, Document, State, Transition
    from visualhfsm._document.diff import Difference

EPILOG: Final = """Examples:

visualhfsm diff old/dance.xml dance.xml

visualhfsm diff dance.xml

visualhfsm diff --ignore-moves --format json old.xml new.xml

git difftool --no-prompt --extcmd "visualhfsm diff" main -- "*.xml"

Exit codes: 0 the same, 1 different, 2 trouble, such as a file that cannot be read."""

_LIMIT: Final = 10.0
"""Seconds that Git may take."""


def diff(
    first: Annotated[
        Path,
        typer.Argument(metavar="OLD", help="The former version; alone it is compared with the one of HEAD."),
    ],
    second: Annotated[Path | None, typer.Argument(metavar="NEW", help="The later version.")] = None,
    *,
    ignore_moves: Annotated[
        bool, typer.Option("--ignore-moves", help="Positions on the canvas do not count.")
    ] = False,
    output_format: Annotated[
        DiffFormat, typer.Option("--format", help="Format of the differences.")
    ] = DiffFormat.TEXT,
) -> None:
    """Compare two versions of a document, as the editor's page does: states, transitions, code, positions.

    White space and the order of elements in the file do not count. Documents of any age can be compared. With
    one file this compares what Git has in HEAD with the file.
    """
    # Imported here: other commands need not wait for the reader of documents.
    from codegen.hfsm import read_document
    from visualhfsm._document.diff import diff_documents

    paths = [path for path in (first, second) if path is not None and not _is_nothing(path)]
    require_extensions(paths, DOCUMENTS)
    diagnostics = Diagnostics()
    if second is None:
        after = read_document(first, diagnostics)
        before = after and _committed(first, diagnostics)
    else:
        before, after = _read(first, diagnostics), _read(second, diagnostics)
    if before is None or after is None:
        show(diagnostics, ErrorFormat.TEXT, outcome=None)
        raise typer.Exit(DiffResult.TROUBLE)
    found = [each for each in diff_documents(before, after) if not (ignore_moves and each.kind == "moved")]
    if output_format is DiffFormat.JSON:
        typer.echo(_as_json(found))
    else:
        for line in _as_text(found, before, after):
            typer.echo(line)
    raise typer.Exit(DiffResult.DIFFERENT if found else DiffResult.SAME)


def _is_nothing(path: Path) -> bool:
    """Return whether a path is what Git names in the place of a file that is not there."""
    return path == Path(os.devnull)


def _read(path: Path, diagnostics: Diagnostics) -> Document | None:
    from codegen.hfsm import read_document
    from codegen.hfsm.document import Document

    return Document() if _is_nothing(path) else read_document(path, diagnostics)


def _committed(path: Path, diagnostics: Diagnostics) -> Document | None:
    """Return the version of a document that Git has in HEAD, None after reporting errors in it."""
    from codegen.hfsm import parse_document

    command = ["git", "show", f"HEAD:./{path.name}"]
    try:
        done = subprocess.run(command, cwd=path.parent, capture_output=True, timeout=_LIMIT, check=False)
    except FileNotFoundError:
        _fail("git is not installed: name two files")
    except (OSError, subprocess.TimeoutExpired) as error:
        _fail(f"git cannot show the version of {path} in HEAD: {error}")
    if done.returncode:
        why = done.stderr.decode(errors="replace").strip().removeprefix("fatal: ")
        _fail(f"git has no version of {path} in HEAD: {why}")
    return parse_document(done.stdout, path, diagnostics)


def _fail(message: str) -> NoReturn:
    typer.echo(f"visualhfsm diff: error: {message}", err=True)
    raise typer.Exit(DiffResult.TROUBLE)


def _as_json(differences: Iterable[Difference]) -> str:
    """Return the differences as a JSON array with one object per line, or `[]`."""
    import msgspec

    lines = [json.dumps(msgspec.to_builtins(each)) for each in differences]
    return "[\n" + ",\n".join(lines) + "\n]" if lines else "[]"


def _as_text(differences: Iterable[Difference], before: Document, after: Document) -> Iterator[str]:
    """Yield a line for each difference, followed by the lines of longer code that differ."""
    from visualhfsm._document.diff import changed_lines

    for each in differences:
        what = _named(each, before if each.kind == "removed" else after)
        lines = [*changed_lines(each)]
        match each.kind:
            case "moved":
                yield f"{what} moved: {each.before} -> {each.after}"
            case "changed" if each.part == "other":
                yield f"{what}: elements changed that have no meaning here"
            case "changed" if lines or not (each.before or each.after):
                yield f"{what}: {each.part} changed"
            case "changed":
                yield f"{what}: {each.part} changed: {json.dumps(each.before)} -> {json.dumps(each.after)}"
            case _:
                yield f"{what} {each.kind}"
        yield from (f"    {line}" for line in lines)


def _named(difference: Difference, document: Document) -> str:
    """Return the words for the place of a difference in the version that has it."""
    from visualhfsm._document.diff import shown

    place = difference.place
    automaton = document.automaton(place.automaton)
    words = "the document" if place.kind == "document" else f"automaton {place.automaton}"
    if automaton is not None and place.id:
        items: tuple[State | Transition | Annotation, ...] = getattr(automaton, f"{place.kind}s")
        item = next((item for item in items if item.id == place.id), None)
        name = shown(item)
        kind = getattr(item, "kind", place.kind)  # a note or a frame
        words = f"{kind} {f'`{name}`' if name else place.id} of {words}"
    if place.part in ("argument", "result"):
        return f"{words}: {place.part} `{place.name}`"
    if place.part:
        entry = getattr(automaton or document, place.part)[place.index]
        return f"{words}: {place.part} `{shown(entry)}`"
    return words
