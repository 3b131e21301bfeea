"""A document that plays with a robot: the referee holds it while it may not, and lets it begin anew."""

from __future__ import annotations

import math
import random
from pathlib import Path
from typing import Final

import numpy as np

from hfsm_runtime.virtual import TaskClock, VirtualWorld
from naoserver.protocol.robot import Robot
from naoserver.serving.medium import Membership
from visualhfsm.plugins import VirtualMedium, catch_up
from visualhfsm.simulation import Behavior, EyesKind, RobotUnderTest
from visualhfsm.trials import Sandbox
from visualhfsm_match._referee import Put, Referee
from visualhfsm_match._servant import IDENTITY, RefereeI

_KEPT: Final = 50
"""Events and calls that are remembered, for errors to tell."""


class _Surroundings(VirtualWorld):
    """What a robot's components have around them, one after the other."""

    def close(self) -> None:
        """Stay: the next component needs it."""

    def end(self) -> None:
        """End it."""
        super().close()


class _Robot(RobotUnderTest):
    """The robot of these components."""

    def close(self) -> None:
        """Stay, too."""

    def end(self) -> None:
        """End all but the robot itself, which is the arena's."""
        super().close()


class Player:
    """A document on a robot of a match, whose code runs in a sandbox.

    One that reads `Referee` runs from the beginning to the end. Any other one begins at each whistle, and
    when it returns from a penalty, as if somebody pressed a button: with its place in its parameters
    `start_x`, `start_y` and `start_heading`, if it has them; and ends when play stops. Its random numbers
    come from `seed`. Raises DocumentInvalid, and BehaviorFailed for what its code does.
    """

    def __init__(
        self,
        name: str,
        robot: Robot,
        document: Path,
        *,
        sandbox: Sandbox,
        referee: Referee,
        medium: VirtualMedium,
        clock: TaskClock,
        seed: int,
        eyes: EyesKind,
    ) -> None:
        self.name: Final = name
        self.team: Final = referee.players[name].team
        self.run: Behavior | None = None
        """The component that plays; None while the referee holds it."""
        self._referee: Final = referee
        self._sandbox: Final = sandbox
        self._document: Final = document
        self._clock: Final = clock
        self._seed: Final = [seed, [*referee.players].index(name)]
        self._begun = 0
        said = sandbox.read(document)
        self._parameters: Final = {each.name for each in said.parameters}
        self._reads: Final = any(each.identity == IDENTITY for each in said.interfaces)
        self._surroundings: Final = _Surroundings(clock, kept=_KEPT)
        self._servant: Final = RefereeI(referee, name)
        member = Membership(name, self.team, medium.at(clock), session=referee.players[name].number)
        self.robot: Final = _Robot(robot, clock, self._surroundings.network, member=member, eyes=eyes)
        self._surroundings.network.serve(IDENTITY, self._servant)

    @property
    def has_begun(self) -> bool:
        """Whether its document has begun at all."""
        return self._begun > 0

    def follow(self) -> None:
        """Begin, go on or end, as the referee says."""
        wanted = self._reads or self._referee.may_play(self.name)
        if self.run is not None and (not wanted or (self.run.finished and not self._reads)):
            self.stop()
        if self.run is None and wanted:
            self.begin()
        self._servant.publish()

    def begin(self) -> None:
        """Begin its document. Raises ExecutionError."""
        self._begun += 1
        random.seed(str([*self._seed, self._begun]))  # the state of which its process gets
        np.random.seed([*self._seed, self._begun])
        self.run = self._sandbox.simulate(
            self._document,
            surroundings=self._surroundings,
            robot=lambda _network: self.robot,
            parameters=self._start(),
        )

    def advance(self, moment: int) -> None:
        """Let its time pass until a moment in ns. Raises BehaviorFailed."""
        catch_up(self.run or self._clock, moment)

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
            self.robot.end()
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
        return {name: value for name, value in wanted.items() if name in self._parameters}
