"""Why a call ended without an answer: Zenoh tells no reasons, so those who are there are asked."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING, Final

from .exceptions import (
    AccessDeniedException,
    BusyException,
    CommunicatorDestroyedException,
    ConnectionLostException,
    MarshalException,
    SystemException,
    TimeoutException,
)
from .identity import Target
from .process_status import ServantStatus, ask_process_status

if TYPE_CHECKING:
    from .communicator import Communicator

__all__ = ["UnansweredCall"]

# s in which the token of a servant that died during a call goes away; measured 2-3 ms.
_LOSS_NOTICE: Final = 0.25
# s in which word comes of the end of the link that a call or its answer was lost with; measured 1 ms.
_LINK_NOTICE: Final = 0.02
# s in which word comes that the link was closed over which a message could not be sent.
_CLOSE_NOTICE: Final = 1.0
# s for which a process that seems to be there is asked how its servants are.
_STATUS_LIMIT: Final = 0.5
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
        self._took: Final = time.monotonic() - started
        self._unsent: Final = self._took >= send_limit
        self._status: Final = None if self._is_lost() else self._ask_status()
        self.lost: Final = self._is_lost() or (self._status is None and self._wait_for_loss())
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
        # The servant's token outlives its link for a while, and may be back with another one.
        notice = _CLOSE_NOTICE if self._unsent else _LINK_NOTICE
        if self._presence.wait_for_link_loss(self._started, min(notice, max(0.0, self.time_left))):
            return ConnectionLostException(f"{self._what}: the connection was lost during the call")
        if self.time_left <= 0:
            return TimeoutException(f"{self._what} did not answer in time")
        if self._status is not None and self._status.busy_for >= self._took:
            return BusyException(f"{self._what} was not executed: too many calls wait for {self._target}")
        return AccessDeniedException(
            f"{self._what} was not executed: {self._target} is there, and access control does not let this "
            "component call it; `security` in its settings, and in those of the router, says who may"
        )

    def _is_lost(self) -> bool:
        return self._presence.lost_since(self._target, self._started)

    def _wait_for_loss(self) -> bool:
        limit = min(_LOSS_NOTICE, max(0.0, self.time_left))
        return self._presence.wait_for_loss(self._target, self._started, limit)

    def _ask_status(self) -> ServantStatus | None:
        """Return how the servant is; None when nobody tells, its process being gone, for instance."""
        communicator, limit = self._communicator, min(_STATUS_LIMIT, self.time_left)
        serving = self._presence.serving(self._target)
        servers = [info.server for info in self._presence.servers(serving)][:_MOST_ASKED]
        for server in servers if limit > 0 and not communicator.destroyed else ():
            try:
                status = ask_process_status(communicator.session, serving.realm, server, limit / len(servers))
            except (ConnectionLostException, MarshalException):
                continue
            if str(serving) in status.servants:
                return status.servants[str(serving)]
        return None
