"""Who is there: servants by their liveliness tokens, and the links that lead to them."""

from __future__ import annotations

import difflib
import logging
import math
import threading
import time
from collections.abc import Callable, Sequence
from typing import Any, Final

import zenoh
from zenoh.handlers import Callback

from ..exceptions import (
    CommunicatorDestroyedException,
    ConnectFailedException,
    ConnectionLostException,
    FacetNotExistException,
    ObjectNotExistException,
    SystemException,
)
from ..identity import ANY_NAME, Target
from ..operation import OBJECT_TYPE_ID
from ..settings import Security
from ..stop_signals import unbroken
from .link_check import explain_endpoints
from .servant_table import ABSENT, ServantInfo, ServantTable
from .servant_tokens import parse_token

__all__ = ["Presence"]

# s after which a servant that is not heard of is absent, counted from the newest link or token: tokens come
# over a link within milliseconds of its making, and gossip makes the links to others within tens of them.
_GRACE: Final = 0.5
# s for the same, where nothing at all is served yet: a server listens before its robot is ready.
_START_GRACE: Final = 2.0
_GRACE_SHARE: Final = 0.1  # of the limit, where that is more: who sets a long one has a busy machine
# s between the end of a link and the end of the tokens that came over it, or the other way round.
_SAME_MOMENT: Final = 0.5

# s to wait for word of the end of a link after the end of a token that came over it; measured 1 ms.
_LINK_NOTICE: Final = 0.1

_MOST_NAMED: Final = 8  # servants in an error message

_logger = logging.getLogger(__name__)


