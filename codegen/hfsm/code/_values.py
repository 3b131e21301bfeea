"""Read typed values, times and constant expressions in a document."""

from __future__ import annotations

import ast
import math
import operator
from collections.abc import Callable, Mapping
from typing import Any, Final

from ...messages import MessageError
from ..document import Text

PARAMETER_TYPES: Final = ("int", "float", "bool", "str")
"""The types of parameters, which a command line can set."""

INPUT_TYPES: Final = (*PARAMETER_TYPES, "object")
"""The types of inputs; `object` is any value."""

_EXACT: Final[Mapping[str, type]] = {"int": int, "bool": bool, "str": str}
EXAMPLES: Final = {"int": "3", "float": "0.5", "bool": "True", "str": '"red"'}
"""A literal of each type of parameters."""


class ValueTextError(MessageError):
    """A text is not a literal of the required type."""


def parse_value(type_name: str, text: Text) -> object:
    """Return the value of a literal: an `int`, `float`, `bool` or `str`, or any value for `object`.

    An integer is also a `float`. Raises ValueTextError, with an example of a correct value.
    """
    written = text.text.strip()
    try:
        value = ast.literal_eval(written)
    except (ValueError, TypeError, SyntaxError, MemoryError, RecursionError):
        example = EXAMPLES.get(type_name, '["red", 3]')
        raise ValueTextError.because(
            "`{written}` is not a Python literal, such as `{example}`", written=written[:40], example=example
        ) from None
    if type_name == "object":
        return value
    if type_name == "float" and type(value) in (int, float):
        return _finite(value, written)
    if type(value) is not _EXACT.get(type_name):
        raise ValueTextError.because(
            "`{written}` is not of type {type}, such as `{example}`",
            written=written[:40],
            type=type_name,
            example=EXAMPLES[type_name],
        )
    return value


def _finite(value: float, written: str) -> float:
    try:
        number = float(value)
    except OverflowError:
        number = math.inf
    if not math.isfinite(number):
        raise ValueTextError.because("`{written}` is too large for a float", written=written[:40])
    return number


_LARGEST_TIME: Final = 1e12  # ms
_SHORTEST_TIME: Final = 0.000_001  # ms
_UNKNOWN: Final = object()


def milliseconds(text: Text) -> float | None:
    """Return a positive time in ms, or None if the text is not one."""
    try:
        value = float(text.text.strip().replace("_", "?"))
    except ValueError:
        return None
    return value if math.isfinite(value) and _SHORTEST_TIME <= value <= _LARGEST_TIME else None


def delay(text: Text) -> float | None:
    """Return the time of a transition in ms, or None if the text is not one.

    With 0 it fires in the next cycle, as with the original generators: 0 becomes the shortest time.
    """
    try:
        return milliseconds(text) or (_SHORTEST_TIME if float(text.text.strip()) == 0 else None)
    except ValueError:
        return None


def truth(node: ast.expr) -> bool | None:
    """Return the truth value of a constant expression, or None if it is not constant."""
    match node:
        case ast.UnaryOp(op=ast.Not(), operand=operand):
            value = truth(operand)
            return None if value is None else not value
        case ast.BoolOp(op=operation, values=operands):
            values = [truth(operand) for operand in operands]
            decisive = isinstance(operation, ast.Or)
            if decisive in values:
                return decisive
            return None if None in values else not decisive
        case ast.Compare():
            return _comparison(node)
    constant = _constant(node)
    return None if constant is _UNKNOWN else bool(constant)


def seconds(node: ast.expr) -> float | None:
    """Return a constant number, such as `2` or `0.5 * 3`, or None for any other expression."""
    match node:
        case ast.Constant(value=int() | float() as value) if (
            type(value) is not bool and value <= _LARGEST_TIME
        ):
            return float(value)
        case ast.BinOp(left=left, op=operation, right=right) if type(operation) in _ARITHMETIC:
            first, second = seconds(left), seconds(right)
            if first is not None and second is not None:
                try:
                    return _ARITHMETIC[type(operation)](first, second)
                except ZeroDivisionError:
                    return None
    return None


_ARITHMETIC: Final[Mapping[type, Callable[[float, float], float]]] = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.Div: operator.truediv,
}
_COMPARISONS: Final[Mapping[type, Callable[[Any, Any], object]]] = {
    ast.Eq: operator.eq,
    ast.NotEq: operator.ne,
    ast.Lt: operator.lt,
    ast.LtE: operator.le,
    ast.Gt: operator.gt,
    ast.GtE: operator.ge,
}


def _comparison(node: ast.Compare) -> bool | None:
    left, right = _constant(node.left), _constant(node.comparators[0])
    compare = _COMPARISONS.get(type(node.ops[0]))
    if len(node.ops) > 1 or left is _UNKNOWN or right is _UNKNOWN or compare is None:
        return None
    try:
        return bool(compare(left, right))
    except TypeError:
        return None


def _constant(node: ast.expr) -> object:
    if any(isinstance(each, ast.Call) for each in ast.walk(node)):
        return _UNKNOWN  # `set()` is one for `literal_eval`, whatever it is here
    try:
        return ast.literal_eval(node)
    except (ValueError, TypeError, MemoryError, RecursionError):
        return _UNKNOWN
