"""A referee in the live simulator: `naoserver-sim --world match --referee 4`."""

from __future__ import annotations

import statistics
import threading
from collections.abc import Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Annotated, Any, Final

import typer

from naoserver.errors import RobotError
from naoserver.serving.entrances import Entrance, Served
from naoserver.soccer_field import Field
from visualhfsm_match._errors import MatchError
from visualhfsm_match._places import Places, sight_of
from visualhfsm_match._referee import BALL, PERIOD, Put, Referee
from visualhfsm_match._rules import DEFAULT_FORMAT, load_format
from visualhfsm_match._servant import IDENTITY, RefereeI

_LOOK: Final = 0.01
"""s by the wall between two looks at the clock."""
_END_LIMIT: Final = 5.0
"""s for the referee's thread to end."""


class _Match:
    """A match between the robots of two teams, which begins when the referee was asked for each of them."""

    def __init__(self, robots: Sequence[Served], field: Field | None, options: Mapping[str, Any]) -> None:
        self._robots: Final = {each.robot.name: each for each in robots}
        try:
            _, rules = load_format(options["format"], options["rules"])
        except MatchError as error:
            raise RobotError(str(error)) from error
        teams = _teams(robots)
        if any(len(names) > rules.most_players for names in teams.values()):
            raise RobotError(f"the rules have places for {rules.most_players} robots of a team, not for more")
        self.referee: Final = Referee(rules, field or Field(), teams, 60.0 * options["referee"])
        self.servants: Final = [RefereeI(self.referee, name) for name in self._robots]
        self._places: Final = Places(self._put)
        self._said = 0

    def run(self, stop: threading.Event) -> None:
        """Judge until `stop` is set."""
        robots = {name: each.robot for name, each in self._robots.items()}
        clock, referee = next(iter(robots.values())).clock, self.referee
        due, begun = clock.now(), False
        while not stop.wait(_LOOK):
            if (now := clock.now()) < due:
                continue
            due = now + PERIOD
            if begun:
                self._places.want(referee.see(sight_of(robots)))
            elif all(servant.is_read for servant in self.servants):
                begun = True
                self._places.want(referee.begin(now))
            for servant in self.servants:
                servant.publish()
            self._say()

    def _put(self, put: Put) -> None:
        first = next(iter(self._robots.values()))
        assert first.robot.stage is not None
        if not put.name:
            first.robot.stage.place_object(BALL, (put.x, put.y, self.referee.field.ball_radius))
            return
        robot, assembly, *_ = self._robots[put.name]
        assert robot.stage is not None
        robot.stage.place_robot(put.x, put.y, put.heading, assembly.end_motion)

    def _say(self) -> None:
        """Print what has happened."""
        for event in self.referee.events[self._said :]:
            typer.echo(f"{event.clock}  {event.text}")
        self._said = len(self.referee.events)


@contextmanager
def _serve(robots: Sequence[Served], field: Field | None, options: Mapping[str, Any]) -> Iterator[str]:
    """Serve `Referee` to each robot, and judge. Raises RobotError in a world without two teams and a ball."""
    match, stop = _Match(robots, field, options), threading.Event()
    with ExitStack() as ends:
        for served, servant in zip(robots, match.servants, strict=True):
            served.adapter.add(servant, IDENTITY)
            ends.callback(served.adapter.removeAll, [IDENTITY])
        thread = threading.Thread(target=match.run, args=(stop,), name="referee")
        thread.start()
        ends.callback(thread.join, _END_LIMIT)
        ends.callback(stop.set)
        yield f"{' : '.join(match.referee.teams)} begins once a document of each robot reads Referee"


def _teams(robots: Sequence[Served]) -> dict[str, tuple[str, ...]]:
    """Return the names of the robots by team, the one that plays to positive x first. Raises RobotError."""
    at: dict[str, list[float]] = {}
    for robot, _, _, team in robots:
        if robot.stage is None or BALL not in (truth := robot.stage.truth()).objects:
            raise RobotError(f"a referee needs a ball of the name {BALL}, as in --world match")
        at.setdefault(team, []).append(truth.torso.position[0])
    if len(at) != 2 or "" in at:
        raise RobotError("a referee needs a world with robots of two teams, such as --world match")
    order = sorted(at, key=lambda team: statistics.mean(at[team]))
    return {team: tuple(each.robot.name for each in robots if each.team == team) for team in order}


ENTRANCE: Final = Entrance(
    programs="Referee",
    options={
        "referee": (
            Annotated[
                float | None,
                typer.Option(metavar="MINUTES", min=0.1, max=90.0, help="Let a referee judge a match."),
            ],
            None,
        ),
        "format": (
            Annotated[
                str,
                typer.Option(metavar="NAME", help="With --referee: by the rules of a format."),
            ],
            DEFAULT_FORMAT,
        ),
        "rules": (
            Annotated[
                Path | None,
                typer.Option(
                    metavar="TOML",
                    exists=True,
                    dir_okay=False,
                    help="With --referee: other figures of the rules.",
                    show_default="its own",
                ),
            ],
            None,
        ),
    },
    serve_world=_serve,
    example=("naoserver-sim --world match --referee 4", "a match that a referee judges"),
)