class Presence:
    """Follow the servants of some realms.

    Zenoh's threads run the handlers here, so they only note what they are told, and nothing asks Zenoh for
    anything while it holds the lock that they take. `notify` hands a function to another thread.
    """

    def __init__(
        self,
        session: zenoh.Session,
        endpoints: Sequence[str],
        notify: Callable[[Callable[[], None]], None],
        security: Security | None = None,
    ) -> None:
        self._session: Final = session
        self._security: Final = security or Security()
        self._own_id: Final = str(session.zid())
        self._endpoints: Final = tuple(endpoints)
        self._notify: Final = notify
        self._changed = threading.Condition()
        self._table: Final = ServantTable()
        self._listeners: list[Callable[[], None]] = []
        self._telling = False  # the listeners, or about to
        self._linked: set[str] = set()
        self._last_news = time.monotonic()
        self._last_link_lost = -math.inf
        self._closed = False
        self._watched: dict[str, Any] = {}
        self._links: Final = session.info.declare_transport_events_listener(
            Callback(unbroken(self._on_link), indirect=False), history=True
        )

    # What others ask.

    def interfaces(self, target: Target) -> dict[str, str]:
        """Return the fingerprints of a servant's interfaces by type id; none when it is not there."""
        return self._table.interfaces.get(target, ABSENT)

    def serving(self, target: Target) -> Target:
        """Return what has the tokens: a target, or what stands for it where it has no servant of its own."""
        return self._table.serving(target)

    def reachable(self, target: Target) -> dict[str, str]:
        """Return as `interfaces` does those of whoever serves a target, a default servant perhaps."""
        return self._table.reachable(target)

    def servants(self, realm: str) -> list[ServantInfo]:
        """Return the servants of a realm, sorted by identity and facet."""
        with self._changed:
            found = [
                info
                for target, servers in self._table.servers.items()
                if target.realm == realm
                for info in servers.values()
            ]
        return sorted(found, key=lambda info: (info.identity, info.facet, info.since))

    def servers(self, target: Target) -> list[ServantInfo]:
        """Return who serves an identity, whoever did so first in front."""
        with self._changed:
            found = list(self._table.servers.get(target, {}).values())
        return sorted(found, key=lambda info: (info.since, info.server))

    def identities(self, realm: str) -> list[str]:
        """Return the identities that are served in a realm, sorted."""
        with self._changed:
            return sorted(
                target.identity
                for target in self._table.interfaces
                if target.realm == realm and not target.facet and not target.identity.endswith(ANY_NAME)
            )

    def is_lost(self, target: Target) -> bool:
        """Return whether a servant was there and is no longer."""
        return self._table.lost_at(target) > 0 and not self.reachable(target)

    def lost_since(self, target: Target, moment: float) -> bool:
        """Return whether a servant, or one of several, went away after a moment of the monotonic clock."""
        return self._table.lost_at(target) >= moment

    def came_since(self, target: Target, moment: float) -> bool:
        """Return whether whoever serves a target came after a moment of the monotonic clock."""
        return self._table.came_at(target) >= moment

    def wait_for_link_loss(self, moment: float, timeout: float) -> bool:
        """Wait for at most `timeout` s for the end of a link; return whether one ended after `moment`."""
        with self._changed:
            return self._changed.wait_for(lambda: self._closed or self._last_link_lost >= moment, timeout)

    def wait_for(
        self, target: Target, type_id: str | None, timeout: float, *, since: float | None = None
    ) -> bool:
        """Wait until a servant, with a certain interface if one is given, is there; return whether it is.

        It waits for at most `timeout` s, and less when those that could tell of the servant have told all,
        for which they have half a second from the moment of the monotonic clock `since`, now by default, two
        seconds while the realm is empty, and more if `timeout` is long.
        """
        self.watch(target.realm)
        now = time.monotonic()
        deadline = now + timeout
        start = now if since is None else since

        def found() -> bool:
            known = self.reachable(target)
            # A servant locator is an object and no more before it is asked.
            return bool(known) if type_id is None else type_id in known or OBJECT_TYPE_ID in known

        with self._changed:
            while not found() and not self._closed:
                until = deadline
                if not self._endpoints or self.linked():
                    grace = _GRACE if self._table.holds(target.realm) else _START_GRACE
                    grace = max(grace, timeout * _GRACE_SHARE)
                    until = min(until, max(start, self._last_news) + grace)
                left = until - time.monotonic()
                if left <= 0:
                    return False
                self._changed.wait(min(left, _GRACE))
            return found()

    def wait_for_loss(self, target: Target, moment: float, timeout: float) -> bool:
        """Wait for at most `timeout` s until a servant is gone; return whether it went after `moment`."""
        with self._changed:
            self._changed.wait_for(
                lambda: self._closed or not self.reachable(target) or self.lost_since(target, moment),
                timeout,
            )
            return self.lost_since(target, moment)

    def wait_until_gone(self, target: Target, timeout: float, server: str) -> bool:
        """Wait for at most `timeout` s until a server no longer serves an identity; return whether so."""
        with self._changed:
            return self._changed.wait_for(
                lambda: self._closed or server not in self._table.servers.get(target, {}), timeout
            )

    def wait_for_return(self, target: Target, timeout: float) -> bool:
        """Wait for at most `timeout` s until a lost servant is there again; return whether it is."""
        with self._changed:
            self._changed.wait_for(lambda: self._closed or bool(self.reachable(target)), timeout)
            return bool(self.reachable(target))

    def linked(self) -> bool:
        """Return whether any link to another process stands."""
        return bool(self._linked)

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
        if self._endpoints and not self.linked():
            return ConnectFailedException(explain_endpoints(self._endpoints, self._security), self._endpoints)
        facets = self._facets(target)
        if facets:
            return FacetNotExistException(
                f"no facet {target.facet!r} of {target.identity!r} in realm {target.realm!r}; "
                f"there is {', '.join(facets)}"
            )
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

    def _facets(self, target: Target) -> list[str]:
        """Return the facets of an identity that is served, without those of its own name."""
        with self._changed:
            found = [other.facet for other in self._table.interfaces if other[:2] == target[:2]]
        return sorted(repr(facet) if facet else "the identity itself" for facet in found)

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
                or not self.linked()
                or self._lost_behind_router(target)
            )

    def _lost_behind_router(self, target: Target) -> bool:
        """Return whether nothing is left of the server of a lost servant, to which no link of ours led."""
        server = self._table.last_server(target)
        if not server or server in self._linked or server == self._own_id:
            return False
        # All its tokens go together; it takes them one by one.
        return self._changed.wait_for(lambda: not self._table.serves(server), _LINK_NOTICE)

    # What others register.

    def watch(self, realm: str) -> None:
        """Follow the servants of a realm from now on."""
        with self._changed:
            if realm in self._watched or self._closed:
                return
            self._watched[realm] = None
        self._watched[realm] = self._session.liveliness().declare_subscriber(
            f"@servant/{realm}/**", Callback(unbroken(self._on_servant), indirect=False), history=True
        )

    def add_listener(self, listener: Callable[[], None]) -> None:
        """Call a function of ours whenever a servant comes or goes."""
        with self._changed:
            self._listeners.append(listener)

    def close(self) -> None:
        """Follow nobody any longer; whoever waits is told."""
        with self._changed:
            self._closed = True
            self._changed.notify_all()
            watched = [subscriber for subscriber in self._watched.values() if subscriber is not None]
            self._watched.clear()
            listeners = list(self._listeners)
        for listener in listeners:
            listener()
        for subscriber in watched:
            subscriber.undeclare()
        self._links.undeclare()

    # On Zenoh's threads.

    def _on_servant(self, sample: zenoh.Sample) -> None:
        token = parse_token(str(sample.key_expr))
        if token is None:
            return
        with self._changed:
            if sample.kind == zenoh.SampleKind.PUT:
                self._table.add(token)
                self._last_news = time.monotonic()
            else:
                self._table.remove(token)
            self._changed.notify_all()
            tell, self._telling = not self._telling, True
        if tell:  # once for all that comes meanwhile: a flood of tokens must not fill the queue of jobs
            self._notify(self._tell)

    def _tell(self) -> None:
        """Tell the listeners, on another thread than Zenoh's."""
        with self._changed:
            self._telling = False
            listeners = list(self._listeners)
        for listener in listeners:
            listener()

    def _on_link(self, event: zenoh.TransportEvent) -> None:
        peer = str(event.transport.zid)
        with self._changed:
            if event.kind == zenoh.SampleKind.PUT:
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
