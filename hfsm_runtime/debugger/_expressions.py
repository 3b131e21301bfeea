"""Evaluate the conditions of breakpoints, which arrive over the network, without executing them as code.

Python parses an expression, and this module walks its tree. It may have names, constants, comparisons, `and`,
`or`, `not`, `if else`, the arithmetic of numbers, and members of plain data: of dicts, lists, tuples, texts
and structures of the interfaces. Nothing is called, no attribute of any other object is read, and the cost
of each step is bounded.
"""

from __future__ import annotations

import ast
import operator
import sys
from collections.abc import Callable, Iterable, Mapping
from types import MemberDescriptorType
from typing import Any, Final

import msgspec

from codegen.parsing import parse_python

_LONGEST_EXPRESSION: Final = 500
_LARGEST_INTEGER: Final = 2**256
_MOST_ELEMENTS: Final = 10_000
"""Largest number of elements read to compare or search containers."""
_DEEPEST_EXPRESSION: Final = 32

_ARITHMETIC: Final[Mapping[type[ast.operator], Callable[[Any, Any], object]]] = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.Div: operator.truediv,
    ast.FloorDiv: operator.floordiv,
    ast.Mod: operator.mod,
}
_SIGNS: Final[Mapping[type[ast.unaryop], Callable[[Any], object]]] = {
    ast.UAdd: operator.pos,
    ast.USub: operator.neg,
}
_COMPARISONS: Final[Mapping[type[ast.cmpop], Callable[[Any, Any], object]]] = {
    ast.Eq: operator.eq,
    ast.NotEq: operator.ne,
    ast.Lt: operator.lt,
    ast.LtE: operator.le,
    ast.Gt: operator.gt,
    ast.GtE: operator.ge,
    ast.In: lambda item, container: item in container,
    ast.NotIn: lambda item, container: item not in container,
}


class ExpressionError(ValueError):
    """An expression must not be evaluated, or has no value; the message names the column."""


class Members(dict[str, object]):
    """Named values that an expression reads as attributes, such as the parameters of a component."""


class Expression:
    """An expression over names, checked and ready to be evaluated. Raises ExpressionError."""

    def __init__(self, text: str) -> None:
        self.text: Final = text.strip()
        self._tree: Final = _parse(self.text)
        _check(self.text, self._tree)
        self.names: Final = frozenset(node.id for node in ast.walk(self._tree) if isinstance(node, ast.Name))
        """The names that it uses."""

    def evaluate(self, names: Mapping[str, object]) -> object:
        """Return its value; raises ExpressionError when it has none."""
        try:
            return _evaluate(self._tree, names)
        except RuntimeError as error:  # a container changed its size while it was searched
            raise ExpressionError(f"its data changed meanwhile: {error}") from error

    def column_of(self, name: str) -> int:
        """Return the column of the first place at which a name is used, from 1; 0 when it is not."""
        columns = (n.col_offset for n in ast.walk(self._tree) if isinstance(n, ast.Name) and n.id == name)
        return min(columns, default=-1) + 1

    def holds(self, names: Mapping[str, object]) -> bool:
        """Return whether its value counts as true; raises ExpressionError when it has none."""
        return _truth(self._tree, self.evaluate(names))


def values_in(code: str, names: Mapping[str, object], most: int) -> dict[str, object]:
    """Return the plain data behind names in code and their members, by their text in the code.

    The code is an expression of any kind, such as one that calls something; nothing of it is executed.
    """
    found: dict[str, object] = {}
    try:
        pending: list[ast.AST] = [parse_python(code.strip(), mode="eval")]
    except (SyntaxError, ValueError, RecursionError, MemoryError):
        return found
    while pending and len(found) < most:
        node = pending.pop(0)
        if isinstance(node, ast.Name | ast.Attribute | ast.Subscript):
            text = ast.unparse(node)
            try:
                found[text] = plain(Expression(text).evaluate(names))
            except (ExpressionError, ValueError):
                pass  # its parts may have a value
            else:
                continue
        pending += ast.iter_child_nodes(node)
    return found


