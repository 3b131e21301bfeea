"""Check the values that states hand to the inputs of their automata, as far as they are written out."""

from __future__ import annotations

import ast

from ...diagnostics import Note
from ..code.values import INPUT_TYPES, ValueTextError, parse_value
from ..document import NO_CHILD, Argument, Document, Parameter, State
from .report import Report

__all__ = ["check_arguments"]


def check_arguments(document: Document, report: Report) -> None:
    """Check that literals are of the type of their input; other values are checked when handed over."""
    for _, state in document.states():
        for argument in state.arguments:
            declared = _input_of(document, state, argument)
            if declared is not None:
                _check_literal(argument, declared, report)


def _input_of(document: Document, state: State, argument: Argument) -> Parameter | None:
    """Return the input that an argument is for; what has none is told when the component is generated."""
    numbers = state.children if argument.child == NO_CHILD else (argument.child,)
    children = [child for number in numbers if (child := document.automaton(number)) is not None]
    found = [item for child in children for item in child.inputs if item.name == argument.name]
    return found[0] if len(found) == 1 else None


def _check_literal(argument: Argument, declared: Parameter, report: Report) -> None:
    type_name = declared.type.text.strip()
    if type_name not in INPUT_TYPES:
        return
    try:
        ast.literal_eval(argument.value.text.strip())
    except (ValueError, TypeError, SyntaxError, MemoryError, RecursionError):
        return  # an expression
    try:
        parse_value(type_name, argument.value)
    except ValueTextError as error:
        message = f"the input `{declared.name}` is handed a wrong value: {error}"
        note = Note("the input is here", report.place(declared))
        report.error("E533", message, report.place(argument, argument.value), [note])
