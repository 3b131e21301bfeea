"""Make messages of results and exceptions of operations: exact for replay, and readable."""

from __future__ import annotations

import hashlib
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial
from typing import Any, Final

import msgspec

from hfsm_runtime.recording_file.messages import Image, Message, Missing, Result, Stamp
from zenoh_ice import MarshalException, ObjectPrx, ZenohIceError
from zenoh_ice.data import typed
from zenoh_ice.data.codec import Parted
from zenoh_ice.data.interface import Operation
from zenoh_ice.data.wire import encode_error

from .recorder import Recorder, describe_error
from .values import readable

_LONGEST_WITHIN: Final = 1024
"""Byte sequences longer than this are kept apart from the values that contain them."""
_LARGEST_RESULT: Final = 256 * 1024
_MOST_REMEMBERED: Final = 64
_MALFORMED: Final = (ValueError, TypeError, RecursionError, OverflowError, MemoryError)

Bulk = list[tuple[Missing, bytes]]
Resolve = Callable[[str], ObjectPrx]


@dataclass(slots=True)
class Exchange:
    """Arguments and result of an operation, as encoded, or the exception that it raised."""

    operation: Operation[..., Any]
    kind: str
    arguments: bytes | None = None
    packed: bytes | Parted | None = None
    error: BaseException | None = None
    extra: dict[str, Any] = field(default_factory=dict)


class Results:
    """Record the exchanges with one servant, under the name of the component's attribute.

    Images and other long byte sequences are written only if the recorder records images; otherwise only their
    size and hash are, so that a replay can report what is missing.
    """

    def __init__(self, recorder: Recorder, attribute: str, resolve: Resolve) -> None:
        self._recorder = recorder
        self._attribute = attribute
        self._resolve = resolve
        self._written: deque[str] = deque(maxlen=_MOST_REMEMBERED)

    def put(self, exchange: Exchange, context: str) -> None:
        """Record an exchange."""
        topic = f"/proxy/{self._attribute}/{exchange.operation.name}"
        payload, exchange.packed = exchange.packed, None
        packed, bulk = (None, []) if payload is None else take_bulk(exchange.operation, payload)
        if packed is not None and self._recorder.takes_images():
            for missing, data in bulk:
                if missing.hash not in self._written:
                    self._written.append(missing.hash)
                    image = partial(_image, packed, data, missing.hash, self._attribute, self._recorder.now())
                    self._recorder.put(f"/images/{self._attribute}", image, 400 + len(data))
        elif bulk:
            self._recorder.images_left_out(self._attribute)
        found = [missing for missing, _ in bulk]
        message = partial(_message, exchange, context, packed, found, self._resolve)
        size = 400 + len(packed or b"") + len(exchange.arguments or b"")
        self._recorder.put(topic, message, size)


def arguments_of(payload: bytes) -> Any:  # noqa: ANN401 - JSON
    """Return the arguments of a call in readable form."""
    return readable(list(typed.from_msgpack(payload).values()))


def digest(data: bytes) -> str:
    """Return the hash by which a recording identifies bytes."""
    return hashlib.blake2b(data, digest_size=12).hexdigest()


def take_bulk(operation: Operation[..., Any], payload: bytes | Parted) -> tuple[bytes, Bulk]:
    """Split a result into a value without long byte sequences, and these sequences."""
    found: Bulk = []
    if isinstance(payload, Parted):
        paths = operation.result.byte_sequences
        for place, data in zip(payload.places, payload.large, strict=True):
            if 0 <= place < len(paths):  # otherwise decoding it fails
                found.append((Missing(list(paths[place]), len(data), digest(data)), data))
        payload = payload.rest
    if len(payload) <= _LONGEST_WITHIN:
        return payload, found
    try:
        plain = _take_bytes(typed.from_msgpack(payload), [], found)
    except _MALFORMED:  # decoding it fails, too
        return payload, found
    return msgspec.msgpack.encode(plain), found


def _take_bytes(value: Any, path: list[str | int], found: Bulk) -> Any:  # noqa: ANN401
    if isinstance(value, bytes) and len(value) > _LONGEST_WITHIN:
        found.append((Missing(path, len(value), digest(value)), value))
        return b""
    if isinstance(value, dict):
        return {key: _take_bytes(item, [*path, key], found) for key, item in value.items()}
    if isinstance(value, list):
        return [_take_bytes(item, [*path, index], found) for index, item in enumerate(value)]
    return value


def put_bytes(value: Any, missing: Missing, data: bytes | str) -> None:  # noqa: ANN401
    """Put bytes back into plain data from which they were taken; raises LookupError or TypeError."""
    *way, last = missing.path
    for step in way:
        value = value[step]
    value[last] = data


def _message(
    exchange: Exchange, context: str, packed: bytes | None, missing: list[Missing], resolve: Resolve
) -> Message:
    operation, error = exchange.operation, exchange.error
    too_large = 0
    shown: Any = None
    if packed is not None:
        try:
            operation.result.unpack(packed, operation.name, resolve)
            plain = typed.from_msgpack(packed)
            for each in missing:
                put_bytes(plain, each, f"<{each.size} bytes>")
            shown = readable(plain.get("returnValue") if list(plain) == ["returnValue"] else plain or None)
        except (MarshalException, *_MALFORMED) as misfit:
            error = misfit
    if packed is not None and len(packed) > _LARGEST_RESULT:
        too_large = len(packed)
        packed = None
    return Result(
        context,
        exchange.kind,
        operation.name,
        None if exchange.arguments is None else arguments_of(exchange.arguments),
        shown,
        packed,
        "" if error is None else describe_error(error),
        encode_error(error) if isinstance(error, ZenohIceError) else None,
        missing,
        too_large,
        **exchange.extra,
    )


def _image(packed: bytes, data: bytes, hash: str, attribute: str, time: int) -> Message:
    plain = typed.from_msgpack(packed)
    width, height, encoding, step = len(data), 1, "8UC1", len(data)
    value = plain.get("returnValue") if isinstance(plain, dict) else None
    description = value.get("description") if isinstance(value, dict) else None
    if isinstance(description, dict):
        columns, rows = description.get("width"), description.get("height")
        if isinstance(columns, int) and isinstance(rows, int) and columns > 0 < rows:
            depth, rest = divmod(len(data), columns * rows)
            if rest == 0 and depth in (1, 3):
                width, height, step = columns, rows, columns * depth
                plain_encoding = "rgb8" if depth == 3 else "8UC1"
                encodings = {"RGB8": "rgb8", "BGR8": "bgr8"}
                encoding = encodings.get(str(description.get("format", "")), plain_encoding)
    return Image(Stamp.of(time), attribute, width, height, encoding, step, data, hash)
