"""The servant of a team: what this robot reports the others, what it heard from them, and who has which role.

What comes from others is hostile: sizes, numbers, names and texts are checked, and nobody is trusted further
than that. Ages are those of the clock of who hears, so clocks need not agree; a robot that simulates time
counts its own seconds.
"""

from __future__ import annotations

import math
import re
import threading
from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

import msgspec

from interfaces import nao
from interfaces.jderobot import InvalidValueException
from naoserver.safety._event_log import EventLog
from naoserver.serving._roles import FRESH, MOST_ROLES, Rival, Roles
from naoserver.serving._shared import MOST_QUOTED, require_finite, require_within, stream_of
from naoserver.serving.medium import REPORT, Membership
from zenoh_ice import Current, MarshalException
from zenoh_ice.data.text import sentence
from zenoh_ice.data.values import NAME

PERIOD: Final = 0.2
"""Seconds between two messages of a robot."""
_HASTE: Final = 0.05
"""The same when something has changed, which is reported `_TIMES`: one message may be lost."""
_TIMES: Final = 3
_KEPT: Final = 10.0
"""Seconds for which a silent mate is still reported."""
_MOST_MATES: Final = 15
_LARGEST: Final = 4096
"""Bytes of a message."""
_FARTHEST: Final = 10_000.0
"""In m, of a place along each axis."""
_ROLE: Final = re.compile(r"[A-Za-z][\w \-]{0,31}", re.ASCII)


@dataclass(frozen=True)
class _Heard:
    mate: nao.Teammate
    at: float
    """When, by our clock."""

    def is_newer_than(self, seconds: float, now: float) -> bool:
        """Return whether it was heard less than some seconds ago; a clock that began again forgets."""
        return 0.0 <= now - self.at < seconds

    def hides(self, mate: nao.Teammate) -> bool:
        """Return whether a message was overtaken by this, or comes from a second server of that name."""
        return mate.session != self.mate.session or mate.time <= self.mate.time


