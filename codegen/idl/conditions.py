"""Evaluate the condition of an `#if`."""

from __future__ import annotations

import operator
import re
from collections.abc import Callable, Mapping

_WORD = re.compile(r"\s*(?:(\d\w*)|([A-Za-z_]\w*)|(&&|\|\||<<|>>|[=!<>]=|[<>!()+*/%~&|^?:-]))")
_DEEPEST = 50


def _shift(bits: int) -> int:
    if not 0 <= bits < 64:
        raise ConditionError(f"a shift by {bits} bits")
    return bits


# Operators by how tightly they bind, the loosest first.
_BINARY: list[dict[str, Callable[[int, int], int]]] = [
    {"||": lambda a, b: int(bool(a) or bool(b))},
    {"&&": lambda a, b: int(bool(a) and bool(b))},
    {"|": operator.or_},
    {"^": operator.xor},
    {"&": operator.and_},
    {"==": operator.eq, "!=": operator.ne},
    {"<": operator.lt, "<=": operator.le, ">": operator.gt, ">=": operator.ge},
    {"<<": lambda a, b: a << _shift(b), ">>": lambda a, b: a >> _shift(b)},
    {"+": operator.add, "-": operator.sub},
    {"*": operator.mul, "/": operator.floordiv, "%": operator.mod},
]


class ConditionError(Exception):
    """A condition cannot be evaluated; the message says why."""


def evaluate(text: str, macros: Mapping[str, str]) -> bool:
    """Return whether a condition holds: integers, `defined X`, names of macros, and C's operators on them.

    A name that is no macro counts as 0. Raises ConditionError.
    """
    words: list[str] = []
    position = 0
    text = text.rstrip()
    while position < len(text):
        match = _WORD.match(text, position)
        if match is None:
            raise ConditionError(f"unexpected {text[position:].split()[0][:20]!r}")
        words.append(match.group().strip())
        position = match.end()
    evaluation = _Evaluation(words, macros)
    value = evaluation.condition()
    if evaluation.words:
        raise ConditionError(f"unexpected `{evaluation.words[-1]}`")
    return bool(value)


class _Evaluation:
    def __init__(self, words: list[str], macros: Mapping[str, str]) -> None:
        self.words = words[::-1]
        self.macros = macros
        self.depth = 0

    def condition(self) -> int:
        """Read a whole condition: `a ? b : c` binds loosest."""
        value = self.binary(0)
        if not self.words or self.words[-1] != "?":
            return value
        self._next()
        self.depth += 1
        if self.depth > _DEEPEST:
            raise ConditionError("too deeply nested")
        then = self.condition()
        if self._next() != ":":
            raise ConditionError("`:` is missing")
        otherwise = self.condition()
        self.depth -= 1
        return then if value else otherwise

    def binary(self, level: int) -> int:
        if level == len(_BINARY):
            return self.unary()
        left = self.binary(level + 1)
        while self.words and self.words[-1] in _BINARY[level]:
            operation = _BINARY[level][self.words.pop()]
            right = self.binary(level + 1)
            try:
                left = int(operation(left, right))
            except ZeroDivisionError:
                raise ConditionError("division by zero") from None
        return left

    def unary(self) -> int:
        word = self._next()
        self.depth += 1
        if self.depth > _DEEPEST:
            raise ConditionError("too deeply nested")
        try:
            match word:
                case "!":
                    return int(not self.unary())
                case "~":
                    return ~self.unary()
                case "+":
                    return self.unary()
                case "-":
                    return -self.unary()
                case "(":
                    value = self.condition()
                    if self._next() != ")":
                        raise ConditionError("`)` is missing")
                    return value
                case "defined":
                    return int(self._defined())
            return self._value(word)
        finally:
            self.depth -= 1

    def _next(self) -> str:
        if not self.words:
            raise ConditionError("it ends too early")
        return self.words.pop()

    def _defined(self) -> bool:
        name = self._next()
        if name == "(":
            name = self._next()
            if self._next() != ")":
                raise ConditionError("`)` is missing")
        return name in self.macros

    def _value(self, word: str) -> int:
        if word[0].isalpha() or word[0] == "_":
            word = self.macros.get(word) or "0"
        digits = word.rstrip("uUlL")
        try:
            return int(digits, 8 if re.fullmatch("0[0-7]+", digits) else 0)
        except ValueError:
            raise ConditionError(f"`{word[:20]}` is not an integer") from None
