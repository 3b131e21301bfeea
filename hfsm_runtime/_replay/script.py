"""The recording as a script: the next message, and those that were used."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final, NamedTuple

from hfsm_runtime.recording_file import messages, reader
from hfsm_runtime.recording_file.failures import FailureLog

from .._recording.recorder import automaton_context
from ..errors import ComponentError, ComponentStoppedError

_MOST_MESSAGES_AHEAD: Final = 5000
"""Number of messages that are searched for those of a cycle."""
_MOST_BYTES_AHEAD: Final = 64 << 20
"""Largest number of bytes of messages that are searched."""
_MOST_IMAGES: Final = 500_000
"""Fourteen hours of ten images a second."""
_INPUTS: Final = (
    messages.Action,
    messages.Cycle,
    messages.Gap,
    messages.Overlap,
    messages.Reading,
    messages.Result,
)


class ReplayError(ComponentError):
    """A replay cannot continue."""


class NothingRecordedError(ReplayError):
    """The edited document reads a value that nobody had read until then: the recording does not have it."""


class ReplayEndedError(ComponentStoppedError):
    """The recording is over: ends code that waits for more. Not an Exception: user code does not catch it."""


class TimedMessage(NamedTuple):
    """A message, and its time in ns since the start of the component."""

    time: int
    topic: str
    message: messages.Message
    data: bytes
    """The message as in the file."""


class Recording(reader.RecordingFile):
    """A recording to replay: it is read once when it is made, and again for each iteration.

    `duration` are the ns from the start of the component to the last message, `settings` the policies that
    it ran with, and the periods of its automata; `failures` are what was made to fail. Raises RecordingError.
    """

    def __init__(self, path: Path, limits: reader.ReadLimits = reader.READ_LIMITS) -> None:
        super().__init__(path, limits)
        self._images: dict[str, int] = {}
        self.failures: Final = FailureLog()
        self.duration = 0
        self.settings: dict[str, Any] = {}
        for raw in self.messages():
            if raw.kind is messages.Image:
                if len(self._images) >= _MOST_IMAGES:
                    raise reader.RecordingError(f"the recording {path} has more than {_MOST_IMAGES} images")
                self._images[reader.decode(raw, reader.ImageHash).hash] = raw.place
            if raw.kind is messages.Failing:
                faults = reader.decode(raw, messages.Failing).faults
                self.failures.note(faults, (raw.time - self.start) / 1e9)
            if raw.kind in messages.TO_LOOK_AT:
                continue
            self.duration = max(self.duration, raw.time - self.start)
            if raw.kind is messages.Action and not self.settings:
                action = reader.decode(raw, messages.Action)
                if action.kind == "made":
                    self.settings = action.arguments
        self.failures.end(self.duration / 1e9)

    def __iter__(self) -> Iterator[TimedMessage]:
        for raw in self.messages():
            if raw.kind not in messages.TO_LOOK_AT:
                yield TimedMessage(raw.time - self.start, raw.topic, reader.decode(raw, raw.kind), raw.data)

    def image(self, hash: str) -> bytes | None:
        """Return the bytes of an image, or None when the recording does not have them."""
        place = self._images.get(hash)
        image = None if place is None else self.image_at(place, hash, messages.Image)
        return None if image is None else image.data


@dataclass(frozen=True, slots=True)
class Want:
    """A request of code: a reading of a kind, or, with an attribute, the outcome of an operation."""

    kind: str
    attribute: str = ""
    operation: str = ""

    def fits(self, record: TimedMessage) -> bool:
        """Return whether a record answers the request."""
        message = record.message
        if self.attribute:
            return (
                isinstance(message, messages.Result)
                and message.kind == self.kind
                and message.operation == self.operation
                and attribute_of(record) == self.attribute
            )
        return isinstance(message, messages.Reading) and message.kind == self.kind

    def __str__(self) -> str:
        if self.attribute:
            return f"self.{self.attribute}.{self.operation} ({self.kind})"
        return {"component": "the component's time"}.get(self.kind, self.kind)


class Script:
    """Walk through a recording. `passed` is called with each record that the walk passes."""

    def __init__(self, recording: Recording, end: int, passed: Callable[[TimedMessage], None]) -> None:
        self.time = 0
        """The time in ns of the record that comes next."""
        self._end = end
        self._passed = passed
        self._coming = iter(recording)
        self._ahead: deque[TimedMessage] = deque()
        """The records that were read and not used yet; the first comes next."""
        self._bytes_ahead = 0

    def peek(self) -> TimedMessage | None:
        """Return the next record that has not been used; None at the end."""
        if not self._ahead and not self._read():
            return None
        record = self._ahead[0]
        if record.time > self._end:
            self.stop()
            return None
        self.time = max(self.time, record.time)
        return record

    def peek_input(self) -> TimedMessage | None:
        """Return the next record that needs an action; skip reports on automata."""
        while (record := self.peek()) is not None and not isinstance(record.message, _INPUTS):
            self.advance()
        return record

    def advance(self) -> None:
        """Pass the next record."""
        if self.peek() is not None:
            self._use(0)

    def stop(self) -> None:
        """End the script here."""
        self._coming = iter(())
        self._ahead.clear()

    def find(self, context: str, want: Want) -> TimedMessage | None:
        """Return, and use, a later answer from the same cycle; None if there is none."""
        for index, record in enumerate(self._look_ahead()):
            if context_of(record.message) == context:
                if want.fits(record):
                    return self._use(index)
                if isinstance(record.message, messages.Cycle) and not record.message.begins:
                    return None
        return None

    def cycle_ahead(self, context: str) -> messages.Cycle | None:
        """Return the beginning of the cycle that the next records belong to."""
        for record in self._look_ahead():
            message = record.message
            if isinstance(message, messages.Cycle) and message.begins and context_of(message) == context:
                return message
        return None

    def _look_ahead(self) -> Iterator[TimedMessage]:
        for index in range(_MOST_MESSAGES_AHEAD):
            if index == len(self._ahead) and (self._bytes_ahead > _MOST_BYTES_AHEAD or not self._read()):
                return
            yield self._ahead[index]

    def _read(self) -> bool:
        record = next(self._coming, None)
        if record is None:
            return False
        self._ahead.append(record)
        self._bytes_ahead += len(record.data)
        return True

    def _use(self, index: int) -> TimedMessage:
        record = self._ahead[index]
        del self._ahead[index]
        self._bytes_ahead -= len(record.data)
        self._passed(record)
        return record


def context_of(message: messages.Message) -> str | None:
    """Return the context that a message belongs to."""
    if isinstance(message, messages.Reading | messages.Result | messages.EventSent):
        return message.context
    if isinstance(message, messages.Cycle):
        return automaton_context(message.automaton)
    return None


def attribute_of(record: TimedMessage) -> str:
    """Return the proxy's attribute of a `Result`."""
    return record.topic.split("/")[2] if record.topic.count("/") >= 3 else ""
