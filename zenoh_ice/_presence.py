"""Who is there: servants by their liveliness tokens, the links that lead to them, and why a call failed."""

from __future__ import annotations

import difflib
import logging
import math
import threading
import time
from collections.abc import Callable, Mapping
from typing import Final

from ._tokens import ABSENT, ServantInfo, ServantTable, parse_servant_token
from .exceptions import (
    AccessDeniedException,
    CommunicatorDestroyedException,
    ConnectFailedException,
    ConnectionLostException,
    ObjectNotExistException,
    SystemException,
    TimeoutException,
)
from .transport import Served, Target, Transport

__all__ = ["Presence"]

_LOOK: Final = 0.5  # s after which a wait looks anyway
# By which the delay of tokens is longer in an empty realm: a server listens before its robot is ready.
_START_GRACE: Final = 4
_GRACE_SHARE: Final = 0.1  # of the limit, where that is more: a long one means a busy machine
# s between the end of a link and the end of the tokens that came over it, or the other way round.
_SAME_MOMENT: Final = 0.5
# s to wait for word of the end of a link after the end of a token that came over it; measured 1 ms.
_LINK_NOTICE: Final = 0.1
# s in which the token of a servant that died during a call goes away; measured 2-3 ms.
_LOSS_NOTICE: Final = 0.25

_MOST_NAMED: Final = 8  # servants in an error message

_logger = logging.getLogger(__name__)


