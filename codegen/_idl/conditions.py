"""Evaluate the condition of an `#if`: an expression of C with 64-bit integers."""

from __future__ import annotations

import operator
import re
from collections.abc import Callable, Sequence

_BITS = 64
_DEEPEST_NESTING = 50
_LONGEST_NUMBER = 40

_INTEGER = re.compile(r"(?P<digits>0[xX][0-9a-fA-F]+|0[0-7]*|[1-9][0-9]*)[uUlL]{0,3}")
_NAME = re.compile(r"[A-Za-z_]\w*", re.ASCII)

Number = int | None
"""A value; None for one that does not exist, such as 1 / 0, which may be in a part that does not count."""


class ConditionError(Exception):
    """A condition cannot be evaluated; the message says why."""


def _and(left: Number, right: Number) -> Number:
    if left == 0:
        return 0
    return None if left is None or right is None else int(right != 0)


def _or(left: Number, right: Number) -> Number:
    if left:
        return 1
    return None if left is None or right is None else int(right != 0)


def _strict(operation: Callable[[int, int], Number]) -> Callable[[Number, Number], Number]:
    """Return an operation that has no value if one of its operands has none."""

    def apply(left: Number, right: Number) -> Number:
        value = None if left is None or right is None else operation(left, right)
        return None if value is None else _wrapped(int(value))

    return apply


def _quotient(left: int, right: int) -> Number:
    if right == 0:
        return None
    return abs(left) // abs(right) * (1 if (left < 0) == (right < 0) else -1)  # towards 0, as in C


def _remainder(left: int, right: int) -> Number:
    quotient = _quotient(left, right)
    return None if quotient is None else left - quotient * right


def _shifted_left(left: int, right: int) -> int:
    return left << right % _BITS


def _shifted_right(left: int, right: int) -> int:
    return left >> right % _BITS


def _wrapped(value: int) -> int:
    return (value + (1 << _BITS - 1)) % (1 << _BITS) - (1 << _BITS - 1)


# The operators between two values by their precedence, the lowest first.
_OPERATORS: tuple[dict[str, Callable[[Number, Number], Number]], ...] = (
    {"||": _or},
    {"&&": _and},
    {"|": _strict(operator.or_)},
    {"^": _strict(operator.xor)},
    {"&": _strict(operator.and_)},
    {"==": _strict(operator.eq), "!=": _strict(operator.ne)},
    {
        "<": _strict(operator.lt),
        "<=": _strict(operator.le),
        ">": _strict(operator.gt),
        ">=": _strict(operator.ge),
    },
    {"<<": _strict(_shifted_left), ">>": _strict(_shifted_right)},
    {"+": _strict(operator.add), "-": _strict(operator.sub)},
    {"*": _strict(operator.mul), "/": _strict(_quotient), "%": _strict(_remainder)},
)


def evaluate(words: Sequence[str]) -> bool:
    """Return whether a condition holds, given its words without macros; other names count as 0.

    Raises ConditionError.
    """
    evaluation = _Evaluation(words)
    value = evaluation.conditional()
    if evaluation.waiting:
        raise ConditionError(f"unexpected `{evaluation.waiting[-1][:20]}`")
    if value is None:
        raise ConditionError("it divides by 0")
    return value != 0


class _Evaluation:
    def __init__(self, words: Sequence[str]) -> None:
        self.waiting = list(reversed(words))
        """The words that have not been read, the next one last."""
        self._depth = 0

    def conditional(self) -> Number:
        """Read an expression, perhaps `a ? b : c`."""
        self._depth += 1
        if self._depth > _DEEPEST_NESTING:
            raise ConditionError("it is nested too deeply")
        value = self._binary(0)
        if self.waiting and self.waiting[-1] == "?":
            self._next()
            first = self.conditional()
            self._expect(":")
            second = self.conditional()
            if value is not None:
                value = first if value else second
        self._depth -= 1
        return value

    def _binary(self, level: int) -> Number:
        """Read an expression of operators with at least some precedence."""
        if level == len(_OPERATORS):
            return self._unary()
        value = self._binary(level + 1)
        while self.waiting and self.waiting[-1] in _OPERATORS[level]:
            operation = _OPERATORS[level][self._next()]
            value = operation(value, self._binary(level + 1))
        return value

    def _unary(self) -> Number:
        signs: list[str] = []
        while self.waiting and self.waiting[-1] in {"!", "~", "+", "-"}:
            signs.append(self._next())
        value = self._operand()
        while signs and value is not None:
            sign = signs.pop()
            value = {"!": int(value == 0), "~": ~value, "+": value, "-": _wrapped(-value)}[sign]
        return value

    def _operand(self) -> Number:
        word = self._next()
        if word == "(":
            value = self.conditional()
            self._expect(")")
            return value
        if _NAME.fullmatch(word):
            return 0
        match = _INTEGER.fullmatch(word)
        if match is None or len(word) > _LONGEST_NUMBER:
            raise ConditionError(f"`{word[:20]}` is not an integer")
        digits = match["digits"]
        base = 10
        if digits.startswith(("0x", "0X")):
            base = 16
        elif digits.startswith("0"):
            base = 8
        value = int(digits, base)
        if value >= 1 << _BITS:
            raise ConditionError(f"`{word[:20]}` has more than {_BITS} bits")
        return _wrapped(value)

    def _next(self) -> str:
        if not self.waiting:
            raise ConditionError("it ends too early")
        return self.waiting.pop()

    def _expect(self, word: str) -> None:
        if not self.waiting or self.waiting.pop() != word:
            raise ConditionError(f"`{word}` is missing")
