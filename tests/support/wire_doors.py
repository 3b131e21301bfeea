"""The entry points for bytes from other processes, with valid examples, for tests with hostile input."""

from __future__ import annotations

import json
import math
import os
import tempfile
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import cache, partial
from pathlib import Path
from typing import Any, Final

import msgpack
import msgspec
import zenoh

import interfaces
from interfaces.jderobot import CameraPrx
from interfaces.nao import JointsPrx, PoseHeadPrx
from nao_tools import NaoError
from nao_tools._dynamic import Types
from nao_tools._values import FromJson, to_json
from tests.support.wire_values import pack
from zenoh_ice import (
    ConfigurationException,
    MarshalException,
    ObjectPrx,
    Settings,
    UserException,
    ZenohIceError,
)
from zenoh_ice.application.cli import describe
from zenoh_ice.carriers._local.memory import Arena, ArenaView, Extent
from zenoh_ice.carriers._local.messages import (
    HELLO,
    LARGEST_INLINE,
    PART,
    REQUEST,
    RESPONSE,
    RETURN,
    SAMPLE,
    SUBSCRIBE,
    SUBSCRIBED,
    VERSION,
    Part,
    Parts,
    Request,
    Response,
    Return,
    Sample,
    Subscribe,
    Subscribed,
    collect,
    decode_hello,
    decode_to_client,
    decode_to_server,
    encode,
)
from zenoh_ice.carriers.zenoh.session import session_config
from zenoh_ice.data.codec import DECODE_ERRORS, LARGE, Codec
from zenoh_ice.data.keys import Target, client_token, parse_client_token, servant_token
from zenoh_ice.data.reflection import first_difference, parse_schema, schema_of
from zenoh_ice.data.status import ProcessStatus, ServantStatus, decode_status
from zenoh_ice.data.text import LONGEST_TEXT
from zenoh_ice.data.wire import (
    Attachment,
    decode_attachment,
    decode_error,
    encode_error,
    encode_sample_attachment,
)
from zenoh_ice.generated import Int, Long, Struct, Value
from zenoh_ice.objects._presence import Presence
from zenoh_ice.routes.in_process import InProcessTransport
from zenoh_ice.settings import load_settings
from zenoh_ice.threads.clock import RobotClock
from zenoh_ice.threads.pool import Pool

from .attachments import encode_call_attachment
from .calculator import CALCULATOR, CalculatorError, DivisionByZero
from .generated_types import structs_of
from .wire_values import Desk

__all__ = ["DOORS", "Door", "check_error", "find_door"]

_LONGEST_ERROR = 2 * LONGEST_TEXT


class Animal(Value, tag="::menagerie::Animal"):
    name: str
    friend: Animal | None


class Dog(Animal, tag="::menagerie::Dog", kw_only=True):
    tricks: Int | None = None
    legs: Int = 4


class Place(Struct):
    row: Long
    name: str


class Menagerie(Struct):
    star: Animal | None
    keeper: ObjectPrx | None
    cages: dict[Place, list[Animal | None]]
    weights: dict[Long, float]
    photo: bytes
    notes: list[list[str]]


class Introduction(Struct):
    proxy: ObjectPrx


class NoRoomError(UserException, id="::menagerie::NoRoomError"):
    animal: Animal | None
    place: Place


@dataclass(frozen=True)
class Door:
    """An entry point for bytes from other processes."""

    sound: Sequence[bytes]
    """Inputs that it accepts."""
    take: Callable[[bytes], bool]
    """Accept or refuse some bytes; return which. Raises AssertionError for any other behavior."""


def check_error(error: Exception) -> None:
    """Raise AssertionError for an error that is empty, too long, or has control characters for a terminal."""
    assert not isinstance(error, UserException), error
    assert 0 < len(str(error)) <= _LONGEST_ERROR
    assert str(error).isprintable(), str(error)


def _refusable(take: Callable[[bytes], object]) -> Callable[[bytes], bool]:
    def taken(data: bytes) -> bool:
        try:
            take(data)
        except (MarshalException, ConfigurationException, NaoError) as error:
            check_error(error)
            return False
        return True

    return taken


# Payloads.

_DESK: Any = Desk()


