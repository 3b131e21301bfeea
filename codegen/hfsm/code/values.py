"""Read the typed values of a document: the defaults of parameters and inputs, which are Python literals."""

from __future__ import annotations

import ast
import math
from collections.abc import Mapping
from typing import Final

from ..document import Text

__all__ = ["INPUT_TYPES", "PARAMETER_TYPES", "ValueTextError", "parse_value"]

PARAMETER_TYPES: Final = ("int", "float", "bool", "str")
"""The types of parameters: what a command line can say."""

INPUT_TYPES: Final = (*PARAMETER_TYPES, "object")
"""The types of inputs; `object` takes everything."""

_EXACT: Final[Mapping[str, type]] = {"int": int, "bool": bool, "str": str}
_EXAMPLES: Final = {"int": "3", "float": "0.5", "bool": "True", "str": '"red"'}


class ValueTextError(ValueError):
    """A text is no literal of the type that it should have."""


def parse_value(type_name: str, text: Text) -> object:
    """Return the value of a literal: of an `int`, `float`, `bool` or `str` exactly, of `object` any.

    A whole number is a `float`, too. Raises ValueTextError, which says what would be right.
    """
    written = text.text.strip()
    try:
        value = ast.literal_eval(written)
    except (ValueError, TypeError, SyntaxError, MemoryError, RecursionError):
        example = _EXAMPLES.get(type_name, '["red", 3]')
        raise ValueTextError(f"`{written[:40]}` is no literal of Python, such as `{example}`") from None
    if type_name == "object":
        return value
    if type_name == "float" and type(value) in (int, float):
        return _finite(value, written)
    if type(value) is not _EXACT.get(type_name):
        message = f"`{written[:40]}` is no {type_name}, such as `{_EXAMPLES[type_name]}`"
        raise ValueTextError(message)
    return value


def _finite(value: float, written: str) -> float:
    try:
        number = float(value)
    except OverflowError:
        number = math.inf
    if not math.isfinite(number):
        raise ValueTextError(f"`{written[:40]}` is too large for a float")
    return number
