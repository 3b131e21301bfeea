"""A match in virtual time, in this process: an arena, a referee, and a document on each robot."""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Final

import msgspec
import numpy as np

from hfsm_runtime.virtual import ExecutionError
from naoserver.bodies import find_body
from naoserver.errors import RobotError
from naoserver.soccer_field import Field
from naoserver_sim.arena import Arena
from naoserver_sim.world import RobotPlace, World
from visualhfsm.plugins import Turns, VirtualMedium
from visualhfsm.simulation import EyesKind
from visualhfsm.trials import Sandbox
from visualhfsm_match._errors import MatchError
from visualhfsm_match._film import Film
from visualhfsm_match._places import Places, sight_of
from visualhfsm_match._player import Player
from visualhfsm_match._referee import BALL, PERIOD, Event, Put, Referee
from visualhfsm_match._rules import Rules
from visualhfsm_match._tally import Counter, Tally
from zenoh_ice.data.text import encodable, printable

COLORS: Final = ("red", "blue")
SHIRTS: Final = ((0.85, 0.15, 0.12), (0.12, 0.3, 0.85))
"""Of the first team, and of the second."""
_SCATTER: Final = 0.1
"""Standard deviation in m of the places where a match begins, and in rad of the headings."""
_LONGEST_REASON: Final = 2000


class Plan(msgspec.Struct, frozen=True, kw_only=True):
    """What is played."""

    documents: tuple[str, str] = ("", "")
    """The two documents, as paths in a folder."""
    teams: tuple[str, str] = ("red", "blue")
    players: int
    """Robots of each team."""
    seconds: float
    seed: int
    rules: Rules
    world: World
    """The pitch with its ball; the robots are those of the match."""
    body: str
    noise: bool = False
    eyes: EyesKind = "truth"
    patience: float = 600.0
    """How long it may take by the wall, in s: then the team loses whose code has taken the most of it."""


class Result(msgspec.Struct, frozen=True, kw_only=True):
    """What a match came to."""

    teams: tuple[str, str]
    score: tuple[int, int]
    winner: str = ""
    """The team that has won; empty in a draw, and if both have lost."""
    reason: str = ""
    """Why the other team, or both, lost, if it was not by the score."""
    events: tuple[Event, ...] = ()
    lying: tuple[str, ...] = ()
    """The robots that lie at the end."""
    seconds: float = 0.0
    """How long it took in virtual time."""
    tallies: tuple[Tally, ...] = ()
    """What the robots of each team did."""
    digest: str = ""
    """Of all states of the match."""


class Cost(msgspec.Struct, frozen=True):
    """What a match has taken, in s by the wall: another time it takes more or less."""

    wall: float = 0.0
    spent: tuple[float, ...] = ()
    """Of it, in the code of each team."""


def play(plan: Plan, folder: Path, sandboxes: Sequence[Sandbox], film: Film) -> tuple[Result, Cost]:
    """Play a match of documents in a folder before a film, and return what it came to, and has taken.

    The code of each runs in a sandbox of its own. Raises MatchError for a plan that is not possible, and
    VisualHfsmError for a computer that cannot contain it.
    """
    with ExitStack() as ends:
        return _Match(plan, folder, sandboxes, ends).play(film)