def _payload() -> Door:
    codec = Codec(Menagerie)

    def take(data: bytes) -> None:
        value = codec.unpack(data, "it", _DESK.stringToProxy)
        assert type(value) is Menagerie
        again = pack(codec, msgspec.structs.astuple(value), "it")
        assert (
            pack(codec, msgspec.structs.astuple(codec.unpack(again, "it", _DESK.stringToProxy)), "it")
            == again
        )

    dog = Dog("Rex", Animal("Tom", None), tricks=3)
    values = (
        dog,
        _DESK.stringToProxy("Head"),
        {Place(1, "x"): [dog, None], Place(-2, "y"): []},
        {1: 1.5, -(1 << 60): math.nan},
        b"\x00\xff",
        [["a", "ñ"], []],
    )
    return Door([pack(codec, values, "it")], _refusable(take))


def _payloads_of_interfaces() -> Door:
    structs = structs_of(interfaces)[::4]
    for operation in CALCULATOR.operations:
        structs += [operation.arguments.struct, operation.result.struct]
    doors = [
        _refusable(partial(Codec(struct).unpack, what="it", resolve=_DESK.stringToProxy))
        for struct in structs
    ]

    def take(data: bytes) -> bool:
        taken = [door(data) for door in doors]
        return any(taken)

    sound = [msgpack.packb({"returnValue": {"time": 1.5, "count": 1, "values": [0.5]}, "a": 1, "b": 2.0})]
    return Door(sound, take)


def _attachments() -> Door:
    def take(data: bytes) -> None:
        about = decode_attachment(data)
        assert isinstance(about, Attachment)
        assert len(about.client) <= 128

    sound = [
        encode_call_attachment("c0ffee", 7, "abc", 2.0),
        encode_sample_attachment("c0ffee", 7, 12.5),
    ]
    return Door(sound, _refusable(take))


def _errors() -> Door:
    def take(data: bytes) -> bool:
        error = decode_error(data, (CalculatorError, NoRoomError), "it", _DESK.stringToProxy)
        if not isinstance(error, UserException):
            check_error(error)
        return True

    raised: list[ZenohIceError] = [
        DivisionByZero("why", 2.0),
        NoRoomError(Dog("Rex", None), Place(1, "x")),
        MarshalException("bad", "$.a"),
    ]
    return Door([encode_error(error) for error in raised], take)


# Messages between processes of one machine.


def _requests() -> Door:
    def take(data: bytes) -> bool:
        parts = Parts()
        try:
            message = decode_to_server(data)
            if isinstance(message, Part):
                parts.append(message.payload)
        except (*DECODE_ERRORS, MarshalException):  # which end the connection
            return False
        assert isinstance(message, Request | Part | Return | Subscribe)
        assert not isinstance(message, Return) or 0 <= message.start < 1 << 62
        return True

    sound = [
        (REQUEST, "nao/Head", "getPose", b"", b"payload"),
        (PART, bytes(LARGEST_INLINE)),
        (RETURN, 0),
        (SUBSCRIBE, "nao/Camera", "getImageData"),
    ]
    return Door([encode(message) for message in sound], take)


def _answers() -> Door:
    arena = Arena()
    view = ArenaView(os.dup(arena.file))
    arena.lend([b"a" * LARGE, b"b" * LARGE], [arena])

    def take(data: bytes) -> bool:
        try:
            message = decode_to_client(data)
        except DECODE_ERRORS:  # which end the connection
            return False
        assert isinstance(message, Response | Part | Subscribed | Sample)
        if not isinstance(message, Response | Sample):
            return True
        try:
            collected = collect(message, view, 3 * LARGE, "it")
        except MarshalException as error:
            check_error(error)
            return False
        size = len(collected) if isinstance(collected, bytes) else sum(map(len, collected.large))
        assert size <= 3 * LARGE
        return True

    sound = [
        (RESPONSE, True, b"payload"),
        (RESPONSE, False, b"", (), Extent(0, (LARGE,))),
        (RESPONSE, True, b"rest", (0, 2), Extent(0, (LARGE, LARGE))),
        (PART, bytes(LARGEST_INLINE)),
        (SUBSCRIBED,),
        (SAMPLE, b"about", b"rest", (1,), Extent(LARGE, (LARGE,))),
    ]
    return Door([encode(message) for message in sound], take)


