"""The messages between a component's automata and its code in another process, and how they are sent.

The near end numbers the pieces of code that it lets run: one that sleeps is left waiting for its answer while
others run. Only one runs at a time, so all that comes from the far end is of the one that the near end waits
for. Each message is a frame: its length in four bytes, the number in four more on the way to the far end, and
MessagePack that is decoded strictly.
"""

from __future__ import annotations

import contextlib
import os
import select
import struct
import time
from typing import Annotated, Any, Final

import msgspec

from hfsm_runtime.errors import ComponentStoppedError, CycleCutError
from hfsm_runtime.plugins import random_state
from zenoh_ice.data.codec import Parted

LARGEST_REQUEST: Final = 4 << 20
"""Bytes of the largest message of the far end."""
LARGEST_TEXT: Final = 4000
"""Characters of the longest text in a message of the far end."""
_LENGTH: Final = struct.Struct(">I")
NUMBER: Final = struct.Struct(">I")
"""The number of a piece of code, before each message to the far end."""
_PIECE: Final = 1 << 16  # bytes that are read at once
_LARGEST_MESSAGE: Final = 1 << 30  # bytes of a message of the near end, whose pictures may be large

ENDS: Final = {each.__name__: each for each in (CycleCutError, ComponentStoppedError)}
"""What ends a cycle, by the name with which Failed and Raised say so."""

Text = Annotated[str, msgspec.Meta(max_length=LARGEST_TEXT)]
Name = Annotated[str, msgspec.Meta(max_length=200)]

Plain = bool | int | float | str
"""A value of a parameter."""
Values = Annotated[dict[Name, msgspec.Raw], msgspec.Meta(max_length=1000)]
"""Variables, each of which is decoded only where somebody wants it."""
LARGEST_VALUES: Final = 1 << 18
"""Bytes of the variables in a message."""
READY: Final = b"ready"
"""What programs behind walls send first: all that fails before is no fault of the code that they get."""
NO_VALUES: Final = msgspec.Raw(msgspec.msgpack.encode({}))


class Message(msgspec.Struct, array_like=True, tag=True, forbid_unknown_fields=True):
    """The base class of messages."""


class Timed(Message):
    """The base class of messages to the far end."""

    now: int
    """The time of the near end's clock in ns."""


# What the near end asks for.


class Limits(Message):
    """What the far end allows itself before it runs any code of others; 0 is no limit."""

    memory: int = 0
    """Bytes of address space."""
    file: int = 0
    """Bytes of a file."""
    files: int = 0
    """Open files."""
    cpu: int = 0
    """Seconds of processor time."""
    threads: int = 0
    """Threads within the walls; the kernel does not count those of root."""
    output: int = 0
    """Characters that it prints."""


class Begin(Timed):
    """Load a component, and run its variables: answered by Done or Raised."""

    file: str
    """The name of its file."""
    text: str
    documents: dict[str, str]
    """The texts of its document and of what that imports, to tell lines of them."""
    include: list[str]
    """Folders with packages of interfaces."""
    parameters: dict[str, Plain]
    limits: Limits
    shows: bool = False
    """Whether each answer has the variables that have changed."""
    random: str = msgspec.field(default_factory=random_state)
    """The state of the random generators."""


class RunCode(Timed):
    """Run a piece of code: answered by Done, with the value of a condition, or by Raised."""

    automaton: int
    part: str
    """entry, code, exit, arguments, results, guard, fired, set_outputs or get_outputs."""
    id: int
    """That of the state, or of the transition; 0 for outputs."""
    event: str = ""
    data: bytes = b""
    """The data of the event as JSON."""


class Deliver(Timed):
    """Call the function of a subscription with a sample: answered by Done or Raised."""

    stream: int
    sample: Sample


class AskHolds(Timed):
    """Say whether what a stream's reader waits for has happened: answered by Done."""

    stream: int


class ListVariables(Timed):
    """Say what the variables of an automaton are: answered by Done."""

    automaton: int


class Answered(Timed):
    """The answer to a request of the far end, with what that asks for."""

    value: Any = None


class Failed(Timed):
    """The answer to a request that failed: the exception, by its name."""

    error: str
    text: str


class Sample(msgspec.Struct, array_like=True):
    """A sample of a stream, and what is known about it."""

    payload: bytes | Parted
    attachment: bytes


# What the far end asks for and answers.


class Done(Message):
    """A piece of code has ended."""

    value: bool = False
    variables: msgspec.Raw = NO_VALUES
    """The variables of its automaton that have changed, if they are to be shown: encoded Values."""


class Raised(Message):
    """A piece of code raised an exception."""

    error: Name
    text: Text
    place: Text = ""
    """Where, in the component and in the document."""
    detail: Name = ""
    """The second member of an exception of a servant, such as who holds the robot."""