class _Match:
    def __init__(self, plan: Plan, folder: Path, sandboxes: Sequence[Sandbox], ends: ExitStack) -> None:
        names = [tuple(f"{color}{number + 1}" for number in range(plan.players)) for color in COLORS]
        self._plan: Final = plan
        self._turns: Final = Turns()
        self._names: Final = [name for each in names for name in each]
        self._spent: Final = dict.fromkeys(plan.teams, 0.0)
        """s by the wall in which code of each team has run."""
        self._field: Final = plan.world.field or Field()
        self._referee: Final = Referee(
            plan.rules, self._field, dict(zip(plan.teams, names, strict=True)), plan.seconds, plan.seed % 2
        )
        self._referee.begin(0.0)
        self._referee.scatter(np.random.default_rng(plan.seed), _SCATTER)
        try:
            self._arena: Final = Arena(
                self._world(),
                body=find_body(plan.body),
                clock=self._turns.clock,
                seed=plan.seed,
                noise=plan.noise,
            )
        except RobotError as error:
            raise MatchError.of(str(error)) from error
        ends.callback(self._arena.close)
        self._places: Final = Places(self._put)
        self._players: list[Player | None] = []
        medium = VirtualMedium.noisy(plan.seed) if plan.noise else VirtualMedium()
        for name, robot in zip(self._names, self._arena.robots, strict=True):
            team = self._referee.players[name].team
            side = plan.teams.index(team)
            player: Player | None = None
            with self._judged(team):
                player = Player(
                    name,
                    robot,
                    folder / plan.documents[side],
                    sandbox=sandboxes[side],
                    referee=self._referee,
                    medium=medium,
                    clock=self._turns.make_clock(),
                    seed=plan.seed,
                    eyes=plan.eyes,
                )
                ends.callback(player.close)
            self._players.append(player)

    def _world(self) -> World:
        robots = tuple(
            RobotPlace(
                name=name,
                position=(player.place.x, player.place.y),
                heading=player.place.heading,
                team=player.team,
                shirt=SHIRTS[self._plan.teams.index(player.team)],
            )
            for name, player in self._referee.players.items()
        )
        return msgspec.structs.replace(self._plan.world, robots=robots)

    def play(self, film: Film) -> tuple[Result, Cost]:
        """Play to the end."""
        referee, until = self._referee, time.monotonic() + self._plan.patience
        robots = dict(zip(self._names, self._arena.robots, strict=True))
        began, counter = time.monotonic(), Counter(referee)
        self._arena.start()
        film.begin(self._arena, self._names, SHIRTS, self._plan.teams)
        begun = False
        while not (begun and referee.over):  # who fails at once may meet somebody who does, too
            begun = True
            for player in self._players:
                if player is not None and player.team not in referee.lost:
                    with self._judged(player.team):
                        player.follow()
            self._advance()
            if len(referee.lost) == 1:
                self._begin_other_team()
            self._arena.check()
            sight = sight_of(robots)
            self._places.want(referee.see(sight))
            counter.see(sight)
            film.look(sight.time, referee.events)
            if time.monotonic() > until:
                slow = max(self._spent, key=lambda team: self._spent[team])
                referee.forfeit(slow, f"it took most of {self._plan.patience:g} s")
        cost = Cost(
            round(time.monotonic() - began, 1), tuple(round(self._spent[team], 1) for team in referee.teams)
        )
        return self._result(film, counter), cost

    def _begin_other_team(self) -> None:
        """Let a team begin that has not yet: it may fail as soon as the one that has lost."""
        for player in self._players:
            if player is not None and not player.has_begun and player.team not in self._referee.lost:
                with self._judged(player.team):
                    player.begin()
        self._advance()

    def _advance(self) -> None:
        """Let a period pass."""
        for moment in self._turns.pass_time(PERIOD):
            for player in self._players:
                if player is not None and player.team not in self._referee.lost:
                    with self._judged(player.team):
                        player.advance(moment)

    def _put(self, put: Put) -> None:
        """Put a robot, or the ball, somewhere. Raises InvalidCommand where there is no room."""
        if not put.name:
            self._arena.place_object(BALL, (put.x, put.y, self._field.ball_radius))
        elif (player := self._players[self._names.index(put.name)]) is not None:
            player.put(put)

    @contextmanager
    def _judged(self, team: str) -> Iterator[None]:
        """Let a team lose by what its document does in a `with` block."""
        began = time.monotonic()
        try:
            yield
        except ExecutionError as error:  # all else is no fault of a document
            text = printable(encodable(str(error).partition("\ntimeline of")[0]), _LONGEST_REASON)
            self._referee.forfeit(team, text)
        finally:
            self._spent[team] += time.monotonic() - began

    def _result(self, film: Film, counter: Counter) -> Result:
        referee = self._referee
        first, second = referee.teams
        lost = [event.text for event in referee.events if event.kind == "lost"]
        why = lost[0] if len(lost) == 1 else "; ".join(text.partition("\n")[0] for text in lost)
        lying = (
            name for name, robot in zip(self._names, self._arena.robots, strict=True) if robot.state().fallen
        )
        return Result(
            teams=(first, second),
            score=(referee.score[first], referee.score[second]),
            winner=referee.winner,
            reason=why,
            events=tuple(referee.events),
            lying=tuple(lying),
            seconds=round(self._turns.clock.now(), 3),
            tallies=tuple(counter.of.values()),
            digest=film.digest,
        )
