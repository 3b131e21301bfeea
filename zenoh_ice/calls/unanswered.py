"""Why a call ended without an answer: Zenoh tells no reasons, so those who are there are asked."""

from __future__ import annotations

import math
import time
from typing import TYPE_CHECKING, Final

from ..exceptions import (
    AccessDeniedException,
    BusyException,
    CommunicatorDestroyedException,
    ConnectionLostException,
    MarshalException,
    SystemException,
    TimeoutException,
)
from ..identity import Target
from ..network.process_status import ask_process_status

if TYPE_CHECKING:
    from ..communicator import Communicator

__all__ = ["UnansweredCall"]

# s in which the token of a servant that died during a call goes away; measured 2-3 ms.
_LOSS_NOTICE: Final = 0.25
# s in which word comes of the end of the link that a call or its answer was lost with; measured 1 ms.
_LINK_NOTICE: Final = 0.02
# s in which word comes that the link was closed over which a message could not be sent.
_CLOSE_NOTICE: Final = 1.0
# s for which a process that seems to be there is asked how its servants are.
_STATUS_LIMIT: Final = 0.5
_STATUS_SHARE: Final = 0.25  # of what is left of the call's limit; who sets a long one has a busy machine
_LATE_STATUS_LIMIT: Final = 0.25  # s for the same, where the call's own limit has passed
_REST_NOTICE: Final = 0.1  # s in which a servant has come to rest that is not crowded
_LOOK_AGAIN: Final = 0.01  # s
_MOST_CROWDED: Final = 1024  # servants of which it is remembered
_MOST_ASKED: Final = 3  # of several servers of one identity


class UnansweredCall:
    """A call that ended without an answer.

    `what` names it, `started` is the moment of the monotonic clock when it began, `timeout` its limit in s,
    and `send_limit` the seconds after which a link is closed that takes nothing.
    """

    def __init__(
        self,
        communicator: Communicator,
        target: Target,
        what: str,
        *,
        started: float,
        timeout: float,
        send_limit: float,
    ) -> None:
        self._presence: Final = communicator.presence
        self._communicator: Final = communicator
        self._target: Final = target
        self._what: Final = what
        self._started: Final = started
        self._deadline: Final = started + timeout
        self._unsent: Final = time.monotonic() - started >= send_limit
        self._at_work = False  # the servant, when it was asked last
        # Of many calls that fall out of a queue, one asks for all.
        self._asked = self._was_crowded() or (not self._is_lost() and self._ask_status())
        self.lost: Final = self._is_lost() or (not self._asked and self._wait_for_loss())
        """Whether the servant, or the way to it, was lost during the call."""

    @property
    def time_left(self) -> float:
        """Seconds of the call's limit that are left."""
        return self._deadline - time.monotonic()

    def reason(self) -> SystemException:
        """Return the exception that says why there is no answer."""
        if self._communicator.destroyed:
            return CommunicatorDestroyedException(
                f"{self._what}: the communicator was destroyed during the call"
            )
        if not self._presence.reachable(self._target):
            return self._presence.explain_absence(self._target)
        if self.lost:
            return ConnectionLostException(f"{self._what}: the server restarted during the call")
        # Whoever told that the servant is crowded did so after word of a link that was lost before.
        crowded = self._was_crowded()
        # The servant's token outlives its link for a while, and may be back with another one.
        notice = 0.0 if crowded else _CLOSE_NOTICE if self._unsent else _LINK_NOTICE
        if self._presence.wait_for_link_loss(self._started, min(notice, max(0.0, self.time_left))):
            return ConnectionLostException(f"{self._what}: the connection was lost during the call")
        if crowded:
            return BusyException(f"{self._what} was not executed: too many calls wait for {self._target}")
        if not self._asked:
            return TimeoutException(
                f"{self._what} got no answer, nor does its process tell why: it hangs, or has too much to do"
            )
        if self._presence.came_since(self._target, self._started):
            return ConnectionLostException(f"{self._what}: its servant came during the call, and missed it")
        return AccessDeniedException(
            f"{self._what} was not executed: {self._target} is there, and access control does not let this "
            "component call it; `security` in its settings, and in those of the router, says who may"
        )

    def _is_lost(self) -> bool:
        return self._presence.lost_since(self._target, self._started)

    def _wait_for_loss(self) -> bool:
        limit = min(_LOSS_NOTICE, max(0.0, self.time_left))
        return self._presence.wait_for_loss(self._target, self._started, limit)

    def _was_crowded(self) -> bool:
        """Return whether calls may, as far as known, have fallen out of the queue since this one began."""
        until = min(self._deadline, time.monotonic() + _REST_NOTICE)
        while self._communicator.crowded_at.get(self._target, -math.inf) >= self._started:
            if not self._at_work or time.monotonic() >= until:
                return True
            # It may only not have come to rest yet after an earlier call; once it has, it knows.
            time.sleep(_LOOK_AGAIN)
            self._ask_status()
        return False

    def _ask_status(self) -> bool:
        """Ask how the servant is; return whether anybody told: its process may be gone, for instance."""
        communicator = self._communicator
        # Whoever looks at a future late finds no time left, and wants to know all the same.
        left = self.time_left
        limit = max(min(_STATUS_LIMIT, left), left * _STATUS_SHARE) if left > 0 else _LATE_STATUS_LIMIT
        serving = self._presence.serving(self._target)
        servers = [info.server for info in self._presence.servers(serving)][:_MOST_ASKED]
        for server in () if communicator.destroyed else servers:
            try:
                status = ask_process_status(communicator.session, serving.realm, server, limit / len(servers))
            except (ConnectionLostException, MarshalException):
                continue
            servant = status.servants.get(str(serving))
            if servant is not None:
                if len(communicator.crowded_at) >= _MOST_CROWDED:
                    communicator.crowded_at.clear()  # who needs to know asks again
                # By the moment of the answer: what was crowded since the question counts, too.
                communicator.crowded_at[self._target] = time.monotonic() - servant.crowded_ago
                self._at_work = servant.crowded_ago == 0
                return True
        return False
