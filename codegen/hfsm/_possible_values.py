"""Describe what a name may be: a capability, a text, a plain value, or unknown.

A *capability* is a value by which code can send events, command servants or assign what others read: the
component and its class, its functions and `send`, proxies and their operations, local functions.

A *plain* value is a number, a text, a truth value, None, a tuple of such values, or *data*: what a servant
answered, which code can change in place. To read a plain value runs no code, and gives the same again.
Values of libraries, containers and all other objects are not plain: to compare them, or to read an attribute
or an item, may run code, with another result each time.
"""

from __future__ import annotations

import ast
import re
from collections.abc import Iterable
from typing import Final, NamedTuple

MOST_TEXTS: Final = 20
"""The most texts that a name may be; more are unknown."""
_PLAIN_KINDS: Final = frozenset({"data", "number", "plain", "shape", "text", "tuple", "whole"})
ANY: Final = "\0"
"""In a shape: any text."""

_NAMES: Final = ("call", "doc", "file", "init", "len", "module", "name", "qualname", "version")
HARMLESS: Final = frozenset(f"__{name}__" for name in _NAMES)
"""Special attributes that lead to no other object."""
AGE: Final = "age"
"""The attribute of a sample of a stream that grows while code reads it."""
FAILED_ON: Final = "obj"
"""The attribute of an AttributeError with the object that lacks one, which may be the component."""
SAME_PROXY: Final = frozenset({"ice_invocationTimeout"})
"""Operations that return a proxy of the same servant."""
_OF_EVERY_PROXY: Final = frozenset(
    {
        *("ice_describe", "ice_getIdentity", "ice_getInvocationTimeout", "ice_getRealm", "ice_id", "ice_ids"),
        *("ice_isA", "ice_ping", "ice_toString", "ice_toWire", *SAME_PROXY),
    }
)
"""Operations of the base of all proxies that lead to no other servant."""


class Value(NamedTuple):
    """A possible value of an expression.

    Its kind is `self` (the component), `proxy` (by its attribute), `operation`, `send` (the component's),
    `function` (of the component, by its name), `reader` (of the last value of a stream), `local` (a nested
    function or lambda), or `other` for unknown values. Plain ones are a `text` that is known, a `shape` of
    texts, of which parts may be anything, a `whole` number or truth value, a `number` of any kind or None, a
    `tuple` of plain values, `data`, or just `plain`. A `container` is a list, a table or the like whose items
    code has put in; what all of them may hold together is known.
    """

    kind: str
    name: str = ""

    @property
    def is_plain(self) -> bool:
        """Whether it is a plain value."""
        return self.kind in _PLAIN_KINDS

    def leaks_by(self, attribute: str) -> bool:
        """Return whether an attribute may lead back to a value that is followed, in a way that is not."""
        if self.is_plain or self.kind == "other" or attribute in HARMLESS:
            return False
        if self.kind == "proxy":
            is_of_base = attribute.startswith(("_", "ice_")) or attribute in ("checkedCast", "uncheckedCast")
            return is_of_base and attribute not in _OF_EVERY_PROXY
        return attribute.startswith(("_", "automaton"))  # to build an automaton again gives its code away


SELF: Final = Value("self")
SENDER: Final = Value("send")
READER: Final = Value("reader")
OTHER: Final = Value("other")
DATA: Final = Value("data")
_PLAIN: Final = Value("plain")

Values = frozenset[Value]
Names = dict[str, Values]
NOTHING: Final[Values] = frozenset()
"""The values of a name to which nothing was given yet."""
COMPONENT: Final[Values] = frozenset({SELF})
NUMBER: Final[Values] = frozenset({Value("number")})
WHOLE: Final[Values] = frozenset({Value("whole")})
_NUMBERS: Final = NUMBER | WHOLE
PLAIN: Final[Values] = frozenset({_PLAIN})
"""A plain value, which may be any text."""
UNSURE: Final[Values] = frozenset({OTHER})
"""An unknown value."""
CONTAINER: Final[Values] = frozenset({Value("container")})
TUPLE: Final[Values] = frozenset({Value("tuple")})
CONTAINERS: Final = CONTAINER | TUPLE
_UNKNOWN_TEXTS: Final = frozenset({OTHER, DATA, _PLAIN})


