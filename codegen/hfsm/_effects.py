"""Follow all code of a document without running it, until the effects of every piece are known.

Names keep their values between the pieces of an automaton; arguments of states and attributes of the
component carry them to others. If the component or a proxy is passed to a helper object, a list or a library,
every call of an unknown object, anywhere in the document, may use it.
"""

from __future__ import annotations

import ast
from collections.abc import Iterator
from dataclasses import replace
from functools import cached_property
from typing import Final

from ..diagnostics import Location, Note
from ..messages import Message
from ._definitions import UNKNOWN, Definitions, is_static
from ._evaluation import Evaluation
from ._piece_effects import Effects, anything
from ._possible_values import (
    COMPONENT,
    NOTHING,
    NUMBER,
    PLAIN,
    UNSURE,
    Names,
    Values,
    add_values,
    as_values,
    defaults_of,
    parameters_of,
)
from .analysis import Analysis, AutomatonCode, Piece
from .code._values import INPUT_TYPES, PARAMETER_TYPES, ValueTextError, parse_value
from .document import NO_CHILD, Argument, Parameter, State, Text

_MOST_CALLS: Final = 1000
"""The most calls of functions with different values that are followed."""
_Call = tuple[str, tuple[tuple[str, Values], ...]]
"""A function, and the values of its parameters."""