class TeamI(nao.Team):
    """Report what this robot knows, and hear the others; in calls and as streams.

    `now` is the robot's time in s, `is_ready` returns whether it can do anything, and `wake` is called when
    something is to be reported at once.
    """

    def __init__(
        self,
        member: Membership,
        now: Callable[[], float],
        is_ready: Callable[[], bool],
        events: EventLog,
        wake: Callable[[], None],
    ) -> None:
        self._member: Final = member
        self._now: Final = now
        self._is_ready: Final = is_ready
        self._events: Final = events
        self._wake: Final = wake
        self._lock: Final = threading.RLock()
        self._roles: Final = Roles(member.name, alone=member.medium is None)
        self._heard: Final[dict[str, _Heard]] = {}
        self._own = nao.Teammate(name=member.name, session=member.session)
        self._placed_at = self._seen_at = -math.inf
        self._was_ready = True
        self._hasty = 0
        self._publish: Final = stream_of(self._state, self.getTeamStatePublisher).send
        self._subscription: Final = (
            None if member.medium is None else member.medium.subscribe(member.team, self.hear)
        )

    # -- what this robot reports ----------------------------------------------------------------------------

    def reportPlace(self, x: float, y: float, heading: float, current: Current) -> None:
        require_within(-_FARTHEST, _FARTHEST, x=x, y=y)
        require_finite(heading=heading)
        with self._lock:
            self._placed_at = self._now()
            self._own = msgspec.structs.replace(
                self._own, x=x, y=y, heading=math.remainder(heading, math.tau)
            )

    def reportBall(self, x: float, y: float, current: Current) -> None:
        require_within(-_FARTHEST, _FARTHEST, x=x, y=y)
        with self._lock:
            self._seen_at = self._now()
            self._own = msgspec.structs.replace(self._own, ballX=x, ballY=y)

    def reportDoing(self, doing: str, current: Current) -> None:
        if len(doing) > MOST_QUOTED or not doing.isprintable():
            message = sentence(f"doing must be at most {MOST_QUOTED} printable characters")
            raise InvalidValueException(message, "doing")
        with self._lock:
            if doing != self._own.doing:
                self._own = msgspec.structs.replace(self._own, doing=doing)
                self._hurry()

    def claim(self, role: str, cost: float, current: Current) -> bool:
        if not _ROLE.fullmatch(role):
            message = sentence("role must be a name of at most 32 letters, digits and spaces: a letter first")
            raise InvalidValueException(message, "role")
        require_finite(cost=cost)
        with self._lock:
            now = self._now()
            self._roles.expire(now)
            if not self._check_ready():
                return False
            before = self._roles.holds(role)
            holds = self._roles.claim(role, cost, current.client, now, self._rivals(role, now))
            if holds != before:
                self._hurry()
            return holds

    def release(self, role: str | None, current: Current) -> None:
        with self._lock:
            if self._roles.release(role):
                self._hurry()

    def getRobotOf(self, role: str, current: Current) -> str:
        with self._lock:
            now = self._now()
            self._roles.expire(now)
            if self._check_ready() and self._roles.holds(role):
                return self._member.name
            holders = [(claim.cost, name) for name, claim in self._rivals(role, now) if claim.holds]
            return min(holders)[1] if holders else ""

    def getReport(self, current: Current) -> nao.Teammate:
        with self._lock:
            self._check_ready()
            return self._report()

    def getTeamState(self, current: Current) -> nao.TeamState:
        return self._state()

    @property
    def is_wanted(self) -> bool:
        """Whether anybody listens to what it reports."""
        listening = self.getReportPublisher.listening or self.getTeamStatePublisher.listening
        return self._member.medium is not None or listening

    @property
    def period(self) -> float:
        """Seconds until it reports again."""
        return _HASTE if self._hasty else PERIOD

    def report(self) -> None:
        """Report the others what this robot knows."""
        with self._lock:
            self._check_ready()
            self._hasty = max(0, self._hasty - 1)
            self._roles.expire(now := self._now())
            if self._roles.report(now):
                self._hurry()
            reported = self._report()
        if self._member.medium is not None:
            message = REPORT.result.gather_result(reported, "message to the team")
            self._member.medium.send(self._member.team, bytes(message))
        self.getReportPublisher.publish(reported, reported.time)
        self._publish()

    def drop_client(self, client: str) -> None:
        """End what a lost client claims."""
        with self._lock:
            if self._roles.drop_client(client):
                self._hurry()

    def close(self) -> None:
        """Hear nothing any more, and report the others, once, that this robot is gone."""
        if self._subscription is None or self._member.medium is None:
            return
        self._subscription.close()
        with self._lock:
            last = msgspec.structs.replace(self._report(), ready=False, claims=[])
        self._member.medium.send(self._member.team, bytes(REPORT.result.gather_result(last, "last message")))

    def _report(self) -> nao.Teammate:  # with the lock, as all below
        now = self._now()
        self._roles.expire(now)
        return msgspec.structs.replace(
            self._own,
            time=now,
            ready=self._was_ready,
            placeAge=now - self._placed_at,
            ballAge=now - self._seen_at,
            claims=self._roles.reported(),
        )

    def _check_ready(self) -> bool:
        """Return whether the robot can do anything; if not, it claims nothing."""
        ready = self._is_ready()
        if ready != self._was_ready:
            self._was_ready = ready
            self._hurry()
        if not ready:
            self._roles.release()
        return ready

    def _hurry(self) -> None:
        self._hasty = _TIMES
        self._wake()

    # -- what it hears ------------------------------------------------------------------------------------

    def hear(self, message: bytes) -> None:
        """Take a message of the team, from whomever; one that is not right is ignored, and reported."""
        try:
            if reason := self._take(message):
                self._ignore(reason)
        except MarshalException as error:
            self._ignore(str(error)[:MOST_QUOTED])

    def _take(self, message: bytes) -> str:
        """Keep a message, and return nothing, or what is wrong with it."""
        if len(message) > _LARGEST:
            return sentence(f"{len(message)} bytes: at most {_LARGEST} are read")
        mate = REPORT.result.unpack_result(message, "message")
        assert isinstance(mate, nao.Teammate)
        if mate.name == self._member.name and mate.session == self._member.session:
            return ""  # our own
        if reason := _fault_of(mate):
            return reason
        if mate.name == self._member.name:
            return sentence(f"another robot is called {mate.name}, too: give it another realm")
        with self._lock:
            now = self._now()
            known = self._heard.get(mate.name)
            if known is not None and known.is_newer_than(FRESH, now) and known.hides(mate):
                return ""
            self._forget(now)
            if mate.name not in self._heard and len(self._heard) >= _MOST_MATES:
                return sentence(f"a robot more than {_MOST_MATES}: the team is full")
            self._heard[mate.name] = _Heard(mate, now)
        return ""

    def _ignore(self, reason: str) -> None:
        message = sentence(f"ignored a message of the team: {reason}")
        self._events.add(nao.Severity.Warning, "Team", message, "ignored")

    def _forget(self, now: float) -> None:
        for name in [name for name, each in self._heard.items() if not each.is_newer_than(_KEPT, now)]:
            del self._heard[name]

    def _rivals(self, role: str, now: float) -> list[Rival]:
        """Return the claims of others to a role, of those that are ready and were heard recently."""
        return [
            (name, claim)
            for name, heard in self._heard.items()
            if heard.mate.ready and heard.is_newer_than(FRESH, now)
            for claim in heard.mate.claims
            if claim.role == role
        ]

    def _state(self) -> nao.TeamState:
        with self._lock:
            now = self._now()
            self._forget(now)
            mates = [_aged(heard, now) for _, heard in sorted(self._heard.items())]
            return nao.TeamState(time=now, team=self._member.team, mates=mates)


def _aged(heard: _Heard, now: float) -> nao.Teammate:
    """Return what a mate reported, as old as it is now."""
    age, mate = now - heard.at, heard.mate
    return msgspec.structs.replace(mate, age=age, placeAge=mate.placeAge + age, ballAge=mate.ballAge + age)


def _fault_of(mate: nao.Teammate) -> str:
    """Return what is wrong with a message, or nothing."""
    places = mate.x, mate.y, mate.ballX, mate.ballY
    ages = mate.placeAge, mate.ballAge
    numbers = mate.time, mate.heading, *(claim.cost for claim in mate.claims)
    if not re.fullmatch(NAME, mate.name):
        return sentence("its sender has no name")
    if not (all(abs(each) <= _FARTHEST for each in places) and all(each >= 0.0 for each in ages)):
        return sentence(f"{mate.name} reports a place that cannot be")
    if not all(map(math.isfinite, numbers)):
        return sentence(f"{mate.name} reports a number that is not finite")
    if len(mate.claims) > MOST_ROLES or not all(_ROLE.fullmatch(claim.role) for claim in mate.claims):
        return sentence(f"{mate.name} claims a role that cannot be")
    if len(mate.doing) > MOST_QUOTED or not mate.doing.isprintable():
        return sentence(f"{mate.name} says what it does in more than {MOST_QUOTED} characters")
    return ""
