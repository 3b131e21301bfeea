"""Encoding of attachments and exceptions.

Declared exceptions travel whole, all others by type and text, never with a traceback.
"""

from __future__ import annotations

import math
import time
from collections.abc import Sequence
from typing import Annotated, Any, Final
from weakref import WeakKeyDictionary

import msgspec
from msgspec import Meta

from zenoh_ice.data import exceptions, typed
from zenoh_ice.data.codec import LARGEST_PAYLOAD, Buffer, Codec, decode_bounded, encode
from zenoh_ice.data.text import cut, encodable, printable, text_of
from zenoh_ice.data.values import Resolve

ATTACHMENT_LIMIT: Final = 2048  # bytes; ours has some 100, and 5 more for each call that was given up
MOST_GIVEN_UP: Final = 256
"""Calls that an attachment names as given up."""

# The bounds also exclude nan: servants and readers wait for and compute with these.
_WallTime = Annotated[float, Meta(ge=0.0, le=1e11)]
_Timeout = Annotated[float, Meta(ge=0.0, le=86_400.0)]
_Number = Annotated[int, Meta(ge=0)]
_Name = Annotated[str, Meta(max_length=128)]

ERROR_ENCODING: Final = "application/msgpack;zenoh_ice.error"
"""Distinguishes our errors from Zenoh's own, such as its timeout."""

_PREFIX: Final = "::zenoh_ice::"
_LONGEST_NAME: Final = 256  # of a type id or a fingerprint in a text

# Exceptions that a server may report, with their encoded members; the others are the client's own.
_REMOTE: Final[dict[str, tuple[type[exceptions.SystemException], tuple[str, ...]]]] = {
    _PREFIX + cls.__name__: (cls, members)
    for cls, members in (
        (exceptions.AccessDeniedException, ()),
        (exceptions.ConnectionLostException, ()),
        (exceptions.ObjectNotExistException, ()),
        (exceptions.OperationNotExistException, ()),
        (exceptions.BusyException, ()),
        (exceptions.TimeoutException, ()),
        (exceptions.UnknownException, ()),
        (exceptions.MarshalException, ("path",)),
        (exceptions.InterfaceMismatchException, ("expected", "found", "member")),
    )
}


class Attachment(msgspec.Struct, array_like=True, frozen=True):
    """The attachment of a call or a stream sample, on the wire an array."""

    fingerprint: _Name = ""
    """Fingerprint of the interface that the sender was generated from; empty if there is none."""
    sequence: _Number = 0
    """Number of the call in its session, or of the sample in its stream."""
    robot_time: float = math.nan
    """Robot time of a sample in s; nan when there is none."""
    wall_time: _WallTime = 0.0
    """The sender's wall time in s since the epoch."""
    call_id: _Name = ""
    """`{session id}/{number}` of a call; of a sample the id of its stream, another after each restart."""
    timeout: _Timeout = 0.0
    """Time limit of the caller in s; 0 in a sample, and where it is unknown."""
    given_up: Annotated[tuple[_Number, ...], Meta(max_length=MOST_GIVEN_UP)] = ()
    """Numbers of earlier calls of the session to the same servant that it must not begin any more."""

    @property
    def stream(self) -> str:
        """The id of a sample's stream."""
        return self.call_id

    @property
    def client(self) -> str:
        """The id of the calling session."""
        return self.call_id.partition("/")[0]


NO_ATTACHMENT: Final = Attachment()

encode_attachment: Final = msgspec.msgpack.Encoder().encode
"""Encodes the members of an attachment, given as a tuple."""

read_attachment: Final = typed.msgpack_decoder(Attachment)


def encode_sample_attachment(
    fingerprint: str, sequence: int, robot_time: float, stream: str = "", wall_time: float | None = None
) -> bytes:
    """Return the encoded attachment of a stream sample, sent now or at a wall time in s."""
    sent_at = time.time() if wall_time is None else wall_time
    return encode_attachment((fingerprint, sequence, robot_time, sent_at, stream, 0.0))


def decode_attachment(data: Buffer) -> Attachment:
    """Return a received attachment; raises MarshalException for a malformed one."""
    return decode_bounded(read_attachment, data, ATTACHMENT_LIMIT, "attachment")


class _WireError(msgspec.Struct, omit_defaults=True):
    """An exception on the wire."""

    exception: str
    """Type id of the exception."""
    bases: list[str] = []
    """Type ids of the declared exceptions that it extends, nearest first."""
    members: msgspec.Raw = msgspec.Raw(b"\x80")
    message: str = ""
    path: str = ""
    expected: str = ""
    found: str = ""
    member: str = ""


_decode: Final = typed.msgpack_decoder(_WireError)

# Codecs of declared exceptions; making one takes a millisecond or more.
_codecs: Final[WeakKeyDictionary[type[exceptions.UserException], Codec[Any]]] = WeakKeyDictionary()


def unknown_exception(error: BaseException) -> exceptions.UnknownException:
    """Return the reply for an exception that the operation does not declare."""
    text = text_of(error)
    name = error.ice_type_id if isinstance(error, exceptions.UserException) else type(error).__name__
    return exceptions.UnknownException(cut(f"{name}: {text}" if text else name))


def encode_error(error: exceptions.ZenohIceError) -> bytes:
    """Return an exception encoded for the wire."""
    if isinstance(error, exceptions.UserException):
        type_id, *bases = error.ice_type_ids()
        try:
            members = msgspec.Raw(encode(error.ice_members(), type_id))
        except Exception as problem:  # noqa: BLE001 - its members are the user's own code
            return encode_error(exceptions.UnknownException(f"{type_id} could not be encoded: {problem}"))
        return msgspec.msgpack.encode(_WireError(type_id, bases, members))
    type_id = _PREFIX + type(error).__name__
    if type_id not in _REMOTE:
        return encode_error(unknown_exception(error))
    wire = _WireError(type_id, message=encodable(cut(str(error))))
    for name in _REMOTE[type_id][1]:
        setattr(wire, name, encodable(cut(getattr(error, name))))
    return msgspec.msgpack.encode(wire)


def decode_error(
    payload: Buffer,
    declared: Sequence[type[exceptions.UserException]],
    what: str,
    resolve: Resolve | None = None,
) -> exceptions.ZenohIceError:
    """Return a received exception as the most derived type that the operation may raise.

    `what` names the call in the text of a malformed error; proxies are made by `resolve`. Texts of the
    other side are cut, and made printable unless they are members of a declared exception.
    """
    try:
        wire = decode_bounded(_decode, payload, LARGEST_PAYLOAD, f"error of {what}")
    except exceptions.MarshalException as problem:
        return problem
    message = printable(wire.message) or f"{what} failed, and the servant gives no reason"
    if wire.exception in _REMOTE:
        system, members = _REMOTE[wire.exception]
        return system(message, *(printable(getattr(wire, name)) for name in members))
    subclasses = [subclass for root in declared for subclass in root.ice_subclasses()]
    known = {subclass.ice_type_id: subclass for subclass in reversed(subclasses)}  # the first of two wins
    for type_id in (wire.exception, *wire.bases):
        if (nearest := known.get(type_id)) is not None:
            codec = _codecs.get(nearest) or _codecs.setdefault(nearest, Codec(nearest.Members))
            try:
                members = codec.unpack(bytes(wire.members), f"{what}: {type_id}", resolve)
                return nearest(**msgspec.structs.asdict(members))
            except exceptions.MarshalException as problem:
                return problem
    name = printable(wire.exception, _LONGEST_NAME)
    return exceptions.UnknownException(f"{what} raised {name}, which the operation does not declare")