def _greetings() -> Door:
    def take(data: bytes) -> bool:
        try:
            hello = decode_hello(data)
        except DECODE_ERRORS:
            return False
        assert len(hello.server) <= 64
        return True

    return Door([encode((HELLO, VERSION, "c0ffee"))], take)


# Information about other processes.


def _tokens() -> Door:
    def take(data: bytes) -> bool:
        transport = InProcessTransport(Pool(0, "test"))
        presence = Presence(transport, lambda _: None, is_served=lambda *_: False, needs_links=True)
        presence.watch("nao")
        key = data.decode("utf-8", "replace")
        for _ in range(2):
            announced = transport.announce(key)
            check_error(presence.explain_absence(Target("nao", "Hand")))
        taken = len(presence.servants("nao"))
        announced.close()
        assert not presence.servants("nao")
        assert not presence.identities("nao")
        return taken == 1

    head = Target("nao", "Head")
    ball = Target("nao", "soccer.Ball")
    sound = [
        servant_token(head, "::nao::PoseHead", "c0ffee", "abc", 1.7e9),
        servant_token(ball, "::Ice::Object", "", "abc", 1.7e9),
        servant_token(ball, "::Ice::Object", "", "abc", 1.7e9, address="0123456789abcdef.1.3"),
    ]
    return Door([key.encode() for key in sound], take)


def _client_tokens() -> Door:
    def take(data: bytes) -> bool:
        client = parse_client_token(data.decode("utf-8", "replace"))
        assert not client or client.isalnum()
        return bool(client)

    return Door([client_token("nao", "c0ffee").encode()], take)


class _Clockwork(Struct):
    time: float
    rate: float
    simulated: bool


def _clock_readings() -> Door:
    codec = Codec(_Clockwork)

    def take(data: bytes) -> None:
        reading = codec.unpack(data, "it")
        clock = RobotClock(1.0, 1.0, simulated=True)
        clock.update(reading.time, reading.rate, reading.simulated)
        clock.update(2.0, 1.0, simulated=True)
        assert 0.0 <= clock.now() <= 2e11
        clock.close()

    return Door([pack(codec, (1.5, 1.0, True), "it"), pack(codec, (0.0, 0.0, False), "it")], _refusable(take))


# Texts.


def _proxies() -> Door:
    codec = Codec(Introduction)

    def take(data: bytes) -> None:
        text = data.decode("utf-8", "replace")
        proxy = codec.unpack(msgspec.msgpack.encode({"proxy": text}), "it", _DESK.stringToProxy).proxy
        assert zenoh.KeyExpr(proxy._target.key("operation"))
        assert proxy.ice_toString().isprintable()

    sound = [b"Head", b"Head@nao", b"soccer.Ball@nao"]
    return Door(sound, _refusable(take))


_ANIMAL, _PLACE, _KEEPER = "::menagerie::Animal", "::menagerie::Place", "::menagerie::Keeper"


def _named(**types: str) -> list[dict[str, Any]]:
    return [{"name": name, "type": kind} for name, kind in types.items()]


_CIRCUS: dict[str, dict[str, Any]] = {
    _ANIMAL: {"kind": "class", "members": _named(friend=_ANIMAL, name="string")},
    "::menagerie::Dog": {
        "kind": "class",
        "bases": [_ANIMAL],
        "members": [{"name": "legs", "type": "int", "optional": True}],
    },
    "::menagerie::Color": {
        "kind": "enumeration",
        "enumerators": [{"name": "green", "value": 3}, {"name": "red", "value": 0}],
    },
    "::menagerie::Colors": {"kind": "sequence", "element": "::menagerie::Color"},
    "::menagerie::Places": {"kind": "dictionary", "key": _PLACE, "value": "::menagerie::Colors"},
    "::menagerie::Bytes": {"kind": "sequence", "element": "byte"},
    _PLACE: {"kind": "struct", "members": _named(row="long")},
    "::menagerie::Full": {"kind": "exception", "members": _named(animal=_ANIMAL, place=_PLACE)},
    _KEEPER: {
        "kind": "interface",
        "operations": [
            {
                "name": "feed",
                "parameters": _named(star=_ANIMAL, where="::menagerie::Places"),
                "results": _named(returnValue="::menagerie::Bytes", next=f"{_KEEPER}*"),
                "exceptions": {"::menagerie::Full": ""},
                "idempotent": True,
                "streamed": True,
            }
        ],
    },
}
_ZOO: Final = {
    "interface": _KEEPER,
    "definitions": {
        name: {"module": "menagerie", "name": name, "fingerprint": "c0ffee", **entry}
        for name, entry in _CIRCUS.items()
    },
}


