"""Compare two versions of interfaces and find what breaks programs that were written for the older one."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TypeVar

from . import ast
from .breaking_rules import BreakingRule
from .fingerprint import canonical_type
from .lexer import Token
from .signature import type_name

__all__ = ["BreakingChange", "breaking_changes"]


@dataclass(frozen=True, slots=True)
class BreakingChange:
    """A change that breaks something; `token` is where it is now, or where what is gone was."""

    rule: BreakingRule
    message: str
    token: Token
    before: Token | None = None
    """Where the older version stands, when that is another place."""


def breaking_changes(
    old: Mapping[str, ast.Definition], new: Mapping[str, ast.Definition]
) -> list[BreakingChange]:
    """Return what breaks between two versions, each given as its definitions by scoped name.

    New definitions break nothing. A change in a type is told once, where the type is defined.
    """
    return [change for scoped, before in old.items() for change in _compare(before, new.get(scoped))]


def _compare(before: ast.Definition, after: ast.Definition | None) -> Iterator[BreakingChange]:
    if after is None:
        message = f"{before.kind} `{before.scoped}` was removed"
        is_interface = isinstance(before, ast.Interface)
        rule = BreakingRule.INTERFACE_REMOVED if is_interface else BreakingRule.TYPE_REMOVED
        yield BreakingChange(rule, message, before.token)
    elif before.kind != after.kind:
        message = f"`{after.scoped}` was {before.kind} and is {after.kind}"
        yield _changed(BreakingRule.KIND_CHANGED, message, before, after)
    else:
        match before, after:
            case ast.Interface(), ast.Interface():
                yield from _interface(before, after)
            case ast.Struct(), ast.Struct():
                yield from _members(before, after, before.members, after.members)
            case ast.Derivable(), ast.Derivable():
                yield from _parent(before, after)
                yield from _members(before, after, before.members, after.members)
            case ast.Enumeration(), ast.Enumeration():
                yield from _enumeration(before, after)
            case ast.Sequence(), ast.Sequence():
                yield from _element(before, after, before.element, after.element)
            case ast.Dictionary(), ast.Dictionary():
                yield from _element(before, after, before.key, after.key)
                yield from _element(before, after, before.value, after.value)
            case ast.Constant(), ast.Constant():
                if (before.literal.value, type_name(before.type)) != (
                    after.literal.value,
                    type_name(after.type),
                ):
                    values = f"was {before.literal.value!r} and is {after.literal.value!r}"
                    message = f"constant `{after.scoped}` {values}"
                    yield _changed(BreakingRule.CONSTANT_CHANGED, message, before, after)


def _changed(
    rule: BreakingRule, message: str, before: ast.Definition, after: ast.Definition
) -> BreakingChange:
    return BreakingChange(rule, message, after.token, before.token)


def _differ(before: ast.Type | None, after: ast.Type | None) -> bool:
    """Return whether two types differ by more than the definitions of what they name.

    What is said of the definition need not be said again where it is used; two names for sequences of the
    same elements are the same type.
    """
    if type_name(before) == type_name(after):
        return False
    if before is None or after is None:
        return True
    return canonical_type(before) != canonical_type(after)


# Interfaces


def _interface(before: ast.Interface, after: ast.Interface) -> Iterator[BreakingChange]:
    bases_before = {base.scoped for base in before.base_definitions}
    bases_after = {base.scoped for base in after.base_definitions}
    removed = sorted(bases_before - {base.scoped for base in after.ancestors()})
    added = sorted(bases_after - {base.scoped for base in before.ancestors()})
    for scoped in removed:
        message = f"interface `{after.scoped}` no longer extends `{scoped}`"
        yield _changed(BreakingRule.BASE_REMOVED, message, before, after)
    for scoped in added:
        message = f"interface `{after.scoped}` now extends `{scoped}`"
        yield _changed(BreakingRule.BASE_ADDED, message, before, after)
    if bases_before != bases_after and not removed and not added:
        message = f"interface `{after.scoped}` extends the same interfaces by another way"
        yield _changed(BreakingRule.BASES_REARRANGED, message, before, after)
    if _is_stoppable(before) and not _is_stoppable(after):
        message = f"interface `{after.scoped}` no longer has an operation that stops it"
        yield _changed(BreakingRule.STOP_REMOVED, message, before, after)
    operations = {operation.name: operation for operation in after.operations}
    for operation in before.operations:
        now = operations.pop(operation.name, None)
        if now is None:
            message = f"operation `{operation.scoped}` was removed"
            yield BreakingChange(BreakingRule.OPERATION_REMOVED, message, operation.token)
        else:
            yield from _operation(operation, now)
    for operation in operations.values():
        message = f"operation `{operation.scoped}` was added"
        yield BreakingChange(BreakingRule.OPERATION_ADDED, message, operation.token)


def _is_stoppable(interface: ast.Interface) -> bool:
    """Return whether an operation, perhaps of a base, is marked to stop the interface."""
    lineage = (interface, *interface.ancestors())
    return any(operation.stop for each in lineage for operation in each.operations)


def _operation(before: ast.Operation, after: ast.Operation) -> Iterator[BreakingChange]:
    name = after.scoped
    was_optional, is_optional = before.return_tag is not None, after.return_tag is not None
    if _differ(before.returns, after.returns) or was_optional != is_optional:
        was = ("optional " if was_optional else "") + type_name(before.returns)
        now = ("optional " if is_optional else "") + type_name(after.returns)
        yield _changed(
            BreakingRule.RETURN_CHANGED, f"`{name}` returned {was} and returns {now}", before, after
        )
    yield from _parameters(before, after)
    thrown_before = {each.definition.scoped for each in before.throws if each.definition}
    thrown_after = {each.definition.scoped for each in after.throws if each.definition}
    for scoped in sorted(thrown_after - thrown_before):
        message = f"`{name}` now throws `{scoped}`"
        yield _changed(BreakingRule.EXCEPTION_ADDED, message, before, after)
    for scoped in sorted(thrown_before - thrown_after):
        message = f"`{name}` no longer throws `{scoped}`"
        yield _changed(BreakingRule.EXCEPTION_REMOVED, message, before, after)
    if before.idempotent != after.idempotent:
        message = f"`{name}` is {'now' if after.idempotent else 'no longer'} idempotent"
        yield _changed(BreakingRule.IDEMPOTENCE_CHANGED, message, before, after)
    if before.streamed and not after.streamed:
        yield _changed(BreakingRule.STREAM_REMOVED, f"`{name}` is no longer streamed", before, after)
    if after.streamed and not before.streamed:
        yield _changed(BreakingRule.STREAM_ADDED, f"`{name}` is now streamed", before, after)
    if before.amd and not after.amd:
        message = f"`{name}` is no longer answered asynchronously"
        yield _changed(BreakingRule.AMD_REMOVED, message, before, after)


def _parameters(before: ast.Operation, after: ast.Operation) -> Iterator[BreakingChange]:
    was, now = before.parameters, after.parameters
    names_before = [each.name for each in was]
    names_after = [each.name for each in now]
    by_name = {each.name: each for each in now}
    renamed = _renamed(was, now)
    for parameter in was:
        other = renamed.get(parameter.name) or by_name.get(parameter.name)
        owner = f"parameter `{parameter.name}` of `{after.scoped}`"
        if other is None:
            yield BreakingChange(
                BreakingRule.PARAMETER_REMOVED, f"{owner} was removed", after.token, parameter.token
            )
            continue
        if other.name != parameter.name:
            message = f"{owner} is now called `{other.name}`"
            yield _changed(BreakingRule.PARAMETER_RENAMED, message, parameter, other)
        if _description(parameter) != _description(other) and (
            _differ(parameter.type, other.type) or _manner(parameter) != _manner(other)
        ):
            message = f"{owner} was {_description(parameter)} and is {_description(other)}"
            yield _changed(BreakingRule.PARAMETER_TYPE_CHANGED, message, parameter, other)
    new_names = {each.name for each in renamed.values()}
    for parameter in now:
        if parameter.name not in names_before and parameter.name not in new_names:
            message = f"parameter `{parameter.name}` of `{after.scoped}` was added"
            yield BreakingChange(BreakingRule.PARAMETER_ADDED, message, parameter.token)
    if names_before != names_after and sorted(names_before) == sorted(names_after):
        message = f"the parameters of `{after.scoped}` stand in another order"
        yield _changed(BreakingRule.PARAMETERS_REORDERED, message, before, after)


def _manner(parameter: ast.Parameter) -> tuple[bool, bool]:
    return parameter.out, parameter.tag is not None


def _description(parameter: ast.Parameter) -> str:
    words = ["out"] if parameter.out else []
    words += ["optional"] if parameter.tag is not None else []
    return " ".join([*words, type_name(parameter.type)])


# Types


def _parent(before: ast.Derivable, after: ast.Derivable) -> Iterator[BreakingChange]:
    was, now = before.base_definition, after.base_definition
    names = [f"`{base.scoped}`" if base else "nothing" for base in (was, now)]
    if names[0] != names[1]:
        message = f"{after.kind} `{after.scoped}` extended {names[0]} and extends {names[1]}"
        yield _changed(BreakingRule.PARENT_CHANGED, message, before, after)


def _members(
    before: ast.Definition, after: ast.Definition, was: Sequence[ast.Member], now: Sequence[ast.Member]
) -> Iterator[BreakingChange]:
    by_name = {member.name: member for member in now}
    names_before = [member.name for member in was]
    names_after = [member.name for member in now]
    renamed = _renamed(was, now)
    for member in was:
        other = renamed.get(member.name) or by_name.get(member.name)
        if other is None:
            message = f"member `{member.name}` of `{after.scoped}` was removed"
            yield BreakingChange(BreakingRule.MEMBER_REMOVED, message, after.token, member.token)
        else:
            yield from _member(member, other, after)
    new_names = {each.name for each in renamed.values()}
    for member in now:
        if member.name not in names_before and member.name not in new_names:
            optional = member.tag is not None
            rule = BreakingRule.OPTIONAL_MEMBER_ADDED if optional else BreakingRule.MEMBER_ADDED
            message = f"{'optional ' if optional else ''}member `{member.name}` of `{after.scoped}` was added"
            yield BreakingChange(rule, message, member.token)
    if names_before != names_after and sorted(names_before) == sorted(names_after):
        message = f"the members of `{after.scoped}` stand in another order"
        yield _changed(BreakingRule.MEMBERS_REORDERED, message, before, after)


def _member(before: ast.Member, after: ast.Member, owner: ast.Definition) -> Iterator[BreakingChange]:
    name = f"member `{before.name}` of `{owner.scoped}`"
    if before.name != after.name:
        yield _changed(BreakingRule.MEMBER_RENAMED, f"{name} is now called `{after.name}`", before, after)
    if _differ(before.type, after.type):
        message = f"{name} was {type_name(before.type)} and is {type_name(after.type)}"
        yield _changed(BreakingRule.MEMBER_TYPE_CHANGED, message, before, after)
    if before.tag is None and after.tag is not None:
        yield _changed(BreakingRule.MEMBER_NOW_OPTIONAL, f"{name} is now optional", before, after)
    elif before.tag is not None and after.tag is None:
        yield _changed(BreakingRule.MEMBER_NOW_REQUIRED, f"{name} is no longer optional", before, after)
    if before.default is not None and after.default is None:
        yield _changed(BreakingRule.DEFAULT_REMOVED, f"{name} no longer has a default value", before, after)


_Named = TypeVar("_Named", ast.Member, ast.Parameter)


def _renamed(was: Sequence[_Named], now: Sequence[_Named]) -> dict[str, _Named]:
    """Return by old name what stands at the same place with the same type and a name that is new."""
    if len(was) != len(now):
        return {}
    old_names = {each.name for each in was}
    new_names = {each.name for each in now}
    return {
        before.name: after
        for before, after in zip(was, now, strict=True)
        if before.name not in new_names
        and after.name not in old_names
        and type_name(before.type) == type_name(after.type)
    }


def _enumeration(before: ast.Enumeration, after: ast.Enumeration) -> Iterator[BreakingChange]:
    values = {each.name: each for each in after.enumerators}
    for enumerator in before.enumerators:
        now = values.pop(enumerator.name, None)
        name = f"enumerator `{enumerator.name}` of `{after.scoped}`"
        if now is None:
            yield BreakingChange(
                BreakingRule.ENUMERATOR_REMOVED, f"{name} was removed", after.token, enumerator.token
            )
        elif now.value != enumerator.value:
            message = f"{name} was {enumerator.value} and is {now.value}"
            yield _changed(BreakingRule.ENUMERATOR_VALUE_CHANGED, message, enumerator, now)
    for enumerator in values.values():
        message = f"enumerator `{enumerator.name}` of `{after.scoped}` was added"
        yield BreakingChange(BreakingRule.ENUMERATOR_ADDED, message, enumerator.token)


def _element(
    before: ast.Definition, after: ast.Definition, was: ast.Type, now: ast.Type
) -> Iterator[BreakingChange]:
    if _differ(was, now):
        message = f"{after.kind} `{after.scoped}` was of {type_name(was)} and is of {type_name(now)}"
        yield _changed(BreakingRule.ELEMENT_CHANGED, message, before, after)
