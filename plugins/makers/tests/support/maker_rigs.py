"""Robots without physics behind their guards, and their makers' programs before them: in virtual time, without DDS."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any, Final

from naoserver.bodies import find_body
from naoserver.bodies.capabilities import WalkVelocity
from naoserver.fake import FakeRobot
from naoserver.options import ServerOptions
from naoserver.serving.assembly import Assembly
from visualhfsm_makers._booster import _loco as booster
from visualhfsm_makers._programs import Codes, Operation, Programs
from visualhfsm_makers._unitree import _loco as unitree
from zenoh_ice import VirtualClock

__all__ = ["G1Rig", "MakerRig", "T1Rig"]


class MakerRig:
    """A robot of a body, and programs of its maker."""

    def __init__(self, body: str, maker: str, codes: Codes) -> None:
        self.clock = VirtualClock()
        self.robot = FakeRobot(self.clock, body=find_body(body))
        self.assembly = Assembly(self.robot, ServerOptions(), self.clock)
        self.programs = Programs(self.robot, self.assembly, maker, codes)

    def advance(self, seconds: float, step: float = 0.1) -> None:
        """Let robot seconds pass."""
        for _ in range(round(seconds / step)):
            self.clock.advance(step)
            self.assembly.player.tick()
            self.assembly.paths.tick()
            self.programs.renew()
            for watched in self.assembly.watched:
                watched.watch()

    @property
    def commanded(self) -> WalkVelocity:
        """The velocity of the walk."""
        assert self.robot.walker is not None
        return self.robot.walker.commanded()

    @property
    def forward(self) -> float:
        """Its part forwards in m/s."""
        return self.commanded.forward

    @property
    def events(self) -> list[str]:
        """What the robot's server reports."""
        return [event.message for event in self.assembly.events.snapshot()[0]]

    def angle(self, joint: str) -> float:
        """Return where a joint is in rad."""
        return self.robot.read().positions[self.robot.body.joint_names.index(joint)]


class _WalkRig(MakerRig):
    """A robot with its maker's service of the walk, and what the services of both makers have."""

    MODE: int
    """The operation that reports the mode."""

    def __init__(self, body: str, maker: str, codes: Codes) -> None:
        super().__init__(body, maker, codes)
        self.stopped: Final = codes.unavailable
        """The maker's code of a robot that cannot now."""

    @property
    def operations(self) -> Mapping[int, Operation]:
        """Those of the service."""
        raise NotImplementedError

    def walk(
        self, forward: float = 0.1, left: float = 0.0, turn: float = 0.0, client: str = "program"
    ) -> int:
        """Walk until the program says otherwise; return the code of the answer."""
        raise NotImplementedError

    def mode(self, mode: int, client: str = "program") -> int:
        """Choose a mode; return the code of the answer."""
        raise NotImplementedError

    def ask(self, operation: int, body: object = None, client: str = "program") -> tuple[int, str]:
        """Call an operation with a text, or with what becomes JSON; return the code and the result."""
        text = body if isinstance(body, str) else json.dumps(body or {})
        return self.programs.answer(self.operations, operation, text, client)

    def call(self, operation: int, body: object = None, client: str = "program") -> int:
        """Call an operation; return the code of the answer."""
        return self.ask(operation, body, client)[0]

    def reported(self) -> Any:
        """Return the mode that the service reports."""
        (value,) = json.loads(self.ask(self.MODE)[1]).values()
        return value


class T1Rig(_WalkRig):
    """A T1 with Booster's service."""

    MODE = 2017

    def __init__(self) -> None:
        super().__init__("T1", "Booster", booster.CODES)
        self.loco = booster.Loco(self.programs)

    @property
    def operations(self) -> Mapping[int, Operation]:
        return self.loco.operations

    def walk(
        self, forward: float = 0.1, left: float = 0.0, turn: float = 0.0, client: str = "program"
    ) -> int:
        return self.call(2001, {"vx": forward, "vy": left, "vyaw": turn}, client)

    def mode(self, mode: int, client: str = "program") -> int:
        return self.call(2000, {"mode": mode}, client)

    def follow(self, motors: dict[int, float], client: str = "program") -> None:
        """Let motors follow positions; the others have weight 0."""
        commands = [(motors.get(n, 0.0), 0.0, 0.0, 50.0, 2.0, float(n in motors)) for n in range(23)]
        self.loco.follow(commands, client)


class G1Rig(_WalkRig):
    """A G1 with Unitree's service."""

    MODE = 7001

    def __init__(self) -> None:
        super().__init__("G1", "Unitree", unitree.CODES)
        self.loco = unitree.Loco(self.programs)

    @property
    def operations(self) -> Mapping[int, Operation]:
        return self.loco.operations

    def walk(
        self, forward: float = 0.1, left: float = 0.0, turn: float = 0.0, client: str = "program"
    ) -> int:
        return self.drive(forward, 864_000.0, client, left=left, turn=turn)

    def drive(
        self,
        forward: float = 0.1,
        seconds: float = 1.0,
        client: str = "program",
        *,
        left: float = 0.0,
        turn: float = 0.0,
    ) -> int:
        """Walk for some time; return the code of the answer."""
        return self.call(7105, {"velocity": [forward, left, turn], "duration": seconds}, client)

    def mode(self, mode: int, client: str = "program") -> int:
        return self.call(7101, {"data": mode}, client)