def add_values(names: Names, name: str, values: Values) -> None:
    """Add values to those that a name may have; texts are lost among unknown values, and if they are many."""
    if values:
        names[name] = united(names.get(name, NOTHING), values)


def united(first: Values, second: Values) -> Values:
    """Return what may be one or the other value; texts are lost among unknown values, and if many."""
    known = first | second
    if len(known) > MOST_TEXTS:
        known |= PLAIN
    if not _UNKNOWN_TEXTS.isdisjoint(known):
        known = frozenset(value for value in known if value.kind not in ("text", "shape"))
    return known


def texts_of(values: Values) -> list[str]:
    """Return all texts that a value may be if it is one, none if some are unknown."""
    if not _UNKNOWN_TEXTS.isdisjoint(values) or any(value.kind == "shape" for value in values):
        return []
    return sorted(value.name for value in values if value.kind == "text")


def shapes_of(values: Values) -> list[str]:
    """Return all texts that a value may be if it is one, some of them as shapes; none if nothing is known."""
    if not _UNKNOWN_TEXTS.isdisjoint(values):
        return []
    return sorted(value.name for value in values if value.kind in ("text", "shape"))


def matches(shape: str, text: str) -> bool:
    """Return whether a text has a shape."""
    return bool(re.fullmatch(".*".join(map(re.escape, shape.split(ANY))), text, re.DOTALL))


def are_texts(values: Values) -> bool:
    """Return whether each of the values is a text that is known."""
    return all(value.kind == "text" for value in values)


def as_values(texts: Iterable[str]) -> Values:
    """Return texts as values; many are any text."""
    shapes = {re.sub(f"{ANY}+", ANY, text) for text in texts}
    if ANY in shapes:
        return PLAIN
    found = frozenset(Value("shape" if ANY in text else "text", text) for text in shapes)
    return found if len(found) <= MOST_TEXTS else PLAIN


def are_plain(*values: Values) -> bool:
    """Return whether values are plain; so are those of a name that has none, since it cannot be read."""
    return all(value.is_plain for each in values for value in each)


def combined(*values: Values) -> Values:
    """Return what an operation on values may give."""
    if not all(values):
        return NOTHING
    if not are_plain(*values):
        return UNSURE
    if any(DATA in each for each in values):
        return frozenset({DATA})
    if all(each <= _NUMBERS for each in values):
        return WHOLE if all(each == WHOLE for each in values) else NUMBER
    return PLAIN


def added(first: Values, second: Values) -> Values:
    """Return what `first + second` may give: known texts or shapes, if there are no others but numbers.

    A text and what may be any text make a shape.
    """
    one, other = shapes_of(first), shapes_of(second)
    if not (one or other) or not (first and second) or DATA in first | second or not are_plain(first, second):
        return combined(first, second)
    if (first | second) & _NUMBERS and PLAIN & (first | second):
        return PLAIN
    texts = as_values(a + b for a in one or _any_of(first) for b in other or _any_of(second))
    numbers = first & _NUMBERS, second & _NUMBERS
    return texts | combined(*numbers) if all(numbers) else texts


def _any_of(values: Values) -> list[str]:
    """Return any text, unless all values are numbers."""
    return [] if values <= _NUMBERS else [ANY]


def parameters_of(function: ast.FunctionDef) -> list[str]:
    """Return the positional parameters; the first is the component."""
    return [each.arg for each in (*function.args.posonlyargs, *function.args.args)]


def of_constant(value: object) -> Values:
    """Return a constant as values."""
    if isinstance(value, str):
        return as_values([value]) if value != ANY else PLAIN
    return WHOLE if isinstance(value, int) else NUMBER


def defaults_of(function: ast.FunctionDef) -> Names:
    """Return the values of the parameters of a function when nothing is known of a call."""
    arguments = function.args
    names = {each.arg: UNSURE for each in ast.walk(arguments) if isinstance(each, ast.arg)}
    positional = [*arguments.posonlyargs, *arguments.args][::-1]
    pairs = zip(positional, arguments.defaults[::-1], strict=False)
    for parameter, default in (*pairs, *zip(arguments.kwonlyargs, arguments.kw_defaults, strict=True)):
        if isinstance(default, ast.Constant):
            names[parameter.arg] = of_constant(default.value)
    return names
