"""Presence: servants and clients by their liveliness tokens, links, and why a call failed."""

from __future__ import annotations

import difflib
import logging
import math
import threading
import time
from collections import ChainMap, deque
from collections.abc import Callable, Iterable, Mapping
from contextlib import suppress
from typing import Any, Final, NamedTuple

from zenoh_ice.data import exceptions
from zenoh_ice.data.keys import (
    FORMAT,
    ServantToken,
    Target,
    any_client,
    parse_client_token,
    parse_servant_token,
    server_of_unknown_token,
)
from zenoh_ice.data.status import own_version, version_in_status, versions
from zenoh_ice.data.text import few, sentence
from zenoh_ice.threads.limits import LIMITS, Limits
from zenoh_ice.transport import NoAnswer, Transport

# No robot has more of these: more means a flood.
_MOST_SERVANTS: Final = 4096
_MOST_OF_SERVANT: Final = 64  # tokens: of one identity, one for each interface of each server
_MOST_CLIENTS: Final = 1 << 14
_MOST_LOST: Final = 1 << 10  # that may still have calls waiting here

# Factor of the delay of tokens in an empty realm: a server listens before its robot is ready.
_START_GRACE: Final = 4
_GRACE_SHARE: Final = 0.1  # of the limit of a call, if that is more: a long limit means a busy machine
# s between the end of a link and the end of the tokens that came over it, or the other way round.
_SAME_MOMENT: Final = 0.5
_VERSION_LIMIT: Final = 1.0  # s in which a server of another version says which one it has
_LINK_NOTICE: Final = 0.1  # s in which the end of a link follows that of its tokens; measured 1 ms
_NEVER: Final = (-math.inf, "")

_logger = logging.getLogger(__name__)


class ServantInfo(NamedTuple):
    """A servant that is present, according to its tokens."""

    identity: str
    interfaces: dict[str, str]  # the fingerprint of each of its interfaces by type id
    server: str  # id of the session that serves it
    since: float  # wall time of the server's machine when it began to, in s since the epoch
    format: int = FORMAT  # of calls and samples; another one than ours belongs to another version


