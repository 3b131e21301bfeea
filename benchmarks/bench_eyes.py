"""Count what eyes see of drawn scenes, beside what stands there: missed, invented, and errors.

Robots, balls and the head are put somewhere on a soccer field, in bright or dim light, with and without the
noise of pictures. `nao eyes` sees the pictures; beside it stand the eyes that a simulation imitates with
noise (`parts.SEEN`). The truth is where things are, as far as they show in a picture.

    python benchmarks/bench_eyes.py [--pictures 1000] [--seed 1]
"""

from __future__ import annotations

import dataclasses
import itertools
import math
import time
from collections import defaultdict
from collections.abc import Iterator, Sequence
from contextlib import closing, suppress
from typing import Final, NamedTuple

import msgspec
import numpy as np
from numpy.typing import NDArray

from benchmarks.common import options
from naoserver.bodies.capabilities import SeenThing
from naoserver.bodies.parts import SEEN, Sight
from naoserver.errors import InvalidCommand
from naoserver.eyes._pictures import PictureEyes
from naoserver.eyes.looks import read_looks
from naoserver_sim._senses.sight import SimulatedEyes
from naoserver_sim.arena import Arena
from naoserver_sim.world import Light, LooseBall, World, load_world
from tests.support.local_camera import local_cameras
from zenoh_ice import VirtualClock

LIGHTS: Final = {"bright": Light(), "dim": Light(brightness=0.25, ambient=0.12)}
"""The light of a hall, and a third of it."""
FARTHEST: Final = 4.0
"""Distance in m up to which all counts."""
NEAR: Final = {"ball": 0.07, "robot": 0.2}
"""Kinds, and the angle in rad within which what is seen is what is there."""
WHOLE: Final = 0.95
"""Share of a thing that shows, from which it counts as missed if it is not seen."""
CERTAIN: Final = 0.35
"""Certainty from which something counts as seen: less has what stands there without a shirt."""
RUNS: Final = 5
LATER: Final = 0.15
"""Seconds from a first picture to the one that counts: more than any delay of pictures."""

Array = NDArray[np.float64]


class Scene(NamedTuple):
    """What a camera shows, and who sees what."""

    kind: str
    truth: list[SeenThing]
    places: dict[str, Array]
    """Where all things of a kind are, shown or not: x and y in the robot's frame, a row for each."""
    seen: dict[str, list[SeenThing]]
    """By whose eyes."""


def worlds() -> Iterator[tuple[str, World]]:
    """Yield a field in each light."""
    field = load_world("match")
    balls = (*field.balls, LooseBall(name="Second", position=(0.5, 0.5), color=(0.95, 0.45, 0.05)))
    for name, light in LIGHTS.items():
        yield name, msgspec.structs.replace(field, balls=balls, light=light)


