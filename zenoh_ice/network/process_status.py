"""What a process that serves tells about itself to whoever asks: its versions, and how busy it is."""

from __future__ import annotations

import logging
import math
import os
import platform
import socket
import sys
import threading
import time
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Final

import msgspec
import zenoh
from zenoh.handlers import RingChannel

from ..calls.invocation import first_reply
from ..exceptions import ConnectionLostException, MarshalException
from ..wire.text import LONGEST_TEXT

if TYPE_CHECKING:
    from ..communicator import Communicator

__all__ = [
    "ProcessStatus",
    "ProcessStatusServer",
    "ServantStatus",
    "ask_process_status",
    "decode_process_status",
    "program_name",
]

_DISTRIBUTION: Final = "visualhfsm"
_MOST_WAITING: Final = 64
_LIMIT: Final = 1 << 20  # bytes of a status that is taken
_JOIN_LIMIT: Final = 1.0  # s

_logger = logging.getLogger(__name__)

_Text = Annotated[str, msgspec.Meta(max_length=LONGEST_TEXT)]
_Count = Annotated[int, msgspec.Meta(ge=0)]
_Seconds = Annotated[float, msgspec.Meta(ge=0.0, le=1e11)]  # and a number


class ServantStatus(msgspec.Struct, frozen=True):
    """What a servant does, and did since it is served."""

    type_id: _Text
    calls: _Count
    """How many calls were executed, those that run included."""
    failed: _Count
    """How many of them raised what their operation does not declare, or returned what does not fit it."""
    refused: _Count
    """How many were not executed: malformed, of another interface, too late, or too many.

    Those that fell out of a full queue while nobody took calls out of it are not counted.
    """
    running: _Count
    """How many are executed now."""
    busy_for: _Seconds
    """For how many s, up to now, calls may have fallen out of its queue; 0 when surely none did."""
    crowded_ago: float = math.inf
    """How many s ago a call may last have fallen out of it; infinite when surely none ever did."""
    listened: tuple[_Text, ...] | None = None
    """Its streams to which somebody listens; None where that is not known."""


class ProcessStatus(msgspec.Struct, frozen=True):
    """A process that serves, and its servants."""

    program: _Text
    pid: _Count
    host: _Text
    python: _Text
    zenoh: _Text
    version: _Text
    """Version of the distribution."""
    since: _Seconds
    """Wall time in s since the epoch at which it began to serve."""
    shared_memory: bool
    servants: dict[_Text, ServantStatus]
    """The servants by `identity -f facet@realm`; `=` stands for all names of a category."""


_encoder: Final = msgspec.msgpack.Encoder()
_decoder: Final = msgspec.msgpack.Decoder(ProcessStatus)


class ProcessStatusServer:
    """Answer those who ask for the status of this process, on a thread of its own.

    So that it answers while all the others are busy.
    """

    def __init__(self, communicator: Communicator) -> None:
        self._communicator: Final = communicator
        self._lock: Final = threading.Lock()
        self._since = 0.0
        self._queryable: zenoh.Queryable[zenoh.Handler[zenoh.Query]] | None = None
        self._thread: threading.Thread | None = None
        self._closed = False

    def open(self) -> None:
        """Answer from now on; does nothing when it does already."""
        with self._lock:
            if self._queryable is not None or self._closed:
                return
            self._since = time.time()
            communicator = self._communicator
            self._queryable = communicator.session.declare_queryable(
                _key(communicator.realm, communicator.client_id), RingChannel(_MOST_WAITING), complete=True
            )
            thread = threading.Thread(
                target=self._serve, args=(self._queryable.handler,), name="process status", daemon=True
            )
            thread.start()  # first: if Ctrl-C strikes here, what was not started must not be waited for
            self._thread = thread

    def close(self) -> None:
        """Answer nobody any longer."""
        with self._lock:
            self._closed = True
            queryable, self._queryable = self._queryable, None
        if queryable is not None:
            queryable.undeclare()
        if self._thread is not None:
            self._thread.join(_JOIN_LIMIT)

    def status(self) -> ProcessStatus:
        """Return the status of this process."""
        communicator = self._communicator
        return ProcessStatus(
            program=program_name(),
            pid=os.getpid(),
            host=socket.gethostname(),
            python=platform.python_version(),
            zenoh=_version("eclipse-zenoh"),
            version=_version(_DISTRIBUTION),
            since=self._since,
            shared_memory=bool(communicator.shared_memory.space),
            servants={
                str(incoming.target): incoming.status() for incoming in communicator.local_servants.all()
            },
        )

    def _serve(self, handler: zenoh.Handler[zenoh.Query]) -> None:
        while True:
            try:
                query = handler.recv()
            except zenoh.ZError:  # the queryable was undeclared
                return
            try:
                with query:
                    query.reply(query.key_expr, _encoder.encode(self.status()))
            except Exception:
                _logger.exception("the status of the process could not be told")
            del query


def ask_process_status(session: zenoh.Session, realm: str, process: str, timeout: float) -> ProcessStatus:
    """Return the status of a process by the id of its session.

    Raises ConnectionLostException when it is not there, does not answer within `timeout` s, or access control
    denies it; MarshalException when what it answers is none.
    """
    key = _key(realm, process)
    replies = session.get(
        key,
        timeout=timeout,
        congestion_control=zenoh.CongestionControl.BLOCK,
        # Not behind the calls that are about to be explained by it.
        priority=zenoh.Priority.INTERACTIVE_HIGH,
    )
    reply = first_reply(replies)
    answer = None if reply is None else reply.ok
    if answer is None:
        raise ConnectionLostException(
            f"the process {process} of realm {realm} did not tell its status within {timeout:g} s: it is "
            "gone, or hangs, or access control denies it"
        )
    size = len(answer.payload)
    if size > _LIMIT:
        raise MarshalException(f"status of {process}: {size} bytes where at most {_LIMIT} are taken")
    return decode_process_status(answer.payload.to_bytes(), process)


def decode_process_status(data: bytes, process: str) -> ProcessStatus:
    """Return the status that arrived; raises MarshalException, which names the process, for what is none."""
    try:
        return _decoder.decode(data)
    except (ValueError, RecursionError, OverflowError) as error:
        raise MarshalException(f"status of {process}: {error}") from error


def program_name() -> str:
    """Return the name of this program: of its script, or of the module that `python -m` runs."""
    program = Path(sys.argv[0])
    return (program.parent.name if program.name == "__main__.py" else program.name) or "python"


def _key(realm: str, process: str) -> str:
    return f"@process/{realm}/{process}/status"


@cache
def _version(distribution: str) -> str:
    from importlib.metadata import PackageNotFoundError, version  # here: it takes long to load

    try:
        return version(distribution)
    except PackageNotFoundError:  # run from a copy of the sources
        return "unknown"
