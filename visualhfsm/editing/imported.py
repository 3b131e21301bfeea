"""Show what the automata of a document stand for that are imported from other files."""

from __future__ import annotations

from pathlib import Path

import msgspec

from codegen.diagnostics import Diagnostics
from codegen.hfsm import resolve
from codegen.hfsm.document import Automaton, Document

from .views import AutomatonView, ImportView, automaton_view

__all__ = ["imported_views"]


def imported_views(document: Document, path: Path) -> list[AutomatonView]:
    """Return the content of all automata that are imported, each before those below it.

    They have the ids that a component of the document, whose file is `path`, gives them. Each tells the file,
    relative to the document, and the automaton of it that it comes from. What cannot be had is left out.
    """
    own = {automaton.id: automaton for automaton in document.automata}
    views = []
    for automaton in resolve(document, path, Diagnostics()).automata:
        stub = own.get(automaton.id)
        if automaton.imported is None and (stub is None or stub.imported is not None):
            source = _source_of(automaton, stub, path)
            views.append(msgspec.structs.replace(automaton_view(automaton), imported=source))
    return views


def _source_of(automaton: Automaton, stub: Automaton | None, path: Path) -> ImportView:
    if stub is not None and stub.imported is not None:
        return ImportView(file=stub.imported.file.text, automaton=stub.imported.automaton)
    file = automaton.path or path
    shown = file.relative_to(path.parent) if file.is_relative_to(path.parent) else file
    return ImportView(file=shown.as_posix(), automaton=automaton.id)