def _parse(text: str) -> ast.expr:
    if len(text) > _LONGEST_EXPRESSION:
        raise ExpressionError(
            f"the expression has {len(text)} characters: at most {_LONGEST_EXPRESSION} are allowed"
        )
    if not text.isprintable():
        raise ExpressionError("the expression has invisible characters")
    try:
        return parse_python(text, mode="eval").body
    except SyntaxError as error:
        raise ExpressionError(f"column {error.offset or len(text) + 1}: {error.msg}") from None
    except (ValueError, RecursionError, MemoryError) as error:
        raise ExpressionError(f"the expression cannot be read: {error}") from None


def _check(text: str, node: ast.expr, depth: int = 0) -> None:
    """Refuse whatever is not known to be harmless."""
    if depth > _DEEPEST_EXPRESSION:
        raise _error(node, f"the expression is nested more than {_DEEPEST_EXPRESSION} deep")
    match node:
        case ast.Constant(value=int()):
            _bounded(node, node.value)
        case ast.Name(id=name) | ast.Attribute(attr=name) if name.startswith("_"):
            raise _error(node, f"{name}: names that begin with an underscore are not allowed")
        case (
            ast.Constant(value=float() | str() | None)
            | ast.Name()
            | ast.Attribute()
            | ast.BoolOp()
            | ast.Compare()
            | ast.IfExp()
            | ast.Subscript()
            | ast.List()
            | ast.Tuple()
        ):
            pass
        case ast.BinOp(op=op) | ast.UnaryOp(op=op) if type(op) in {ast.Not, *_SIGNS, *_ARITHMETIC}:
            pass
        case _:
            what = ast.get_source_segment(text, node) or type(node).__name__
            raise _error(node, f"{what} is not allowed: expressions execute nothing")
    for child in ast.iter_child_nodes(node):
        if isinstance(child, ast.expr):
            _check(text, child, depth + 1)


def _evaluate(node: ast.expr, names: Mapping[str, object]) -> object:
    def value(part: ast.expr) -> object:
        return _evaluate(part, names)

    match node:
        case ast.Constant():
            return node.value
        case ast.Name(id=name):
            if name not in names:
                raise _error(node, f"{name} has no value")
            return names[name]
        case ast.Attribute(value=owner, attr=name):
            return _attribute(node, value(owner), name)
        case ast.Subscript(value=owner, slice=index):
            return _item(node, value(owner), value(index))
        case ast.BoolOp(op=op, values=parts):
            result: object = None
            for part in parts:
                result = value(part)
                if _truth(part, result) is isinstance(op, ast.Or):
                    break
            return result
        case ast.UnaryOp(op=ast.Not(), operand=operand):
            return not _truth(operand, value(operand))
        case ast.UnaryOp(op=sign, operand=operand):
            return _SIGNS[type(sign)](_number(operand, value(operand)))
        case ast.BinOp(left=left, op=symbol, right=right):
            first, second = _number(left, value(left)), _number(right, value(right))
            return _bounded(node, _apply(node, _ARITHMETIC[type(symbol)], first, second))
        case ast.Compare(left=left, ops=ops, comparators=others):
            first_node, former = left, value(left)
            for compare, other in zip(ops, others, strict=True):
                latter = value(other)
                if not _compare(first_node, former, compare, other, latter):
                    return False
                first_node, former = other, latter
            return True
        case ast.IfExp(test=test, body=body, orelse=orelse):
            return value(body) if _truth(test, value(test)) else value(orelse)
        case ast.List(elts=elements):
            return [value(element) for element in elements]
        case ast.Tuple(elts=elements):
            return tuple(value(element) for element in elements)
        case _:
            raise AssertionError(f"a {type(node).__name__} was not checked")


def _compare(left: ast.expr, first: object, op: ast.cmpop, right: ast.expr, second: object) -> bool:
    if isinstance(op, ast.Is | ast.IsNot):
        return (first is second) is isinstance(op, ast.Is)
    if (first is None or second is None) and isinstance(op, ast.Eq | ast.NotEq):
        return (first is second) is isinstance(op, ast.Eq)
    return bool(_apply(right, _COMPARISONS[type(op)], _data(left, first), _data(right, second)))


