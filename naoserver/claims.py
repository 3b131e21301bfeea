"""Whose joints are whose: what moves some by itself, such as the walk or a motion, keeps others off them."""

from __future__ import annotations

import logging
import threading
from collections.abc import Callable, Iterable
from dataclasses import dataclass

from naoserver.errors import InvalidCommand

__all__ = ["Claims"]

_logger = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True)
class _Claim:
    joints: frozenset[str]
    stop: Callable[[], None]


class Claims:
    """The joints of a device that belong to somebody. Safe to use from any thread."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._claims: dict[str, _Claim] = {}

    def claim(self, owner: str, joints: Iterable[str], stop: Callable[[], None]) -> None:
        """Let joints belong to `owner`, as people call it ("the walk"), instead of those it had before.

        `stop` is called when somebody wants one of them to hold still: it lets the owner end what it does.
        Raises InvalidCommand, and then claims nothing, while one of them belongs to somebody else.
        """
        wanted = frozenset(joints)
        with self._lock:
            self._check(wanted, owner)
            self._claims[owner] = _Claim(wanted, stop)

    def release(self, owner: str) -> frozenset[str]:
        """Let the joints of `owner` belong to nobody; returns which it had."""
        with self._lock:
            claim = self._claims.pop(owner, None)
        return claim.joints if claim else frozenset()

    def check(self, joints: Iterable[str], owner: str = "") -> None:
        """Raise InvalidCommand, naming the joint and its owner, unless `owner` may move all the joints."""
        with self._lock:
            self._check(joints, owner)

    def stop(self, joints: Iterable[str]) -> frozenset[str]:
        """Let whom any of the joints belong to end what they do; returns the joints that are still theirs."""
        wanted = frozenset(joints)
        with self._lock:
            claims = [claim for claim in self._claims.values() if claim.joints & wanted]
        for claim in claims:
            try:
                claim.stop()
            except Exception:  # the others and the joints themselves are to be stopped all the same
                _logger.exception("what moves %s could not be stopped", ", ".join(sorted(claim.joints)))
        with self._lock:
            return wanted & frozenset().union(*(claim.joints for claim in self._claims.values()))

    def _check(self, joints: Iterable[str], owner: str) -> None:
        for joint in joints:
            for name, claim in self._claims.items():
                if name != owner and joint in claim.joints:
                    raise InvalidCommand(joint, f"{joint} is moved by {name} now: stop it first")
