"""A match by its rules: what is seen ten times a second goes in, events and places come out.

Pure: it knows neither clock nor robot, and the same sights give the same match. Places are in m in the frame
of the field: the first team plays toward positive x, and the second sees everything turned by half a turn.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Final, Literal, NamedTuple

import numpy as np

from interfaces.nao import MatchPhase, Offense
from naoserver.soccer_field import Field
from visualhfsm_match._rules import Rules

PERIOD: Final = 0.1
"""s between two sights."""
BALL: Final = "Ball"
_ROOM: Final = 0.45
"""m around a place in which nobody else may be for a robot to be put there."""
_BALL_ROOM: Final = 0.4
"""m from the hull of a ball to the middle of a robot, at least, where it is put."""
_FASTER: Final = 0.1
"""m/s by which a ball gets faster that was touched."""
_TWICE: Final = 2.0
"""Who comes nearer so much more than the other pushes; else both met front to front."""

Point = tuple[float, float]
EventKind = Literal["kick-off", "whistle", "goal", "out", "penalty", "return", "stuck", "lost", "end"]


SAID: Final = {
    Offense.LeavingTheField: "leaving the field",
    Offense.Pushing: "pushing",
    Offense.IncapableRobot: "incapable robot",
    Offense.IllegalPositioning: "illegal positioning",
    Offense.MotionInSet: "motion in set",
}
"""Why a robot leaves the field, in words."""
_COUNTS: Final = {Offense.LeavingTheField, Offense.Pushing}
"""What makes later penalties of the team longer."""


class Seen(NamedTuple):
    """A robot as it is seen: where its middle is, and whether it lies."""

    x: float
    y: float
    lying: bool = False

    @property
    def at(self) -> Point:
        """Where it is."""
        return self.x, self.y


@dataclass(frozen=True, slots=True)
class Sight:
    """Everything at a time in s."""

    time: float
    ball: Point
    robots: Mapping[str, Seen]


@dataclass(frozen=True, slots=True)
class Event:
    """What happened in a match, at a time in s since its start."""

    time: float
    kind: EventKind
    text: str
    team: str = ""
    robot: str = ""

    @property
    def clock(self) -> str:
        """The time as people read it."""
        minutes, seconds = divmod(self.time, 60.0)
        return f"{minutes:3.0f}:{seconds:04.1f}"


class Put(NamedTuple):
    """Where something is to be put: a robot, with its heading in rad, or the ball, whose name is empty."""

    name: str
    x: float
    y: float
    heading: float = 0.0


_MIDDLE: Final = Put("", 0.0, 0.0)


@dataclass(slots=True)
class Player:
    """A robot of a match, and what the referee knows of it."""

    name: str
    team: str
    number: int
    """Its place among those of its team, from 0."""
    offense: Offense | None = None
    left: float = 0.0
    """s of its penalty."""
    place: Put = _MIDDLE
    """Where it was put last."""
    placed_at: float = 0.0
    still_at: Point = (0.0, 0.0)
    """Where it is to stand still before the whistle."""
    lying_since: float | None = None
    lay_at: float = 0.0
    """When it lay last."""


@dataclass(slots=True)
class _Contact:
    """Two opponents that touch: since when, and how far each has come nearer meanwhile, in m."""

    since: float
    last: float
    nearer: dict[str, float] = field(default_factory=dict)
    speed: dict[str, float] = field(default_factory=dict)


class Referee:
    """A match of two teams, `seconds` long; `players` are the names of the robots of each, by team.

    `begin` starts it, and `see` is to be called every `PERIOD` with a later time. Both return what is to be
    put where: robots by name, and the ball.
    """

    def __init__(
        self,
        rules: Rules,
        soccer: Field,
        players: Mapping[str, tuple[str, ...]],
        seconds: float,
        kick_off: int = 0,
    ) -> None:
        self.rules: Final = rules
        self.field: Final = soccer
        self.teams: Final = tuple(players)
        self.players: Final = {
            name: Player(name, team, number)
            for team, names in players.items()
            for number, name in enumerate(names)
        }
        self.score: Final = dict.fromkeys(self.teams, 0)
        self.events: Final[list[Event]] = []
        self.phase = MatchPhase.Ready
        self.kick_off: str = self.teams[kick_off]
        """The team that has the kick-off, or had it last."""
        self.ball_free = False
        """Whether both teams may play the ball."""
        self.lost: Final[list[str]] = []
        """The teams that lost whatever the score is: two if both did in the same moment."""
        self.left = seconds
        """s until the end."""
        self._seconds: Final = seconds
        self._beyond: Final = soccer.line / 2 + soccer.ball_radius if rules.whole_ball else 0.0
        """m beyond the middle of a line at which the middle of a ball is out."""
        self._room: Final = _BALL_ROOM + soccer.ball_radius
        self._counted: Final = dict.fromkeys(self.teams, 0)
        self.now = 0.0
        """The time in s of what was seen last."""
        self._start = self._until = self._lost_at = 0.0
        self._before: Sight | None = None
        self._speed = 0.0
        self._toucher = ""
        self._spot: Point | None = None
        """Where a ball that was out is to be put, until it is in play again."""
        self._near_at = 0.0
        self._rested = (0.0, (0.0, 0.0))
        self._contacts: dict[tuple[str, str], _Contact] = {}

    # -- what others ask -----------------------------------------------------------------------------------

    @property
    def over(self) -> bool:
        """Whether the match has ended."""
        return self.phase is MatchPhase.Finished

    @property
    def winner(self) -> str:
        """The team that has won, or would if this were the end; empty in a draw, and if both have lost."""
        if self.lost:
            return self.other(self.lost[0]) if len(self.lost) == 1 else ""
        first, second = self.teams
        if self.score[first] == self.score[second]:
            return ""
        return max(self.teams, key=lambda team: self.score[team])

    def other(self, team: str) -> str:
        """Return the team that a team plays against."""
        return self.teams[1] if team == self.teams[0] else self.teams[0]

    @property
    def touching_team(self) -> str:
        """The team whose robot touched the ball last; empty if nobody has since it was put somewhere."""
        return self.players[self._toucher].team if self._toucher else ""

    def may_play(self, name: str) -> bool:
        """Return whether a robot may play the ball."""
        player = self.players[name]
        free = self.ball_free or player.team == self.kick_off
        return self.phase is MatchPhase.Playing and player.offense is None and free

    def turned(self, team: str, x: float, y: float, heading: float = 0.0) -> tuple[float, float, float]:
        """Return a place in the frame of a team in that of the field, and the other way round."""
        if team == self.teams[0]:
            return x, y, heading
        return -x, -y, math.remainder(heading + math.pi, math.tau)

    # -- what happens --------------------------------------------------------------------------------------

    def begin(self, time: float) -> list[Put]:
        """Begin the match at a time in s."""
        self._start = self.now = time
        return [*self._ready(self.kick_off)]

    def scatter(self, random: np.random.Generator, deviation: float) -> None:
        """Let robots begin somewhat elsewhere, by `deviation` in m, and in rad of their headings."""
        for player in self.players.values():
            x, y, heading = np.clip(random.normal(0.0, deviation, 3), -2 * deviation, 2 * deviation).tolist()
            place = player.place
            player.place = Put(player.name, place.x + x, place.y + y, place.heading + heading)

    def forfeit(self, team: str, why: str) -> None:
        """End the match: a team has lost it; so does the other one that fails before more is seen."""
        if self.over and not (self.lost and self._lost_at == self.now):
            return
        if team not in self.lost:
            if self.lost:
                self.events.pop()  # the end, which comes now
            self.lost.append(team)
            self._lost_at = self.now
            self._note("lost", f"{team} loses: {why}", team)
            self._finish()

    def see(self, sight: Sight) -> list[Put]:
        """Judge what is seen. Raises ValueError for a time before the last one."""
        if sight.time < self.now:
            raise ValueError(f"the time went from {self.now:g} s back to {sight.time:g} s")
        passed, self.now = sight.time - self.now, sight.time
        if self.over:
            return []
        self.left = max(0.0, self._seconds - (self.now - self._start))
        puts = [*self._judge(sight, passed)]
        self._before = sight
        if self.left <= 0.0 and not self.over:  # a goal in the last moment counts
            self._finish()
        return [] if self.over else puts

    def _judge(self, sight: Sight, passed: float) -> Iterator[Put]:
        yield from self._serve_penalties(sight, passed)
        if self.phase is MatchPhase.Playing:
            if self._spot is not None and self._is_out(sight.ball):
                yield Put("", *self._spot)
                yield from self._watch_robots(sight, passed)
                return
            self._spot = None
            self._watch_ball(sight, passed)
            ended = [*self._goal_or_out(sight)] or [*self._stuck()]
            if ended:
                yield from ended
                return
            yield from self._watch_robots(sight, passed)
            return
        if math.dist(sight.ball, (0.0, 0.0)) > self.field.ball_radius:
            yield Put("", 0.0, 0.0)
        if self.now >= self._until - 1e-9:
            yield from self._next_phase(sight)
        elif self.phase is MatchPhase.Set:
            for player, seen in self._on_field(sight):
                if math.dist(seen.at, player.still_at) > self.rules.motion and not seen.lying:
                    yield from self._penalize(player, Offense.MotionInSet)

    def _next_phase(self, sight: Sight) -> Iterator[Put]:
        if self.phase is MatchPhase.Ready:
            self.phase, self._until = MatchPhase.Set, self.now + self.rules.set
            for player, seen in self._on_field(sight):
                if self._is_illegal(player, seen):
                    yield from self._penalize(player, Offense.IllegalPositioning)
                else:
                    player.still_at = seen.at
            return
        self.phase, self._until = MatchPhase.Playing, self.now + self.rules.ball_free
        self._spot = None
        self.ball_free = False
        self._near_at, self._rested = self.now, (self.now, (0.0, 0.0))
        self._toucher, self._speed = "", 0.0
        self._contacts.clear()
        self._note("whistle", "the whistle", self.kick_off)

    def _ready(self, kick_off: str) -> Iterator[Put]:
        """Begin a kick-off."""
        self.phase, self.kick_off, self.ball_free = MatchPhase.Ready, kick_off, False
        self._until = self.now + self.rules.ready
        self._note("kick-off", f"kick-off for {kick_off}", kick_off)
        for player in self.players.values():
            if player.offense is None:
                places = self.rules.kick_off if player.team == kick_off else self.rules.waiting
                yield self._place(player, *self.turned(player.team, *places[player.number]))
        yield Put("", 0.0, 0.0)

    def _finish(self) -> None:
        self.phase = MatchPhase.Finished
        self.left = 0.0 if not self.lost else self.left
        for player in self.players.values():
            player.offense, player.left = None, 0.0
        first, second = self.teams
        self._note("end", f"the end: {first} {self.score[first]}, {second} {self.score[second]}", self.winner)

    # -- the ball ------------------------------------------------------------------------------------------

    def _watch_ball(self, sight: Sight, passed: float) -> None:
        """Note who touches the ball, where it rests, and when somebody was near."""
        rules, ball = self.rules, sight.ball
        near = sorted((math.dist(seen.at, ball), player.name) for player, seen in self._on_field(sight))
        before = self._before
        speed = math.dist(ball, before.ball) / passed if before and passed > 0 else 0.0
        if near and near[0][0] < rules.reach and speed > self._speed + _FASTER:
            self._toucher = near[0][1]
        self._speed = speed
        if near and near[0][0] < rules.stuck_distance:
            self._near_at = self.now
        if math.dist(ball, self._rested[1]) > rules.still_distance:
            self._rested = self.now, ball
        if not self.ball_free:
            self.ball_free = math.dist(ball, (0.0, 0.0)) > self.field.ball_radius or self.now >= self._until

    def _goal_or_out(self, sight: Sight) -> Iterator[Put]:
        """Judge a ball that has wholly crossed a line; nothing for one in play."""
        soccer, (x, y) = self.field, sight.ball
        if not self._is_out(sight.ball):
            return
        end = soccer.length / 2 + self._beyond
        if abs(x) > end:
            attackers = self.teams[0] if x > 0 else self.teams[1]
            if abs(self._crossed_at(sight, math.copysign(end, x))) < soccer.goal_width / 2:
                yield from self._goal(attackers)
                return
            touched = self.players[self._toucher].team if self._toucher else attackers
            across = math.copysign(1.0, y)
            if touched == attackers:  # a goal kick from the corner of the goal area
                depth, width = soccer.goal_area
                spot = math.copysign(soccer.length / 2 - depth, x), across * width / 2
                yield from self._out(sight, spot, "goal kick", self.other(attackers))
            else:
                spot = math.copysign(soccer.length / 2, x), across * soccer.width / 2
                yield from self._out(sight, spot, "corner kick", attackers)
        else:
            touched = self.players[self._toucher].team if self._toucher else self.kick_off
            spot = (x, math.copysign(soccer.width / 2, y))
            yield from self._out(sight, spot, "kick-in", self.other(touched))

    def _is_out(self, ball: Point) -> bool:
        margin = self._beyond
        return abs(ball[0]) > self.field.length / 2 + margin or abs(ball[1]) > self.field.width / 2 + margin

    def _crossed_at(self, sight: Sight, line: float) -> float:
        """Return y where the ball has crossed a line of constant x since the last sight."""
        (x, y), before = sight.ball, self._before.ball if self._before else sight.ball
        if abs(x - before[0]) < 1e-9:
            return y
        share = min(1.0, max(0.0, (line - before[0]) / (x - before[0])))
        return before[1] + share * (y - before[1])

    def _goal(self, team: str) -> Iterator[Put]:
        self.score[team] += 1
        own = self._toucher and self.players[self._toucher].team != team
        by = f" by {self._toucher}{' (an own goal)' if own else ''}" if self._toucher else ""
        first, second = self.teams
        text = f"goal for {team}{by}: {self.score[first]} to {self.score[second]}"
        self._note("goal", text, team, self._toucher)
        if abs(self.score[first] - self.score[second]) >= self.rules.mercy:
            self._finish()
        else:
            yield from self._ready(self.other(team))

    def _out(self, sight: Sight, spot: Point, what: str, team: str) -> Iterator[Put]:
        self._note("out", f"out by {self._toucher or 'nobody'}: {what} {team}", team, self._toucher)
        x, y = self._free_spot(sight, spot)
        self._rested, self._speed = (self.now, (x, y)), 0.0
        self._toucher = ""
        self._spot = x, y
        yield Put("", x, y)

    def _free_spot(self, sight: Sight, spot: Point) -> Point:
        """Return the nearest place toward the middle of the field where the ball touches no robot."""
        x, y = spot
        for step in range(40):
            share = 1.0 - 0.05 * step
            place = x * share, y if abs(x) < self.field.length / 2 - 1e-9 else y * share
            if all(math.dist(seen.at, place) > self._room for seen in sight.robots.values()):
                return place
        return spot

    def _stuck(self) -> Iterator[Put]:
        """Drop the ball if nobody is near it for long, or if it hardly moves."""
        alone = self.now - self._near_at >= self.rules.stuck
        if alone or self.now - self._rested[0] >= self.rules.still:
            why = "nobody is near the ball" if alone else "the ball does not move"
            self._note("stuck", f"dropped ball: {why}")
            yield from self._ready(self.other(self.kick_off))

    # -- the robots ----------------------------------------------------------------------------------------

    def _watch_robots(self, sight: Sight, passed: float) -> Iterator[Put]:
        fallen = [
            player for player, seen in self._on_field(sight) if seen.lying and player.lying_since is None
        ]
        for player, seen in self._on_field(sight):
            if seen.lying:
                player.lying_since = self.now if player.lying_since is None else player.lying_since
                player.lay_at = self.now
            elif self.now - player.lay_at >= self.rules.up:
                player.lying_since = None
        self._watch_contacts(sight, passed)
        offenders = dict.fromkeys(self._pushers(sight, fallen), Offense.Pushing)
        half_x = self.field.length / 2 + self.field.border
        half_y = self.field.width / 2 + self.field.border
        for player, seen in self._on_field(sight):
            if abs(seen.x) > half_x or abs(seen.y) > half_y:
                offenders.setdefault(player.name, Offense.LeavingTheField)
            elif seen.lying and self.now - (player.lying_since or 0.0) >= self.rules.get_up:
                offenders.setdefault(player.name, Offense.IncapableRobot)
            elif not self.ball_free and player.team != self.kick_off and self._in_circle(seen):
                offenders.setdefault(player.name, Offense.IllegalPositioning)
        for name, offense in offenders.items():
            yield from self._penalize(self.players[name], offense)

    def _watch_contacts(self, sight: Sight, passed: float) -> None:
        """Note which opponents touch, and which of them comes nearer."""
        rules, before = self.rules, self._before
        robots = [*self._on_field(sight)]
        for index, (one, seen) in enumerate(robots):
            for other, found in robots[index + 1 :]:
                pair = one.name, other.name
                apart = math.dist(seen.at, found.at)
                if one.team == other.team or apart > rules.contact:
                    known = self._contacts.get(pair)
                    if known is not None and self.now - known.last > rules.fall:
                        del self._contacts[pair]
                    continue
                contact = self._contacts.get(pair)
                if contact is None or self.now - contact.last > 1.5 * PERIOD:
                    contact = self._contacts[pair] = _Contact(self.now, self.now)
                contact.last = self.now
                if before is None or passed <= 0.0:
                    continue
                for name, toward in ((one.name, found), (other.name, seen)):
                    was = before.robots.get(name)
                    nearer = 0.0 if was is None else math.dist(was.at, toward.at) - apart
                    contact.nearer[name] = contact.nearer.get(name, 0.0) + nearer
                    contact.speed[name] = max(nearer / passed, 0.5 * contact.speed.get(name, 0.0))

    def _pushers(self, sight: Sight, fallen: list[Player]) -> Iterator[str]:
        """Yield the robots that push: for long, or so that an opponent has fallen."""
        for pair, contact in [*self._contacts.items()]:
            for name, other in (pair, pair[::-1]):
                victim, own = sight.robots[other], contact.nearer.get(name, 0.0)
                least = self.rules.push_speed * PERIOD
                more = own > _TWICE * max(0.0, contact.nearer.get(other, 0.0)) and own > least
                fell = any(player.name == other for player in fallen) and victim.lying
                forceful = contact.speed.get(name, 0.0) > self.rules.push_speed
                if more and ((fell and forceful) or contact.last - contact.since >= self.rules.pushing):
                    self._contacts.pop(pair, None)
                    yield name

    def _serve_penalties(self, sight: Sight, passed: float) -> Iterator[Put]:
        """Let penalties pass but while all stand still, and robots return after them."""
        for player in self.players.values():
            if player.offense is None:
                continue
            if self.phase is not MatchPhase.Set:
                player.left = max(0.0, player.left - passed)
            seen = sight.robots[player.name]
            if player.left <= 0.0:
                player.offense = None
                self._note("return", f"{player.name} returns", player.team, player.name)
                yield self._place(player, *player.place[1:])
            elif math.dist(seen.at, player.place[1:3]) > self.rules.motion:
                yield self._place(player, *player.place[1:])

    def _penalize(self, player: Player, offense: Offense) -> Iterator[Put]:
        player.offense = offense
        player.left = self.rules.penalty + self.rules.penalty_increase * self._counted[player.team]
        self._counted[player.team] += offense in _COUNTS
        player.lying_since = None
        self._contacts = {pair: each for pair, each in self._contacts.items() if player.name not in pair}
        text = f"{SAID[offense]}: {player.name}, off for {player.left:g} s"
        self._note("penalty", text, player.team, player.name)
        yield self._place(player, *self._bench(player))

    def _bench(self, player: Player) -> tuple[float, float, float]:
        """Return where a penalized robot waits: beside its own half, at the height of the penalty mark."""
        back = self.field.length / 2 - self.field.penalty_mark
        x = -back + 2 * _ROOM * player.number
        aside = self.field.width / 2 + self.rules.beside
        return self.turned(player.team, min(x, -_ROOM), -aside, math.pi / 2)

    def _place(self, player: Player, x: float, y: float, heading: float) -> Put:
        player.place, player.placed_at = Put(player.name, x, y, heading), self.now
        player.lying_since = None
        return player.place

    def _on_field(self, sight: Sight) -> Iterator[tuple[Player, Seen]]:
        for player in self.players.values():
            if player.offense is None:
                yield player, sight.robots[player.name]

    def _is_illegal(self, player: Player, seen: Seen) -> bool:
        if abs(player.place.y) > self.field.width / 2:
            return False  # it returns from a penalty
        x, y, _ = self.turned(player.team, *seen.at)
        outside = x < -self.field.length / 2 or abs(y) > self.field.width / 2
        return outside or x > 0.0 or (player.team != self.kick_off and self._in_circle(seen))

    def _in_circle(self, seen: Seen) -> bool:
        return math.hypot(*seen.at) < self.field.circle_diameter / 2

    def _note(self, kind: EventKind, text: str, team: str = "", robot: str = "") -> None:
        self.events.append(Event(round(self.now - self._start, 3), kind, text, team, robot))
