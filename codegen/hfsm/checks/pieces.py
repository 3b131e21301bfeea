"""Take the Python of a document apart: every piece of code as a tree, with the way back to its place."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Final

from ...diagnostics import Location
from ..code.text import Code, CodeError, parse, split
from ..document import Automaton, Document, State, Text, Transition
from .assignments import assignments_of
from .report import Node, Report

__all__ = ["AutomatonCode", "Piece", "automaton_code", "document_functions"]

_DEEPEST: Final = 150
"""Nodes below one another in code that is looked into: the checks go down with Python's stack."""


@dataclass(frozen=True, eq=False)
class Piece:
    """A piece of code: `tree` counts lines as `code` does, after `header` lines of ours.

    With `is_functions` it becomes methods of the component, else a function that shares the names of its
    automaton; with `has_event` that one takes the event.
    """

    tree: ast.Module
    code: Code
    header: int
    path: Path
    is_functions: bool = False
    has_event: bool = False

    def place(self, node: ast.expr | ast.stmt, length: int = 0) -> Location:
        """Return where a node stands in its file; `length` is that of the text to underline."""
        line = min(max(node.lineno - self.header, 1), len(self.code.lines))
        before = self.code.lines[line - 1].encode()[: node.col_offset].decode(errors="replace")
        left = 0 if line - 1 in self.code.fixed else self.code.removed
        if line == 1:
            left = self.code.start - 1
        if not length and node.end_lineno == node.lineno:
            length = (node.end_col_offset or 0) - node.col_offset
        return Location(self.path, self.code.line + line - 1, left + len(before) + 1, max(1, length))

    def place_of_attribute(self, node: ast.Attribute) -> Location:
        """Return where the name of an attribute stands."""
        end = ast.copy_location(ast.Name(node.attr), node)
        end.lineno = node.end_lineno or node.lineno
        end.col_offset = (node.end_col_offset or 0) - len(node.attr.encode())
        return self.place(end, len(node.attr))

    @property
    def expression(self) -> ast.expr | None:
        """The expression that a condition or an argument is, None for statements."""
        match self.tree.body:
            case [ast.Expr(value=value)] | [ast.Return(value=ast.expr() as value)]:
                return value
        return None


@dataclass(eq=False)
class AutomatonCode:
    """All code of an automaton; that of states by their id, that of transitions by the transition itself.

    It is `broken` when some of it is missing, because it is no Python or nested too deeply: then nobody knows
    what the rest may rely on.
    """

    automaton: Automaton
    variables: Piece | None = None
    functions: Piece | None = None
    entry: dict[int, Piece] = field(default_factory=dict)
    code: dict[int, Piece] = field(default_factory=dict)
    exit: dict[int, Piece] = field(default_factory=dict)
    arguments: dict[int, list[Piece]] = field(default_factory=dict)
    conditions: dict[int, Piece] = field(default_factory=dict)
    """Conditions and guards, by the index of the transition in the automaton."""
    fired: dict[int, Piece] = field(default_factory=dict)
    broken: bool = False

    def running(self) -> Iterator[Piece]:
        """Yield the pieces that run in cycles."""
        for pieces in (self.entry, self.code, self.exit, self.conditions, self.fired):
            yield from pieces.values()
        for arguments in self.arguments.values():
            yield from arguments

    def sharing(self) -> Iterator[Piece]:
        """Yield the pieces that share the automaton's names."""
        if self.variables is not None:
            yield self.variables
        yield from self.running()

    @cached_property
    def names(self) -> frozenset[str]:
        """The names that the code shares: those that it assigns, and the inputs."""
        bound = (assignments_of(piece.tree.body).assigned for piece in self.sharing())
        return frozenset(item.name for item in self.automaton.inputs).union(*bound)

    def condition_of(self, transition: Transition) -> Piece | None:
        """Return the condition or the guard of a transition."""
        return self.conditions.get(self._index(transition))

    def fired_by(self, transition: Transition) -> Piece | None:
        """Return the code that runs when a transition fires."""
        return self.fired.get(self._index(transition))

    def condition(self, transition: Transition) -> ast.expr | None:
        """Return the condition or the guard of a transition as an expression."""
        piece = self.condition_of(transition)
        return None if piece is None else piece.expression

    def _index(self, transition: Transition) -> int:
        return self._indices[id(transition)]

    def __post_init__(self) -> None:
        self._indices = {id(transition): index for index, transition in enumerate(self.automaton.transitions)}


