"""A document that plays with a robot: the referee holds it while it may not, and lets it begin anew."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path
from typing import Final

from hfsm_runtime.component import parameters_of, proxies_of
from hfsm_runtime.virtual import Execution, TaskClock, VirtualWorld
from interfaces.nao import RefereePrx
from naoserver.protocol.robot import Robot
from naoserver.serving.medium import Membership
from visualhfsm.plugins import VirtualMedium
from visualhfsm.simulation import RobotUnderTest, load_component
from visualhfsm_match._referee import Put, Referee
from visualhfsm_match._servant import IDENTITY, RefereeI

_HIDDEN: Final = ("GroundTruth", "Scene")
"""Servants of a simulation alone, with which a document would cheat."""
TICK: Final = 0.01
"""s from one control tick of the robots to the next: so far one player runs ahead of the others."""
_NANOSECONDS: Final = 1_000_000_000
_KEPT: Final = 50
"""Events and calls that are remembered, for errors to tell."""


class _Surroundings(VirtualWorld):
    """What a robot's components have around them, one after the other."""

    def close(self) -> None:
        """Stay: the next component needs it."""

    def end(self) -> None:
        """End it."""
        super().close()


class Player:
    """A document on a robot of a match.

    One that reads `Referee` runs from the beginning to the end. Any other one begins at each whistle, and
    when it returns from a penalty, as if somebody pressed a button: with its place in its parameters
    `start_x`, `start_y` and `start_heading`, if it has them; and ends when play stops. Raises
    DocumentInvalid, and what the component's code raises.

    It has its own clock, which calls `follow_clock` in each control tick: code that sleeps leaves others
    alone.
    """

    def __init__(
        self,
        name: str,
        robot: Robot,
        document: Path,
        *,
        referee: Referee,
        medium: VirtualMedium,
        follow_clock: Callable[[TaskClock], None],
    ) -> None:
        self.name: Final = name
        self.team: Final = referee.players[name].team
        self.run: Execution | None = None
        """The component that plays; None while the referee holds it."""
        self._referee: Final = referee
        self._document: Final = document
        self._clock: Final = TaskClock()
        self._clock.call_every(TICK, lambda: follow_clock(self._clock))
        self._surroundings: Final = _Surroundings(self._clock, kept=_KEPT)
        self._servant: Final = RefereeI(referee, name)
        member = Membership(name, self.team, medium.at(self._clock), session=referee.players[name].number)
        self.robot: Final = RobotUnderTest(
            robot, self._clock, self._surroundings.network, member=member, without=_HIDDEN
        )
        self._surroundings.network.serve(IDENTITY, self._servant)
        self._component: Final = load_component(document)
        declared = proxies_of(self._component).values()
        self._reads: Final = any(issubclass(each.type, RefereePrx) for each in declared)

    def follow(self) -> None:
        """Begin, go on or end, as the referee says."""
        wanted = self._reads or self._referee.may_play(self.name)
        if self.run is not None and (not wanted or (self.run.finished and not self._reads)):
            self.stop()
        if self.run is None and wanted:
            self.run = Execution(self._component(), self._surroundings, parameters=self._start())
        self._servant.publish()

    def advance(self, moment: int) -> None:
        """Let its time pass until a moment in ns; raises what the component's code raises."""
        behind = moment - self._clock.moment
        if behind >= 0:  # code that waited may be ahead
            (self.run or self._clock).advance(behind / _NANOSECONDS)

    def stop(self) -> None:
        """End the component."""
        run, self.run = self.run, None
        if run is not None:
            run.close()

    def put(self, place: Put) -> None:
        """Put the robot somewhere. Raises InvalidCommand when there is no room."""
        self.robot.put(*place[1:])

    def close(self) -> None:
        """End everything but the robot, which is the arena's."""
        try:
            self.stop()
            self.robot.close()
        finally:
            self._surroundings.end()

    def _start(self) -> dict[str, object]:
        """Return the parameters that say where the robot would be if its odometry were 0."""
        device, player = self.robot.device, self._referee.players[self.name]
        x, y, heading = self._referee.turned(self.team, *player.place[1:])
        if device.walker is not None:
            walked = device.walker.odometry()
            heading = math.remainder(heading - walked.heading, math.tau)
            x -= math.cos(heading) * walked.x - math.sin(heading) * walked.y
            y -= math.sin(heading) * walked.x + math.cos(heading) * walked.y
        wanted = {"start_x": x, "start_y": y, "start_heading": heading}
        return {name: value for name, value in wanted.items() if name in parameters_of(self._component)}
