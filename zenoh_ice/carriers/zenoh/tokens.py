"""Follow liveliness tokens: which of them come, and which end."""

from __future__ import annotations

import logging
import threading
import time
from collections.abc import Callable
from typing import Any, Final

import zenoh
from zenoh.handlers import Callback

from zenoh_ice.carriers.zenoh.session import undeclare

MOST_UNSURE: Final = 1 << 12
"""Reported tokens that wait to be confirmed: more mean a flood, and count at once."""
FEW: Final = 16
"""So many tokens are asked for one by one."""
MOST_QUESTIONS: Final = 16
"""How often a token is asked for while Zenoh drops the answers."""
PAUSE_STEP: Final = 0.005
"""Seconds by which each pause between these questions is longer: answers were dropped for up to 15 ms."""

_logger = logging.getLogger(__name__)


class Tokens:
    """Report each token that comes (True) or ends (False), those that exist first.

    A subscriber with history alone does not do. Zenoh reports what the session knows from other threads than
    the ends: such a report may come after the end, which Zenoh may even drop then, and it goes on reporting
    the token to later subscribers. So what is reported counts only when the session confirms it: it knows
    each token that it reports, and answers with those before a question returns. To ask is not enough
    either: Zenoh reports no end of a token that only an answer named when its router is lost.

    A token may be reported more than once as coming. Reports come one at a time: on Zenoh's threads, those of
    jobs, and the one that begins to follow. None comes after `close`.
    """

    def __init__(
        self,
        session: zenoh.Session,
        pattern: str,
        changed: Callable[[str, bool], object],
        submit: Callable[[Callable[[], object]], object],
        most_unsure: int = MOST_UNSURE,
        *,
        pause_step: float = PAUSE_STEP,
    ) -> None:
        """Follow the tokens of a pattern until `close`.

        `submit` runs a job on a thread that is none of Zenoh's; a job takes up to 0.2 ms for each token that
        it asks for, of which `most_unsure` may wait. Raises zenoh.ZError when the session is closed.
        """
        self._pattern: Final = pattern
        self._changed: Final = changed
        self._submit: Final = submit
        self._most_unsure: Final = most_unsure
        self._pause_step: Final = pause_step
        self._lock: Final = threading.Lock()
        self._unsure: set[str] = set()
        """The tokens that were reported, and did not come or end since."""
        self._asked: set[str] = set()
        """Those of them that are being asked for."""
        self._newest = ""
        """The token that came last: it is reported, too."""
        self._confirming = True
        self._closed = False
        self._liveliness: Final = session.liveliness()
        declare = self._liveliness.declare_subscriber
        self._subscribers: Final[tuple[zenoh.Subscriber[Any], ...]] = (
            declare(pattern, Callback(self._on_report, indirect=False), history=True),
            declare(pattern, Callback(self._on_news, indirect=False)),
        )
        self._confirm()

    def close(self) -> None:
        """Stop following, unless the session was closed meanwhile."""
        with self._lock:
            self._closed = True
        for subscriber in self._subscribers:
            undeclare(subscriber)

    def _on_news(self, sample: zenoh.Sample) -> None:
        """Report a token that comes: this subscriber has no history."""
        if sample.kind == zenoh.SampleKind.PUT:
            with self._lock:
                self._newest = token = str(sample.key_expr)
                self._settle(token, came=True)

    def _on_report(self, sample: zenoh.Sample) -> None:
        """Report a token that ends; keep one that exists, as it seems, until it is confirmed."""
        token = str(sample.key_expr)
        with self._lock:
            if sample.kind == zenoh.SampleKind.DELETE:
                self._newest = ""
                self._settle(token, came=False)
                return
            if token == self._newest or token in self._unsure:
                return
            if len(self._unsure) >= self._most_unsure:
                self._settle(token, came=True)
                return
            self._unsure.add(token)
            due, self._confirming = not self._confirming, True
        if due:
            self._submit(self._confirm)

    def _settle(self, token: str, *, came: bool) -> None:
        self._unsure.discard(token)
        self._asked.discard(token)
        if not self._closed:
            self._changed(token, came)

    def _confirm(self) -> None:
        """Ask for the tokens that were reported, and report those that exist."""
        with self._lock:
            self._asked, self._unsure = self._unsure, set()
            asked = frozenset(self._asked)
            self._confirming = bool(asked) and not self._closed
            if not self._confirming:
                return
        existing = self._existing(asked)
        with self._lock:
            for token in self._asked & existing:
                self._settle(token, came=True)
            asks = self._confirming = bool(self._unsure)
        if asks:
            self._submit(self._confirm)

    def _existing(self, asked: frozenset[str]) -> set[str]:
        """Return which tokens exist: those of many that the session names at once, then one by one."""
        existing: set[str] = set()
        if len(asked) > FEW:
            self._ask(self._pattern, asked, existing)
        unanswered = {*asked} - existing
        for number in range(MOST_QUESTIONS):
            time.sleep(number * self._pause_step)
            unanswered = {token for token in unanswered if not self._ask(token, asked, existing)} - existing
            if not unanswered:
                return existing
        _logger.warning("%s: %d tokens may have ended: Zenoh drops answers", self._pattern, len(unanswered))
        return existing | unanswered

    def _ask(self, key: str, asked: frozenset[str], existing: set[str]) -> bool:
        """Add the tokens of a key that are asked for and exist; return whether none was dropped."""
        ended_by: list[int] = []

        def answer(reply: zenoh.Reply) -> None:  # takes no lock: Zenoh holds one
            if reply.ok is not None and (token := str(reply.ok.key_expr)) in asked:
                existing.add(token)

        answers = Callback(answer, lambda: ended_by.append(threading.get_ident()), indirect=False)
        try:
            self._liveliness.get(key, handler=answers)
        except zenoh.ZError as error:
            _logger.debug("tokens not asked for, the session was closed: %s", error)
        # What the session knows comes on this thread. When the end of a router's answers comes meanwhile, on
        # another one, Zenoh drops the rest.
        return all(thread == threading.get_ident() for thread in ended_by)
