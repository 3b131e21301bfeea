"""Follow all code of a document without running it, until the effects of every piece are known.

Names keep their values between the pieces of an automaton; arguments of states and attributes of the
component carry them to others. What escapes in one piece, as `evaluation` says, may run in all of them.
"""

from __future__ import annotations

import ast
from collections.abc import Iterable, Iterator
from dataclasses import replace
from functools import cached_property
from typing import Any, Final, TypeVar

from ..diagnostics import Location, Note
from ..messages import Message
from ._definitions import is_static
from ._evaluation import Evaluation, ends
from ._known_code import NOWHERE, KnownCode
from ._piece_effects import Effects, anything
from ._possible_values import (
    COMPONENT,
    DATA,
    NOTHING,
    NUMBER,
    PLAIN,
    SELF,
    UNSURE,
    WHOLE,
    Names,
    Values,
    add_values,
    defaults_of,
    of_constant,
    parameters_of,
)
from .analysis import Analysis, AutomatonCode, Piece
from .code._values import INPUT_TYPES, PARAMETER_TYPES, ValueTextError, parse_value
from .code.text import evaluated_at_once
from .document import NO_CHILD, Argument, Parameter, Result, State, Text

_MOST_CALLS: Final = 300  # of functions with different values
_Item = TypeVar("_Item", Argument, Result)
_Call = tuple[str, tuple[tuple[str, Values], ...]]  # a function, and the values of its parameters


