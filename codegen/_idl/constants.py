"""Check and evaluate the values of constants, defaults, enumerators, tags and compact ids."""

from __future__ import annotations

import math

from codegen.diagnostics import did_you_mean

from . import ast
from .report import Code, note_at
from .resolver import Resolver, Scope, declared_kind, with_article

_INTEGER_RANGES = {
    "byte": (0, 2**8 - 1),
    "short": (-(2**15), 2**15 - 1),
    "int": (-(2**31), 2**31 - 1),
    "long": (-(2**63), 2**63 - 1),
}
_HIGHEST_INT = _INTEGER_RANGES["int"][1]
_VALUE_TYPES = frozenset({*_INTEGER_RANGES, "bool", "float", "double", "string"})


class ConstantChecker:
    """Sets the values of literals and reports invalid ones."""

    def __init__(self, resolver: Resolver) -> None:
        self._resolver = resolver
        self._error = resolver.report.error

    def check_value(self, literal: ast.Literal, kind: ast.Type, what: str, scope: Scope) -> None:
        """Set the value of a constant or a member of some type; `what` names it in messages."""
        if literal.name is not None and not self._resolve(literal, scope):
            return
        if isinstance(kind, ast.NamedType) and isinstance(kind.definition, ast.Enumeration):
            self._check_enumerator(literal, kind.definition, what)
        elif isinstance(kind, ast.BuiltinType) and kind.name in _VALUE_TYPES:
            self._check_builtin(literal, kind.name, what, scope)
        else:
            message = f"{what} cannot have a value: its type is neither built in nor an enumeration"
            self._error(Code.BAD_CONSTANT, message, kind.token)

    def _resolve(self, literal: ast.Literal, scope: Scope) -> bool:
        """Find the target of a literal, if it is declared; report a name without a value."""
        name = literal.name or ""
        target = self._resolver.symbols.find(name, scope.name)
        if target is None:  # perhaps an enumerator of the expected type
            return True
        if not isinstance(target, ast.Constant | ast.Enumerator):
            note = note_at(f"`{target.name}` is defined here", target.token)
            message = f"`{name}` is {with_article(declared_kind(target).kind)}, which has no value"
            self._error(Code.BAD_CONSTANT, message, literal.token, note)
            return False
        self._resolver.introduce(name, scope, literal.token, target)
        literal.target = target
        return True

    def _check_builtin(self, literal: ast.Literal, kind: str, what: str, scope: Scope) -> None:
        target = literal.target
        if literal.name is not None and target is None:
            self._report_undefined(literal.name, literal, scope)
            return
        if target is not None and isinstance(_enumerator_or_constant(target), ast.Enumerator):
            note = note_at(f"`{literal.name}` is defined here", target.token)
            message = f"the value of {what} is an enumerator, not {with_article(kind)}"
            self._error(Code.BAD_CONSTANT, message, literal.token, note)
            return
        if isinstance(target, ast.Constant):
            literal.value = target.literal.value
        value = literal.value
        if value is None:  # already reported
            return
        if not _fits(kind, value):
            message = f"the value of {what} is {_described(value)}, not {with_article(kind)}"
            self._error(Code.BAD_CONSTANT, message, literal.token)
        elif kind in _INTEGER_RANGES and isinstance(value, int):
            lowest, highest = _INTEGER_RANGES[kind]
            if not lowest <= value <= highest:
                message = (
                    f"{what} is out of range: {with_article(kind)} must be between {lowest} and {highest}"
                )
                self._error(Code.OUT_OF_RANGE, message, literal.token)
        elif kind in {"float", "double"} and isinstance(value, int | float):
            literal.value = _as_float(value)
            if math.isinf(literal.value):
                self._error(Code.OUT_OF_RANGE, f"{what} is out of range for a {kind}", literal.token)

    def _check_enumerator(self, literal: ast.Literal, enumeration: ast.Enumeration, what: str) -> None:
        """Resolve an enumeration's value: an enumerator, scoped or not, or a constant of the type."""
        if literal.name is None:
            message = f"{what} must be an enumerator of `{enumeration.name}`, not {_described(literal.value)}"
            self._error(Code.BAD_CONSTANT, message, literal.token)
            return
        target = _enumerator_or_constant(literal.target)
        if literal.target is None:
            # An enumerator can be named like a sibling of its enumeration.
            container, separator, last = literal.name.rpartition("::")
            name = f"{container}{separator}{enumeration.name}::{last}" if separator else last
            found = self._resolver.symbols.find(name, enumeration.scoped)
            target = found if isinstance(found, ast.Enumerator) else None
        if isinstance(target, ast.Enumerator) and target.enumeration is enumeration:
            literal.target = target
            literal.value = target.value
            return
        literal.target = None
        notes = did_you_mean(literal.name, [each.name for each in enumeration.enumerators])
        message = f"`{literal.name}` is not an enumerator of `{enumeration.name}`"
        self._error(Code.BAD_CONSTANT, message, literal.token, *notes)

    # Enumerations

    def check_enumerator_value(self, enumerator: ast.Enumerator, scope: Scope) -> None:
        """Evaluate the explicit value of an enumerator, if it has one."""
        literal = enumerator.literal
        if literal is None:
            return
        if literal.name is not None:
            target = self._resolver.symbols.find(literal.name, scope.name)
            if target is None:
                self._report_undefined(literal.name, literal, scope)
                return
            if isinstance(target, ast.Constant):
                literal.target = target
                literal.value = target.literal.value
        if not isinstance(literal.value, int) or isinstance(literal.value, bool):
            literal.value = None
            message = f"the value of enumerator `{enumerator.name}` is not an integer"
            self._error(Code.BAD_ENUMERATION, message, literal.token)

    def number_enumerators(self, enumeration: ast.Enumeration) -> None:
        """Number the enumerators; report values that are out of range or repeated."""
        used: dict[int, ast.Enumerator] = {}
        value = -1
        for enumerator in enumeration.enumerators:
            value += 1
            place = enumerator.token
            if enumerator.literal is not None:
                if not isinstance(enumerator.literal.value, int):
                    continue
                place = enumerator.literal.token
                value = enumerator.literal.value
            enumerator.value = value
            if not 0 <= value <= _HIGHEST_INT:
                message = f"the value {value} of `{enumerator.name}` is not between 0 and {_HIGHEST_INT}"
                self._error(Code.BAD_ENUMERATION, message, place)
            elif value in used:
                note = note_at("first used here", used[value].token)
                message = f"`{enumerator.name}` has the same value as `{used[value].name}`"
                self._error(Code.BAD_ENUMERATION, message, place, note)
            used.setdefault(value, enumerator)

    # Tags and compact ids

    def check_number(self, number: ast.Literal, what: str, scope: Scope) -> None:
        """Evaluate the number in `optional(n)` or `class C(n)`; `what` names it in messages."""
        if number.name is not None:
            target = self._named_number(number.name, number, scope)
            if target is None:
                return
            self._resolver.introduce(number.name, scope, number.token, target)
            number.target = target
            number.value = target.value if isinstance(target, ast.Enumerator) else target.literal.value
        value = number.value
        if isinstance(value, bool) or not isinstance(value, int):
            if value is not None or number.name is not None:
                self._error(Code.BAD_TAG, f"{what} is not an integer", number.token)
            number.value = None
        elif not 0 <= value <= _HIGHEST_INT:
            message = f"{what} is out of range: it must be between 0 and {_HIGHEST_INT}"
            self._error(Code.BAD_TAG, message, number.token)

    def _named_number(
        self, name: str, number: ast.Literal, scope: Scope
    ) -> ast.Constant | ast.Enumerator | None:
        """Find a constant or an enumerator; the enumeration can be omitted here."""
        target = self._resolver.symbols.find(name, scope.name)
        if isinstance(target, ast.Constant | ast.Enumerator):
            return target
        if target is not None:
            note = note_at(f"`{target.name}` is defined here", target.token)
            message = f"`{name}` is {with_article(declared_kind(target).kind)}, not a constant"
            self._error(Code.BAD_TAG, message, number.token, note)
            return None
        enumerators = self._resolver.symbols.enumerators(name, scope.name)
        if len(enumerators) == 1:
            return enumerators[0]
        if enumerators:
            notes = [note_at("this is one of them", each.token) for each in enumerators]
            message = f"`{name}` is an enumerator of more than one enumeration"
            self._error(Code.UNDEFINED_NAME, message, number.token, *notes)
        else:
            self._report_undefined(name, number, scope)
        return None

    def _report_undefined(self, name: str, literal: ast.Literal, scope: Scope) -> None:
        notes = self._resolver.symbols.help(name, scope.name, (ast.Constant, ast.Enumerator))
        self._error(Code.UNDEFINED_NAME, f"`{name}` is not defined", literal.token, *notes)


def _enumerator_or_constant(
    target: ast.Constant | ast.Enumerator | None,
) -> ast.Constant | ast.Enumerator | None:
    """Return the enumerator that is the value of a constant, or else the definition itself."""
    named = target.literal.target if isinstance(target, ast.Constant) else None
    return named if isinstance(named, ast.Enumerator) else target


def _as_float(value: float) -> float:
    try:
        return float(value)
    except OverflowError:
        return math.inf


def _fits(kind: str, value: ast.Value) -> bool:
    if isinstance(value, bool):
        return kind == "bool"
    if isinstance(value, int):
        return kind in _INTEGER_RANGES or kind in {"float", "double"}
    if isinstance(value, float):
        return kind in {"float", "double"}
    return kind == "string"


def _described(value: ast.Value | None) -> str:
    if isinstance(value, bool):
        return "a bool"
    if value is None:
        return "this"
    return {int: "an integer", float: "a floating-point number", str: "a string"}[type(value)]