def automaton_code(automaton: Automaton, report: Report) -> AutomatonCode:
    """Return the code of an automaton."""
    reader = _CodeReader(AutomatonCode(automaton), report)
    found = reader.found
    found.variables = reader.statements(automaton, automaton.variables)
    found.functions = reader.statements(automaton, automaton.functions, is_functions=True)
    for state in automaton.states:
        reader.state(state)
    for index, transition in enumerate(automaton.transitions):
        reader.transition(index, transition)
    return found


def document_functions(document: Document, report: Report) -> tuple[list[Piece], bool]:
    """Return the functions that belong to no automaton, and whether all of them are known."""
    reader = _CodeReader(AutomatonCode(Automaton(id=0)), report)
    pieces = (
        reader.statements(functions, functions.text, is_functions=True) for functions in document.functions
    )
    return [piece for piece in pieces if piece is not None], not reader.found.broken


class _CodeReader:
    def __init__(self, found: AutomatonCode, report: Report) -> None:
        self.found = found
        self._report = report

    def state(self, state: State) -> None:
        for text, pieces in (
            (state.entry, self.found.entry),
            (state.code, self.found.code),
            (state.exit, self.found.exit),
        ):
            piece = self.statements(state, text)
            if piece is not None:
                pieces[state.id] = piece
        for argument in state.arguments:
            piece = self._expression(argument, argument.value)
            if piece is not None:
                self.found.arguments.setdefault(state.id, []).append(piece)

    def transition(self, index: int, transition: Transition) -> None:
        has_event = transition.type == "event"
        text = transition.trigger if transition.type == "condition" else transition.guard
        condition = self._expression(transition, text, has_event=has_event)
        if condition is not None:
            self.found.conditions[index] = condition
        fired = self.statements(transition, transition.code, has_event=has_event)
        if fired is not None:
            self.found.fired[index] = fired

    def statements(
        self, node: Node, text: Text, *, is_functions: bool = False, has_event: bool = False
    ) -> Piece | None:
        code = split(text)
        if code is None:
            return None
        try:
            tree = parse(code, code.lines)
        except CodeError:  # told when the component is generated
            self.found.broken = True
            return None
        if _is_too_deep(tree):
            self.found.broken = True
            return None
        return Piece(tree, code, 0, self._report.place(node).path, is_functions, has_event)

    def _expression(self, node: Node, text: Text, *, has_event: bool = False) -> Piece | None:
        """Return an expression, which may span lines, or the statements that return one."""
        code = split(text)
        if code is None:
            return None
        try:
            tree = parse(code, ("(", *code.lines, ")"), header=1)
        except CodeError:
            return self.statements(node, text, has_event=has_event)
        if _is_too_deep(tree) or not _is_expression(tree):
            self.found.broken = True
            return None
        return Piece(tree, code, 1, self._report.place(node).path, has_event=has_event)


def _is_expression(tree: ast.Module) -> bool:
    """Return whether a tree is one expression, which leaves the parentheses around it to us."""
    match tree.body:
        case [ast.Expr(value=value)]:
            return value.lineno > 1
    return False


def _is_too_deep(tree: ast.AST) -> bool:
    level: list[ast.AST] = [tree]
    for _ in range(_DEEPEST):
        level = [child for node in level for child in ast.iter_child_nodes(node)]
        if not level:
            return False
    return True
