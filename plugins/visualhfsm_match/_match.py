"""A match in virtual time, in this process: an arena, a referee, and a document on each robot."""

from __future__ import annotations

import math
import random
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Final

import msgspec
import numpy as np

from hfsm_runtime.virtual import ExecutionError, TaskClock
from naoserver.bodies import find_body
from naoserver.errors import InvalidCommand, RobotError
from naoserver.soccer_field.model import Field
from naoserver_sim.arena import Arena
from naoserver_sim.world import RobotPlace, World, load_world
from visualhfsm.plugins import VirtualMedium
from visualhfsm_match._errors import MatchError
from visualhfsm_match._film import Film
from visualhfsm_match._player import TICK, Player
from visualhfsm_match._referee import BALL_RADIUS, PERIOD, Event, Put, Referee, Seen, Sight
from visualhfsm_match._rules import Rules
from zenoh_ice import VirtualClock

BALL: Final = "Ball"
COLORS: Final = ("red", "blue")
SHIRTS: Final = ((0.85, 0.15, 0.12), (0.12, 0.3, 0.85))
"""Of the first team, and of the second."""
_SCATTER: Final = 0.1
"""Standard deviation in m of the places where a match begins, and in rad of the headings."""
_ASIDE: Final = 0.35
"""m by which a robot is put elsewhere where there is no room."""
_NANOSECONDS: Final = 1_000_000_000
_LONGEST_REASON: Final = 2000


class Plan(msgspec.Struct, frozen=True, kw_only=True):
    """What is played."""

    documents: tuple[str, str]
    """The files of the two documents."""
    teams: tuple[str, str]
    players: int
    """Robots of each team."""
    seconds: float
    seed: int
    rules: Rules
    body: str
    noise: bool = False


class Result(msgspec.Struct, frozen=True, kw_only=True):
    """What a match came to."""

    teams: tuple[str, str]
    score: tuple[int, int]
    winner: str = ""
    """The team that has won; empty in a draw."""
    reason: str = ""
    """Why the other team lost, if it was not by the score."""
    events: tuple[Event, ...] = ()
    lying: tuple[str, ...] = ()
    """The robots that lie at the end."""
    seconds: float = 0.0
    """How long it took in virtual time."""
    digest: str = ""
    """Of all states of the match."""


def play(plan: Plan, film: Film, on_turn: Callable[[int], object] = lambda _team: None) -> Result:
    """Play a match before a film, and return what it came to.

    `on_turn` gets the number of the team whose code runs from now on, counted from 1, and 0 when none does.
    Raises MatchError for a plan that is not possible.
    """
    random.seed(plan.seed)
    np.random.seed(plan.seed % (1 << 32))
    with ExitStack() as ends:
        return _Match(plan, on_turn, ends).play(film)