class Call(Message):
    """Call an operation of a servant: answered with whether it succeeded, and its result, or by Failed."""

    realm: Name
    identity: Name
    operation: Name
    payload: bytes


class Find(Message):
    """Say which interfaces a servant has: answered with fingerprints by type id, or by Failed."""

    realm: Name
    identity: Name
    type_id: Name


class Subscribe(Message):
    """Listen to a stream: answered by Answered or Failed. The far end numbers its streams."""

    stream: int
    realm: Name
    identity: Name
    operation: Name
    queue: int


class Poll(Message):
    """Take the next sample of a stream: answered with it, or None."""

    stream: int


class Push(Message):
    """Deliver each sample of a stream from now on, at most `rate` in a second: answered by Answered."""

    stream: int
    rate: float | None


class Unsubscribe(Message):
    """Listen to a stream no longer: answered by Answered."""

    stream: int


class Wait(Message):
    """Let time pass until AskHolds says that it holds, at most `timeout` s: answered with whether it does."""

    stream: int
    timeout: float


class Sleep(Message):
    """Let time pass: answered by Answered, or by Failed if the cycle has to end."""

    seconds: float
    ends: bool = True
    """Whether the sleep ends when the cycle has to."""


class Send(Message):
    """Send an event, with data as JSON: answered by Answered or Failed."""

    name: Text
    data: bytes


class SetMark(Message):
    """Mark a pixel of a camera's picture: answered by Answered or Failed."""

    camera: Name
    u: float
    v: float
    label: Name


class Log(Message):
    """Log a text: answered by Answered."""

    level: int
    text: Text


Task = Begin | RunCode | Deliver | AskHolds | ListVariables
"""What the far end is to do."""
ToFar = Task | Answered | Failed
ToNear = (
    Done | Raised | Call | Find | Subscribe | Poll | Push | Unsubscribe | Wait | Sleep | Send | SetMark | Log
)


class PrintedTooMuch(Exception):
    """Code prints without end; the text says how much it may."""


class PipeError(Exception):
    """The other end does not keep to the protocol, or has gone; the text says what happened."""


class PipeTimeout(PipeError):
    """The other end did not answer in time."""


class MessageTooLarge(PipeError):
    """The other end announces a message of more bytes than are taken."""


class Pipe:
    """Frames through two file descriptors.

    One that does not wait in the kernel waits until the time `until` at the latest.
    """

    def __init__(
        self, reads: int, writes: int, largest: int = _LARGEST_MESSAGE, *, waits: bool = True
    ) -> None:
        self._reads: Final = reads
        self._writes: Final = writes
        self._largest: Final = largest
        self._left = bytearray()
        self._waits: Final = waits
        self.until = float("inf")
        """When waiting ends, by the monotonic clock."""
        if not waits:
            os.set_blocking(reads, False)
            os.set_blocking(writes, False)

    def send(self, message: bytes) -> None:
        """Send a message. Raises PipeError, and PipeTimeout."""
        view = memoryview(_LENGTH.pack(len(message)) + message)
        try:
            while view:
                try:
                    view = view[os.write(self._writes, view) :]
                except BlockingIOError:
                    self._wait(self._writes, select.POLLOUT)
        except OSError as error:
            raise PipeError("the process has ended") from error

    def receive(self) -> bytes:
        """Return the next message. Raises PipeError, MessageTooLarge, and PipeTimeout."""
        left = self._left
        self._fill(_LENGTH.size)
        (length,) = _LENGTH.unpack_from(left)
        if length > self._largest:
            raise MessageTooLarge(f"a message of {length} bytes; at most {self._largest} are taken")
        end = _LENGTH.size + length
        self._fill(end)
        message = bytes(memoryview(left)[_LENGTH.size : end])
        del left[:end]
        return message

    @property
    def has_more(self) -> bool:
        """Whether something has come that nobody has received; for an end that does not wait."""
        if not self._left:
            with contextlib.suppress(BlockingIOError):
                self._left += os.read(self._reads, _PIECE)
        return bool(self._left)

    def _fill(self, wanted: int) -> None:
        left = self._left
        while len(left) < wanted:
            try:
                data = os.read(self._reads, _PIECE)
            except BlockingIOError:
                self._wait(self._reads, select.POLLIN)
                continue
            except OSError as error:
                raise PipeError("the process has ended") from error
            if not data:
                raise PipeError("the process has ended")
            left += data

    def _wait(self, file: int, what: int) -> None:
        poll = select.poll()
        poll.register(file, what)
        left = self.until - time.monotonic()
        if left <= 0 or not poll.poll(None if left == float("inf") else left * 1000):
            raise PipeTimeout("no answer in time")
