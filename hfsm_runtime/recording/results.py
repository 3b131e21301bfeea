"""Make messages of what operations return and raise: exact for replay, and readable for people."""

from __future__ import annotations

import hashlib
from collections import OrderedDict
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, Final, TypeVar

import msgspec

from hfsm_recording.messages import Image, Message, Missing, Result, Stamp
from zenoh_ice import Sample, ZenohIceError
from zenoh_ice.interface import Operation
from zenoh_ice.transport import encode_error

from .recorder import Recorder, describe_error
from .values import readable

__all__ = ["AgedSample", "Outcome", "Results", "digest", "put_bytes", "take_bytes"]

V = TypeVar("V")

_BULK: Final = 1024
"""Bytes sequences of more bytes than this are kept apart from the values that hold them."""
_LARGEST: Final = 256 * 1024
_REMEMBERED: Final = 64


@dataclass(slots=True)
class Outcome:
    """What an operation brought: a value, or an exception. Packed at once, since user code may change it."""

    operation: Operation[..., Any]
    kind: str
    arguments: tuple[object, ...] | None = None
    packed: bytes | None = None
    error: BaseException | None = None
    extra: dict[str, Any] = field(default_factory=dict)

    def take(self, value: object) -> Outcome:
        """Take the value."""
        self.packed = self.operation.result.pack_result(value, self.operation.name)
        return self


class AgedSample(Sample[V]):
    """A sample whose age is recorded each time it is asked for."""

    __slots__ = ("_recorder", "genuine")

    def __init__(self, sample: Sample[V], recorder: Recorder) -> None:
        super().__init__(
            sample.value, sample.sequence, sample.time, sample.wall_time, sample.lost, stream=sample.stream
        )
        self._recorder = recorder
        self.genuine = sample

    @property
    def age(self) -> float:
        """Wall seconds since it was sent."""
        value = super().age
        self._recorder.reading("age", value)
        return value


class Results:
    """Record the outcomes of the operations of one proxy.

    Images, and whatever else is many bytes, are written only where the recorder is to; otherwise their size
    and hash are, so that a replay can say what is missing.
    """

    def __init__(self, recorder: Recorder, attribute: str) -> None:
        self._recorder = recorder
        self._attribute = attribute
        self.newest: dict[str, AgedSample[Any]] = {}
        """The sample that was recorded last, by operation."""
        self._written: OrderedDict[str, None] = OrderedDict()

    def put(self, outcome: Outcome, context: str) -> None:
        """Record an outcome."""
        topic = f"/proxy/{self._attribute}/{outcome.operation.name}"
        size = 400 + len(outcome.packed or b"")
        if outcome.packed is None or len(outcome.packed) <= _BULK:
            self._recorder.put(topic, lambda: _message(outcome, context, outcome.packed, []), size)
            return
        plain = msgspec.msgpack.decode(outcome.packed)
        bulk: list[tuple[Missing, bytes]] = []
        packed = msgspec.msgpack.encode(take_bytes(plain, [], bulk))
        outcome.packed = None
        if self._recorder.with_images and not self._recorder.writer.crowded:
            for missing, data in bulk:
                if missing.hash not in self._written:
                    self._remember(missing.hash)
                    image = _image(plain, data, missing.hash, self._attribute, self._recorder.now())
                    self._recorder.put(f"/images/{self._attribute}", image, 400 + len(data))
        found = [missing for missing, _ in bulk]
        self._recorder.put(topic, lambda: _message(outcome, context, packed, found), 400 + len(packed))

    def _remember(self, hash: str) -> None:
        self._written[hash] = None
        if len(self._written) > _REMEMBERED:
            self._written.popitem(last=False)


def digest(data: bytes) -> str:
    """Return the hash of bytes by which a recording knows them."""
    return hashlib.blake2b(data, digest_size=12).hexdigest()


def take_bytes(value: Any, path: list[str | int], found: list[tuple[Missing, bytes]]) -> Any:  # noqa: ANN401
    """Return plain data without the long bytes sequences in it, which come to `found` with their paths."""
    if isinstance(value, bytes) and len(value) > _BULK:
        found.append((Missing(path, len(value), digest(value)), value))
        return b""
    if isinstance(value, dict):
        return {key: take_bytes(item, [*path, key], found) for key, item in value.items()}
    if isinstance(value, list):
        return [take_bytes(item, [*path, index], found) for index, item in enumerate(value)]
    return value


def put_bytes(value: Any, missing: Missing, data: bytes | str) -> None:  # noqa: ANN401
    """Put bytes back into plain data from which `take_bytes` took them; raises LookupError or TypeError."""
    *way, last = missing.path
    for step in way:
        value = value[step]
    value[last] = data


def _message(outcome: Outcome, context: str, packed: bytes | None, missing: list[Missing]) -> Message:
    operation, error = outcome.operation, outcome.error
    too_large = 0
    shown: Any = None
    if packed is not None:
        plain = msgspec.msgpack.decode(packed)
        for each in missing:
            put_bytes(plain, each, f"<{each.size} bytes>")
        shown = readable(plain.get("returnValue") if list(plain) == ["returnValue"] else plain)
        size = len(packed)
        if size > _LARGEST:
            packed, too_large = None, size
        elif not plain:
            shown = None
    return Result(
        context,
        outcome.kind,
        operation.name,
        None if outcome.arguments is None else readable(outcome.arguments),
        shown,
        packed,
        "" if error is None else describe_error(error),
        encode_error(error) if isinstance(error, ZenohIceError) else None,
        missing,
        too_large,
        **outcome.extra,
    )


def _image(plain: Any, data: bytes, hash: str, attribute: str, time: int) -> Callable[[], Message]:  # noqa: ANN401
    def make() -> Message:
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

    return make
