"""Find what of a document's values SCXML can hold as data, and which code as a condition."""

from __future__ import annotations

import ast
import keyword
import re
import warnings
from collections.abc import Collection
from typing import Final

from ..code.trees import parse_python
from ..document import Document, Parameter, Text

__all__ = ["assignments", "expression_of", "is_expression", "is_name", "plain_parameters"]

_ASSIGNMENT: Final = re.compile(r"([A-Za-z_][A-Za-z_0-9]*) = (\S.*)")


def is_expression(code: str) -> bool:
    """Return whether a text is one expression of Python."""
    return expression_of(code.strip()) is not None


def is_name(text: str) -> bool:
    """Return whether a text can be the name of a variable, and an id of SCXML, too."""
    return text.isascii() and text.isidentifier() and not keyword.iskeyword(text)


def assignments(variables: Text, used: Collection[str]) -> tuple[tuple[str, str], ...]:
    """Return the names and expressions of variables, each on a line of its own: `x = 0`.

    Nothing where anything else is among them, or a name that is `used` as an id.
    """
    found: list[tuple[str, str]] = []
    for line in variables.text.split("\n"):
        match = _ASSIGNMENT.fullmatch(line)
        if match is None or not is_name(match[1]) or not is_expression(match[2]):
            return ()
        found.append((match[1], match[2]))
    names = {name for name, _ in found}
    return tuple(found) if len(names) == len(found) and not names & set(used) else ()


def plain_parameters(document: Document, used: Collection[str]) -> tuple[Parameter, ...]:
    """Return the parameters when each has a name that can be an id, and nothing that data cannot have."""
    if any(leaf.tag == "parameters" for leaf in document.leaves):
        return ()
    names = {parameter.name for parameter in document.parameters}
    if len(names) < len(document.parameters) or names & set(used):
        return ()
    return document.parameters if all(map(_is_plain, document.parameters)) else ()


def _is_plain(parameter: Parameter) -> bool:
    has_more = parameter.comments or parameter.extras or parameter.attributes or parameter.leaves
    return is_name(parameter.name) and bool(parameter.default.text) and not has_more


def expression_of(code: str) -> ast.Expression | None:
    """Return the tree of an expression of Python, or None when the text is none."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            return parse_python(code, mode="eval")
    except (SyntaxError, ValueError, RecursionError, MemoryError):
        return None
