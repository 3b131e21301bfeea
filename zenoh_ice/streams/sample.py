"""A value that a stream brought, and how it is made of what travels."""

from __future__ import annotations

from time import monotonic as _monotonic
from time import time as _wall_time
from typing import TYPE_CHECKING, Final, Generic, TypeVar, cast

import zenoh

from ..exceptions import InterfaceMismatchException
from ..identity import Target
from ..operation import Operation
from ..wire.attachment import NO_ATTACHMENT, Attachment, decode_attachment
from ..wire.pieces import Parted

if TYPE_CHECKING:
    from ..communicator import Communicator

__all__ = ["Gaps", "Sample", "SampleDecoder"]

V = TypeVar("V")


class Sample(Generic[V]):
    """A value that a stream brought."""

    __slots__ = ("_read_at", "_transit", "lost", "sequence", "stream", "time", "value", "wall_time")

    def __init__(
        self, value: V, sequence: int, time: float, wall_time: float, lost: int = 0, *, stream: str = ""
    ) -> None:
        self.value: Final = value
        self.sequence: Final = sequence
        """Number of the sample in its stream, which begins anew when its servant does."""
        self.time: Final = time
        """Robot time of the value in s, nan when the servant gives none."""
        self.wall_time: Final = wall_time
        """Wall time of the servant's machine at which it was sent, in s since the epoch."""
        self.stream: Final = stream
        """Tells its stream from the one before a restart of its servant; empty when that is not known."""
        self.lost = lost
        """How many samples there were between the one before and this one that did not come this far.

        Newer ones overtook them, as whoever reads is slower than the stream, or they were lost on the way.
        """

        # From here on by the steady clock: when the date is set back, old samples must not look fresh.
        self._transit: Final = max(0.0, _wall_time() - wall_time)
        self._read_at: Final = _monotonic()

    @property
    def age(self) -> float:
        """Wall seconds since it was sent; between machines as exact as their clocks agree."""
        return self._transit + _monotonic() - self._read_at

    def follows(self, other: Sample[V] | None) -> bool:
        """Return whether it is newer than another one, or of another start of the servant."""
        if self is other:
            return False
        same_stream = other is not None and self.stream == other.stream != ""
        return not same_stream or other is None or self.sequence > other.sequence

    def __repr__(self) -> str:
        from rich.pretty import pretty_repr  # here: most programs never ask

        # An image of some megabytes must not be formatted to show its beginning.
        value = pretty_repr(self.value, max_width=1 << 16, max_length=8, max_string=40, max_depth=4)
        return f"<sample {self.sequence} at {self.time:.3f} s: {value:.200}>"


class Gaps:
    """Find the samples of a stream that did not reach one reader, by their numbers."""

    def __init__(self) -> None:
        self._stream: str | None = None
        self._last = 0

    def before(self, about: Attachment) -> int:
        """Return how many are missing between the sample of the last time and this one.

        Of a servant that started anew, none: how many it sent before is not known.
        """
        stream, last = self._stream, self._last
        self._stream, self._last = about.stream, about.sequence
        return max(0, about.sequence - last - 1) if about.stream == stream else 0


class SampleDecoder(Generic[V]):
    """Make samples of one operation of what arrives."""

    def __init__(
        self, communicator: Communicator, target: Target, operation: Operation[..., V], what: str
    ) -> None:
        self._what: Final = f"sample of {what}"
        self._communicator: Final = communicator
        self._target: Final = target
        self._interface: Final = operation.interface
        self._accepted = ""
        self._result: Final = operation.result
        self._limit: Final = communicator.size_limit(operation.result)
        self._read: Final = communicator.shared_memory.read

    def about(self, raw: zenoh.Sample) -> Attachment:
        """Return what a sample says about itself; raises MarshalException."""
        return NO_ATTACHMENT if raw.attachment is None else decode_attachment(raw.attachment.to_bytes())

    def read(self, raw: zenoh.Sample) -> bytes | Parted:
        """Return what a sample holds.

        Raises MarshalException when that is too much, ConnectionLostException when it is no longer there.
        """
        return self._read(raw.payload, self._limit, self._what)

    def decode(self, data: bytes | Parted, about: Attachment, lost: int) -> Sample[V]:
        """Return the sample that holds something.

        Raises MarshalException for one that does not fit the operation, InterfaceMismatchException for one of
        a servant whose interface is another one.
        """
        if about.fingerprint != self._accepted:
            self._check_fingerprint(about.fingerprint)
        value = cast("V", self._result.unpack_result(data, self._what, self._communicator))
        return Sample(value, about.sequence, about.robot_time, about.wall_time, lost, stream=about.stream)

    def _check_fingerprint(self, fingerprint: str) -> None:
        own = self._interface
        if own is not None and own.fingerprint and fingerprint != own.fingerprint:
            # The sample tells that of its servant's own interface, which may extend the one that we know.
            found = self._communicator.presence.reachable(self._target).get(own.type_id, own.fingerprint)
            if found != own.fingerprint:
                raise InterfaceMismatchException(
                    f"{self._what}: this component was generated from {own.fingerprint}, the servant's "
                    f"{own.type_id} from {found}; generate both from the same IDL",
                    expected=own.fingerprint,
                    found=found,
                )
        self._accepted = fingerprint