class Presence:
    """Follow the servants of some realms.

    The handlers here run on the transport's threads. They therefore only record what they receive, and the
    transport is never called with their lock held. `submit` runs a function on another thread; `is_served`
    asks a process that seems to serve a target whether it does, with a limit in s.
    Memory use is bounded, whatever tokens a stranger declares. A warning is logged when no link is left and
    the process `needs_links`.
    """

    def __init__(
        self,
        transport: Transport,
        submit: Callable[[Callable[[], object]], None],
        *,
        is_served: Callable[[Target, float], bool],
        needs_links: bool,
        limits: Limits = LIMITS,
    ) -> None:
        self._transport: Final = transport
        self._submit: Final = submit
        self.is_served: Final = is_served
        self._endpoints: Final = tuple(transport.endpoints)
        self._limits: Final = limits
        self.needs_links = needs_links
        self._changed: Final = threading.Condition()
        self._tokens: Final[dict[Target, dict[str, ServantToken]]] = {}  # by their keys
        self._count = 0  # of these tokens
        self._unknown: Final[dict[str, str]] = {}  # servers by tokens that only another version understands
        # The fingerprints of each servant's interfaces by type id; replaced as a whole: readers take no lock.
        self.present: Final[dict[Target, Mapping[str, str]]] = {}
        self._came: Final[dict[Target, float]] = {}  # when its last server did, of what is there
        self._lost: Final[dict[Target, tuple[float, str]]] = {}  # when, and the id of the last server
        self._listeners: list[Callable[[], object]] = []
        self._notifying = False  # the listeners, or about to
        self._linked: set[str] = set()
        self._last_news = time.monotonic()
        self._last_link_lost = -math.inf
        self._closed = False
        self._realms: Final[set[str]] = set()
        self._watches: Final = [transport.watch_links(self._on_link)]

    # Lookups.

    def interfaces(self, target: Target) -> Mapping[str, str]:
        """Return the fingerprints of a servant's interfaces by type id; none when it is not present.

        If an identity has several servers with different interfaces, those of the first server count.
        """
        return self.present.get(target, {})

    def identities(self, realm: str) -> list[str]:
        """Return the identities that are served in a realm, sorted."""
        with self._changed:
            return sorted(target.identity for target in self._tokens if target.realm == realm)

    def servants(self, realm: str) -> list[ServantInfo]:
        """Return the servants of a realm, sorted by identity."""
        return [info for identity in self.identities(realm) for info in self.servers(Target(realm, identity))]

    def servers(self, target: Target) -> list[ServantInfo]:
        """Return the servers of an identity, the earliest first."""
        found: dict[str, ServantInfo] = {}
        with self._changed:
            for token in self._tokens.get(target, {}).values():
                new = ServantInfo(target.identity, {}, token.server, token.since, token.format)
                found.setdefault(token.server, new).interfaces[token.type_id] = token.fingerprint
        return sorted(found.values(), key=lambda info: (info.since, info.server))

    def others(self, server: str) -> set[tuple[str, Target]]:
        """Return all servers but one, each with an identity that it serves."""
        with self._changed:
            tokens = [token for each in self._tokens.values() for token in each.values()]
        return {(token.server, token.target) for token in tokens if token.server != server}

    def has_other_format(self, target: Target) -> bool:
        """Return whether a present servant understands other calls and samples than ours."""
        server = next(iter(self.servers(target)), None)
        return server is not None and server.format != FORMAT

    def is_lost(self, target: Target) -> bool:
        """Return whether a servant was present and is not any more."""
        return target in self._lost and target not in self.present

    def lost_since(self, target: Target, moment: float) -> bool:
        """Return whether a servant, or one of several, was lost after a moment of the monotonic clock."""
        return self._lost.get(target, _NEVER)[0] >= moment

    def came_since(self, target: Target, moment: float) -> bool:
        """Return whether a server of a present servant appeared after a moment of the monotonic clock."""
        return self._came.get(target, -math.inf) >= moment

    def linked(self) -> bool:
        """Return whether any link to another process exists."""
        return bool(self._linked)

    # Waits.

    def wait_for(
        self, target: Target, type_id: str | None, timeout: float, *, since: float | None = None
    ) -> bool:
        """Wait until a servant, with a certain interface if one is given, is present; return whether it is.

        Waits for at most `timeout` s, and less once every process that could know the servant must have
        reported it. They have half a second for that from `since`, a moment of the monotonic clock, now by
        default; two seconds while the realm is empty, or if `timeout` is long.
        """
        self.watch(target.realm)
        now = time.monotonic()

        def found() -> bool:
            known = self.interfaces(target)
            return bool(known) if type_id is None else type_id in known

        with self._changed:
            while not found() and not self._closed:
                until = now + timeout
                if not self._endpoints or self._linked:
                    delay = self._transport.token_delay
                    if not any(known.realm == target.realm for known in self._tokens):
                        delay *= _START_GRACE
                    longer = min(timeout * _GRACE_SHARE, self._limits.longest_grace)
                    grace = max(delay, longer) if delay else 0.0
                    until = min(until, max(now if since is None else since, self._last_news) + grace)
                left = until - time.monotonic()
                if left <= 0:
                    return False
                self._changed.wait(left)
            return found()

    def wait_for_return(self, target: Target, timeout: float) -> bool:
        """Wait for at most `timeout` s until a lost servant is present again; return whether it is."""
        return self._wait_until(lambda: target in self.present, timeout)

    def wait_until_gone(self, target: Target, timeout: float, server: str) -> bool:
        """Wait for at most `timeout` s until a server stops serving an identity; return whether it did."""
        return self._wait_until(lambda: not _serves(server, self._tokens.get(target, {})), timeout)

    def _wait_until(self, condition: Callable[[], bool], timeout: float) -> bool:
        with self._changed:
            self._changed.wait_for(lambda: self._closed or condition(), timeout)
            return condition()

    # Explanations.

    def explain_absence(self, target: Target, limit: float = math.inf) -> exceptions.SystemException:
        """Return the exception that says why a servant cannot be called, after at most 2.5 or `limit` s."""
        if self._closed:
            return exceptions.CommunicatorDestroyedException("the communicator was destroyed")
        if self._lost_with_its_process(target, limit):
            what, addresses = sentence(f"the server of {target} is offline"), ", ".join(self._endpoints)
            if addresses:
                what = sentence(f"{what} (connecting to {addresses})")
            return exceptions.ConnectionLostException(f"{what}; {sentence('calls continue when it is back')}")
        if self._endpoints and not self._linked:
            return exceptions.ConnectFailedException(self._transport.explain_unreachable(limit))
        present = self.identities(target.realm)
        shown = difflib.get_close_matches(target.identity, present, 3, 0.5) or present
        servant, realm, other = target.identity, target.realm, self.other_version_in(target.realm, limit)
        what = sentence(f"no servant {servant!r} in realm {realm!r}")
        if shown:
            what = sentence(f"no servant {servant!r} in realm {realm!r}; there is {few(shown, 8)}")
        if other:
            what = f"{what}; the realm has {other}"
        elif not shown:
            what = f"{what}; " + sentence("the realm has no servants: no robot is here")
        return exceptions.ObjectNotExistException(what)

    def other_version_in(self, realm: str, limit: float = math.inf) -> str:
        """Return that a realm has servants of another version of VisualHFSM, and which; empty if it has none.

        Asks one of their servers, for at most 1 or `limit` s.
        """
        with self._changed:
            servers = {server for key, server in self._unknown.items() if key.split("/")[1] == realm}
        if not servers:
            return ""
        server = max(servers)  # a name, if any of the tokens has one
        return f"servants of {versions(self._version(realm, server, limit) if server else '')}"

    def other_version(self, target: Target, limit: float) -> str:
        """Return that the server of a present servant has another version of VisualHFSM; empty if it has not.

        Asks it for its version, for at most 1 or `limit` s.
        """
        server = next(iter(self.servers(target)), None)
        if server is None:
            return ""
        theirs = self._version(target.realm, server.server, limit)
        is_other = server.format != FORMAT or theirs not in {"", "unknown", own_version()}
        return f"its server has {versions(theirs)}" if is_other else ""

    def _version(self, realm: str, server: str, limit: float) -> str:
        """Return the version of a server; empty where it does not say it."""
        with suppress(exceptions.SystemException):
            return version_in_status(self._transport.ask_status(realm, server, min(_VERSION_LIMIT, limit)))
        return ""

    def explain_no_answer(
        self,
        target: Target,
        what: str,
        started: float,
        timeout: float,
        end: NoAnswer,
        *,
        limit: float | None = None,
    ) -> exceptions.SystemException:
        """Return the exception of a call that ended without an answer.

        `started` is the moment of the monotonic clock when it was sent, `timeout` its limit in s, which may
        have passed; `limit` is the one that was set, if the call had waited before. Servants answer every
        call that reaches them. If the call ended before its limit although the servant and the connection are
        well, it never reached the servant: access control dropped it.
        """
        served = False
        # There will be no further news of a servant that was offline before the call.
        unexplained = not end.timed_out and target in self.present and not self.lost_since(target, started)
        if unexplained and not self.came_since(target, started):  # a new server never received the call
            served = self.is_served(target, started + timeout - time.monotonic())
        if unexplained and not served:
            self._wait_until(lambda: self.lost_since(target, started), self._limits.loss_notice)
        if self._closed:
            return exceptions.CommunicatorDestroyedException(
                f"{what}: the communicator was destroyed during the call"
            )
        if target not in self.present:
            return self.explain_absence(target)
        if self.lost_since(target, started):
            lost = sentence(f"{what}: the server restarted during the call")
        elif self._last_link_lost >= started:
            lost = sentence(f"{what}: the connection was lost during the call")
        elif end.timed_out:
            return exceptions.TimeoutException(
                sentence(f"{what} did not answer within {limit or timeout:g} s")
            )
        elif self.came_since(target, started):
            lost = sentence(f"{what}: its servant started during the call, and missed it")
        elif not served:
            lost = sentence(f"{what} got no answer, and its process does not answer either")
        elif end.broken:
            lost = sentence(f"{what}: the connection was lost during the call")
        else:
            return exceptions.AccessDeniedException(
                sentence(
                    f"{what} was not executed: {target} exists, but access control does not let this "
                    "component call it; `security` in its settings, and in those of the router, says who may"
                )
            )
        return exceptions.ConnectionLostException(lost)

    def _lost_with_its_process(self, target: Target, limit: float) -> bool:
        """Return whether a servant was lost because its process ended or its link broke."""
        lost, server = self._lost.get(target, _NEVER)

        def gone() -> bool:
            if abs(lost - self._last_link_lost) < _SAME_MOMENT or not self._linked:
                return True
            if server in self._linked or server == self._transport.id:
                return False
            return not any(_serves(server, tokens) for tokens in self._tokens.values())  # behind a router

        # The ends of the link and of all tokens of a process are reported one by one.
        fresh = time.monotonic() - lost < _SAME_MOMENT
        return bool(server) and self._wait_until(gone, min(_LINK_NOTICE, limit) if fresh else 0.0)

    # Watching.

    def watch(self, realm: str) -> None:
        """Follow the servants of a realm from now on."""
        with self._changed:
            if realm in self._realms or self._closed:
                return
            self._realms.add(realm)
        self._watches.append(self._transport.watch(f"@servant/{realm}/**", self._on_token))

    def add_listener(self, listener: Callable[[], object]) -> None:
        """Call a function of ours whenever a servant appears or disappears, and at the end."""
        self._listeners.append(listener)

    def close(self) -> None:
        """Stop following; wake up all waiting threads."""
        with self._changed:
            self._closed = True
            self._changed.notify_all()
        self._notify()
        for watch in tuple(self._watches):
            watch.close()

    # On the transport's threads.

    def _on_token(self, key: str, came: bool) -> None:
        token = parse_servant_token(key)
        if token is None:
            self._on_unknown_token(key, came)
            return
        target = token.target
        with self._changed:
            now, tokens = time.monotonic(), self._tokens.get(target, {})
            if came:
                self._last_news = now
                full = len(tokens) >= _MOST_OF_SERVANT or self._count >= self._limits.tokens
                if key in tokens or full or (not tokens and len(self._tokens) >= _MOST_SERVANTS):
                    return
                if not _serves(token.server, tokens):
                    self._came[target] = now
                if not tokens and target in self._lost:
                    _logger.info("%s is back", target)
                tokens[key] = token
                self._count += 1
            else:
                if tokens.pop(key, None) is None:
                    return
                self._count -= 1
                if not _serves(token.server, tokens):
                    if target not in self._lost and len(self._lost) >= _MOST_SERVANTS:
                        del self._lost[next(iter(self._lost))]
                    self._lost[target] = now, token.server
            if tokens:
                self._tokens[target] = tokens
                self.present[target] = dict(ChainMap(*(info.interfaces for info in self.servers(target))))
            else:
                del self._tokens[target], self.present[target], self._came[target]
                _logger.info("%s is gone", target)
            self._changed.notify_all()
            notify, self._notifying = not self._notifying, True
        if notify:  # once for all that arrive meanwhile: a flood of tokens must not fill the job queue
            self._submit(self._notify)

    def _on_unknown_token(self, key: str, came: bool) -> None:
        server = server_of_unknown_token(key)
        with self._changed:
            if not came:
                self._unknown.pop(key, None)
            elif server is not None and len(self._unknown) < _MOST_OF_SERVANT:
                self._unknown[key] = server
                self._last_news = time.monotonic()

    def _notify(self) -> None:
        with self._changed:
            self._notifying = False
        for listener in tuple(self._listeners):
            listener()

    def _on_link(self, peer: str, up: bool) -> None:
        with self._changed:
            if up:
                self._linked.add(peer)
                self._last_news = time.monotonic()
            else:
                self._linked.discard(peer)
                self._last_link_lost = time.monotonic()
                if self.needs_links and self._endpoints and not self._linked and not self._closed:
                    _logger.warning(
                        "no process is linked any more; connecting again to %s", ", ".join(self._endpoints)
                    )
            self._changed.notify_all()


