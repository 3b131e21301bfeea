"""Tell what of a document other programs do not see, since SCXML has no word for it."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Final

from codegen.diagnostics import Diagnostics, Location, Note

from ..code.pieces import is_foreign
from ..document import Automaton, Document, Node
from .data import assignments, is_expression
from .placement import Placement

__all__ = ["tell"]

_MOST_LINES: Final = 20
"""Lines of which a remark tells."""


def tell(document: Document, placement: Placement, path: Path, diagnostics: Diagnostics) -> None:
    """Tell what stands in our namespace alone; `path` is where the document lies."""
    found: dict[str, list[int]] = {}
    for kind, line in _wordless(document):
        lines = found.setdefault(kind, [])
        if line not in lines:
            lines.append(line)
    for kind, lines in found.items():
        listed = ", ".join(map(str, lines[1 : _MOST_LINES + 1]))
        more = f" and {len(lines) - _MOST_LINES - 1} more" if len(lines) > _MOST_LINES + 1 else ""
        notes = [Note(f"also in line{'s' if len(lines) > 2 else ''} {listed}{more}")] if listed else []
        message = f"SCXML has no word for {kind}: it is kept, and other programs do not see it"
        diagnostics.note("N560", message, Location(path, lines[0]), notes)
    for misfit in placement.misfits:
        what = misfit.what
        name = "automaton" if isinstance(what, Automaton) else "transition"
        message = f"{name} {what.id} has no place in SCXML, and other programs do not see it: {misfit.reason}"
        diagnostics.warning("W560", message, _place(what, path))
    if placement.root is None or not placement.root.states:
        message = "there is no state, of which SCXML wants one: other programs may refuse the file"
        diagnostics.warning("W560", message, Location(path))


def _wordless(document: Document) -> Iterator[tuple[str, int]]:
    is_python = not is_foreign(document)
    for automaton in document.automata:
        if not automaton.variables.is_blank and not (is_python and assignments(automaton.variables, ())):
            yield "code that gives variables their values", automaton.variables.line
        if not automaton.functions.is_blank:
            yield "functions", automaton.functions.line
        if automaton.imported is not None:
            yield "an automaton of another file", automaton.imported.line or automaton.line
        for item in automaton.inputs:
            yield "the input of an automaton", item.line
        for state in automaton.states:
            if not state.code.is_blank:
                yield "code that runs in every cycle", state.code.line
            for argument in state.arguments:
                yield "the argument of a state", argument.line
        for transition in automaton.transitions:
            trigger = transition.trigger
            if transition.type != "condition":
                continue
            if is_python and not trigger.is_blank and not is_expression(trigger.text):
                yield "a condition of statements", trigger.line
            if not transition.guard.is_blank:
                yield "the guard of a condition", transition.guard.line


def _place(node: Node, path: Path) -> Location:
    return Location(path, node.line, max(1, node.column))