class CodeEffects:
    """The effects of the code of a document, piece by piece."""

    def __init__(self, analysis: Analysis) -> None:
        document = analysis.document
        self.analysis: Final = analysis
        self.definitions = Definitions(analysis)
        self.attributes: Names = {each.name: PLAIN for each in document.parameters}
        """The values of attributes that code assigns."""
        self.local: dict[str, Effects] = {}
        """The effects of nested functions and lambdas."""
        self._known: dict[_Call, Effects] = {}
        self._last: dict[_Call, Effects] = {}
        """The effects of functions by the values of their parameters: of this pass, and of the last one."""
        self._names: dict[int, Names] = {
            automaton.id: {
                "self": COMPONENT,
                **{item.name: _given(item) for item in automaton.inputs},
                **{item.name: _first(item) for item in automaton.outputs},
            }
            for automaton in document.automata
        }
        """The values of the variables of each automaton, by its id."""
        self._function_names: dict[_Call, Names] = {}
        """The values of the variables of functions, by the values of their parameters."""
        self._by_piece: dict[Piece, Effects] = {}
        for _, state in document.states():
            for child, argument in _passed(state):
                if child in self._names:
                    self._names[child].pop(argument.name, None)  # the argument gives its value
        self._follow()
        # who can send any event and call anything has the component
        is_passed = any(effects.any_event and effects.any_call for effects in self._by_piece.values())
        has_unclear_calls = any(effects.any_call for effects in self._by_piece.values())
        for effects in self._by_piece.values():
            if is_passed and effects.reads_component:
                effects.answer |= UNKNOWN
            if has_unclear_calls:
                effects.any_call += effects.unknown

    def of(self, text: Text) -> Effects:
        """Return the effects of a text of the document; one that is not valid Python may do anything."""
        piece = self.analysis.piece(text)
        if piece is not None:
            return self.of_piece(piece)
        return anything(ast.Module([], [])) if self.analysis.is_broken(text) else Effects()

    def of_piece(self, piece: Piece) -> Effects:
        """Return the effects of a piece of code; of functions, those of all together."""
        return anything(piece.tree) if piece.is_deep else self._by_piece[piece]

    @cached_property
    def unclear_sends(self) -> tuple[Note, ...]:
        """The places that may send any event."""
        found = []
        if self.analysis.extension is not None:
            place = Location(self.analysis.path)
            found.append(Note(Message("hand-written code beside the document may send any event"), place))
        for text, path, piece in self.analysis.by_text.values():
            effects = self.of(text)
            if effects.any_event:
                place = Location(path, max(1, text.line), max(1, text.column))
                if piece is not None:
                    first = min(effects.any_event, key=lambda node: getattr(node, "lineno", 1))
                    place = piece.place(first)
                found.append(Note(Message("this code may send any event"), place))
        return tuple(found)

    def _follow(self) -> None:
        """Evaluate all code until no name gets a new value: the effects are then complete."""
        before: object = None
        while before != (now := self._snapshot()):
            before = now
            self._last, self._known = self._known, {}
            for code in self.analysis.automata:
                names = self._names[code.automaton.id]
                for piece in code.sharing():
                    self._by_piece[piece] = self._look(piece, names)
                self._pass_arguments(code, names)
                self._take_results(code, names)
            for piece in self.analysis.functions:
                self._by_piece[piece] = self._look(piece, self.attributes)  # its names are attributes

    def _snapshot(self) -> object:
        names = {
            key: {**names} for group in (self._names, self._function_names) for key, names in group.items()
        }
        return {**self.attributes}, names, self._known, {**self.local}, self.definitions.is_opaque

    def _look(self, piece: Piece, names: Names) -> Effects:
        functions = self.definitions.functions if piece.is_functions else {}
        walk = Evaluation(self, names, f"{piece.automaton}", piece.automaton)
        try:
            for node in piece.tree.body:
                if isinstance(node, ast.FunctionDef) and functions.get(node.name) is node:
                    walk.effects.add(self._uncalled(node.name))
                else:
                    walk.visit(node)
        except RecursionError:
            self.definitions.lose_track()
            return anything(piece.tree)
        return walk.effects

    def _uncalled(self, name: str) -> Effects:
        """Return the effects of a function that depend on no call; the code that calls it has the others."""
        effects = self.called(name, {})
        is_implicit = name.startswith("__")  # Python calls it
        return effects if is_implicit else replace(effects, any_event=[], any_call=[], unknown=[])

    def _pass_arguments(self, code: AutomatonCode, names: Names) -> None:
        """Give the values of arguments to the inputs of automata."""
        for state in code.automaton.states:
            for child, argument in _passed(state):
                piece = code.of("argument", argument)
                if piece is not None and not piece.is_deep and piece.expression is not None:
                    values = Evaluation(self, names, f"{piece.automaton}").value(piece.expression)
                    if child in self._names:
                        add_values(self._names[child], argument.name, values)

    def _take_results(self, code: AutomatonCode, names: Names) -> None:
        """Give the values of outputs to the variables that take them."""
        for state in code.automaton.states:
            for result in state.results:
                for child in state.children if result.child == NO_CHILD else (result.child,):
                    values = self._names.get(child, {}).get(result.name, NOTHING)
                    add_values(names, result.variable.text.strip(), values)

    def called(self, name: str, passed: Names) -> Effects:
        """Return the effects of a function of the document for these values of its parameters."""
        function = self.definitions.functions[name]
        if not is_static(function) and not parameters_of(function):
            return anything(function)  # the component is among the arguments of `*args`
        key = name, tuple(sorted(passed.items()))
        if key not in self._known:
            if len(self._known) >= _MOST_CALLS:
                return anything(function)
            self._known[key] = self._last.get(key, Effects())  # in case functions call each other
            names = self._function_names.setdefault(key, defaults_of(function) | passed)
            if not is_static(function):
                names[parameters_of(function)[0]] = COMPONENT
            walk = Evaluation(self, names, f"{name} {hash(key)}")
            try:
                for statement in function.body:
                    walk.visit(statement)
            except RecursionError:
                self.definitions.lose_track()
                walk.effects = anything(function)
            self._known[key] = walk.effects
        return self._known[key]


def _given(item: Parameter) -> Values:
    """Return the values of an input whose argument is unknown: the runtime checks the types."""
    return PLAIN if item.type.text.strip() in PARAMETER_TYPES else UNSURE


def _first(item: Parameter) -> Values:
    """Return the values of an output until code assigns it."""
    type_name = item.type.text.strip()
    try:
        value = parse_value(type_name if type_name in INPUT_TYPES else "object", item.default)
    except ValueTextError:
        return UNSURE
    if isinstance(value, str):
        return as_values([value])
    return NUMBER if isinstance(value, int | float) or value is None else UNSURE


def _passed(state: State) -> Iterator[tuple[int, Argument]]:
    """Yield the arguments of a state, each with the id of an automaton that gets it."""
    for argument in state.arguments:
        for child in state.children if argument.child == NO_CHILD else (argument.child,):
            yield child, argument