def _serves(server: str, tokens: Mapping[str, ServantToken]) -> bool:
    return any(token.server == server for token in tokens.values())


class ClientWatch:
    """Call a function with the id of each client of a realm that is lost, one after the other.

    `close` ends the watch. The first token with a client's id represents the client: only the end of that
    token is its end. Later tokens with the same id, which others may declare and end, have no effect.

    A call over a local socket may come before its client's token, which comes over the network. A client that
    is killed in between has no token that ends: it is lost when none has come for a while after its call, and
    so is one whose call was executed after its end.
    """

    def __init__(
        self,
        transport: Transport,
        realm: str,
        callback: Callable[[str], Any],
        submit: Callable[[Callable[[], object]], None],
        forget: Callable[[ClientWatch], object],
        *,
        limits: Limits = LIMITS,
    ) -> None:
        self._own_id: Final = transport.id
        self._callback: Final = callback
        self._submit: Final = submit
        self._forget: Final = forget
        self._token_checks: Final = limits.token_checks
        self._lock: Final = threading.Lock()
        self.present: Final[dict[str, str]] = {}
        """The first token of each present client."""
        self._without_token: Final[dict[str, int]] = {}  # clients that called, and checks since
        self._gone: Final[dict[str, None]] = {}  # the clients lost last, in this order
        self._lost: Final[deque[str]] = deque()  # the first is being reported
        self._closed = False
        self._warned = False  # of a client of another version
        self._following: Final = transport.watch(any_client(realm), self._on_token)

    def close(self) -> None:
        """Begin no more calls; a running one continues."""
        with self._lock:
            self._closed = True
        self._forget(self)
        self._following.close()

    def is_lost(self, client: str) -> bool:
        """Return whether a client was lost recently and has not come back, as after a break of its link."""
        return client in self._gone

    def note_call(self, client: str) -> None:
        """Note that a call of a client is executed, or was: it should have a token."""
        if client in self.present or not client or client == self._own_id:
            return
        with self._lock:
            if not self._closed and len(self._without_token) < _MOST_CLIENTS:
                self._without_token[client] = 0

    def check(self) -> None:
        """Notice clients whose tokens did not come; called at each check of the pool's watch."""
        if not self._without_token:
            return
        # Counted in checks: nobody checks in a process that stands still, and the tokens wait to be read.
        with self._lock:
            for client in self._without_token:
                self._without_token[client] += 1
            late = [client for client, checks in self._without_token.items() if checks >= self._token_checks]
            for client in late:
                del self._without_token[client]
            begins = self._lose(client for client in late if client not in self.present)
        if begins:
            self._submit(self._report_next)

    def _on_token(self, key: str, came: bool) -> None:  # on the transport's thread
        client = parse_client_token(key)
        if came and not client and not self._warned:
            self._warned = True
            _logger.warning(
                "a client of another version of VisualHFSM is in the realm and may not find these servants; "
                "this is %s: install the same version on both sides",
                own_version(),
            )
        begins = False
        with self._lock:
            if came and client and len(self.present) < _MOST_CLIENTS:
                self.present.setdefault(client, key)
                self._gone.pop(client, None)
            elif not came and self.present.get(client) == key:
                del self.present[client]
                begins = self._lose([client])
        if begins:
            self._submit(self._report_next)

    def _lose(self, clients: Iterable[str]) -> bool:
        """Note clients as lost; return whether to begin to report them. Needs the lock: a token may come."""
        reporting = bool(self._lost)
        for client in clients:
            self._gone[client] = None
            if len(self._gone) > _MOST_LOST:
                del self._gone[next(iter(self._gone))]
            self._lost.append(client)
        return not reporting and bool(self._lost)

    def _report_next(self) -> None:
        try:
            if not self._closed:
                self._callback(self._lost[0])
        finally:
            with self._lock:
                self._lost.popleft()
                left = bool(self._lost)
            if left:  # so that other jobs run in between
                self._submit(self._report_next)
