"""Check and evaluate the values of constants, defaults and enumerators."""

from __future__ import annotations

from codegen.diagnostics import Diagnostics, Note, did_you_mean

from . import ast
from .codes import Code
from .symbols import Symbols

INTEGER_RANGES = {
    "byte": (0, 2**8 - 1),
    "short": (-(2**15), 2**15 - 1),
    "int": (-(2**31), 2**31 - 1),
    "long": (-(2**63), 2**63 - 1),
}
_LARGEST_FLOAT = 3.4028234663852886e38


def check_constant(
    literal: ast.Literal, kind: ast.Type, name: str, symbols: Symbols, scope: str, diagnostics: Diagnostics
) -> None:
    """Give a literal its value and report one that does not fit the type of the constant or member `name`."""
    token = literal.token
    if isinstance(kind, ast.NamedType) and kind.definition is None:
        return
    if isinstance(kind, ast.NamedType) and isinstance(kind.definition, ast.Enumeration):
        _check_enumerator(literal, kind.definition, symbols, scope, diagnostics)
        return
    if not isinstance(kind, ast.BuiltinType):
        message = f"`{name}` can have no value: its type is neither built in nor an enumeration"
        diagnostics.error(Code.BAD_CONSTANT, message, kind.token.location)
        return
    if literal.name is not None and not _resolve(literal, symbols, scope, diagnostics):
        return
    value = literal.value
    if value is None:
        return
    if not _fits(kind.name, value):
        message = f"the value of `{name}` is {_described(value)}, not a {kind.name}"
        diagnostics.error(Code.BAD_CONSTANT, message, token.location)
    elif kind.name in INTEGER_RANGES:
        lowest, highest = INTEGER_RANGES[kind.name]
        if isinstance(value, int) and not lowest <= value <= highest:
            message = f"`{name}` is out of range: a {kind.name} lies between {lowest} and {highest}"
            diagnostics.error(Code.OUT_OF_RANGE, message, token.location)
    elif kind.name in {"float", "double"} and isinstance(value, int | float):
        _check_float(literal, kind.name, name, diagnostics)


def check_enumeration(
    enumeration: ast.Enumeration, symbols: Symbols, scope: str, diagnostics: Diagnostics
) -> None:
    """Give the enumerators their values; report values that are not integers, out of range, or used twice."""
    if not enumeration.enumerators:
        message = f"enumeration `{enumeration.name}` has no enumerator"
        diagnostics.error(Code.BAD_ENUMERATION, message, enumeration.token.location)
    used: dict[int, ast.Enumerator] = {}
    value = -1
    for enumerator in enumeration.enumerators:
        value += 1
        place = enumerator.token
        literal = enumerator.literal
        if literal is not None:
            place = literal.token
            if literal.name is not None and not _resolve(literal, symbols, scope, diagnostics):
                continue
            if not isinstance(literal.value, int) or isinstance(literal.value, bool):
                if literal.value is not None:
                    message = f"the value of an enumerator is an integer, not {_described(literal.value)}"
                    diagnostics.error(Code.BAD_ENUMERATION, message, place.location)
                continue
            value = literal.value
        enumerator.value = value
        if not 0 <= value <= INTEGER_RANGES["int"][1]:
            message = f"the value {value} of `{enumerator.name}` is not between 0 and 2147483647"
            diagnostics.error(Code.BAD_ENUMERATION, message, place.location)
        elif value in used:
            note = Note("first used here", used[value].token.location)
            message = f"`{enumerator.name}` has the same value as `{used[value].name}`"
            diagnostics.error(Code.BAD_ENUMERATION, message, place.location, [note])
        used.setdefault(value, enumerator)


def _check_enumerator(
    literal: ast.Literal, enumeration: ast.Enumeration, symbols: Symbols, scope: str, diagnostics: Diagnostics
) -> None:
    """Resolve a value of an enumeration: an enumerator, with or without scope, or a constant of the type."""
    if literal.name is None:
        message = f"a value of the enumeration `{enumeration.name}` is one of its enumerators"
        diagnostics.error(Code.BAD_CONSTANT, message, literal.token.location)
        return
    target = symbols.find(literal.name, scope)
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
    diagnostics.error(Code.BAD_CONSTANT, message, literal.token.location, notes)


def _resolve(literal: ast.Literal, symbols: Symbols, scope: str, diagnostics: Diagnostics) -> bool:
    """Give a literal the value of the constant that it names; report a name that is none."""
    target = symbols.find(literal.name or "", scope)
    if target is None:
        notes = did_you_mean(literal.name or "", symbols.spellings(scope))
        message = f"`{literal.name}` is not defined"
        diagnostics.error(Code.UNDEFINED_NAME, message, literal.token.location, notes)
        return False
    if not isinstance(target, ast.Constant):
        note = Note(f"`{target.name}` is defined here", target.token.location)
        message = f"`{literal.name}` is a {target.kind}, not a constant of this type"
        diagnostics.error(Code.BAD_CONSTANT, message, literal.token.location, [note])
        return False
    literal.target = target
    literal.value = target.literal.value
    if isinstance(target.literal.target, ast.Enumerator):
        message = f"`{literal.name}` is an enumerator, not a value of this type"
        diagnostics.error(Code.BAD_CONSTANT, message, literal.token.location)
        return False
    return True


def _fits(kind: str, value: ast.Value) -> bool:
    if isinstance(value, bool):
        return kind == "bool"
    if isinstance(value, int):
        return kind in INTEGER_RANGES or kind in {"float", "double"}
    if isinstance(value, float):
        return kind in {"float", "double"}
    return kind == "string"


def _check_float(literal: ast.Literal, kind: str, name: str, diagnostics: Diagnostics) -> None:
    try:
        value = float(literal.value or 0)
    except OverflowError:
        value = float("inf")
    if abs(value) > _LARGEST_FLOAT and (kind == "float" or value == float("inf")):
        message = f"`{name}` is out of range for a {kind}"
        diagnostics.error(Code.OUT_OF_RANGE, message, literal.token.location)
    literal.value = value


def _described(value: ast.Value) -> str:
    if isinstance(value, bool):
        return "a bool"
    return {int: "an integer", float: "a floating-point number", str: "a string"}[type(value)]
