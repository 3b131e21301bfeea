"""What programs of a robot's maker command a simulated robot, in virtual time and without DDS."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

from naoserver.bodies import find_body
from naoserver.options import ServerOptions
from naoserver.serving.assembly import Assembly
from naoserver_sim.robot import SimulatedRobot
from naoserver_sim.world import load_world
from visualhfsm_makers._programs import Codes, Programs
from zenoh_ice import VirtualClock

_STEP: Final = 0.05


class SimulatedPrograms:
    """A simulated robot of a body behind the guards, and the programs of its maker."""

    def __init__(self, body: str, maker: str, codes: Codes) -> None:
        self.clock = VirtualClock()
        self.robot = SimulatedRobot(clock=self.clock, body=find_body(body), world=load_world("empty"))
        self.assembly = Assembly(self.robot, ServerOptions(), self.clock)
        self.programs = Programs(self.robot, self.assembly, maker, codes)

    def live(self, seconds: float, renew: Callable[[], object] = lambda: None) -> None:
        """Let robot seconds pass; `renew` is called before each step."""
        for _ in range(round(seconds / _STEP)):
            renew()
            self.clock.advance(_STEP)
            self.programs.renew()
            self.assembly.jobs[0].run()
