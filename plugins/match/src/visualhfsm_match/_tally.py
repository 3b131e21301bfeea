"""What a match was like, in numbers: shots, falls, and how often and how fast robots got up."""

from __future__ import annotations

import math
from typing import Final

import msgspec

from visualhfsm_match._referee import Point, Referee, Sight

_KICKED: Final = 0.5
"""Speed in m/s from which a ball beside a robot was kicked."""
_ROLLS: Final = 0.2
"""Speed in m/s below which it has come to rest, as far as shots are counted."""
_BESIDE: Final = 0.5
"""m beside the goal within which a kick was meant for it."""

HEAD: Final = ("goals", "shots", "falls", "got up", "s on the ground")
"""What a `Tally` counts; in brackets, and for the last, a robot and minute."""


class Tally(msgspec.Struct, kw_only=True):
    """What the robots of a team did, all together."""

    goals: int = 0
    shots: int = 0
    """Kicks toward the opponents' goal, or at most half a meter beside it."""
    falls: int = 0
    got_up: int = 0
    """How often one got up by itself; the others were taken off the field, or put elsewhere."""
    down: float = 0.0
    """s for which one lay on the field."""
    minutes: float = 0.0
    """For which they were on the field, all robots together."""

    @property
    def cells(self) -> tuple[str, ...]:
        """What a table says of them, in the order of `HEAD`: counts, and how many a robot and minute."""
        minutes = self.minutes or math.inf
        counts = (self.goals, self.shots, self.falls, self.got_up)
        return (*(f"{count} ({count / minutes:.2f})" for count in counts), f"{self.down / minutes:.1f}")

    def add(self, other: Tally) -> None:
        """Add what was counted in another match."""
        for name in self.__struct_fields__:
            setattr(self, name, getattr(self, name) + getattr(other, name))


class Counter:
    """Count what happens in a match; `see` is to be called after each `Referee.see`, with the same sight."""

    def __init__(self, referee: Referee) -> None:
        self.of: Final = {team: Tally() for team in referee.teams}
        """What was counted, by team."""
        self._referee: Final = referee
        self._lying: Final[dict[str, float]] = {}
        """Who lies, and since when."""
        self._before: Sight | None = None
        self._rolls = False

    def see(self, sight: Sight) -> None:
        """Count what is seen."""
        before, self._before = self._before, sight
        passed = sight.time - before.time if before else 0.0
        for player in self._referee.players.values():
            tally, lying = self.of[player.team], sight.robots[player.name].lying
            if player.offense is not None:
                self._lying.pop(player.name, None)
                continue
            tally.minutes += passed / 60.0
            since = self._lying.get(player.name)
            if lying and since is None:
                self._lying[player.name] = sight.time
                tally.falls += 1
            elif lying:
                tally.down += passed
            elif since is not None:
                del self._lying[player.name]
                tally.got_up += player.placed_at < since
        if before is not None and passed > 0.0:
            self._watch_ball(before.ball, sight, passed)
        for team, goals in self._referee.score.items():
            self.of[team].goals = goals

    def _watch_ball(self, was: Point, sight: Sight, passed: float) -> None:
        """Count a shot when the ball gets fast beside a robot."""
        x, y = sight.ball
        way_x, way_y = x - was[0], y - was[1]
        speed = math.hypot(way_x, way_y) / passed
        rolled, self._rolls = self._rolls, speed > (_ROLLS if self._rolls else _KICKED)
        team = self._referee.touching_team
        if rolled or not self._rolls or not team:
            return
        soccer = self._referee.field
        side = 1.0 if team == self._referee.teams[0] else -1.0
        left = side * soccer.length / 2 - x
        if way_x * side > 0.0 and left * side > 0.0:
            self.of[team].shots += abs(y + left * way_y / way_x) < soccer.goal_width / 2 + _BESIDE
