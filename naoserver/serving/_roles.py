"""Who of a team has a role: each robot decides it by itself, from what the others reported, without a center.

One robot has a role: of all that claim it the one with the lowest cost, and of equal ones the first by name.
It keeps the role until another one's cost is a fifth lower. Then it gives the role up and reports so, and the
other one takes it as soon as it hears that: nobody has it for as long as a message takes. A robot that is not
heard for `FRESH` seconds, or says that it is not ready, has none. If messages were lost and two have the
role, one of them gives it up at the next message that it hears of the other.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

from interfaces.jderobot import InvalidValueException
from interfaces.nao import RoleClaim
from zenoh_ice.data.text import sentence

FRESH: Final = 0.7
"""Seconds for which a message counts: of five a second, three may be lost."""
RENEWAL: Final = 1.0
"""Seconds after which a claim ends that is not repeated."""
MOST_ROLES: Final = 8
_LISTENING: Final = 0.5
"""Seconds for which a robot of a team that begins to claim a role listens who has it, before it says so."""
_SETTLING: Final = 0.1
"""Seconds after it said so until it may take the role: others may have begun at the same time."""
_BETTER: Final = 0.2
"""By which share another one's cost must be lower for the role to go over to it."""

Rival = tuple[str, RoleClaim]
"""The name of another robot that is ready and was heard recently, and its claim."""


@dataclass
class _Claim:
    client: str
    since: float
    renewed: float
    cost: float
    reported: float | None
    """The cost that the others know, by which all decide; None until they know any."""
    reported_at: float = math.inf
    """Since when."""
    holds: bool = False


class Roles:
    """The roles that a robot claims, by name. `alone` says that there is no team to listen to."""

    def __init__(self, name: str, *, alone: bool) -> None:
        self._name: Final = name
        self._alone: Final = alone
        self._claims: Final[dict[str, _Claim]] = {}

    def claim(self, role: str, cost: float, client: str, now: float, rivals: Sequence[Rival]) -> bool:
        """Claim a role, or repeat that; return whether this robot has it, given the claims of others to it.

        Raises InvalidValueException for too many roles.
        """
        if (mine := self._claims.get(role)) is None:
            if len(self._claims) >= MOST_ROLES:
                message = sentence(f"a robot claims at most {MOST_ROLES} roles: release one of them")
                raise InvalidValueException(message, "role")
            mine = self._claims[role] = _Claim(client, now, now, cost, None)
        mine.client, mine.renewed, mine.cost = client, now, cost
        if self._alone:
            mine.reported, mine.reported_at = cost, -math.inf
        if mine.reported is None:
            return False
        own = mine.reported, self._name
        holders = [(claim.cost, name) for name, claim in rivals if claim.holds]
        others = [(claim.cost, name) for name, claim in rivals if not claim.holds]
        if mine.holds:
            enough = mine.reported - _BETTER * abs(mine.reported)
            mine.holds = all(own < each for each in holders) and all(cost >= enough for cost, _ in others)
        else:
            settled = now - mine.reported_at >= _SETTLING
            mine.holds = settled and not holders and all(own < each for each in others)
        return mine.holds

    def release(self, role: str | None = None) -> bool:
        """End the claim of a role, or all; return whether there was one."""
        ended = list(self._claims) if role is None else [role] if role in self._claims else []
        for each in ended:
            del self._claims[each]
        return bool(ended)

    def expire(self, now: float) -> None:
        """End the claims that were not repeated in time."""
        for role in [role for role, mine in self._claims.items() if now - mine.renewed > RENEWAL]:
            del self._claims[role]

    def drop_client(self, client: str) -> bool:
        """End what a lost client claims; return whether it claimed anything."""
        its = [role for role, mine in self._claims.items() if mine.client == client]
        for role in its:
            self.release(role)
        return bool(its)

    def holds(self, role: str) -> bool:
        """Return whether this robot has a role."""
        return role in self._claims and self._claims[role].holds

    def report(self, now: float) -> bool:
        """Let the others know all claims but those that began just now; return whether one is new to them."""
        ripe = [mine for mine in self._claims.values() if now - mine.since >= _LISTENING]
        new = [mine for mine in ripe if mine.reported is None]
        for mine in ripe:
            mine.reported, mine.reported_at = mine.cost, min(mine.reported_at, now)
        return bool(new)

    def reported(self) -> list[RoleClaim]:
        """Return the claims that the others know."""
        return [
            RoleClaim(role, mine.reported, mine.holds)
            for role, mine in self._claims.items()
            if mine.reported is not None
        ]
