"""Compare two versions of interfaces: which changes make programs of the two versions refuse each other.

That is decided by the canonical forms, whose digests `checkedCast` and every call compare.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import partial
from typing import Any, Final, Literal

from codegen.diagnostics import Location

from . import ast
from .schema import canonical_members, fingerprint, members_of, schema_entry

_NOT_SENT: Final = (ast.Constant,)
"""Definitions that are part of no interface's canonical form."""


@dataclass(frozen=True, slots=True)
class DefinitionChange:
    """A change of a definition, or of a `member` of one: an operation, member or enumerator.

    A change is `breaking` if it changes the canonical form of interfaces that use the definition, or if the
    definition is gone: programs that import it fail. `before` and `after` are what the form says, or the
    names of what was renamed. `location` is in the later version, except for what was removed.
    """

    kind: Literal["added", "removed", "changed", "renamed", "described"]
    breaking: bool
    location: Location
    definition: str
    what: str
    member: str = ""
    before: str = ""
    after: str = ""

    def __str__(self) -> str:
        """Return the change in words."""
        name = f"`{self.definition.removeprefix('::')}`"
        what = f"{self.what} {name}" if not self.member else f"{self.what} `{self.member}` of {name}"
        match self.kind:
            case "changed":
                return f"{what} changed: `{self.before}` -> `{self.after}`"
            case "renamed":
                return f"{what} renamed to `{self.after}`"
            case "described":
                return f"{what}: {self.after}"
        return f"{what} {self.kind}"


@dataclass(frozen=True, slots=True)
class Refusal:
    """An interface of which clients and servants of the two versions refuse each other."""

    interface: str
    before: str
    after: str
    """The fingerprint; empty if there is none any more."""


Definitions = Mapping[str, ast.Definition]
"""Definitions by scoped name."""


def refusals(before: Definitions, after: Definitions) -> Iterator[Refusal]:
    """Yield the interfaces of a version that another one lacks, or has with another fingerprint."""
    for name, definition in sorted(before.items()):
        if isinstance(definition, ast.Interface):
            later = after.get(name)
            own, other = fingerprint(definition), fingerprint(later) if later else ""
            if own != other:
                yield Refusal(name, own, other)


def changes(before: Definitions, after: Definitions) -> Iterator[DefinitionChange]:
    """Yield what differs in two versions, by the names of definitions."""
    for name in sorted(before.keys() | after.keys()):
        old, new = before.get(name), after.get(name)
        if old is None:
            assert new is not None
            yield DefinitionChange("added", False, new.token.location, name, new.kind)
        elif new is None:
            yield DefinitionChange("removed", True, old.token.location, name, old.kind)
        else:
            yield from _changes(old, new)


def _changes(old: ast.Definition, new: ast.Definition) -> Iterator[DefinitionChange]:
    """Yield the changes of a definition that both versions have."""
    name, breaking = new.scoped, not isinstance(new, _NOT_SENT)
    own, other = canonical_members(old), canonical_members(new)
    if own == other:
        yield from _described(old, new)
        return
    members = {each.scoped: each for each in (*members_of(old), *members_of(new))}
    renamed = _renamed(own, other)
    for key in dict.fromkeys((*own, *other)):
        member = members.get(key)
        what, short = (member.kind, member.name) if member else (new.kind, "")
        place = (member or new).token.location
        found = partial(
            DefinitionChange, breaking=breaking, location=place, definition=name, what=what, member=short
        )
        if key in renamed:
            yield found("renamed", before=short, after=members[renamed[key]].name)
        elif key not in other:
            yield found("removed", before=_rest(own, key))
        elif key not in own and key not in renamed.values():
            yield found("added", after=_rest(other, key))
        elif key in own and own[key] != other[key]:
            yield found("changed", before=_rest(own, key), after=_rest(other, key))


def _rest(lines: Mapping[str, str], key: str) -> str:
    """Return what a line says of what it names."""
    return lines[key].removeprefix(key).removeprefix(": ").removeprefix(" = ")


def _renamed(own: Mapping[str, str], other: Mapping[str, str]) -> dict[str, str]:
    """Return the new names of members that only have another name."""
    gone = {key: line.removeprefix(key) for key, line in own.items() if key not in other}
    new = {key: line.removeprefix(key) for key, line in other.items() if key not in own}
    pairs = {key: [each for each, rest in new.items() if rest == wanted] for key, wanted in gone.items()}
    taken = [each for found in pairs.values() for each in found]
    return {key: found[0] for key, found in pairs.items() if len(found) == 1 == taken.count(found[0])}


def _described(old: ast.Definition, new: ast.Definition) -> Iterator[DefinitionChange]:
    """Yield what differs in two definitions that are equal on the wire."""
    own, other = ({**schema_entry(each, ""), "fingerprint": ""} for each in (old, new))
    if own == other:
        return
    message = "its description changed"
    if _without_docs(own) != _without_docs(other):
        message = "the order, default values or names of types changed, which are not sent"
    yield DefinitionChange("described", False, new.token.location, new.scoped, new.kind, after=message)


def _without_docs(value: Any) -> Any:  # noqa: ANN401 - data for JSON
    match value:
        case dict():
            kept = {key: each for key, each in value.items() if key != "doc"}
            return {
                key: [*each] if key == "exceptions" else _without_docs(each) for key, each in kept.items()
            }
        case tuple():
            return [_without_docs(each) for each in value]
    return value
