"""Tell in what two versions of an interface differ: the first member, and which side has what."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Final

from ..exceptions import InterfaceMismatchException, ZenohIceError
from ..operation import Interface
from ..wire.text import printable

if TYPE_CHECKING:
    from ..proxy import ObjectPrx

__all__ = ["describe_difference", "first_difference", "with_difference"]

# What a line of a definition is about: `::m::Light::power: float`, `::m::Lamp::get(string which): ...`,
# `::m::Color::red = 0`, `interface ::m::Lamp extends ::m::Switch`.
_SUBJECT: Final = re.compile(r"(?:interface|class|exception|enum|struct|const) [^ ]+|[\w:]+?(?=:? |\(|$)")
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
        descriptions = proxy.ice_describe()
    except ZenohIceError as error:
        return f"the servant could not be asked for its definition ({error})"
    found = next((known for known in descriptions if known.typeId == wanted.type_id), None)
    if found is None:
        return f"the servant has no {wanted.type_id}"
    return printable(first_difference(wanted.definition, found.definition), _LONGEST_DIFFERENCE)


def first_difference(expected: str, found: str) -> str:
    """Return the first member in which two definitions differ, as the two sides have it."""
    ours, theirs = _by_subject(expected), _by_subject(found)
    for subject in sorted({*ours, *theirs}):
        own, other = ours.get(subject), theirs.get(subject)
        if own is None:
            return f"the proxy lacks `{other}`"
        if other is None:
            return f"the servant lacks `{own}`"
        if own != other:
            return f"the proxy has `{own}` where the servant has `{other}`"
    return "the same members stand in another order"


def _by_subject(definition: str) -> dict[str, str]:
    lines = [line.strip() for line in definition.splitlines()]
    return {match[0] if (match := _SUBJECT.match(line)) else line: line for line in lines}
