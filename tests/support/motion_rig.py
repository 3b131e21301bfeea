"""A robot in virtual time behind its safety layer, with the player of its motions: no threads, no network."""

from __future__ import annotations

from typing import Any, Final

from interfaces.nao import ActionState
from naoserver.bodies import find_body
from naoserver.moves._player import PERIOD
from naoserver.moves.motion_file import load_motions
from naoserver.moves.routes import MotionRoute, PostureRoute, nearest_posture, situation_of, stance_of
from naoserver.options import ServerOptions
from naoserver.serving.assembly import Assembly
from zenoh_ice import VirtualClock

MOTIONS: Final = load_motions(find_body("H25"))
"""The motions of the Nao."""
LONGEST: Final = 120.0
"""The limit of any motion in robot seconds."""


class MotionRig:
    """Starts motions and postures, and advances the time in steps of the player."""

    def __init__(self, robot: Any, clock: VirtualClock) -> None:
        self.robot = robot
        self.clock = clock
        self.assembly = Assembly(robot, ServerOptions(), clock)
        self.player = self.assembly.player

    def let_go(self, seconds: float) -> None:
        """Let some robot time pass."""
        for _ in range(round(seconds / PERIOD)):
            self.clock.advance(PERIOD)
            if self.robot.control_loop is None:
                self.player.tick()

    def lose(self, client: str) -> None:
        """Lose a client as a server does: its commands are refused first, then what it moves is ended."""
        self.assembly.gate.is_lost = {client}.__contains__
        self.let_go(PERIOD)
        self.assembly.drop_client(client)

    def begin(self, motion: str, pace: float = 1.0, client: str = "") -> None:
        """Start a motion."""
        motions = self.player.motions
        route = MotionRoute(self.player.body, motions[motion], motions.values())
        self.player.begin("motion", motion, route, pace=pace, client=client)

    def play(self, motion: str, pace: float = 1.0) -> ActionState:
        """Play a motion to its end."""
        self.begin(motion, pace)
        self.finish()
        return self.player.progress("motion")

    def begin_posture(self, posture: str, fraction: float = 1.0, client: str = "") -> None:
        """Start to go to a posture."""
        route = PostureRoute(self.player.body, posture, self.player.motions.values(), fraction)
        self.player.begin("posture", posture, route, client=client)

    def go(self, posture: str, fraction: float = 1.0) -> ActionState:
        """Go to a posture."""
        self.begin_posture(posture, fraction)
        self.finish()
        return self.player.progress("posture")

    def finish(self) -> None:
        """Let time pass until the action ends."""
        end = self.clock.now() + LONGEST
        while self.player.busy:
            assert self.clock.now() < end, "it does not end"
            self.let_go(PERIOD)

    @property
    def stance(self) -> str | None:
        """The part of the body on which the robot rests."""
        return stance_of(self.robot.body, situation_of(self.robot))

    @property
    def posture(self) -> str:
        """The current posture of the robot."""
        return nearest_posture(self.robot.body, situation_of(self.robot))

    def commands(self) -> dict[str, float]:
        """Return the setpoint of each joint."""
        names = (joint.name for joint in self.robot.joints)
        return dict(zip(names, self.robot.read().commands, strict=True))