class _Match:
    def __init__(self, plan: Plan, on_turn: Callable[[int], object], ends: ExitStack) -> None:
        names = [tuple(f"{color}{number + 1}" for number in range(plan.players)) for color in COLORS]
        self._plan: Final = plan
        self._on_turn: Final = on_turn
        self._clock: Final = VirtualClock()
        self._names: Final = [name for each in names for name in each]
        self._numbers: Final = {team: number + 1 for number, team in enumerate(plan.teams)}
        world = load_world("soccer")
        self._field: Final = world.field or Field()
        self._referee: Final = Referee(
            plan.rules, self._field, dict(zip(plan.teams, names, strict=True)), plan.seconds, plan.seed % 2
        )
        self._referee.begin(0.0)
        self._referee.scatter(np.random.default_rng(plan.seed), _SCATTER)
        self._waiting: Final = {player.name: player.place for player in self._referee.players.values()}
        try:
            self._arena: Final = Arena(
                self._world(world),
                body=find_body(plan.body),
                clock=self._clock,
                seed=plan.seed,
                noise=plan.noise,
            )
        except RobotError as error:
            raise MatchError.of(str(error)) from error
        ends.callback(self._arena.close)
        self._waiting.clear()  # all begin there
        self._tries: dict[str, int] = {}
        self._players: list[Player | None] = []
        medium = VirtualMedium.noisy(plan.seed) if plan.noise else VirtualMedium()
        for name, robot in zip(self._names, self._arena.robots, strict=True):
            team = self._referee.players[name].team
            document = Path(plan.documents[plan.teams.index(team)])
            player: Player | None = None
            with self._judged(team):
                player = Player(
                    name, robot, document, referee=self._referee, medium=medium, follow_clock=self._follow
                )
                ends.callback(player.close)
            self._players.append(player)

    def _world(self, world: World) -> World:
        robots = tuple(
            RobotPlace(
                name=name,
                position=(put.x, put.y),
                heading=put.heading,
                team=self._referee.players[name].team,
                shirt=SHIRTS[self._plan.teams.index(self._referee.players[name].team)],
            )
            for name, put in self._waiting.items()
        )
        return msgspec.structs.replace(world, robots=robots)

    def play(self, film: Film) -> Result:
        """Play to the end."""
        referee = self._referee
        self._arena.start()
        film.begin(self._arena, self._names, SHIRTS, self._plan.teams)
        while not referee.over:
            for player in self._players:
                if player is not None and not referee.over:
                    with self._judged(player.team):
                        player.follow()
            self._advance()
            self._arena.check()
            sight = self._sight()
            self._waiting.update((put.name, put) for put in referee.see(sight))
            self._put()
            film.look(sight.time, referee.events)
        return self._result(film)

    def _advance(self) -> None:
        """Let a period pass, tick by tick: in each the world moves first, then the players in their order."""
        start = self._clock.moment
        for tick in range(1, round(PERIOD / TICK) + 1):
            moment = start + round(tick * TICK * _NANOSECONDS)
            for player in self._players:
                if player is not None and not self._referee.over:
                    with self._judged(player.team):
                        player.advance(moment)
            self._follow_to(moment)

    def _follow(self, clock: TaskClock) -> None:
        """Move the world to the time of a player, unless another one was there before."""
        self._follow_to(clock.moment)

    def _follow_to(self, moment: int) -> None:
        self._clock.advance(max(0, moment - self._clock.moment) / _NANOSECONDS)

    def _sight(self) -> Sight:
        x, y, _ = self._arena.truth().objects[BALL].position
        robots = {}
        for name, robot in zip(self._names, self._arena.robots, strict=True):
            at = robot.stage.truth().torso.position
            robots[name] = Seen(at[0], at[1], robot.state().fallen)
        return Sight(self._clock.now(), (x, y), robots)

    def _put(self) -> None:
        """Put robots and ball where they are wanted; what has no room there waits, and then stands aside."""
        for name, put in [*self._waiting.items()]:
            tries = self._tries[name] = self._tries.get(name, -1) + 1
            turn, ring = 2.4 * tries, (_ASIDE * (tries // 3) / 4 if name or tries else 0.0)
            x, y = put.x + ring * math.cos(turn), put.y + ring * math.sin(turn)
            try:
                if not name:
                    self._arena.place_object(BALL, (x, y, BALL_RADIUS))
                elif (player := self._players[self._names.index(name)]) is not None:
                    player.put(Put(name, x, y, put.heading))
            except InvalidCommand:
                continue
            del self._waiting[name], self._tries[name]

    @contextmanager
    def _judged(self, team: str) -> Iterator[None]:
        """Let a team lose by what its document does in a `with` block."""
        self._on_turn(self._numbers[team])
        try:
            yield
        except Exception as error:  # noqa: BLE001 - whatever the code of a document raises
            self._lose(team, error)
        finally:
            self._on_turn(0)

    def _lose(self, team: str, error: Exception) -> None:
        text = str(error) or type(error).__name__
        if not isinstance(error, ExecutionError | RobotError):
            text = f"{type(error).__name__}: {text}"
        self._referee.forfeit(team, text.partition("\ntimeline of")[0][:_LONGEST_REASON])

    def _result(self, film: Film) -> Result:
        referee = self._referee
        first, second = referee.teams
        why = next((event.text for event in referee.events if event.kind == "lost"), "")
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
            seconds=round(self._clock.now(), 3),
            digest=film.digest,
        )
