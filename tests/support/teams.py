"""Robots of a team in virtual time: their servants, which may fall silent, and a contest for a role among them."""

from __future__ import annotations

import random
from collections.abc import Callable, Sequence
from typing import Final, NamedTuple

from hfsm_runtime.virtual.clock import TaskClock
from interfaces import nao
from naoserver.protocol.jobs import Periodic, is_due
from naoserver.safety._event_log import EventLog
from naoserver.serving._team import TeamI
from naoserver.serving.medium import Medium, Membership
from visualhfsm.simulation._medium import NOISY_DELAY, VirtualMedium
from zenoh_ice import Current
from zenoh_ice.transport import Registration

__all__ = ["STEP", "Contest", "Player", "Seen", "current"]

STEP: Final = 0.02
"""Seconds of virtual time between two looks at who has a role."""
_CYCLE: Final = 0.1
"""Seconds after which a component claims a role again."""


def current(client: str = "a") -> Current:
    """Return a call of a client."""
    return Current("Team", "claim", f"{client}/1", 1.0, None)  # type: ignore[arg-type]


class _Antenna:
    """A medium that a robot reaches while it is on."""

    def __init__(self, medium: Medium) -> None:
        self.is_on = True
        self._medium: Final = medium

    def send(self, team: str, message: bytes) -> None:
        if self.is_on:
            self._medium.send(team, message)

    def subscribe(self, team: str, callback: Callable[[bytes], object]) -> Registration:
        return self._medium.subscribe(team, lambda message: self.is_on and callback(message))


class Player:
    """The servant of a robot, without the robot; its clock is `ahead` of the others by some seconds."""

    def __init__(self, clock: TaskClock, medium: Medium | None, name: str, *, ahead: float = 0.0) -> None:
        self.name: Final = name
        self.is_ready = True
        """Whether it stands and is not stopped."""
        self.costs: dict[str, float] = {}
        """What its component claims, by role."""
        self.held: set[str] = set()
        """What its component was reported that it has."""
        self._clock: Final = clock
        self._medium: Final = medium
        self._antenna: _Antenna | None = None
        self._ahead: Final = ahead
        self._starts = 0
        self._claims_at = 0.0
        self._server: TeamI | None = None
        self.start()

    @property
    def team(self) -> TeamI:
        """Its servant, while it is there."""
        assert self._server is not None
        return self._server

    @property
    def is_there(self) -> bool:
        """Whether its server lives."""
        return self._server is not None

    def now(self) -> float:
        """Return the time of its own clock."""
        return self._clock.now() + self._ahead

    def start(self) -> None:
        """Start its server, which knows nothing of a former one."""
        self._starts += 1
        self.is_ready = True
        self._antenna = None if self._medium is None else _Antenna(self._medium)
        member = Membership(self.name, "red", self._antenna, session=self._starts)
        self.events = EventLog(self.now, self._clock.now)
        server = TeamI(member, self.now, lambda: self.is_ready, self.events, lambda: None)
        self._job = Periodic("team", self._clock, lambda: server.period, server.report)
        self._server = server

    def vanish(self) -> None:
        """Let its server die: it says nothing any more."""
        if self._antenna is not None:
            self._antenna.is_on = False
        self.team.close()
        self._server = None
        self.held.clear()

    def live(self) -> None:
        """Report, and claim what the component claims, if it is time for that."""
        if self._server is None:
            return
        if is_due(self._job, self._clock.now()):
            self._job.run()
        if self._clock.now() >= self._claims_at:
            self._claims_at = self._clock.now() + _CYCLE
            reported = {role for role, cost in self.costs.items() if self.team.claim(role, cost, current())}
            self.held = reported

    def mates(self) -> dict[str, nao.Teammate]:
        """Return what it heard of the others, by name."""
        return {mate.name: mate for mate in self.team.getTeamState(current()).mates}

    def reports(self) -> list[str]:
        """Return what it reported for operators."""
        return [event.message for event in self.events.snapshot()[0]]


class Seen(NamedTuple):
    """What was seen of a role."""

    hand_overs: int
    two: float
    """The longest time in s for which two robots had it."""
    none: float
    """The longest time in s for which nobody had it, though somebody could."""
    twice: int
    """How often two had it."""


class Contest:
    """Robots of a team that want one role, at costs that change; a share of the messages is lost."""

    def __init__(self, names: Sequence[str], *, seed: int, loss: float, role: str = "striker") -> None:
        self.clock: Final = TaskClock()
        medium = VirtualMedium(seed=seed, loss=loss, delay=NOISY_DELAY)
        self.players: Final = [
            Player(self.clock, medium.at(self.clock), name, ahead=100.0 * number)
            for number, name in enumerate(names)
        ]
        self._role: Final = role
        self._random: Final = random.Random(seed)
        for player in self.players:
            player.costs[role] = self._random.uniform(1.0, 5.0)

    def step(self) -> list[Player]:
        """Let a moment pass; return who has the role."""
        self.clock.advance(STEP)
        for player in self.players:
            player.live()
        return [player for player in self.players if self._role in player.held]

    def hand_over(self, count: int) -> Seen:
        """Let the holder fall, vanish, or be outbid again and again; return what was seen."""
        two = none = longest_two = longest_none = 0.0
        changes = twice = 0
        last: Player | None = None
        trouble_at, recovery = 3.0, dict[Player, float]()
        while changes < count:
            holders = self.step()
            now = self.clock.now()
            if len(holders) == 1 and holders[0] is not last:
                last, changes = holders[0], changes + 1
            twice += len(holders) > 1 and two == 0.0
            two = two + STEP if len(holders) > 1 else 0.0
            able = any(player.is_there and player.is_ready for player in self.players)
            none = none + STEP if able and not holders else 0.0
            longest_two, longest_none = max(two, longest_two), max(none, longest_none)
            for player in [player for player, when in recovery.items() if when <= now]:
                del recovery[player]
                if player.is_there:
                    player.is_ready = True
                else:
                    player.start()
            if now >= trouble_at:
                trouble_at = now + self._random.uniform(0.5, 2.5)
                self._trouble(holders, recovery, now)
        return Seen(changes, longest_two, longest_none, twice)

    def _trouble(self, holders: list[Player], recovery: dict[Player, float], now: float) -> None:
        """Let something happen to who has the role, or to somebody."""
        player = holders[0] if holders else self._random.choice(self.players)
        what = self._random.choice(("falls", "vanishes", "is outbid", "all move"))
        if what in ("falls", "vanishes") and player not in recovery and len(recovery) < len(self.players) - 1:
            recovery[player] = now + self._random.uniform(0.3, 4.0)
            if what == "falls":
                player.is_ready = False
            else:
                player.vanish()
        elif what == "is outbid":
            player.costs[self._role] *= 2.0
        for each in self.players if what == "all move" else ():
            each.costs[self._role] = self._random.uniform(1.0, 5.0)
