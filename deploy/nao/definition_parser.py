"""Read the canonical definitions that servants give of their interfaces.

A definition has one line for each interface, type, member, enumerator and operation, and mentions every type
that is needed to talk to the servant:

    ::nao::HeadPose::pan: double
    ::nao::PoseHead::getPose(): ::nao::HeadPose idempotent stream
    interface ::nao::PoseHead
    struct ::nao::HeadPose

It comes from another process: whatever does not fit is a MarshalException.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import Final

from deploy.nao.definitions import (
    RETURN_VALUE,
    Builtin,
    Definitions,
    Dictionary,
    Enumeration,
    Member,
    Named,
    OperationSignature,
    Optional,
    Proxy,
    Record,
    Sequence,
    Type,
)
from zenoh_ice import MarshalException
from zenoh_ice.wire.text import cut

__all__ = ["parse_definition"]

_BUILTIN_TYPES: Final = frozenset(
    {"bool", "byte", "short", "int", "long", "float", "double", "string", "Object", "Value"}
)
# As in Slice a name neither begins nor ends with an underscore nor has two together: Python's `__init__` and
# its like cannot be members.
_NAME: Final = r"[A-Za-z](?:_?[A-Za-z0-9])*"
_TOKEN: Final = re.compile(rf"\s*((?:::{_NAME})+|{_NAME}|-?\d+|[<>(),:=*])", re.ASCII)
_KINDS: Final = frozenset({"interface", "struct", "class", "exception", "enum"})
_MODIFIERS: Final = frozenset({"throws", "idempotent", "stream"})
_LONGEST_NUMBER: Final = 20  # digits
_LONGEST_NAME: Final = 256  # with all that it is in
_LONGEST_SHOWN: Final = 200  # characters of what is wrong
_DEEPEST: Final = 32
"""Types within types."""


def parse_definition(text: str) -> Definitions:
    """Return what a canonical definition tells.

    Raises MarshalException, with the line, for what is no such definition.
    """
    definitions = Definitions()
    # Nothing that travels depends on a constant.
    lines = [_Line(line) for line in text.splitlines() if line.strip() and not line.startswith("const ")]
    # A member's line may stand before that of its struct.
    for line in lines:
        if line.peek() in _KINDS:
            _read_head(line, definitions)
    for line in lines:
        if line.is_whole():
            _read_body(line, definitions)
    return definitions


def _read_head(line: _Line, definitions: Definitions) -> None:
    kind, type_id = line.take(), line.scoped()
    bases: tuple[str, ...] = ()
    if line.accept("extends"):
        bases = (line.scoped(), *(line.scoped() for _ in line.while_accepted(",")))
    line.end()
    match kind:
        case "interface":
            definitions.interfaces[type_id] = bases
        case "enum":
            definitions.enumerations[type_id] = Enumeration(type_id)
        case _:
            definitions.records[type_id] = Record(kind, type_id, bases[0] if bases else None)


def _read_body(line: _Line, definitions: Definitions) -> None:
    if not line.peek().startswith("::"):
        return  # a type that has no members
    owner, _, name = line.scoped().rpartition("::")
    if line.accept("("):
        if owner not in definitions.interfaces:
            raise line.error(f"there is no interface {_quoted(owner)}")
        definitions.operations[name] = _operation(line, owner, name)
    elif line.accept("="):
        if owner not in definitions.enumerations:
            raise line.error(f"there is no enumeration {_quoted(owner)}")
        definitions.enumerations[owner].values[name] = line.integer()
        line.end()
    else:
        line.expect(":")
        if owner not in definitions.records:
            raise line.error(f"there is no type {_quoted(owner)}")
        definitions.records[owner].members.append(Member(name, line.type()))
        line.end()


def _operation(line: _Line, owner: str, name: str) -> OperationSignature:
    parameters: list[Member] = []
    if not line.accept(")"):
        parameters = [line.member(), *(line.member() for _ in line.while_accepted(","))]
        line.expect(")")
    line.expect(":")
    results: list[Member] = []
    if not line.accept("void"):
        first = line.type()
        named = line.peek() not in {"", ",", *_MODIFIERS}
        results = [Member(line.take() if named else RETURN_VALUE, first)]
        results += [line.member() for _ in line.while_accepted(",")]
    throws: tuple[str, ...] = ()
    if line.accept("throws"):
        throws = (line.scoped(), *(line.scoped() for _ in line.while_accepted(",")))
    # A later version may say more of an operation than we know of.
    words = set(line.rest())
    return OperationSignature(
        owner, name, tuple(parameters), tuple(results), throws, "idempotent" in words, "stream" in words
    )


class _Line:
    """One line of a definition, token by token."""

    def __init__(self, text: str) -> None:
        self._text: Final = text
        self._tokens: Final = _TOKEN.findall(text)
        self._next = 0
        self._depth = 0
        if "".join(self._tokens) != "".join(text.split()):
            raise self.error("there is what is neither a name nor a sign of Slice")
        if any(len(token) > _LONGEST_NAME for token in self._tokens):
            raise self.error("a name is too long")

    def error(self, problem: str) -> MarshalException:
        return MarshalException(f"malformed definition of an interface: {problem}, in {_quoted(self._text)}")

    def is_whole(self) -> bool:
        """Return whether nothing of it was read yet."""
        return self._next == 0

    def peek(self) -> str:
        return self._tokens[self._next] if self._next < len(self._tokens) else ""

    def take(self) -> str:
        token = self.peek()
        if not token:
            raise self.error("it ends too early")
        self._next += 1
        return token

    def accept(self, token: str) -> bool:
        if self.peek() != token:
            return False
        self._next += 1
        return True

    def while_accepted(self, token: str) -> Iterator[None]:
        while self.accept(token):
            yield

    def expect(self, token: str) -> None:
        if not self.accept(token):
            raise self.error(f"{token!r} was expected where {_quoted(self.peek())} stands")

    def end(self) -> None:
        if self.peek():
            raise self.error(f"{_quoted(self.peek())} was not expected")

    def rest(self) -> list[str]:
        rest, self._next = self._tokens[self._next :], len(self._tokens)
        return rest

    def scoped(self) -> str:
        token = self.take()
        if not token.startswith("::"):
            raise self.error(f"{_quoted(token)} is no scoped name")
        return token

    def integer(self) -> int:
        token = self.take()
        if not token.lstrip("-").isdecimal() or len(token) > _LONGEST_NUMBER:
            raise self.error(f"{_quoted(token)} is no number")
        return int(token)

    def member(self) -> Member:
        kind = self.type()
        name = self.take()
        if not name.isidentifier():
            raise self.error(f"{_quoted(name)} is no name")
        return Member(name, kind)

    def type(self) -> Type:
        self._depth += 1
        if self._depth > _DEEPEST:
            raise self.error("types are nested too deeply")
        kind = self._type()
        self._depth -= 1
        return kind

    def _type(self) -> Type:
        if self.accept("optional"):
            return Optional(self.type())
        if self.accept("sequence"):
            self.expect("<")
            element = self.type()
            self.expect(">")
            return Sequence(element)
        if self.accept("dictionary"):
            self.expect("<")
            key = self.type()
            self.expect(",")
            value = self.type()
            self.expect(">")
            return Dictionary(key, value)
        name = self.take()
        if self.accept("*"):
            return Proxy(name if name.startswith("::") else f"::Ice::{name}")
        if name.startswith("::"):
            return Named(name)
        if name not in _BUILTIN_TYPES:
            raise self.error(f"{_quoted(name)} is no type")
        return Builtin(name)


def _quoted(text: str) -> str:
    return repr(cut(text, _LONGEST_SHOWN))