class Presence:
    """Follow the servants of some realms.

    The transport's threads run the handlers here, so they only note what they are given, and nothing asks the
    transport for anything while it holds the lock that they take. `submit` runs a function on another thread.
    """

    def __init__(self, transport: Transport, submit: Callable[[Callable[[], object]], None]) -> None:
        self._transport: Final = transport
        self._submit: Final = submit
        self._endpoints: Final = tuple(transport.endpoints)
        self._changed: Final = threading.Condition()
        self._table: Final = ServantTable()
        self._listeners: list[Callable[[], object]] = []
        self._notifying = False  # the listeners, or about to
        self._linked: set[str] = set()
        self._last_news = time.monotonic()
        self._last_link_lost = -math.inf
        self._closed = False
        self._watched: dict[str, Served | None] = {}
        self._links: Final = transport.watch_links(self._on_link)

    # Lookups.

    def interfaces(self, target: Target) -> Mapping[str, str]:
        """Return the fingerprints of a servant's interfaces by type id; none when it is not there."""
        return self._table.interfaces.get(target, ABSENT)

    def servants(self, realm: str) -> list[ServantInfo]:
        """Return the servants of a realm, sorted by identity."""
        with self._changed:
            found = [
                info
                for target, servers in self._table.servers.items()
                if target.realm == realm
                for info in servers.values()
            ]
        return sorted(found, key=lambda info: (info.identity, info.since))

    def servers(self, target: Target) -> list[ServantInfo]:
        """Return who serves an identity, the first to do so in front."""
        with self._changed:
            found = list(self._table.servers.get(target, {}).values())
        return sorted(found, key=lambda info: (info.since, info.server))

    def identities(self, realm: str) -> list[str]:
        """Return the identities that are served in a realm, sorted."""
        with self._changed:
            return sorted(target.identity for target in self._table.interfaces if target.realm == realm)

    def is_lost(self, target: Target) -> bool:
        """Return whether a servant was there and is no longer."""
        return self._table.lost_at(target) > 0 and target not in self._table.interfaces

    def lost_since(self, target: Target, moment: float) -> bool:
        """Return whether a servant, or one of several, went away after a moment of the monotonic clock."""
        return self._table.lost_at(target) >= moment

    def linked(self) -> bool:
        """Return whether any link to another process stands."""
        return bool(self._linked)

    # Waits.

    def wait_for(
        self, target: Target, type_id: str | None, timeout: float, *, since: float | None = None
    ) -> bool:
        """Wait until a servant, with a certain interface if one is given, is there; return whether it is.

        It waits for at most `timeout` s, and less when those that could know of the servant have reported
        all, for which they have half a second from the moment of the monotonic clock `since`, now by default,
        two seconds while the realm is empty, and more if `timeout` is long.
        """
        self.watch(target.realm)
        now = time.monotonic()
        deadline = now + timeout
        start = now if since is None else since

        def found() -> bool:
            known = self.interfaces(target)
            return bool(known) if type_id is None else type_id in known

        with self._changed:
            while not found() and not self._closed:
                until = deadline
                if not self._endpoints or self._linked:
                    delay = self._transport.token_delay
                    if not self._table.holds(target.realm):
                        delay *= _START_GRACE
                    grace = max(delay, timeout * _GRACE_SHARE) if delay else 0.0
                    until = min(until, max(start, self._last_news) + grace)
                left = until - time.monotonic()
                if left <= 0:
                    return False
                self._changed.wait(min(left, _LOOK))
            return found()

    def wait_for_return(self, target: Target, timeout: float) -> bool:
        """Wait for at most `timeout` s until a lost servant is there again; return whether it is."""
        with self._changed:
            self._changed.wait_for(lambda: self._closed or target in self._table.interfaces, timeout)
            return target in self._table.interfaces

    def wait_until_gone(self, target: Target, timeout: float, server: str) -> bool:
        """Wait for at most `timeout` s until a server no longer serves an identity; return whether so."""
        with self._changed:
            return self._changed.wait_for(
                lambda: self._closed or server not in self._table.servers.get(target, {}), timeout
            )

    # Explanations.

    def explain_absence(self, target: Target) -> SystemException:
        """Return the exception that says why a servant cannot be called."""
        if self._closed:
            return CommunicatorDestroyedException("the communicator was destroyed")
        endpoints = ", ".join(self._endpoints)
        if self._lost_with_its_link(target):
            return ConnectionLostException(
                f"the server of {target} went away{f' (connecting to {endpoints})' if endpoints else ''}; "
                "calls go on as soon as it is back"
            )
        if self._endpoints and not self._linked:
            return ConnectFailedException(self._transport.explain_unreachable(), self._endpoints)
        present = self.identities(target.realm)
        near = difflib.get_close_matches(target.identity, present, 3, 0.5)
        if near or len(present) <= _MOST_NAMED:
            names = ", ".join(near or present)
        else:
            names = f"{', '.join(present[:_MOST_NAMED])} and {len(present) - _MOST_NAMED} more"
        return ObjectNotExistException(
            f"no servant {target.identity!r} in realm {target.realm!r}; "
            + (f"there is {names}" if names else "the realm has no servants: is --realm right?")
        )

    def explain_no_answer(
        self,
        target: Target,
        what: str,
        started: float,
        *,
        timeout: float | None,
        is_served: Callable[[], bool],
    ) -> SystemException:
        """Return the exception of a call that ended without an answer.

        `started` is the moment of the monotonic clock when it began, `timeout` its limit in s if that has
        passed. Servants answer every call that reaches them. So where the call ended before its limit, and
        `is_served` finds that the servant is well, it did not get there: access control dropped it.
        """
        served = False
        # Of one that was away before the call no more word will come.
        if timeout is None and target in self._table.interfaces and not self.lost_since(target, started):
            served = is_served()
            if not served:
                with self._changed:
                    self._changed.wait_for(
                        lambda: self._closed or self.lost_since(target, started), _LOSS_NOTICE
                    )
        if self._closed:
            return CommunicatorDestroyedException(f"{what}: the communicator was destroyed during the call")
        if target not in self._table.interfaces:
            return self.explain_absence(target)
        if self.lost_since(target, started):
            return ConnectionLostException(f"{what}: the server restarted during the call")
        if self._last_link_lost >= started:
            return ConnectionLostException(f"{what}: the connection was lost during the call")
        if timeout is not None:
            return TimeoutException(f"{what} did not answer within {timeout:g} s")
        if self._table.came_at(target) >= started:
            return ConnectionLostException(f"{what}: its servant came during the call, and missed it")
        if not served:
            return ConnectionLostException(f"{what} got no answer, and its process does not answer either")
        return AccessDeniedException(
            f"{what} was not executed: {target} is there, and access control does not let this component "
            "call it; `security` in its settings, and in those of the router, says who may"
        )

    def _lost_with_its_link(self, target: Target) -> bool:
        """Return whether a servant went away because its process did, or the way to it."""
        with self._changed:
            lost = self._table.lost_at(target)
            if lost <= 0:
                return False
            if time.monotonic() - lost < _SAME_MOMENT:  # word of the link may still be on its way
                self._changed.wait_for(lambda: abs(lost - self._last_link_lost) < _SAME_MOMENT, _LINK_NOTICE)
            return (
                abs(lost - self._last_link_lost) < _SAME_MOMENT
                or not self._linked
                or self._lost_behind_router(target)
            )

    def _lost_behind_router(self, target: Target) -> bool:
        """Return whether nothing is left of the server of a lost servant, to which no link of ours led."""
        server = self._table.last_server(target)
        if not server or server in self._linked or server == self._transport.id:
            return False
        # All its tokens go together, and arrive one by one.
        return self._changed.wait_for(lambda: not self._table.serves(server), _LINK_NOTICE)

    # Watching.

    def watch(self, realm: str) -> None:
        """Follow the servants of a realm from now on."""
        with self._changed:
            if realm in self._watched or self._closed:
                return
            self._watched[realm] = None
        self._watched[realm] = self._transport.watch(f"@servant/{realm}/**", self._on_token)

    def add_listener(self, listener: Callable[[], object]) -> None:
        """Call a function of ours whenever a servant comes or goes, and at the end."""
        with self._changed:
            self._listeners.append(listener)

    def close(self) -> None:
        """Follow nobody any longer; those who wait wake up."""
        with self._changed:
            self._closed = True
            self._changed.notify_all()
            watched = [watch for watch in self._watched.values() if watch is not None]
            self._watched.clear()
            listeners = list(self._listeners)
        for listener in listeners:
            listener()
        for watch in watched:
            watch.close()
        self._links.close()

    # On the transport's threads.

    def _on_token(self, key: str, came: bool) -> None:
        token = parse_servant_token(key)
        if token is None:
            return
        with self._changed:
            if came:
                self._table.add(token)
                self._last_news = time.monotonic()
            else:
                self._table.remove(token)
            self._changed.notify_all()
            notify, self._notifying = not self._notifying, True
        if notify:  # once for all that comes meanwhile: a flood of tokens must not fill the queue of jobs
            self._submit(self._notify)

    def _notify(self) -> None:
        with self._changed:
            self._notifying = False
            listeners = list(self._listeners)
        for listener in listeners:
            listener()

    def _on_link(self, peer: str, up: bool) -> None:
        with self._changed:
            if up:
                self._linked.add(peer)
                self._last_news = time.monotonic()
            else:
                self._linked.discard(peer)
                self._last_link_lost = time.monotonic()
                if self._endpoints and not self._linked and not self._closed:
                    _logger.warning(
                        "no process is linked any more; connecting again to %s", ", ".join(self._endpoints)
                    )
            self._changed.notify_all()