class CodeEffects(KnownCode):
    """The effects of the code of a document, piece by piece."""

    def __init__(self, analysis: Analysis) -> None:
        super().__init__(analysis)
        document = analysis.document
        self.attributes = {each.name: _given(each) for each in document.parameters}
        self._known: dict[_Call, Effects] = {}
        self._last: dict[_Call, Effects] = {}
        """The effects of functions by the values of their parameters: of this pass, and of the last one."""
        passed = {
            (child, argument.name)
            for _, state in document.states()
            for child, argument in _by_child(state, state.arguments)
        }
        self._names: dict[int, Names] = {
            automaton.id: {
                "self": COMPONENT,
                **{
                    item.name: _until_passed(item) if (automaton.id, item.name) in passed else _given(item)
                    for item in automaton.inputs
                },
                **{item.name: _first(item) for item in automaton.outputs},
            }
            for automaton in document.automata
        }
        """The values of the variables of each automaton, by its id."""
        self._names[0] = dict.fromkeys(self.definitions.functions, COMPONENT)  # not bound yet
        self._function_names: dict[_Call, Names] = {}
        """The values of the variables of functions, by the values of their parameters."""
        self._by_piece: dict[Piece, Effects] = {}
        self._follow()

    def of(self, text: Text) -> Effects:
        """Return all that may happen while a text of the document runs, also by what escaped elsewhere."""
        piece = self.analysis.piece(text)
        if piece is None:
            return anything(NOWHERE) if self.analysis.is_broken(text) else Effects()
        own = self.of_piece(piece)
        if not self.escaped - {DATA}:
            return own
        found = Effects()
        found.add(own)
        found.add(replace(self._wild, calls=set(), answer=own.answer), piece.tree.body[0])
        found.possible = (found.possible | self._wild.calls) - own.calls
        return found

    def of_piece(self, piece: Piece) -> Effects:
        """Return the effects of a piece of code; of functions, those of all together."""
        return anything(piece.tree) if piece.is_deep else self._by_piece[piece]

    @cached_property
    def _wild(self) -> Effects:
        """What code may do that has all that escaped."""
        found = Effects()
        for value in self.escaped - {DATA}:
            found.add(self.effects_of(value))
        return found

    @cached_property
    def unclear_sends(self) -> tuple[Note, ...]:
        """The places that may send any event."""
        found = []
        if self.analysis.extension is not None:
            place = Location(self.analysis.path)
            found.append(Note(Message("hand-written code beside the document may send any event"), place))
        for text, path, piece in self.analysis.by_text.values():
            effects = self.of(text) if piece is None else self.of_piece(piece)
            if effects.any_event:
                place = Location(path, max(1, text.line), max(1, text.column))
                if piece is not None:
                    place = piece.place(min(effects.any_event, key=lambda node: getattr(node, "lineno", 1)))
                found.append(Note(Message("this code may send any event"), place))
        if not found and self._wild.any_event:
            found.append(Note(Message("this code may send any event"), Location(self.analysis.path)))
        return tuple(found)

    def _follow(self) -> None:
        """Evaluate all code until no name gets a new value: the effects are then complete."""
        before: object = None
        while before != (now := self._snapshot()):
            before = now
            self._last, self._known = self._known, {}
            for piece in self.analysis.functions:
                self._by_piece[piece] = self._evaluate_functions(piece)
            for code in self.analysis.automata:
                names = self._names[code.automaton.id]
                for piece in code.sharing():
                    if piece.has_event:
                        add_values(names, "event", frozenset({DATA}))
                    body = piece.tree.body
                    self._by_piece[piece] = self._evaluate(body, names, f"{piece.automaton}", piece.automaton)
                self._exchange(code, names)

    def _snapshot(self) -> object:
        groups: tuple[dict[Any, Names], ...] = (self._names, self._function_names, self.parameters)
        names = [{key: {**names} for key, names in group.items()} for group in groups]
        found = (
            {**self.attributes},
            {**self.local},
            {*self.escaped},
            self.contents,
            self.definitions.is_opaque,
        )
        return names, self._known, found

    def _evaluate(
        self,
        body: Iterable[ast.AST],
        names: Names,
        context: str,
        automaton: int = 0,
        *,
        is_function: bool = False,
    ) -> Effects:
        """Evaluate code with these values of its names; what a function returns is followed."""
        walk = Evaluation(self, names, context, automaton, is_function=is_function)
        try:
            for node in body:
                walk.visit(node)
        except RecursionError:
            return self._lose_track()
        return walk.effects

    def _evaluate_functions(self, piece: Piece) -> Effects:
        """Evaluate the statements among functions; add what functions do that depends on no call."""
        functions = [each for each in piece.tree.body if each in self.definitions.functions.values()]
        body: list[ast.AST] = [each for each in piece.tree.body if each not in functions]
        body += [each for one in functions for each in evaluated_at_once(one)]
        found = self._evaluate(body, self._names[0], "")
        for name, function in self.definitions.functions.items():
            if function in functions:
                found.add(replace(self.called(name, {}), any_event=[], any_call=[]))
        for name in piece.bound - self.definitions.functions.keys():
            add_values(self.attributes, name, self._names[0].get(name, UNSURE))
        return found

    def _lose_track(self) -> Effects:
        """Give up: code that cannot be followed has the component."""
        self.definitions.is_opaque = True
        self.escaped.add(SELF)
        return anything(NOWHERE)

    def _exchange(self, code: AutomatonCode, names: Names) -> None:
        """Give the values of arguments to the inputs of automata, and those of outputs to variables."""
        for state in code.automaton.states:
            for child, argument in _by_child(state, state.arguments):
                piece, values = code.of("argument", argument), UNSURE
                if piece is not None and not piece.is_deep and piece.expression is not None:
                    values = Evaluation(self, names, f"{piece.automaton}").value(piece.expression)
                self._carry(self._names.get(child, {}), argument.name, values)
            for child, result in _by_child(state, state.results):
                values = self._names.get(child, {}).get(result.name, NOTHING)
                self._carry(names, result.variable.text.strip(), values)

    def _carry(self, names: Names, name: str, values: Values) -> None:
        """Give values to a name of another automaton, which runs at the same time."""
        self.escaped |= values & {DATA}
        add_values(names, name, values)

    def called(self, name: str, passed: Names) -> Effects:
        """Return the effects of a function of the document for these values of its parameters."""
        function = self.definitions.functions[name]
        own = [] if is_static(function) else parameters_of(function)[:1]
        key = name, tuple(sorted(passed.items()))
        if key in self._known:
            return self._known[key]
        if len(self._known) >= _MOST_CALLS or not (own or is_static(function)):
            return self._lose_track()  # or the component is among the arguments of `*args`
        self._known[key] = self._last.get(key, Effects())  # in case functions call each other
        first = defaults_of(function) | passed | dict.fromkeys(own, COMPONENT)
        names = self._function_names.setdefault(key, first)
        found = self._evaluate(function.body, names, f"{name} {hash(key)}", is_function=True)
        if not ends(function.body):
            found.returned |= NUMBER  # None
        self._known[key] = found
        return found


def _given(item: Parameter) -> Values:
    """Return the values of an input whose argument is unknown: the runtime checks the types."""
    name = item.type.text.strip()
    return WHOLE if name in ("bool", "int") else PLAIN if name in PARAMETER_TYPES else UNSURE


def _until_passed(item: Parameter) -> Values:
    """Return the values of an input without those of its argument, which a servant may refuse to give."""
    return NOTHING if item.default.is_blank else _first(item)


def _first(item: Parameter) -> Values:
    """Return the values of an input or output until code assigns it."""
    type_name = item.type.text.strip()
    try:
        value = parse_value(type_name if type_name in INPUT_TYPES else "object", item.default)
    except ValueTextError:
        return UNSURE
    return of_constant(value) if isinstance(value, str | int | float) or value is None else UNSURE


def _by_child(state: State, items: Iterable[_Item]) -> Iterator[tuple[int, _Item]]:
    """Yield arguments or results of a state, each with the id of an automaton of which it is."""
    for item in items:
        for child in state.children if item.child == NO_CHILD else (item.child,):
            yield child, item
