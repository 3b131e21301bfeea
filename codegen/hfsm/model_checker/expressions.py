"""Parse the expressions of properties, which are true or false in a configuration.

    implication  = disjunction [ "->" implication ]
    disjunction  = conjunction { "or" conjunction }
    conjunction  = negation { "and" negation }
    negation     = "not" negation | primary
    primary      = "(" implication ")" | "true" | "false" | [ "in" ] state
                 | ( "active" | "ghost" | "finished" ) "(" automaton ")"
    state        = [ "#" id "/" ] name { "/" name }
    automaton    = "#" id | state that owns it

A name that is not one plain word, or is one of the words above, must be in double quotes.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Final

from ...diagnostics import Misspelt, did_you_mean
from ...logic import Form, predicate
from ...messages import Message, MessageError, any_of
from .model import AutomatonModel, Model
from .transition_system import ACTIVE, FINISHED, Holds

_TOKEN: Final = re.compile(
    r"""
    (?P<space>\s+) | (?P<arrow>->) | (?P<mark>[()/#]) | "(?P<quoted>[^"]*)" | (?P<word>(?:(?!->)[^\s()/#"])+)
    """,
    re.VERBOSE,
)
_WORDS: Final = frozenset({"in", "and", "or", "not", "true", "false", "active", "ghost", "finished"})
_FUNCTIONS: Final = ("active", "ghost", "finished")
_DEEPEST_EXPRESSION: Final = 100

Positions = dict[int, int]


class ExpressionError(MessageError):
    """An expression is not valid, from the character at the index `offset`, for `length` characters."""

    def __init__(
        self,
        message: Message,
        offset: int,
        length: int = 1,
        hints: tuple[Message, ...] = (),
        misspelt: Misspelt | None = None,
    ) -> None:
        super().__init__(message)
        self.offset = offset
        self.length = max(1, length)
        self.hints = hints
        self.misspelt = misspelt


@dataclass(frozen=True)
class Expression:
    """A parsed expression: the automata and states that it names, and its function."""

    automata: frozenset[int]
    states: frozenset[tuple[int, int]]
    """The states that it names, with their automata."""
    form: Form
    """It itself, by the indices of automata and states."""

    def bind(self, positions: Positions) -> Holds:
        """Return its function, from the position of each automaton in a configuration."""

        def leaf(form: Form) -> Holds:
            kind, *parts = form
            if kind == "in":
                wanted = [(positions[automaton], state) for automaton, state in parts]
                return lambda configuration: any(
                    configuration[position][0] == state and configuration[position][1] & ACTIVE
                    for position, state in wanted
                )
            position, flag = positions[parts[0]], FINISHED if kind == "finished" else ACTIVE
            return lambda configuration: bool(configuration[position][1] & flag)

        return predicate(self.form, leaf)


@dataclass(frozen=True, slots=True)
class _Token:
    kind: str
    text: str
    offset: int
    length: int


def parse(text: str, model: Model) -> Expression:
    """Return an expression parsed for a model. Raises ExpressionError."""
    return _Parser(text, model).parse()


def _tokens(text: str) -> Iterator[_Token]:
    offset = 0
    while offset < len(text):
        match = _TOKEN.match(text, offset)
        if match is None:
            raise ExpressionError(Message("this quote is not closed"), offset, len(text) - offset)
        kind = match.lastgroup or ""
        if kind != "space":
            value = match.group(kind)
            if kind == "mark" or (kind == "word" and value in _WORDS):
                kind = value
            yield _Token(kind, value, offset, match.end() - offset)
        offset = match.end()
    yield _Token("end", "", len(text.rstrip()), 1)


class _Parser:
    def __init__(self, text: str, model: Model) -> None:
        self._tokens = list(_tokens(text))
        self._at = 0
        self._depth = 0
        self._model = model

    def parse(self) -> Expression:
        found = self._implication()
        if self._token.kind != "end":
            raise self._unexpected(Message("`and`, `or`, `->` or the end"))
        return found

    @property
    def _token(self) -> _Token:
        return self._tokens[self._at]

    def _accept(self, kind: str) -> bool:
        if self._token.kind != kind:
            return False
        self._at += 1
        return True

    def _expect(self, kind: str) -> None:
        if not self._accept(kind):
            raise self._unexpected(Message.verbatim(f"`{kind}`"))

    def _unexpected(self, wanted: str) -> ExpressionError:
        token = self._token
        message = Message("`{text}` stands where {wanted} is expected", text=token.text, wanted=wanted)
        if token.kind == "end":
            message = Message("the expression ends where {wanted} is expected", wanted=wanted)
        return ExpressionError(message, token.offset, token.length)

    def _implication(self) -> Expression:
        self._depth += 1
        if self._depth > _DEEPEST_EXPRESSION:
            message = Message("this is nested deeper than {limit}", limit=_DEEPEST_EXPRESSION)
            raise ExpressionError(message, self._token.offset)
        left = self._several("or", lambda: self._several("and", self._negation))
        if self._accept("arrow"):
            right = self._implication()
            left = _joined("or", _negated(left), right)
        self._depth -= 1
        return left

    def _several(self, word: str, part: Callable[[], Expression]) -> Expression:
        found = [part()]
        while self._accept(word):
            found.append(part())
        return found[0] if len(found) == 1 else _joined(word, *found)

    def _negation(self) -> Expression:
        negated = False
        while self._accept("not"):
            negated = not negated
        found = self._primary()
        return _negated(found) if negated else found

    def _primary(self) -> Expression:
        if self._accept("("):
            found = self._implication()
            self._expect(")")
            return found
        for constant in (True, False):
            if self._accept(str(constant).lower()):
                always = Expression(frozenset(), frozenset(), ("true",))
                return always if constant else _negated(always)
        for function in _FUNCTIONS:
            if self._accept(function):
                self._expect("(")
                automaton = self._automaton()
                self._expect(")")
                return _flag(automaton, function)
        self._accept("in")
        return _in(self._states())

    def _states(self) -> list[tuple[int, int]]:
        """Read the path of a state; return the automata and states that match it."""
        automata = [self._model.automata[0]] if self._model.automata else []
        begin = self._token.offset
        if self._accept("#"):
            automata = [self._numbered()]
            self._expect("/")
        return self._path(automata, begin)

    def _path(self, automata: list[AutomatonModel], begin: int) -> list[tuple[int, int]]:
        while True:
            token = self._token
            if not (self._accept("word") or self._accept("quoted")):
                raise self._unexpected(Message("the path of a state"))
            found = [
                (automaton, state)
                for automaton in automata
                for state in automaton.states
                if state.source.name.strip() == token.text.strip()
            ]
            if not found:
                raise self._unknown(token, automata)
            if not self._accept("/"):
                return [(automaton.index, state.index) for automaton, state in found]
            automata = [self._model.automata[child] for _, state in found for child in state.children]
            if not automata:
                length = token.offset + token.length - begin
                raise ExpressionError(
                    Message("the state `{name}` owns no automaton", name=token.text), begin, length
                )

    def _unknown(self, token: _Token, automata: list[AutomatonModel]) -> ExpressionError:
        names = [state.source.name for automaton in automata for state in automaton.states]
        where = self._model.label(automata[0].index) if automata else Message("the document")
        near = did_you_mean(token.text, names, "")
        hints = [note.message for note in near]
        hints += [
            Message('write `"{name}"`', name=name) for name in names if name.startswith(f"{token.text} ")
        ][:1]
        hints += [
            Message("there is `{path}`", path=self._model.state_path(automaton.index, state.index))
            for automaton in self._model.automata
            for state in automaton.states
            if state.source.name.strip() == token.text.strip()
        ][:3]
        return ExpressionError(
            Message("{where} has no state `{name}`", where=where, name=token.text),
            token.offset,
            token.length,
            tuple(hints),
            near[0].misspelt if near else None,
        )

    def _numbered(self) -> AutomatonModel:
        token = self._token
        if not self._accept("word"):
            raise self._unexpected(Message("the id of an automaton"))
        number = int(token.text) if token.text.isdecimal() and len(token.text) < 19 else -1
        automaton = self._model.by_id.get(number)
        if automaton is None:
            raise ExpressionError(
                Message("there is no automaton with the id `{id}`", id=token.text), token.offset, token.length
            )
        return automaton

    def _automaton(self) -> int:
        begin = self._token.offset
        if self._accept("#"):
            automaton = self._numbered()
            if not self._accept("/"):
                return automaton.index
            states = self._path([automaton], begin)
        else:
            states = self._states()
        end = self._tokens[self._at - 1]
        length = end.offset + end.length - begin
        owned = [
            child for index, state in states for child in self._model.automata[index].states[state].children
        ]
        if len(owned) == 1:
            return owned[0]
        if not owned:
            raise ExpressionError(Message("this state owns no automaton"), begin, length)
        ids = any_of([f"`#{self._model.automata[child].source.id}`" for child in owned])
        raise ExpressionError(Message("several automata are meant: write {ids}", ids=ids), begin, length)


def _joined(word: str, *parts: Expression) -> Expression:
    automata = frozenset[int]().union(*(part.automata for part in parts))
    states = frozenset[tuple[int, int]]().union(*(part.states for part in parts))
    return Expression(automata, states, (word, *(part.form for part in parts)))


def _negated(part: Expression) -> Expression:
    return _joined("not", part)


def _in(states: list[tuple[int, int]]) -> Expression:
    return Expression(frozenset(automaton for automaton, _ in states), frozenset(states), ("in", *states))


def _flag(automaton: int, function: str) -> Expression:
    found = Expression(frozenset({automaton}), frozenset(), (function.replace("ghost", "active"), automaton))
    return _negated(found) if function == "ghost" else found
