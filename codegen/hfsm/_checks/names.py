"""Find undefined names, variables that are never read, and expressions that are certainly mistakes.

Pyflakes knows Python's scopes and builtins. It checks each piece of code as the function that it becomes in
the component; the names that the piece shares are passed to it as builtins.
"""

from __future__ import annotations

import ast
import builtins
from collections.abc import Collection, Iterator
from functools import lru_cache
from typing import Final

from pyflakes import messages
from pyflakes.checker import Checker

from ...diagnostics import Location, Misspelt, Note, did_you_mean
from ...messages import Message
from ...parsing import parse_python
from ..analysis import AutomatonCode, Piece
from ..code._scopes import INSPECTING
from ..code.names import RESERVED
from ..code.text import all_nodes, own_nodes, place_of_bound
from ..codes import Code
from ..report import Report
from .libraries import KnownLibraries
from .scope import Above

_DOUBTFUL: Final = (
    messages.AssertTuple,
    messages.IfTuple,
    messages.InvalidPrintSyntax,
    messages.IsLiteral,
    messages.MultiValueRepeatedKeyLiteral,
    messages.RaiseNotImplemented,
    *(kind for name, kind in vars(messages).items() if name.startswith(("PercentFormat", "StringDotFormat"))),
)
"""Messages of pyflakes about certain mistakes, without those about style."""

_FUNCTIONS: Final = "class Component: pass"
_PLAIN: Final = "def piece(self): pass"
_WITH_EVENT: Final = "def piece(self, event): pass"

_BUILTINS: Final = frozenset(dir(builtins))
_SLIP: Final = 0.8
"""Likeness to a name of Python that only a slip explains: another one is probably a variable to declare."""


def check_names(
    piece: Piece,
    known: Collection[str],
    report: Report,
    libraries: KnownLibraries,
    attributes: Collection[str],
    *,
    above: Above | None = None,
) -> None:
    """Check one piece of code; `known` are the names that are defined outside it.

    `attributes` are those of `self`, `libraries` those that could define a name.
    """
    for message in _messages(piece, known):
        place = piece.at(message.lineno, message.col)
        if not isinstance(message, messages.UndefinedName):
            text = message.message % message.message_args
            report.warning(Code.DOUBTFUL_CODE, Message.verbatim(text[:1].lower() + text[1:]), place)
            continue
        name = str(message.message_args[0])
        place = piece.at(message.lineno, message.col, len(name))
        if above is not None and above.report(name, place, report):
            continue
        notes = _advice(name, piece, known, libraries, attributes)
        report.warning(Code.UNDEFINED_NAME, Message("`{name}` is not defined", name=name), place, notes)


def _advice(
    name: str, piece: Piece, known: Collection[str], libraries: KnownLibraries, attributes: Collection[str]
) -> tuple[Note, ...]:
    """Return what would define a name: what has exactly this name, or else what is similar."""
    if name in attributes:
        written = f"self.{name}"
        message = Message("the component has it: write `{name}`", name=written)
        return (Note(message, misspelt=None if piece.is_functions else Misspelt(name, written)),)
    if library := libraries.defining(name, piece):
        return (
            Note(
                Message("it has to be imported: add the library `{library}`", library=library),
                library=library,
            ),
        )
    return did_you_mean(name, {*known} - {name}, "") or did_you_mean(name, _BUILTINS, "", _SLIP)


def _messages(piece: Piece, known: Collection[str]) -> tuple[messages.Message, ...]:
    # Pyflakes spends time on each name, and an automaton may share thousands.
    nodes = (node for node in all_nodes(piece.tree) if isinstance(node, ast.Global | ast.Nonlocal))
    names = piece.used.union(*(node.names for node in nodes)).intersection(known)
    head = _PLAIN
    if piece.is_functions:
        head = _FUNCTIONS
    elif piece.has_event:
        head = _WITH_EVENT
    return _messages_of(piece.tree, head, names)


