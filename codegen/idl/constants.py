"""Check and evaluate the values of constants, defaults and enumerators."""

from __future__ import annotations

import math
from collections.abc import Iterable

from codegen.diagnostics import Diagnostics, Note, did_you_mean

from . import ast
from .codes import Code
from .lexer import Token
from .symbols import Symbols

INTEGER_RANGES = {
    "byte": (0, 2**8 - 1),
    "short": (-(2**15), 2**15 - 1),
    "int": (-(2**31), 2**31 - 1),
    "long": (-(2**63), 2**63 - 1),
}


class ConstantChecker:
    """Gives literals their values and reports those that do not fit."""

    def __init__(self, symbols: Symbols, diagnostics: Diagnostics) -> None:
        self._symbols = symbols
        self._diagnostics = diagnostics

    def _error(self, code: Code, message: str, token: Token, notes: Iterable[Note] = ()) -> None:
        self._diagnostics.error(code, message, token.location, notes)

    def check(self, literal: ast.Literal, kind: ast.Type, name: str, scope: str) -> None:
        """Give a literal its value and report one that does not fit the constant or member `name`."""
        if isinstance(kind, ast.NamedType) and kind.definition is None:
            return
        if isinstance(kind, ast.NamedType) and isinstance(kind.definition, ast.Enumeration):
            self._check_enumerator(literal, kind.definition, scope)
            return
        if not isinstance(kind, ast.BuiltinType):
            message = f"`{name}` can have no value: its type is neither built in nor an enumeration"
            self._error(Code.BAD_CONSTANT, message, kind.token)
            return
        if literal.name is not None:
            self._resolve(literal, scope)
        value = literal.value
        if value is None:
            return
        if not _fits(kind.name, value):
            message = f"the value of `{name}` is {_described(value)}, not a {kind.name}"
            self._error(Code.BAD_CONSTANT, message, literal.token)
        elif kind.name in INTEGER_RANGES and isinstance(value, int):
            lowest, highest = INTEGER_RANGES[kind.name]
            if not lowest <= value <= highest:
                message = f"`{name}` is out of range: a {kind.name} lies between {lowest} and {highest}"
                self._error(Code.OUT_OF_RANGE, message, literal.token)
        elif kind.name in {"float", "double"} and isinstance(value, int | float):
            self._check_float(literal, value, kind.name, name)

    def check_enumeration(self, enumeration: ast.Enumeration, scope: str) -> None:
        """Give the enumerators their values; report values that are wrong, out of range, or used twice."""
        used: dict[int, ast.Enumerator] = {}
        value = -1
        for enumerator in enumeration.enumerators:
            value += 1
            place = enumerator.token
            if enumerator.literal is not None:
                place = enumerator.literal.token
                given = self._enumerator_value(enumerator.literal, scope)
                if given is None:
                    continue
                value = given
            enumerator.value = value
            if not 0 <= value <= INTEGER_RANGES["int"][1]:
                message = f"the value {value} of `{enumerator.name}` is not between 0 and 2147483647"
                self._error(Code.BAD_ENUMERATION, message, place)
            elif value in used:
                note = Note("first used here", used[value].token.location)
                message = f"`{enumerator.name}` has the same value as `{used[value].name}`"
                self._error(Code.BAD_ENUMERATION, message, place, [note])
            used.setdefault(value, enumerator)

    def _enumerator_value(self, literal: ast.Literal, scope: str) -> int | None:
        if literal.name is not None:
            self._resolve(literal, scope)
        value = literal.value
        if isinstance(value, int) and not isinstance(value, bool):
            return value
        if value is not None:
            message = f"the value of an enumerator is an integer, not {_described(value)}"
            self._error(Code.BAD_ENUMERATION, message, literal.token)
        return None

    def _check_enumerator(self, literal: ast.Literal, enumeration: ast.Enumeration, scope: str) -> None:
        """Resolve a value of an enumeration: an enumerator, scoped or not, or a constant of the type."""
        if literal.name is None:
            message = f"a value of the enumeration `{enumeration.name}` is one of its enumerators"
            self._error(Code.BAD_CONSTANT, message, literal.token)
            return
        target = self._symbols.find(literal.name, scope)
        if target is None and "::" not in literal.name:
            target = next((each for each in enumeration.enumerators if each.name == literal.name), None)
        if isinstance(target, ast.Constant) and isinstance(target.literal.target, ast.Enumerator):
            target = target.literal.target
        if isinstance(target, ast.Enumerator) and target.enumeration is enumeration:
            literal.target = target
            literal.value = target.value
            return
        notes = did_you_mean(literal.name, [each.name for each in enumeration.enumerators])
        message = f"`{literal.name}` is not an enumerator of `{enumeration.name}`"
        self._error(Code.BAD_CONSTANT, message, literal.token, notes)

    def _resolve(self, literal: ast.Literal, scope: str) -> None:
        """Give a literal the value of the constant that it names; report a name that is none."""
        name = literal.name or ""
        target = self._symbols.find(name, scope)
        if target is None:
            notes = self._symbols.proposal(name, scope)
            self._error(Code.UNDEFINED_NAME, f"`{name}` is not defined", literal.token, notes)
        elif not isinstance(target, ast.Constant) or isinstance(target.literal.target, ast.Enumerator):
            note = Note(f"`{target.name}` is defined here", target.token.location)
            message = f"`{name}` is not a constant of this type"
            self._error(Code.BAD_CONSTANT, message, literal.token, [note])
        else:
            literal.target = target
            literal.value = target.literal.value

    def _check_float(self, literal: ast.Literal, value: float, kind: str, name: str) -> None:
        try:
            literal.value = float(value)
        except OverflowError:
            literal.value = math.inf
        if math.isinf(literal.value):
            message = f"`{name}` is out of range for a {kind}"
            self._error(Code.OUT_OF_RANGE, message, literal.token)


def _fits(kind: str, value: ast.Value) -> bool:
    if isinstance(value, bool):
        return kind == "bool"
    if isinstance(value, int):
        return kind in INTEGER_RANGES or kind in {"float", "double"}
    if isinstance(value, float):
        return kind in {"float", "double"}
    return kind == "string"


def _described(value: ast.Value) -> str:
    if isinstance(value, bool):
        return "a bool"
    return {int: "an integer", float: "a floating-point number", str: "a string"}[type(value)]
