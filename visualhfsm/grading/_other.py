"""Recognize a document that was drawn for another exercise, by the names of its states."""

from __future__ import annotations

from pathlib import Path
from typing import Final

from codegen.diagnostics import Diagnostics
from codegen.hfsm import read_document

from ._exercise import SOLUTION, Exercise

_ENOUGH: Final = 2
"""States of one name by which an exercise is recognized."""


def other_exercise(exercise: Exercise, document: Path) -> str:
    """Return the name of the exercise beside this one that a document is for; empty if it is of this one."""
    own = _states(document)
    if len(own) < _ENOUGH or own & _states(exercise.solution):
        return ""
    for solution in sorted(exercise.folder.parent.glob(f"*/{SOLUTION}")):
        theirs = _states(solution)
        if len(own & theirs) >= _ENOUGH and (own <= theirs or theirs <= own):
            return solution.relative_to(exercise.folder.parent).parts[0]
    return ""


def _states(path: Path) -> set[str]:
    """Return the names of all states of a document, none if it cannot be read."""
    try:
        document = read_document(path, Diagnostics())
    except (OSError, ValueError, RecursionError):
        return set()
    found = document.automata if document is not None else ()
    return {state.name.strip() for automaton in found for state in automaton.states}
