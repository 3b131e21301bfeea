"""The emergency stop of a robot as one message, which is the same for every release, forever.

It is a query of Zenoh with the key `REALM/Safety/emergencyStop` and, as its payload, the MessagePack map
`{"reason": TEXT}`. It has no attachment: so no fingerprint, which another release might refuse, and no limit,
after which a server might think it obsolete. A robot that has stopped answers with an empty map, any other
answer is an error. Its sender asks for no description and reads no token before.
tests/data/emergency_stop has the bytes, with the answers of the releases so far. Never change them.
"""

from __future__ import annotations

import math
import time
from collections.abc import Iterable
from concurrent.futures import Future, InvalidStateError
from contextlib import suppress
from dataclasses import dataclass
from typing import Final

import msgspec

from zenoh_ice import Communicator, SystemException, ZenohIceError
from zenoh_ice.data.interface import Operation
from zenoh_ice.data.keys import Target
from zenoh_ice.data.text import cut, encodable
from zenoh_ice.data.wire import decode_error
from zenoh_ice.objects.proxy import Call
from zenoh_ice.transport import NoAnswer, Outcome

SAFETY: Final = "Safety"
"""Identity of the servant that stops a robot."""
STILL: Final = 0.1
"""Speed in rad/s below which a joint counts as still."""
STILL_LIMIT: Final = 2.0
"""Seconds after a confirmed stop within which the joints must be still."""

_OPERATION: Final = "emergencyStop"
_WHAT: Final = f"{SAFETY}.{_OPERATION}"
_LONGEST_REASON: Final = 256  # characters


class _Reason(msgspec.Struct):
    reason: str


class _Resume(msgspec.Struct, omit_defaults=True):
    resume: bool = False


class _Nothing(msgspec.Struct):
    pass


_EMERGENCY_STOP: Final[Operation[[str], None]] = Operation(_OPERATION, arguments=_Reason, result=_Nothing)
_RESET: Final[Operation[[bool], None]] = Operation(
    "resetEmergencyStop", arguments=_Resume, result=_Nothing, idempotent=True
)


def stop_key(realm: str) -> str:
    """Return the key of the message that stops the robot of a realm."""
    return Target(realm, SAFETY).key(_OPERATION)


def stop_payload(reason: str) -> bytes:
    """Return the payload of the message; the reason is cut after 256 characters."""
    return msgspec.msgpack.encode(_Reason(encodable(cut(reason, _LONGEST_REASON))))


def refusal(ok: bool, answer: bytes) -> ZenohIceError | None:
    """Return what the robot reports instead of having stopped; None if it has stopped.

    `ok` is whether the answer came as a result, not as an error. What a result contains does not matter: a
    later release may add to the empty map.
    """
    return None if ok else decode_error(answer, (), _WHAT)


def begin_stop(communicator: Communicator, reason: str, timeout: float) -> Future[None]:
    """Send the message to the robot of a communicator's realm; the future ends within `timeout` s.

    It raises what the robot reports, or the reason why there was no answer.
    """
    target = Target(communicator.realm, SAFETY)
    future: Future[None] = communicator.new_future()
    started = time.monotonic()

    def finish(outcome: Outcome | SystemException) -> None:
        if isinstance(outcome, NoAnswer):
            failure: ZenohIceError | None = communicator.presence.explain_no_answer(
                target, _WHAT, started, timeout, outcome
            )
        elif isinstance(outcome, SystemException):
            failure = outcome
        else:
            ok, answer = outcome
            failure = refusal(ok, bytes(answer) if isinstance(answer, bytes) else b"")
        with suppress(InvalidStateError):  # cancelled, or the communicator was destroyed
            if failure is None:
                future.set_result(None)
            else:
                future.set_exception(failure)

    try:
        caller = communicator.transport.caller(target, _EMERGENCY_STOP, timeout=timeout)
        caller.begin(stop_payload(reason), finish)
    except SystemException as error:
        finish(error)
    return future


@dataclass(kw_only=True)
class RobotStop:
    """The stop of one robot, which is sent again until it is `over`: confirmed, and the robot is still.

    A robot whose joints do not come to rest, or that says nothing of them, is not waited for forever.
    """

    confirmed_at: float | None = None
    """The moment of the monotonic clock when the robot first confirmed the stop."""
    speed: float | None = None
    """The fastest joint in rad/s, last; None while the robot does not say."""
    lost: str | None = None
    """Why no command reaches the robot, last; empty while they do, None while it does not say."""
    over: bool = False
    """Nothing more is to be done."""

    @property
    def confirmed(self) -> bool:
        """Return whether the robot has confirmed the stop."""
        return self.confirmed_at is not None

    @property
    def moving(self) -> bool:
        """Return whether its joints still moved when it last said how fast."""
        return self.speed is not None and self.speed >= STILL

    @property
    def still(self) -> bool:
        """Return whether it has stopped and its joints are still, as far as it says and knows."""
        return self.confirmed and not self.moving and not self.lost

    def confirm(self) -> None:
        """Note that the robot confirms the stop."""
        if self.confirmed_at is None:
            self.confirmed_at = time.monotonic()

    def observe(
        self, velocities: Iterable[float] | None, lost: str | None, limit: float, *, answered: bool
    ) -> None:
        """Note the velocities of its joints in rad/s, and why it is lost; None for what it did not say.

        Unless it has `answered`, nothing is known: a busy robot may answer late. The last time is that which
        comes `limit` s after it confirmed the stop.
        """
        if self.confirmed_at is None:
            return
        last = time.monotonic() - self.confirmed_at >= limit
        if answered or last:
            if velocities is not None:
                known = [abs(velocity) for velocity in velocities if not math.isnan(velocity)]
                self.speed = max(known, default=self.speed)
            self.lost = self.lost if lost is None else lost
            self.over = last or self.still


def reset(communicator: Communicator, *, resume: bool = False) -> None:
    """Let the robot of a realm accept commands again, and with `resume` paused behaviors go on.

    Raises what a call raises. This is an ordinary call, so that one that was delayed is not executed; but it
    asks for no fingerprint.
    """
    Call(communicator.stringToProxy(SAFETY), _RESET)(resume)
