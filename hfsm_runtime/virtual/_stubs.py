"""Stubs and stand-ins: servants that answer in place of those that nobody serves.

A stub gives the answers of a test. A stand-in accepts every call and returns blank values, filled at any
depth, so that code can read them, or black pictures, since code that reads one fails if it is empty.
"""

from __future__ import annotations

import math
import types
from collections.abc import Callable, Mapping
from enum import EnumType
from typing import Annotated, Any, Final, Union, get_args, get_origin

import msgspec

from interfaces import jderobot
from zenoh_ice import Object, ObjectPrx
from zenoh_ice.data.interface import Interface, Operation

from .errors import UnknownName
from .network import VirtualNetwork

MakeProxy = Callable[[type[ObjectPrx]], ObjectPrx | None]
"""Returns a proxy of a type for a blank value, or None."""

_NESTED: Final = 2
"""Objects of one class within each other; what they refer to beyond that is null."""
_WIDTH: Final = 320
_HEIGHT: Final = 240
_BLACK: Final = {
    "RGB8": b"\0\0\0",
    "BGR8": b"\0\0\0",
    "GRAY8": b"\0",
    "YUV422": b"\x10\x80",
}
"""The bytes of a pixel by pixel format; the first is that of the stream."""
_STREAMED: Final = next(iter(_BLACK))


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


def blank(struct: type[msgspec.Struct], proxy: MakeProxy = lambda _: None) -> tuple[object, ...]:
    """Return blank values for the fields of a struct.

    Numbers are zeros, texts and bytes are empty, an enumeration has its first value. Structs, classes and
    optional values are there, with blank members or the defaults that are declared; sequences and
    dictionaries have one blank element. `proxy` makes the proxies.
    """
    make = _Blanks(proxy)
    return tuple(make.value(field.type) for field in msgspec.structs.fields(struct))


class _Blanks:
    """Makes blank values, and keeps track of the classes whose objects are being made."""

    def __init__(self, proxy: MakeProxy) -> None:
        self._proxy: Final = proxy
        self._within: Final[list[type]] = []

    def value(self, kind: Any) -> Any:  # noqa: ANN401 - any type
        """Return the blank value of a type; None for a proxy or an object that is not made."""
        origin, arguments = get_origin(kind), get_args(kind)
        if origin is Annotated:
            return self.value(arguments[0])
        if origin in {Union, types.UnionType}:
            return self.value(next(each for each in arguments if each is not types.NoneType))
        if origin is list:
            element = self.value(arguments[0])
            return [] if element is None else [element]
        if origin is dict:
            key, element = map(self.value, arguments)
            return {} if element is None else {key: element}
        if isinstance(kind, EnumType):
            return next(iter(kind))
        if issubclass(kind, ObjectPrx):
            return self._proxy(kind)
        return self._struct(kind) if issubclass(kind, msgspec.Struct) else kind()

    def _struct(self, kind: type[msgspec.Struct]) -> msgspec.Struct | None:
        if self._within.count(kind) == _NESTED:
            return None
        self._within.append(kind)
        fields = msgspec.structs.fields(kind)
        made = kind(**{field.name: self._member(field) for field in fields})
        self._within.pop()
        return made

    def _member(self, field: msgspec.structs.FieldInfo) -> object:
        declared = field.default
        return declared if isinstance(declared, int | float | str | bytes) else self.value(field.type)


def gives_pictures(interface: Interface) -> bool:
    """Return whether an interface is that of a camera, or extends it."""
    return jderobot.ImageProviderPrx.ice_interface in interface.lineage


def black_camera(identity: str, interface: Interface) -> dict[str, Any]:
    """Return what a camera that sees nothing answers, by operation; nothing for what is no camera."""
    if not gives_pictures(interface):
        return {}

    def picture(format: str) -> jderobot.ImageData:
        pixel = _BLACK.get(format or _STREAMED)
        if pixel is None:
            known = ", ".join(_BLACK)
            message = f"{identity} is a stand-in, which has no format {format[:64]!r}; it has {known}"
            raise jderobot.ConfigurationNotExistException(message)
        pixels = pixel * (_WIDTH * _HEIGHT)
        return jderobot.ImageData(description=_shape(format or _STREAMED), pixelData=pixels)

    answers: dict[str, Any] = {
        "getImageDescription": _shape(_STREAMED),
        "getImageFormat": [*_BLACK],
        "getImageData": picture,
    }
    if jderobot.CameraPrx.ice_interface in interface.lineage:
        nowhere = jderobot.FloorPoint(x=math.inf, y=math.inf, distance=math.inf, pan=0.0, tilt=0.0)
        answers |= {"getCameraDescription": _description(identity), "getFloorPoint": nowhere}
    return answers


def _shape(format: str) -> jderobot.ImageDescription:
    size = len(_BLACK[format]) * _WIDTH * _HEIGHT
    return jderobot.ImageDescription(width=_WIDTH, height=_HEIGHT, size=size, format=format)


def _description(identity: str) -> jderobot.CameraDescription:
    return jderobot.CameraDescription(
        name=identity,
        shortDescription="a stand-in, whose pictures are black",
        width=_WIDTH,
        height=_HEIGHT,
        rate=10.0,
        fdistx=_WIDTH,
        fdisty=_WIDTH,
        u0=(_WIDTH - 1) / 2,
        v0=(_HEIGHT - 1) / 2,
    )
