"""Servants made by hand, operation by operation, for interfaces that no robot of a test serves."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, Final

import msgspec

from zenoh_ice import Object
from zenoh_ice.interface import Interface, Operation

from .errors import UnknownName

__all__ = ["make_stub"]

_ZEROS: Final[dict[object, object]] = {str: "", int: 0, float: 0.0, bool: False, bytes: b""}


def make_stub(
    identity: str, interface: Interface, answers: Mapping[str, object], below: Object | None = None
) -> tuple[Object, dict[str, Callable[[], Any]]]:
    """Return a servant that answers some operations, and what its streams yield by operation.

    An answer is a function of the operation's arguments, an exception, which is raised, or a value, which is
    returned. Other operations go to the servant `below`. A stream of a stubbed operation yields what the
    operation returns for arguments that are empty. Raises UnknownName for what is no operation.
    """
    operations = interface.all_operations
    for name in answers:
        if name not in operations:
            raise UnknownName(f"{identity} has no operation {name!r}; it has {', '.join(operations)}")
    methods: dict[str, Any] = {
        operation.method: _answering(answers[name])
        if name in answers
        else _passing_on(f"{identity}.{name}", operation, below)
        for name, operation in operations.items()
    }
    servant: Object = type("Stub", (Object,), {"ice_interface": interface, **methods})()
    if below is not None:
        vars(servant)["_ice_publishers"] = below.ice_publishers()  # its streams go on
    polls = {name: _poll(answers[name], operations[name]) for name in answers if operations[name].streamed}
    return servant, polls


def _answering(answer: object) -> Callable[..., object]:
    def call(self: Object, *arguments: object) -> object:  # noqa: ARG001
        return _answer(answer, arguments[:-1])  # the last is the Current

    return call


def _passing_on(what: str, operation: Operation[..., Any], below: Object | None) -> Callable[..., object]:
    def call(self: Object, *arguments: object) -> object:  # noqa: ARG001
        if below is None:
            raise NotImplementedError(f"{what} is not stubbed")
        return getattr(below, operation.method)(*arguments)

    return call


def _poll(answer: object, operation: Operation[..., Any]) -> Callable[[], object]:
    fields = msgspec.structs.fields(operation.arguments.struct)
    empty = tuple(_ZEROS.get(_plain(field.type)) for field in fields)
    return lambda: _answer(answer, empty)


def _plain(annotation: object) -> object:
    return getattr(annotation, "__origin__", annotation)  # Int is an annotated int


def _answer(answer: object, arguments: tuple[object, ...]) -> object:
    if isinstance(answer, BaseException):
        raise answer
    return answer(*arguments) if callable(answer) else answer
