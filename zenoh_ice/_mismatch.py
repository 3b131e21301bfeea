"""Explain in what two versions of an interface differ: the first member, and which side has what."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Final

from .exceptions import InterfaceMismatchException, ZenohIceError
from .operation import Interface
from .reflection import RETURN_VALUE, Definition, Member, OperationDescription, Schema, schema_of
from .text import printable

if TYPE_CHECKING:
    from .proxy import ObjectPrx

__all__ = ["canonical_lines", "describe_difference", "first_difference", "with_difference"]

_LONGEST_DIFFERENCE: Final = 1024  # characters; one side of it is what the other process says


def with_difference(
    error: InterfaceMismatchException, proxy: ObjectPrx, wanted: Interface
) -> InterfaceMismatchException:
    """Return what a servant refused a call with, with the member that differs if it can be found out."""
    difference = describe_difference(proxy, wanted)
    return InterfaceMismatchException(f"{error}; {difference}", error.expected, error.found, difference)


def describe_difference(proxy: ObjectPrx, wanted: Interface) -> str:
    """Return in what an interface differs from the one that the servant of a proxy has; asks the servant."""
    try:
        found = proxy.ice_describe()
    except ZenohIceError as error:
        return f"the servant could not be asked for its definition ({error})"
    if wanted.type_id not in found.lineage(found.interface):
        return printable(f"the servant has no {wanted.type_id}")
    try:
        expected = schema_of(wanted)
    except ZenohIceError as error:
        return f"the difference is not known ({error})"
    return printable(first_difference(expected, found.part(wanted.type_id)), _LONGEST_DIFFERENCE)


def first_difference(expected: Schema, found: Schema) -> str:
    """Return the first member in which two schemas differ, as the two sides have it."""
    ours, theirs = canonical_lines(expected), canonical_lines(found)
    for subject in sorted({*ours, *theirs}):
        own, other = ours.get(subject), theirs.get(subject)
        if own is None:
            return f"the proxy lacks `{other}`"
        if other is None:
            return f"the servant lacks `{own}`"
        if own != other:
            return f"the proxy has `{own}` where the servant has `{other}`"
    return "they are described alike"


def canonical_lines(schema: Schema) -> dict[str, str]:
    """Return the canonical form of a schema, of which codegen takes the fingerprint, line by line.

    Each line comes by what it is about, such as the scoped name of a member.
    """
    return {
        subject: subject + rest
        for type_id, definition in schema.definitions.items()
        for subject, rest in _lines(schema, type_id, definition)
    }


def _lines(schema: Schema, type_id: str, definition: Definition) -> Iterator[tuple[str, str]]:
    match definition.kind:
        case "interface" | "struct" | "class" | "exception":
            bases = ", ".join(sorted(definition.bases))
            yield f"{definition.kind} {type_id}", f" extends {bases}" if bases else ""
        case "enumeration":
            yield f"enum {type_id}", ""
        case _:  # what uses them says what they are made of
            return
    for member in definition.members:
        yield f"{type_id}::{member.name}", f": {_type(schema, member)}"
    for enumerator in definition.enumerators:
        yield f"{type_id}::{enumerator.name}", f" = {enumerator.value}"
    for operation in definition.operations:
        yield f"{type_id}::{operation.name}", _signature(schema, operation)


def _signature(schema: Schema, operation: OperationDescription) -> str:
    parameters = ", ".join(f"{_type(schema, each)} {each.name}" for each in operation.parameters)
    results = [
        _type(schema, each) + ("" if each.name == RETURN_VALUE else f" {each.name}")
        for each in operation.results
    ]
    text = f"({parameters}): {', '.join(results) or 'void'}"
    if operation.exceptions:
        text += f" throws {', '.join(sorted(operation.exceptions))}"
    return text + " idempotent" * operation.idempotent + " stream" * operation.streamed


def _type(schema: Schema, member: Member) -> str:
    return schema.type_text(member.type, optional=member.optional)
