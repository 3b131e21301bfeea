"""Check the arguments of a call in the code of a document."""

from __future__ import annotations

import ast
from collections.abc import Sequence
from typing import Final

from ..diagnostics import Location, Note, did_you_mean
from ..messages import Message, all_of
from .analysis import Access
from .codes import Code
from .known_interfaces import Operation
from .report import Report

_NUMBERS: Final = frozenset({"byte", "short", "int", "long", "float", "double"})
"""Types of IDL."""


def check_call(access: Access, operation: Operation, report: Report) -> None:
    """Check the number and the names of the arguments of a call, and the kinds of constants."""
    call = access.call
    if call is None or any(isinstance(argument, ast.Starred) for argument in call.args):
        return
    names = [keyword.arg for keyword in call.keywords]
    if None in names:
        return
    parameters = operation.parameters
    given = parameters[: len(call.args)]
    wrong = next((name for name in names if name not in parameters and name not in operation.by_name), None)
    missing = [name for name in parameters[: operation.required] if name not in (*given, *names)]
    if len(call.args) > len(parameters):
        message = Message(
            "`{operation}` takes {parameters}, but gets {given}",
            operation=operation.name,
            parameters=_count(parameters),
            given=len(call.args),
        )
    elif wrong is not None:
        message = Message("`{operation}` has no parameter `{name}`", operation=operation.name, name=wrong)
    elif missing:
        message = Message(
            "`{operation}` is called without {missing}",
            operation=operation.name,
            missing=all_of([f"`{name}`" for name in missing]),
        )
    elif repeated := [name for name in names if name in given]:
        message = Message("`{operation}` gets `{name}` twice", operation=operation.name, name=repeated[0])
    else:
        _check_kinds(access, call, operation, report)
        return
    place = access.place(-1)
    notes: tuple[Note, ...] = ()
    if wrong is not None and len(call.args) <= len(parameters):
        place = _keyword_place(access, call, wrong)
        notes = did_you_mean(wrong, {*parameters[len(given) :], *operation.by_name} - {*names}, "")
    example = f"`{operation.name}({', '.join(parameters)})`"
    note = Note(Message("call it as {example}", example=example))
    report.warning(Code.BAD_CALL, message, place, [*notes, note])


def _check_kinds(access: Access, call: ast.Call, operation: Operation, report: Report) -> None:
    """Report the first constant of a kind that its parameter cannot be."""
    types = dict(zip(operation.parameters, operation.types, strict=False))
    given = [
        *zip(operation.parameters, call.args, strict=False),
        *((str(each.arg), each.value) for each in call.keywords),
    ]
    for name, argument in given:
        if not isinstance(argument, ast.Constant) or argument.value in (None, ...):
            continue
        is_text = isinstance(argument.value, str)
        wanted = types.get(name, "")
        if wanted == "string" and not is_text:
            kind = Message("text")
        elif wanted in _NUMBERS and is_text:
            kind = Message("a number")
        else:
            continue
        message = Message(
            "`{name}` of `{operation}` must be {kind}", name=name, operation=operation.name, kind=kind
        )
        place = access.piece.at(argument.lineno, argument.col_offset, 1)
        report.warning(Code.BAD_CALL, message, place)
        return


def _keyword_place(access: Access, call: ast.Call, name: str) -> Location:
    """Return the place of the name of an argument."""
    keyword = next(each for each in call.keywords if each.arg == name)
    return access.piece.at(keyword.lineno, keyword.col_offset, len(name))


def _count(parameters: Sequence[str]) -> Message:
    if not parameters:
        return Message("no argument")
    return Message.counted("{count} argument", "{count} arguments", count=len(parameters))
