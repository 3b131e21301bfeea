"""The status of a serving process: its versions, and how busy its servants are."""

from __future__ import annotations

import os
import platform
import socket
import sys
from collections.abc import Mapping
from contextlib import suppress
from functools import cache
from pathlib import Path
from typing import Annotated

import msgspec

from zenoh_ice.data import typed
from zenoh_ice.data.codec import LARGEST_PAYLOAD, Buffer, decode_bounded
from zenoh_ice.data.exceptions import MarshalException
from zenoh_ice.data.text import LONGEST_TEXT, printable

_Text = Annotated[str, msgspec.Meta(max_length=LONGEST_TEXT)]
_Count = Annotated[int, msgspec.Meta(ge=0)]
_Seconds = Annotated[float, msgspec.Meta(ge=0.0, le=1e11)]  # and a number


class ServantStatus(msgspec.Struct, frozen=True):
    """Load of a servant, and its number of calls since it was added."""

    type_id: _Text
    calls: _Count  # executed, including the running ones
    failed: _Count  # of them, with an undeclared exception or an invalid result
    refused: _Count  # not executed: malformed, of another interface, too late, or too many
    running: _Count  # executed now
    waiting: _Count  # for their turn
    listened: tuple[_Text, ...]  # its streams with listeners


class ProcessStatus(msgspec.Struct, frozen=True):
    """A process that serves, and its servants."""

    program: _Text
    pid: _Count
    host: _Text
    python: _Text
    zenoh: _Text
    version: _Text  # of the distribution
    since: _Seconds  # wall time in s since the epoch at which it began to serve
    servants: dict[_Text, ServantStatus]  # by `identity@realm`
    local_sockets: bool = False  # which version 0.2.0 did not have


def encode_status(since: float, *, local_sockets: bool, servants: Mapping[str, ServantStatus]) -> bytes:
    """Return the status of this process, encoded."""
    return msgspec.msgpack.encode(
        ProcessStatus(
            program=program_name(),
            pid=os.getpid(),
            host=socket.gethostname(),
            python=platform.python_version(),
            zenoh=version_of("eclipse-zenoh"),
            version=own_version(),
            since=since,
            local_sockets=local_sockets,
            servants=dict(servants),
        )
    )


class _Version(msgspec.Struct, frozen=True):
    version: _Text


def decode_status(data: Buffer, process: str) -> ProcessStatus:
    """Decode the status of a process; raises MarshalException that names it for a malformed one."""
    decode = typed.msgpack_decoder(ProcessStatus)
    try:
        return decode_bounded(decode, data, LARGEST_PAYLOAD, f"status of {process}")
    except MarshalException as error:
        theirs = version_in_status(data)
        if theirs in {"", own_version()}:
            raise
        raise MarshalException(f"the process {process} has {versions(theirs)}") from error


def version_in_status(data: Buffer) -> str:
    """Return the version in the status of a process of any version; empty where it has none."""
    decode = typed.msgpack_decoder(_Version)
    with suppress(MarshalException):
        return printable(decode_bounded(decode, data, LARGEST_PAYLOAD, "status").version)
    return ""


def versions(theirs: str) -> str:
    """Return the text on a version of VisualHFSM that does not fit this one, and what to do."""
    name = "in another version" if theirs in {"", "unknown", own_version()} else theirs
    return f"VisualHFSM {name}, this is {own_version()}: install the same version on both sides"


def program_name() -> str:
    """Return the name of this program: of its script, or of the module that `python -m` runs."""
    program = Path(sys.argv[0])
    return (program.parent.name if program.name == "__main__.py" else program.name) or "python"


def own_version() -> str:
    """Return the version of the installed distribution; `unknown` for a copy of its sources."""
    return version_of("visualhfsm")


@cache
def version_of(distribution: str, otherwise: str = "unknown") -> str:
    """Return the version of an installed distribution, and something else for one that is not installed."""
    from importlib.metadata import PackageNotFoundError, version  # here: it takes long to load

    try:
        return version(distribution)
    except PackageNotFoundError:
        return otherwise