def scenes(count: int, seed: int) -> Iterator[Scene]:
    """Yield what the cameras show, in `RUNS` runs of each kind, whose robots have other errors."""
    exact = Sight(kinds={kind: msgspec.structs.replace(facts, farthest=12.0) for kind, facts in SEEN.items()})
    looks = read_looks()
    for (name, world), noise, run in itertools.product(worlds(), (False, True), range(RUNS)):
        kind = f"{name}, noise" if noise else name
        random = np.random.default_rng((seed, run))
        clock = VirtualClock()
        arena = Arena(world, clock=clock, noise=noise, seed=seed + run)
        with closing(arena):
            arena.start()
            robot = arena.robots[0]
            body = msgspec.structs.replace(robot.body, sight=exact)
            model = dataclasses.replace(robot._model, body=body)
            truth = SimulatedEyes(model, robot._simulator, noise=False, seed=None)
            imitated = SimulatedEyes(robot._model, robot._simulator, noise=True, seed=seed + run)
            cameras = local_cameras(robot)
            eyes = PictureEyes(cameras, looks)
            for _ in range(count // (4 * RUNS * len(cameras))):
                shuffle(arena, clock, random)
                eyes.look()  # the body's places are noted from the first picture on
                clock.advance(LATER)
                there = truth.look().things
                seen = {"pictures": eyes.look().things, "imitated": imitated.look().things}
                for camera in cameras:
                    yield Scene(
                        kind,
                        [thing for thing in there if thing.camera == camera],
                        places_in(arena, world),
                        {
                            who: [each for each in things if each.camera == camera]
                            for who, things in seen.items()
                        },
                    )


def places_in(arena: Arena, world: World) -> dict[str, Array]:
    """Return where balls and robots are, in the frame of the first robot."""
    truth = arena.robots[0].stage.truth()
    (x, y, _), turn = truth.torso.position, truth.torso.heading
    balls = {ball.name for ball in world.balls}
    found: dict[str, list[tuple[float, float]]] = {}
    for name, pose in truth.objects.items():
        found.setdefault("ball" if name in balls else "robot", []).append(pose.position[:2])
    to_frame = np.array(((math.cos(turn), math.sin(turn)), (-math.sin(turn), math.cos(turn))))
    return {kind: (np.array(places) - (x, y)) @ to_frame.T for kind, places in found.items()}


def shuffle(arena: Arena, clock: VirtualClock, random: np.random.Generator) -> None:
    """Put everything somewhere: two balls before the first robot, others farther away, and turn its head."""
    robot = arena.robots[0]
    x, y, heading = random.uniform(-4.0, 4.0), random.uniform(-2.7, 2.7), random.uniform(-math.pi, math.pi)
    _place(arena, clock, robot.name, (x, y, heading))

    def somewhere(nearest: float) -> tuple[float, float]:
        way, angle = random.uniform(nearest, FARTHEST), heading + random.uniform(-0.5, 0.5)
        return _on_grass(x + way * math.cos(angle), 4.9), _on_grass(y + way * math.sin(angle), 3.4)

    for other in arena.robots[1:]:
        _place(arena, clock, other.name, (*somewhere(0.8), random.uniform(-math.pi, math.pi)))
    for ball in ("Ball", "Second"):
        with suppress(InvalidCommand):  # below a robot
            arena.place_object(ball, (*somewhere(0.3), 0.05))
    head = {"HeadYaw": random.uniform(-0.5, 0.5), "HeadPitch": random.uniform(-0.1, 0.4)}
    robot.command_positions(head, dict.fromkeys(head, 3.0))
    clock.advance(1.0)  # balls and the head rest, and the exposure adapts


def _on_grass(place: float, end: float) -> float:
    return min(max(place, -end), end)


def _place(arena: Arena, clock: VirtualClock, name: str, pose: tuple[float, float, float]) -> None:
    with suppress(InvalidCommand):  # somebody stands there
        arena.place(name, *pose)
    clock.advance(0.02)


@dataclasses.dataclass
class Count:
    """How some eyes saw things of a kind."""

    pictures: int = 0
    there: int = 0
    missed: int = 0
    invented: int = 0
    named: int = 0
    in_picture: list[float] = dataclasses.field(default_factory=list)
    """Errors of the direction in rad, in the picture, and in the torso's frame."""
    of_torso: list[float] = dataclasses.field(default_factory=list)
    distance: list[float] = dataclasses.field(default_factory=list)
    """Errors as a share of it."""

    def add(self, scene: Scene, kind: str, seen: Sequence[SeenThing]) -> None:
        """Compare what was seen with what is there, one to one, the nearest first."""
        self.pictures += 1
        left = [each for each in seen if each.kind == kind and each.certainty >= CERTAIN]
        for thing in (each for each in scene.truth if each.kind == kind):
            near = [each for each in left if _angle(each, thing) < NEAR[kind]]
            found = min(near, key=lambda each: _angle(each, thing), default=None)
            if found is not None:
                left.remove(found)
            share = thing.certainty / (1.0 - thing.distance / 24.0)  # of it that nothing hides
            if thing.distance > FARTHEST or share < WHOLE:
                continue
            self.there += 1
            if found is None:
                self.missed += 1
                continue
            self.named += found.name == thing.name
            self.in_picture.append(math.hypot(found.left - thing.left, found.down - thing.down))
            self.of_torso.append(_angle(found, thing))
            self.distance.append(found.distance / thing.distance - 1.0)
        for each in left:
            ways = np.hypot(*(scene.places[kind] - (each.x, each.y)).T)
            self.invented += not (ways < 0.3 + 0.15 * each.distance).any()

    def row(self) -> str:
        """Return its figures."""

        def rms(values: list[float]) -> float:
            return math.sqrt(sum(value * value for value in values) / max(1, len(values)))

        return (
            f"{self.there:5} {self.missed / max(1, self.there):7.1%} {self.invented / self.pictures:8.2%}"
            f" {self.named / max(1, self.there - self.missed):6.0%} {math.degrees(rms(self.in_picture)):9.2f}"
            f" {math.degrees(rms(self.of_torso)):9.2f} {np.mean(self.distance or [0.0]):+9.1%}"
            f" {rms(self.distance):9.1%}"
        )


def _angle(one: SeenThing, other: SeenThing) -> float:
    """Return the angle between two directions in the torso's frame."""
    across = math.cos(one.tilt) * math.cos(other.tilt) * math.cos(one.pan - other.pan)
    return math.acos(max(-1.0, min(1.0, across + math.sin(one.tilt) * math.sin(other.tilt))))


def main() -> None:
    """See scenes, and print a table for each kind of things."""
    given = options(__doc__, pictures=1000, seed=1)
    counts: defaultdict[tuple[str, str, str], Count] = defaultdict(Count)
    begun = time.perf_counter()
    for scene in scenes(given.pictures, given.seed):
        for (who, seen), kind in itertools.product(scene.seen.items(), NEAR):
            for pictures in (scene.kind, "all"):
                counts[kind, who, pictures].add(scene, kind, seen)
    head = "there  missed invented  named picture/deg torso/deg  dist. bias  rms"
    print(f"{'kind':9} {'eyes':9} {'pictures':14} {head}")
    for (kind, who, pictures), count in sorted(counts.items()):
        print(f"{kind:9} {who:9} {pictures:14} {count.row()}")
    print(f"{counts['ball', 'pictures', 'all'].pictures} pictures in {time.perf_counter() - begun:.0f} s")


if __name__ == "__main__":
    main()