def _apply(node: ast.expr, function: Callable[[Any, Any], object], first: object, second: object) -> object:
    try:
        return function(first, second)
    except (TypeError, ArithmeticError) as error:
        raise _error(node, str(error)) from None


def _attribute(node: ast.expr, owner: object, name: str) -> object:
    if type(owner) is Members:
        if name in owner:
            return owner[name]
        raise _error(node, f"there is no {name}")
    if issubclass(type(owner), msgspec.Struct):
        member = next((vars(base)[name] for base in type(owner).__mro__ if name in vars(base)), None)
        if name in getattr(type(owner), "__struct_fields__", ()) and isinstance(member, MemberDescriptorType):
            return member.__get__(owner)
        raise _error(node, f"{type(owner).__name__} has no member {name}")
    raise _error(node, f"members of {_kind(owner)} cannot be read")


def _item(node: ast.expr, owner: object, index: object) -> object:
    key = _scalar(index)
    if type(owner) is dict:
        _data(node, list(owner))  # looking up a key compares it with the others
    elif type(owner) not in {list, tuple, str}:
        raise _error(node, f"elements of {_kind(owner)} cannot be read")
    try:
        return owner[key]  # type: ignore[index]
    except LookupError:
        raise _error(node, f"there is no element {key!r}") from None
    except TypeError as error:
        raise _error(node, str(error)) from None


def _truth(node: ast.expr, value: object) -> bool:
    found = _scalar(value)
    if found is None or type(found) in {bool, int, float, str, list, tuple, dict}:
        return bool(found)
    raise _error(node, f"{_kind(found)} is neither true nor false here: ask whether it `is not None`")


def _number(node: ast.expr, value: object) -> object:
    found = _scalar(value)
    if type(found) not in {bool, int, float}:
        raise _error(node, f"{_kind(found)} is not a number")
    return _bounded(node, found)


def _bounded(node: ast.expr, value: object) -> object:
    if isinstance(value, int) and abs(value) > _LARGEST_INTEGER:
        raise _error(node, "the number is too large")
    return value


def _data(node: ast.expr, value: object) -> object:
    """Return plain data, which can be compared without running methods of user objects."""
    try:
        return plain(value)
    except ValueError as error:
        raise _error(node, str(error)) from None


def plain(value: object) -> object:
    """Return a copy of plain data: None, numbers and texts in dicts, lists and tuples.

    Raises ValueError for other values, and for values that are too large or too deep.
    """
    return _copy(value, [_MOST_ELEMENTS], 0)


def _copy(value: object, left: list[int], depth: int) -> object:
    left[0] -= 1
    if left[0] < 0 or depth > _DEEPEST_EXPRESSION:
        raise ValueError("it is too large")
    found = _scalar(value)
    if found is None or type(found) in {bool, int, float, str}:
        return found
    if type(found) is list or type(found) is tuple:
        elements: Iterable[object] = (_copy(element, left, depth + 1) for element in found)
        return list(elements) if type(found) is list else tuple(elements)
    if type(found) is dict:
        return {_copy(k, left, depth + 1): _copy(item, left, depth + 1) for k, item in found.items()}
    raise ValueError(f"{_kind(found)} is not plain data")


def _scalar(value: object) -> object:
    """Return a number or a text of a derived type as a value of the builtin type.

    Only the type is inspected, and only methods of builtin types are used: the value's class runs no code.
    """
    kind = type(value)
    if kind is bool:
        return value
    if issubclass(kind, int):
        return int.__int__(value)  # type: ignore[arg-type]
    if issubclass(kind, float):
        return float.__float__(value)  # type: ignore[arg-type]
    if issubclass(kind, str):
        return str.__str__(value)
    numpy = sys.modules.get("numpy")
    if numpy is not None and issubclass(kind, numpy.number | numpy.bool_):
        found: object = value.item()  # type: ignore[attr-defined]
        return found
    return value


def _kind(value: object) -> str:
    return f"a {type(value).__name__}"


def _error(node: ast.expr, message: str) -> ExpressionError:
    return ExpressionError(f"column {node.col_offset + 1}: {message}")
