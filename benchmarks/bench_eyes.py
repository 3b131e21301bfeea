"""Count what eyes see of drawn scenes, beside what stands there: missed, invented, and errors.

Robots, balls and the head are put somewhere on a soccer field, in bright or dim light, with and without the
noise of pictures. `nao eyes` sees the pictures; beside it stand the eyes that a simulation imitates with
noise (`parts.SEEN`). The truth is where things are, as far as they show in a picture.

    python benchmarks/bench_eyes.py [--pictures 1000] [--seed 1]
"""

from __future__ import annotations

import dataclasses
import math
from collections import defaultdict
from collections.abc import Iterator
from contextlib import closing, suppress
from typing import Any, Final, NamedTuple

import msgspec
import numpy as np

from benchmarks.common import options
from naoserver.bodies import find_body
from naoserver.bodies.capabilities import SeenThing
from naoserver.bodies.parts import SEEN, Sight
from naoserver.errors import InvalidCommand
from naoserver.options import CameraOptions
from naoserver.safety._event_log import EventLog
from naoserver.serving.camera import BodyHistory, CameraI
from naoserver_sim._senses.sight import SimulatedEyes
from naoserver_sim.arena import Arena
from naoserver_sim.robot import ArenaRobot
from naoserver_sim.world import Light, LooseBall, World, load_world
from zenoh_ice import VirtualClock

LIGHTS: Final = {"bright": Light(), "dim": Light(brightness=0.25, ambient=0.12)}
"""The light of a hall, and a third of it."""
FARTHEST: Final = 4.0
"""Distance in m up to which all counts."""


class LocalCamera:
    """The camera of a robot in this process, with the operations of a CameraPrx."""

    def __init__(self, robot: ArenaRobot, name: str) -> None:
        facts = next(camera for camera in robot.body.cameras if camera.name == name)
        now = robot.clock.now
        history = BodyHistory(robot, lambda: None)
        self._servant: Any = CameraI(robot, facts, CameraOptions(), EventLog(now, now), history)

    def __getattr__(self, operation: str) -> Any:  # noqa: ANN401
        return lambda *arguments: getattr(self._servant, operation)(*arguments, None)


class Scene(NamedTuple):
    """Where things are, and who looks."""

    kind: str
    robot: ArenaRobot
    cameras: dict[str, LocalCamera]
    truth: tuple[SeenThing, ...]
    imitated: tuple[SeenThing, ...]


def worlds() -> Iterator[tuple[str, World]]:
    """Yield a field in each light."""
    field = load_world("match")
    balls = (*field.balls, LooseBall(name="Second", position=(0.5, 0.5), color=(0.95, 0.45, 0.05)))
    for name, light in LIGHTS.items():
        yield name, msgspec.structs.replace(field, balls=balls, light=light)


def scenes(count: int, seed: int) -> Iterator[Scene]:
    """Yield scenes, a picture of each camera in each."""
    exact = Sight(kinds={kind: msgspec.structs.replace(facts, farthest=12.0) for kind, facts in SEEN.items()})
    of_each = count // (2 * 2 * len(find_body("H25").cameras))
    for name, world in worlds():
        for noise in (False, True):
            kind = f"{name}, noise" if noise else name
            random = np.random.default_rng(seed)
            arena = Arena(world, clock=VirtualClock(), noise=noise, seed=seed)
            with closing(arena):
                arena.start()
                robot = arena.robots[0]
                body = msgspec.structs.replace(robot.body, sight=exact)
                model = dataclasses.replace(robot._model, body=body)
                truth = SimulatedEyes(model, robot._simulator, noise=False, seed=None)
                imitated = SimulatedEyes(robot._model, robot._simulator, noise=True, seed=seed)
                cameras = {each.name: LocalCamera(robot, each.name) for each in robot.body.cameras}
                for _ in range(of_each):
                    shuffle(arena, random)
                    yield Scene(kind, robot, cameras, truth.look().things, imitated.look().things)


def shuffle(arena: Arena, random: np.random.Generator) -> None:
    """Put everything somewhere: two balls before the first robot, others farther away, and turn its head."""
    robot = arena.robots[0]
    x, y, heading = random.uniform(-4.0, 4.0), random.uniform(-2.7, 2.7), random.uniform(-math.pi, math.pi)
    _place(arena, robot.name, x, y, heading)

    def somewhere(nearest: float) -> tuple[float, float]:
        way, angle = random.uniform(nearest, FARTHEST), heading + random.uniform(-0.5, 0.5)
        return _on_grass(x + way * math.cos(angle), 4.9), _on_grass(y + way * math.sin(angle), 3.4)

    for other in arena.robots[1:]:
        _place(arena, other.name, *somewhere(0.8), random.uniform(-math.pi, math.pi))
    for ball in ("Ball", "Second"):
        with suppress(InvalidCommand):  # below a robot
            arena.place_object(ball, (*somewhere(0.3), 0.05))
    head = {"HeadYaw": random.uniform(-0.5, 0.5), "HeadPitch": random.uniform(-0.1, 0.4)}
    robot.command_positions(head, dict.fromkeys(head, 3.0))
    arena.clock.advance(1.0)  # balls and the head rest, and the exposure adapts


def _on_grass(place: float, end: float) -> float:
    return min(max(place, -end), end)


def _place(arena: Arena, name: str, x: float, y: float, heading: float) -> None:
    with suppress(InvalidCommand):  # somebody stands there
        arena.place(name, x, y, heading)
    arena.clock.advance(0.02)
