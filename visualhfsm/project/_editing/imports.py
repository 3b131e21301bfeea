"""Move an automaton to another document, and inline an imported one."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from codegen.diagnostics import Diagnostics
from codegen.hfsm import resolve
from codegen.hfsm.document import NO_CHILD, Automaton, Document, Functions
from codegen.messages import Message
from visualhfsm._base.errors import EditError
from visualhfsm._document.commands import Command
from visualhfsm._document.commands.automata import ExtractAutomaton
from visualhfsm._document.commands.paste import FillAutomaton
from visualhfsm._document.imported_places import shown_path
from visualhfsm._document.nodes import changed, find_automaton
from visualhfsm._document.serialization import written
from visualhfsm._document.subtrees import below
from visualhfsm._document.views import AutomatonView, view

from .files import write_file


def extract(document: Document, automaton: int, path: Path | None, file: Path) -> Command:
    """Write an automaton with all below it to a new document, and return the command that imports it.

    `path` is the document's own file; `file` lies in its directory or below, and must not exist. What the
    document declares is copied, so that the new document can be checked by itself. Functions of automata
    outside stay where they are: a component may define each only once. Raises EditError.
    """
    what = Message("Cannot move the automaton to {file}", file=file.name)
    if path is None:
        raise EditError(what, "the document has no file yet", "save it first: imports are relative to it")
    source = find_automaton(document, automaton)
    if source.father == NO_CHILD:
        raise EditError(what, "it is the root", "use `Save as`")
    if source.imported is not None:
        raise EditError(what, "it is imported already", "edit the file that it comes from")
    target = file.absolute()
    if not target.is_relative_to(path.absolute().parent) or ".." in file.parts:
        raise EditError(what, "the file is not in the directory of the document", "choose one there or below")
    if target.exists():
        raise EditError(what, "the file exists", "choose another name")
    parts = below(document, [source.id])
    top = replace(source, father=NO_CHILD)
    library = Document(
        dialect=document.dialect,
        parameters=document.parameters,
        automata=(top, *(each for each in parts if each is not source)),
        libraries=document.libraries,
        interfaces=document.interfaces,
        ros=document.ros,
        events=document.events,
        language=document.language,
    )
    write_file(target, written(library).encode())
    relative = target.relative_to(path.absolute().parent).as_posix()
    return ExtractAutomaton(automaton=automaton, file=relative)


def inline(document: Document, automaton: int, path: Path | None) -> Command:
    """Return the command that inlines the content of an imported automaton. Raises EditError.

    `path` is the document's own file.
    """
    if path is None:
        what = Message("Cannot read {file_of}", file_of=_file_of(document, automaton))
        raise EditError(what, "the document has no file yet", "save it first: imports are relative to it")
    content = imported_content(document, automaton, path)
    title = f"Inline {_file_of(document, automaton)}"
    return FillAutomaton(automaton=automaton, content=written(content), name=title)


def imported_content(document: Document, automaton: int, path: Path) -> Document:
    """Return the content of an imported automaton: itself, then all below it. Raises EditError.

    The declarations of its file are included, and it gets the functions of the other automata there.
    """
    stub = find_automaton(document, automaton)
    what = Message("Cannot read {file_of}", file_of=_file_of(document, automaton))
    diagnostics = Diagnostics()
    lonely = Document(automata=(replace(stub, father=NO_CHILD),))
    resolved = resolve(lonely, path, diagnostics)
    if diagnostics.has_errors:
        raise EditError(what, diagnostics.errors[0].message, "fix the file, or import another")
    top, *others = resolved.automata
    return replace(resolved, automata=(with_functions(top, resolved.functions), *others), functions=())


def with_functions(automaton: Automaton, functions: tuple[Functions, ...]) -> Automaton:
    """Return an automaton that has further functions, those of imported files that belong to no automaton."""
    if not functions:
        return automaton
    texts = (automaton.functions, *(each.text for each in functions))
    return changed(
        automaton, functions="\n".join(each.text.strip("\n") for each in texts if not each.is_blank)
    )


def _file_of(document: Document, automaton: int) -> str:
    stub: Automaton = find_automaton(document, automaton)
    if stub.imported is None:
        what = Message("Cannot inline automaton {automaton}", automaton=automaton)
        raise EditError(what, "it is not imported", "it is in this document already")
    return stub.imported.file.text.strip()[:60]


def imported_views(document: Document, path: Path, include: Sequence[Path] = ()) -> list[AutomatonView]:
    """Return the content of all automata that are imported, each before those below it.

    They have the ids that a component of the document, whose file is `path`, gives them. Each has the file,
    relative to the document, and the automaton of it that it comes from. Unreadable imports are left out.
    `include` are as for `resolve`.
    """
    own = {automaton.id: automaton for automaton in document.automata}
    views = []
    for automaton in resolve(document, path, Diagnostics(), include).automata:
        stub = own.get(automaton.id)
        if automaton.imported is None and (stub is None or stub.imported is not None):
            views.append(view(automaton) | {"imported": _source_of(automaton, stub, path)})
    return views


def _source_of(automaton: Automaton, stub: Automaton | None, path: Path) -> dict[str, Any]:
    if stub is not None and stub.imported is not None:
        return {"file": stub.imported.file.text, "automaton": stub.imported.automaton}
    return {"file": shown_path(automaton.path or path, path), "automaton": automaton.id}
