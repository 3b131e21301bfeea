"""Compare two versions of interfaces and find what breaks programs that were written for the older one."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from enum import Enum, StrEnum
from typing import TypeVar

from . import ast
from .lexer import Token
from .schema import canonical_type, type_name

__all__ = ["Break", "BreakingChange", "BreakingRule", "breaking_changes"]


class Break(StrEnum):
    """How a change breaks: WIRE, old and new programs refuse each other; SOURCE, code must be rewritten."""

    WIRE = "wire"
    SOURCE = "source"


_WIRE, _SOURCE, _BOTH = (Break.WIRE,), (Break.SOURCE,), (Break.WIRE, Break.SOURCE)


class BreakingRule(Enum):
    """A kind of change: its code, what it breaks, and whom it hits and how."""

    INTERFACE_REMOVED = "B101", _BOTH, "clients no longer find it, and servants of it no longer run"
    TYPE_REMOVED = "B102", _SOURCE, "code that names it no longer runs"
    KIND_CHANGED = "B103", _BOTH, "values of the old kind are refused, and code for it no longer runs"

    OPERATION_REMOVED = "B201", _BOTH, "clients that call it fail"
    OPERATION_ADDED = "B202", _BOTH, "servants must implement it, and old servants are refused"
    RETURN_CHANGED = "B203", _BOTH, "clients misread the result"
    PARAMETER_REMOVED = "B204", _BOTH, "calls and servants have one parameter too many"
    PARAMETER_ADDED = "B205", _BOTH, "calls and servants lack a parameter"
    PARAMETER_TYPE_CHANGED = "B206", _BOTH, "the value is refused where it arrives"
    PARAMETER_RENAMED = "B207", _BOTH, "parameters travel by name"
    PARAMETERS_REORDERED = "B208", _BOTH, "callers pass values in the old order"
    EXCEPTION_ADDED = "B209", _BOTH, "clients do not expect it"
    EXCEPTION_REMOVED = "B210", _BOTH, "a servant that still throws it is answered with UnknownException"
    IDEMPOTENCE_CHANGED = "B211", _WIRE, "the sides disagree whether a lost call may be repeated"
    STREAM_REMOVED = "B212", _BOTH, "subscribers wait for ever, and servants no longer have its publisher"
    STREAM_ADDED = "B213", _WIRE, "old servants publish nothing and are refused"
    BASE_REMOVED = "B214", _BOTH, "proxies of the base no longer accept the servant"
    BASE_ADDED = "B215", _BOTH, "servants must implement its operations"
    BASES_REARRANGED = "B216", _WIRE, "the sides refuse each other, although nothing else changed"
    AMD_REMOVED = "B217", _SOURCE, "servants must return values: no futures, no coroutines"
    STOP_REMOVED = "B218", _SOURCE, "a component that ends no longer stops what it commanded"

    MEMBER_REMOVED = "B301", _BOTH, "receivers miss it, and code that reads it fails"
    MEMBER_ADDED = "B302", _BOTH, "old senders lack it, and code that makes the value must give it"
    OPTIONAL_MEMBER_ADDED = "B303", _WIRE, "old receivers leave it out and are refused"
    MEMBER_TYPE_CHANGED = "B304", _BOTH, "the value is refused where it arrives"
    MEMBER_RENAMED = "B305", _BOTH, "members travel by name"
    MEMBERS_REORDERED = "B306", _SOURCE, "code passes members in the old order"
    MEMBER_NOW_OPTIONAL = "B307", _BOTH, "receivers may miss it, and code must expect None"
    MEMBER_NOW_REQUIRED = "B308", _BOTH, "senders may leave it out"
    DEFAULT_REMOVED = "B309", _SOURCE, "code that relies on the default value must give one"
    PARENT_CHANGED = "B310", _BOTH, "code that expects the old base misses it"

    ENUMERATOR_REMOVED = "B401", _BOTH, "its value is refused where it arrives, and code that names it fails"
    ENUMERATOR_ADDED = "B402", _WIRE, "old receivers refuse its value"
    ENUMERATOR_VALUE_CHANGED = "B403", _BOTH, "one value means two things"

    ELEMENT_CHANGED = "B501", _BOTH, "the elements are refused where they arrive"
    CONSTANT_CHANGED = "B502", _SOURCE, "the sides work with different values"

    def __init__(self, code: str, breaks: tuple[Break, ...], consequence: str) -> None:
        self.code = code
        self.breaks = breaks
        self.consequence = consequence


@dataclass(frozen=True, slots=True)
class BreakingChange:
    """A change that breaks something; `token` is where it is now, or where what is gone was."""

    rule: BreakingRule
    message: str
    token: Token
    before: Token | None = None
    """Where the older version stands, when that is another place."""


_Changes = Iterator[BreakingChange]


def breaking_changes(
    old: Mapping[str, ast.Definition], new: Mapping[str, ast.Definition]
) -> list[BreakingChange]:
    """Return what breaks between two versions, each given as its definitions by scoped name.

    New definitions break nothing. A change in a type is reported once, where the type is defined.
    """
    return [change for scoped, before in old.items() for change in _compare(before, new.get(scoped))]


def _compare(before: ast.Definition, after: ast.Definition | None) -> _Changes:
    if after is None:
        is_interface = isinstance(before, ast.Interface)
        rule = BreakingRule.INTERFACE_REMOVED if is_interface else BreakingRule.TYPE_REMOVED
        yield BreakingChange(rule, f"{before.kind} `{before.scoped}` was removed", before.token)
        return
    match before, after:
        case ast.Interface(), ast.Interface():
            yield from _interface(before, after)
        case ast.Struct() | ast.Derivable(), ast.Struct() | ast.Derivable() if before.kind == after.kind:
            yield from _record(before, after)
        case ast.Enumeration(), ast.Enumeration():
            yield from _listed(before.enumerators, after.enumerators, after, _enumerator)
        case ast.Sequence(), ast.Sequence():
            yield from _element(before, after, before.element, after.element)
        case ast.Dictionary(), ast.Dictionary():
            yield from _element(before, after, before.key, after.key)
            yield from _element(before, after, before.value, after.value)
        case ast.Constant(), ast.Constant():
            was, now = before.literal.value, after.literal.value
            if was != now or type_name(before.type) != type_name(after.type):
                message = f"constant `{after.scoped}` was {was!r} and is {now!r}"
                yield _changed(BreakingRule.CONSTANT_CHANGED, message, before, after)
        case _:
            message = f"`{after.scoped}` was {before.kind} and is {after.kind}"
            yield _changed(BreakingRule.KIND_CHANGED, message, before, after)


def _changed(
    rule: BreakingRule, message: str, before: ast.Definition, after: ast.Definition
) -> BreakingChange:
    return BreakingChange(rule, message, after.token, before.token)


def _differ(before: ast.Type | None, after: ast.Type | None) -> bool:
    """Return whether two types differ by more than the definitions of what they name.

    What is reported of the definition need not be repeated where it is used; two names for sequences of the
    same elements are the same type.
    """
    if type_name(before) == type_name(after):
        return False
    if before is None or after is None:
        return True
    return canonical_type(before) != canonical_type(after)


# What a definition lists: operations, parameters, members, enumerators

_REMOVED = {
    "operation": BreakingRule.OPERATION_REMOVED,
    "parameter": BreakingRule.PARAMETER_REMOVED,
    "member": BreakingRule.MEMBER_REMOVED,
    "enumerator": BreakingRule.ENUMERATOR_REMOVED,
}
_ADDED = {
    "operation": BreakingRule.OPERATION_ADDED,
    "parameter": BreakingRule.PARAMETER_ADDED,
    "member": BreakingRule.MEMBER_ADDED,
    "enumerator": BreakingRule.ENUMERATOR_ADDED,
}
_RENAMED = {"parameter": BreakingRule.PARAMETER_RENAMED, "member": BreakingRule.MEMBER_RENAMED}
_REORDERED = {"parameter": BreakingRule.PARAMETERS_REORDERED, "member": BreakingRule.MEMBERS_REORDERED}

_Item = TypeVar("_Item", bound=ast.Definition)


def _listed(
    was: Sequence[_Item],
    now: Sequence[_Item],
    owner: ast.Definition,
    compare: Callable[[_Item, _Item, str], _Changes],
) -> _Changes:
    """Compare what stands in two lists by its names; `compare` gets old, new and how messages name them."""
    new = {each.name: each for each in now}
    renamed = _renamed(was, now)
    for before in was:
        name = f"{before.kind} `{before.name}` of `{owner.scoped}`"
        after = new.pop(renamed.get(before.name, before.name), None)
        if after is None:
            yield BreakingChange(_REMOVED[before.kind], f"{name} was removed", owner.token, before.token)
            continue
        if after.name != before.name:
            yield _changed(_RENAMED[before.kind], f"{name} is now called `{after.name}`", before, after)
        yield from compare(before, after, name)
    for after in new.values():
        message = f"{after.kind} `{after.name}` of `{owner.scoped}` was added"
        if isinstance(after, ast.Member) and after.tag is not None:
            yield BreakingChange(BreakingRule.OPTIONAL_MEMBER_ADDED, f"optional {message}", after.token)
        else:
            yield BreakingChange(_ADDED[after.kind], message, after.token)
    names_before, names_after = [each.name for each in was], [each.name for each in now]
    if (
        names_before != names_after
        and sorted(names_before) == sorted(names_after)
        and was[0].kind in _REORDERED
    ):
        message = f"the {was[0].kind}s of `{owner.scoped}` stand in another order"
        yield BreakingChange(_REORDERED[was[0].kind], message, owner.token)


def _renamed(was: Sequence[ast.Definition], now: Sequence[ast.Definition]) -> dict[str, str]:
    """Return new names by old ones: in lists of one length, of what has the same place and type."""
    found: dict[str, str] = {}
    old_names, new_names = {each.name for each in was}, {each.name for each in now}
    for before, after in zip(was, now, strict=False) if len(was) == len(now) else ():
        if (
            isinstance(before, ast.Member | ast.Parameter)
            and isinstance(after, ast.Member | ast.Parameter)
            and before.name not in new_names
            and after.name not in old_names
            and type_name(before.type) == type_name(after.type)
        ):
            found[before.name] = after.name
    return found


# Interfaces


def _interface(before: ast.Interface, after: ast.Interface) -> _Changes:
    bases_before = {base.scoped for base in before.base_definitions}
    bases_after = {base.scoped for base in after.base_definitions}
    removed = sorted(bases_before - {base.scoped for base in after.ancestors()})
    added = sorted(bases_after - {base.scoped for base in before.ancestors()})
    name = f"interface `{after.scoped}`"
    for scoped in removed:
        yield _changed(BreakingRule.BASE_REMOVED, f"{name} no longer extends `{scoped}`", before, after)
    for scoped in added:
        yield _changed(BreakingRule.BASE_ADDED, f"{name} now extends `{scoped}`", before, after)
    if bases_before != bases_after and not removed and not added:
        message = f"{name} extends the same interfaces by another way"
        yield _changed(BreakingRule.BASES_REARRANGED, message, before, after)
    if _is_stoppable(before) and not _is_stoppable(after):
        message = f"{name} no longer has an operation that stops it"
        yield _changed(BreakingRule.STOP_REMOVED, message, before, after)
    yield from _listed(before.operations, after.operations, after, _operation)


def _is_stoppable(interface: ast.Interface) -> bool:
    """Return whether an operation, perhaps of a base, is marked to stop the interface."""
    lineage = (interface, *interface.ancestors())
    return any(operation.stop for each in lineage for operation in each.operations)


def _operation(before: ast.Operation, after: ast.Operation, name: str) -> _Changes:
    def changed(rule: BreakingRule, message: str) -> BreakingChange:
        return _changed(rule, f"{name} {message}", before, after)

    was = _described(before.returns, optional=before.return_tag is not None)
    now = _described(after.returns, optional=after.return_tag is not None)
    if _differ(before.returns, after.returns) or (before.return_tag is None) != (after.return_tag is None):
        yield changed(BreakingRule.RETURN_CHANGED, f"returned {was} and returns {now}")
    yield from _listed(before.parameters, after.parameters, after, _parameter)
    thrown_before = {each.definition.scoped for each in before.throws if each.definition}
    thrown_after = {each.definition.scoped for each in after.throws if each.definition}
    for scoped in sorted(thrown_after - thrown_before):
        yield changed(BreakingRule.EXCEPTION_ADDED, f"now throws `{scoped}`")
    for scoped in sorted(thrown_before - thrown_after):
        yield changed(BreakingRule.EXCEPTION_REMOVED, f"no longer throws `{scoped}`")
    if before.idempotent != after.idempotent:
        message = f"is {'now' if after.idempotent else 'no longer'} idempotent"
        yield changed(BreakingRule.IDEMPOTENCE_CHANGED, message)
    if before.streamed and not after.streamed:
        yield changed(BreakingRule.STREAM_REMOVED, "is no longer streamed")
    if after.streamed and not before.streamed:
        yield changed(BreakingRule.STREAM_ADDED, "is now streamed")
    if before.amd and not after.amd:
        yield changed(BreakingRule.AMD_REMOVED, "is no longer answered asynchronously")


def _parameter(before: ast.Parameter, after: ast.Parameter, name: str) -> _Changes:
    was_optional, is_optional = before.tag is not None, after.tag is not None
    if _differ(before.type, after.type) or before.out != after.out or was_optional != is_optional:
        was = _described(before.type, optional=was_optional, out=before.out)
        now = _described(after.type, optional=is_optional, out=after.out)
        yield _changed(BreakingRule.PARAMETER_TYPE_CHANGED, f"{name} was {was} and is {now}", before, after)


def _described(kind: ast.Type | None, *, optional: bool, out: bool = False) -> str:
    return f"{'out ' if out else ''}{'optional ' if optional else ''}{type_name(kind)}"


# Types


def _record(before: ast.Struct | ast.Derivable, after: ast.Struct | ast.Derivable) -> _Changes:
    if isinstance(before, ast.Derivable) and isinstance(after, ast.Derivable):
        bases = (before.base_definition, after.base_definition)
        was, now = (f"`{base.scoped}`" if base else "nothing" for base in bases)
        if was != now:
            message = f"{after.kind} `{after.scoped}` extended {was} and extends {now}"
            yield _changed(BreakingRule.PARENT_CHANGED, message, before, after)
    yield from _listed(before.members, after.members, after, _member)


def _member(before: ast.Member, after: ast.Member, name: str) -> _Changes:
    if _differ(before.type, after.type):
        message = f"{name} was {type_name(before.type)} and is {type_name(after.type)}"
        yield _changed(BreakingRule.MEMBER_TYPE_CHANGED, message, before, after)
    if before.tag is None and after.tag is not None:
        yield _changed(BreakingRule.MEMBER_NOW_OPTIONAL, f"{name} is now optional", before, after)
    elif before.tag is not None and after.tag is None:
        yield _changed(BreakingRule.MEMBER_NOW_REQUIRED, f"{name} is no longer optional", before, after)
    if before.default is not None and after.default is None:
        yield _changed(BreakingRule.DEFAULT_REMOVED, f"{name} no longer has a default value", before, after)


def _enumerator(before: ast.Enumerator, after: ast.Enumerator, name: str) -> _Changes:
    if before.value != after.value:
        message = f"{name} was {before.value} and is {after.value}"
        yield _changed(BreakingRule.ENUMERATOR_VALUE_CHANGED, message, before, after)


def _element(before: ast.Definition, after: ast.Definition, was: ast.Type, now: ast.Type) -> _Changes:
    if _differ(was, now):
        message = f"{after.kind} `{after.scoped}` was of {type_name(was)} and is of {type_name(now)}"
        yield _changed(BreakingRule.ELEMENT_CHANGED, message, before, after)
