"""The referee as one robot reads it: the servant `Referee` beside the robot's own."""

from __future__ import annotations

from typing import Final

from interfaces import nao
from visualhfsm_match._referee import Referee
from zenoh_ice import Current

IDENTITY: Final = "Referee"


class RefereeI(nao.Referee):
    """Say to one robot how the match stands, in calls and as a stream."""

    def __init__(self, referee: Referee, robot: str) -> None:
        self._referee: Final = referee
        self._robot: Final = robot
        self._asked = False

    @property
    def is_read(self) -> bool:
        """Whether anybody has asked, or listens."""
        return self._asked or self.getMatchPublisher.listening

    def getMatch(self, current: Current) -> nao.MatchReading:  # noqa: ARG002
        """Return how the match stands, as this robot sees it."""
        self._asked = True
        return self._reading()

    def publish(self) -> None:
        """Send it to those who listen."""
        self.getMatchPublisher.publish(self._reading())

    def _reading(self) -> nao.MatchReading:
        referee = self._referee
        player = referee.players[self._robot]
        opponents = referee.other(player.team)
        place = player.place
        return nao.MatchReading(
            time=referee.now,
            phase=referee.phase,
            timeLeft=referee.left,
            team=player.team,
            opponents=opponents,
            score=referee.score[player.team],
            opponentScore=referee.score[opponents],
            ownKickOff=referee.kick_off == player.team,
            mayPlay=referee.may_play(self._robot),
            penalties=[
                nao.Penalty(each.name, each.team, each.offense, each.left)
                for each in referee.players.values()
                if each.offense is not None
            ],
            place=nao.FieldPlace(*referee.turned(player.team, place.x, place.y, place.heading)),
            placedAt=player.placed_at,
        )