def _schemas() -> Door:
    def take(data: bytes) -> None:
        schema = parse_schema(data.decode("utf-8", "replace"))
        assert first_difference(schema, schema) == "they are described alike"
        types = Types(schema)
        for _, description in schema.operations():
            operation = types.operation(description)
            values = FromJson(schema, types, _DESK.stringToProxy)
            zeros = tuple(
                None if each.optional else values.zero(each.type) for each in description.parameters
            )
            payload = pack(operation.arguments, zeros, "it")
            json.dumps(to_json(operation.arguments.unpack(payload, "it", _DESK.stringToProxy)))
            for exception in operation.exceptions:
                members = {
                    each.name: None if each.optional else values.zero(each.type)
                    for each in schema.members(exception.ice_type_id)
                }
                wire = msgspec.msgpack.encode({"exception": exception.ice_type_id, "members": members})
                assert isinstance(
                    decode_error(wire, operation.exceptions, "it", _DESK.stringToProxy), ZenohIceError
                )

    sound = [schema_of(each.ice_interface).as_json() for each in (PoseHeadPrx, CameraPrx, JointsPrx)]
    return Door([text.encode() for text in (json.dumps(_ZOO), *sound)], _refusable(take))


def _statuses() -> Door:
    def take(data: bytes) -> None:
        status = decode_status(data, "abc")
        assert isinstance(status, ProcessStatus)
        assert all(servant.waiting >= 0 for servant in status.servants.values())

    servant = ServantStatus("::nao::PoseHead", 7, 1, 1, 0, 2, ("getPose",))
    status = ProcessStatus("nao", 1, "host", "3.11", "1.10", "0.1", 1.7e9, {"Head@nao": servant}, True)
    return Door([msgspec.msgpack.encode(status)], _refusable(take))


def _settings() -> Door:
    directory = tempfile.TemporaryDirectory()
    path = Path(directory.name) / "robot.toml"

    def take(data: bytes) -> None:
        assert directory  # it lives as long as the door
        path.write_bytes(data)
        settings = load_settings(path, environment={})
        assert isinstance(settings, Settings)
        assert describe(settings).replace("\n", "").isprintable()
        with suppress(zenoh.ZError):  # as opening a session reports
            zenoh.Config.from_json5(json.dumps(session_config(settings)))

    sound = [
        b"realm = 'nao'\nconnect = ['tcp/127.0.0.1:7447', 'unixsock-stream/nao.sock']\ntimeout = 2.5\n",
        b'local_sockets = true\ndispatch_threads = 0x10\nclock = "auto"\nmode = "client"\n',
        (
            b'[security]\nmutual = false\nuser = "a"\npassword = "b"\n[security.roles.student]\n'
            b'call = ["Camera*.get*", "Left*Motors.get*"]\nread = ["**"]\nserve = ["Hfsm.*"]\n'
            b'[security.users]\n"*" = "student"\n'
        ),
    ]
    return Door(sound, _refusable(take))


_MAKERS: Final[dict[str, Callable[[], Door]]] = {
    "payload": _payload,
    "any payload": _payloads_of_interfaces,
    "attachment": _attachments,
    "error": _errors,
    "request": _requests,
    "answer": _answers,
    "greeting": _greetings,
    "token": _tokens,
    "client token": _client_tokens,
    "clock": _clock_readings,
    "proxy": _proxies,
    "schema": _schemas,
    "process status": _statuses,
    "settings": _settings,
}
DOORS: Final = tuple(_MAKERS)
"""The names of all doors."""


@cache
def find_door(name: str) -> Door:
    """Return an entry point; it is made here, because that takes long and all workers import this module."""
    return _MAKERS[name]()
