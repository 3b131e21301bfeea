"""Several robots in one world, with one physics and one clock."""

from __future__ import annotations

from dataclasses import replace
from typing import Final

from naoserver.bodies import DEFAULT_BODY, find_body
from naoserver.bodies.capabilities import Truth, Vector
from naoserver.body import Body
from naoserver.errors import InvalidCommand
from naoserver_sim._simulator import Physics, RunningPhysics
from naoserver_sim._together import Placed, stand_together
from naoserver_sim.cameras import CameraLimits
from naoserver_sim.named_body import named_body
from naoserver_sim.robot import ArenaRobot, seeded
from naoserver_sim.world import World, side_by_side
from zenoh_ice import VirtualClock

_CAMERA_LIMITS: Final = CameraLimits()


class Arena:
    """The robots of a world, each at rest at its place, which meet as real ones do; of none, a single one.

    `body` is what those are whose place names none. `seed` is that of the first robot, and the next numbers
    are those of the others; all other arguments are those of `SimulatedRobot`, and so are the promises.
    Raises RobotError when a robot has no room at its place, or a body cannot be read.
    """

    def __init__(
        self,
        world: World | None = None,
        *,
        body: Body | None = None,
        speed: float = 1.0,
        clock: VirtualClock | None = None,
        skin: bool = True,
        seed: int | None = None,
        noise: bool = False,
        posture: str | None = None,
        camera_limits: CameraLimits = _CAMERA_LIMITS,
    ) -> None:
        world, seed = seeded(world, seed, virtual=clock is not None)
        places = world.robots or side_by_side(world, 1).robots
        usual = body or find_body(DEFAULT_BODY)
        bodies = [named_body(place.body) if place.body else usual for place in places]
        placed = [Placed(at.name, of, at, at.shirt) for at, of in zip(places, bodies, strict=True)]
        models, data = stand_together(world, placed, posture, skin=skin)
        self._running: Final = RunningPhysics(Physics(models[0].whole, data), speed, clock)
        self.clock: Final = self._running.clock
        self.robots: Final = tuple(
            ArenaRobot(
                place.name,
                model,
                self._running,
                team=place.team,
                shirt=place.shirt,
                seed=None if seed is None else seed + number,
                noise=noise,
                camera_limits=camera_limits,
            )
            for number, (place, model) in enumerate(zip(places, models, strict=True))
        )

    def start(self, *, cameras: bool = False) -> None:
        """Start the thread of the physics, and with `cameras` theirs; with a virtual clock there are none."""
        for robot in self.robots:
            robot.start(cameras=cameras)
        self._running.start()

    def check(self) -> None:
        """Raise RobotError when an error has stopped the physics."""
        self._running.check()

    def close(self) -> None:
        """End the threads of physics and cameras and free GL."""
        self._running.close()
        for robot in self.robots:
            robot.close()

    def truth(self) -> Truth:
        """Return the places of everything, with the robots among the objects; the trunk is the first's."""
        first = self.robots[0]
        truth = first.stage.truth()
        return replace(truth, objects={first.name: truth.torso, **truth.objects})

    def place(self, name: str, x: float, y: float, heading: float) -> None:
        """Put a robot somewhere, as `Stage.place_robot` does. Raises InvalidCommand."""
        for robot in self.robots:
            if robot.name == name:
                robot.stage.place_robot(x, y, heading)
                return
        names = ", ".join(robot.name for robot in self.robots)
        raise InvalidCommand("name", f"there is no robot {name!r}; there are {names}")

    def place_object(self, name: str, position: Vector) -> None:
        """Put an object somewhere, as `Stage.place_object` does. Raises InvalidCommand."""
        self.robots[0].stage.place_object(name, position)