@lru_cache(maxsize=2048)
def _messages_of(tree: ast.Module, head: str, names: frozenset[str]) -> tuple[messages.Message, ...]:
    """Return the messages of pyflakes, cached: an editor checks all pieces again after each change."""
    checker = Checker(_as_module(tree.body, head), builtins=names)
    found = sorted(checker.messages, key=lambda message: (message.lineno, message.col))
    return tuple(each for each in found if isinstance(each, (messages.UndefinedName, *_DOUBTFUL)))


def _as_module(body: list[ast.stmt], head: str) -> ast.Module:
    """Return a module with a piece of code as it is in the component."""
    module = parse_python(head)
    (whole,) = module.body
    assert isinstance(whole, ast.ClassDef | ast.FunctionDef)
    whole.body = body or whole.body
    return module


def check_variables(code: AutomatonCode, above: Above, report: Report) -> None:
    """Check the variables and inputs of one automaton; a name that starts with _ may be unused."""
    if code.broken:
        return
    read = set(RESERVED)  # check_reserved reports those that code assigns
    read.update(item.name for item in code.automaton.outputs)  # the automaton above reads them
    for piece in code.sharing():
        read.update(piece.reads)
    if not read.isdisjoint(INSPECTING):
        return
    for declared in code.automaton.inputs:
        name = declared.name.strip()
        if name not in read and not name.startswith("_"):
            message = Message("the input `{name}` is never read", name=name)
            report.warning(Code.UNREAD_VARIABLE, message, declared)
    reported: set[str] = set()
    for piece in code.sharing():
        for target in _plain_targets(piece):
            name = target.id
            if name not in read and name not in reported and not name.startswith("_"):
                reported.add(name)
                message = Message("the variable `{name}` is never read", name=name)
                if above.report(name, piece.place(target, len(name)), report):
                    continue
                report.warning(Code.UNREAD_VARIABLE, message, piece.place(target, len(name)))


def check_reserved(code: AutomatonCode, reserved: Collection[str], report: Report) -> None:
    """Check that code assigns no `reserved` names, and declares no shared name as global."""
    pieces = [*code.by_owner.values(), *([] if code.variables is None else [code.variables])]
    for piece in pieces:
        for name in sorted(piece.bound.intersection(reserved) - {"self"}):  # code cannot assign it at all
            message = Message("`{name}` is a reserved name: choose another", name=name)
            line, column = piece.code.place(*place_of_bound(name, piece.tree, piece.code, piece.header))
            report.error(Code.RESERVED_NAME, message, Location(piece.path, line, column, len(name)))
    shared = code.automaton.declared.union(*(piece.bound for piece in code.by_owner.values()))
    for node in () if code.variables is None else own_nodes(code.variables.tree):
        for name in node.names if isinstance(node, ast.Global) else ():
            if name in shared:
                assert code.variables is not None
                message = Message(
                    "`global {name}` makes `{name}` global in the file, but other code of the automaton "
                    "assigns a variable `{name}`: delete `global` here, or add it there",
                    name=name,
                )
                place = code.variables.place(node)
                report.error(Code.BAD_CODE, message, Location(place.path, place.line))


def check_start(code: AutomatonCode, own: Collection[str], report: Report) -> None:
    """Report events and waits in the variables; `own` are the attributes that the document defines."""
    if code.variables is None:
        return
    for node in own_nodes(code.variables.tree):
        match node:
            case ast.Call(func=ast.Attribute(ast.Name("self"), "send" | "sleep" as name)) if name not in own:
                message = Message(
                    "`self.{name}` is for entry code: no automaton runs yet when variables are set", name=name
                )
                report.error(Code.BAD_CODE, message, code.variables.place(node))


def _plain_targets(piece: Piece) -> Iterator[ast.Name]:
    """Yield the targets of plain assignments; parts of a tuple and loop variables may be unused."""
    for node in own_nodes(piece.tree):
        match node:
            case ast.Assign(targets=targets):
                yield from (target for target in targets if isinstance(target, ast.Name))
            case ast.AnnAssign(target=ast.Name() as target):
                yield target
