"""Stubs and stand-ins: servants that answer in place of those that nobody serves.

A stub gives the answers of a test; a stand-in accepts every call and returns blank values, or black pictures.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, Final

from zenoh_ice import Object, ObjectPrx
from zenoh_ice.interface import Interface, Operation

from ._black_camera import black_camera
from ._blank import blank
from .errors import UnknownName
from .network import VirtualNetwork


def make_stub(
    identity: str, interface: Interface, answers: Mapping[str, object], below: Object | None = None
) -> tuple[Object, dict[str, Callable[[], Any]]]:
    """Return a servant that answers some operations, and the functions that yield its streams' samples.

    An answer is a function of the operation's arguments, an exception, which is raised, or a value, which is
    returned. Other operations go to the servant `below`. A stream of a stubbed operation yields what the
    operation returns for empty arguments. Raises UnknownName for an unknown operation.
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
        vars(servant)["_ice_publishers"] = vars(below).setdefault("_ice_publishers", {})
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
    empty = blank(operation.arguments.struct)
    return lambda: _answer(answer, empty)


def _answer(answer: object, arguments: tuple[object, ...]) -> object:
    if isinstance(answer, BaseException):
        raise answer
    return answer(*arguments) if callable(answer) else answer


class StandIns:
    """Serves stand-ins, whose streams have a blank sample at any time."""

    def __init__(self, network: VirtualNetwork) -> None:
        self._network: Final = network
        self._returned: Final[set[Interface]] = set()
        """Interfaces that have a stand-in because an operation returns a proxy of it."""

    def serve(self, identity: str, interface: Interface) -> None:
        """Serve a stand-in, in place of any earlier servant with this identity."""
        answers: dict[str, object] = {}
        for name, operation in interface.all_operations.items():
            values = blank(operation.result.struct, self._proxy)
            answers[name] = values[0] if len(values) == 1 else values or None
        answers |= black_camera(identity, interface)
        self._network.serve(identity, *make_stub(identity, interface, answers))

    def _proxy(self, kind: type[ObjectPrx]) -> ObjectPrx:
        """Return a proxy of another stand-in, which is named like its type."""
        interface = kind.ice_interface
        identity = interface.type_id.removeprefix("::").replace("::", ".")
        if interface not in self._returned:
            self._returned.add(interface)  # first: its operations may return proxies of it
            self.serve(identity, interface)
        return kind.uncheckedCast(self._network.communicator.stringToProxy(identity))
