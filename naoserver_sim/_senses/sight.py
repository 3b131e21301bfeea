"""The eyes of a simulated robot: they know what its cameras show, and no picture is rendered for it.

A thing is seen when it is in the picture of a camera, near enough, and no more than a part of it is hidden,
by the robot's own body, too: rays from the camera meet the shapes of contacts. With noise, some things are
missed, others are invented, and directions and distances have errors, as the body's facts say
(`parts.Sight`).
"""

from __future__ import annotations

import math
import threading
from collections.abc import Iterator
from typing import Final, NamedTuple

import mujoco
import numpy as np
from numpy.typing import NDArray

from naoserver.bodies.capabilities import SeenThing, SightReading
from naoserver.bodies.parts import CameraFacts, Sight
from naoserver.bodies.sight import CameraPlace, Thing
from naoserver.soccer_field import Field
from naoserver_sim._motors import Array
from naoserver_sim._senses._targets import Target, fixed_targets, moving_targets
from naoserver_sim._simulator import Simulator, Snapshot
from naoserver_sim.cameras import put_cameras
from naoserver_sim.model import Model

Indices = NDArray[np.intp]

_OPAQUE: Final = np.array([1, 0, 0, 1, 0, 0], np.uint8)
"""The groups of geoms that hide others: the surroundings, and the shapes of robots that touch."""
_CLEAR: Final = 0.5
"""Opacity below which a geom hides nothing: a goal's net."""
_ENOUGH: Final = 0.4
"""Share of a thing that must not be hidden."""
_MOST_LINES: Final = 30
"""Most places on lines in a picture."""
_LINKS: Final = 6
"""Links of a robot that are looked for."""
_SPREAD: Final = 0.7
"""Where a ball is looked for besides its middle, as a share of its radius."""
_LEAST_FALL: Final = 0.03
"""Least slope of a ray to the floor of which the distance follows."""
_TICKS: Final = 100  # a second


class SimulatedEyes:
    """See what the cameras of a body show. Implements `capabilities.Eyes`; thread-safe.

    Without noise, all that shows is seen as it is, at once.
    """

    def __init__(self, model: Model, simulator: Simulator, *, noise: bool, seed: int | None) -> None:
        self._mj: Final = model.whole
        self._model: Final = model
        self._simulator: Final = simulator
        self._facts: Final = model.body.sight
        self._noise: Final = noise
        self._seed: Final = int(np.random.SeedSequence(seed).generate_state(1)[0])
        lean = np.random.default_rng(self._seed).normal(0.0, self._facts.lean, 2)
        self._lean: Final[Array] = np.array((*lean, 0.0))
        self.field: Final = model.world.field or Field()
        self._lock: Final = threading.Lock()
        self._scene: _Scene | None = None
        self._newest = SightReading(-math.inf)

    def look(self) -> SightReading:
        with self._lock:
            snapshot = self._simulator.past(self._facts.delay if self._noise else 0.0)
            since = snapshot.time - self._newest.time
            if not 0.0 <= since < 1.0 / self._facts.rate - 1e-6:
                self._newest = self._look(snapshot)
            return self._newest

    def _look(self, snapshot: Snapshot) -> SightReading:
        scene = self._scene = self._scene or _Scene(self._model)  # most robots never look
        scene.put(snapshot)
        seen: list[SeenThing] = []
        for number, camera in enumerate(self._model.body.cameras):
            place = scene.camera_place(camera, snapshot.time)
            errors = None
            if self._noise:
                tick = round(snapshot.time * _TICKS)
                random = np.random.default_rng((self._seed, number, tick))
                errors = _Errors(self._facts, place.eye, scene.to_world(self._lean), random)
            seen += scene.see(place, errors)
        seen.sort(key=lambda thing: (thing.kind, -thing.certainty))
        return SightReading(snapshot.time, tuple(seen))


class _Scene:
    """What stands in the world, and a state of it."""

    def __init__(self, model: Model) -> None:
        self._mj = mj = model.whole
        self._data = mujoco.MjData(mj)
        self._prefix = model.share.prefix
        self._root = mj.body(self._prefix + model.body.root.name).id
        self._facts = model.body.sight
        moving = [*moving_targets(model)]
        targets = [*moving, *fixed_targets(model.world)]
        self._targets = [target for target in targets if target.kind in self._facts.kinds]
        kinds = [self._facts.kinds[target.kind] for target in self._targets]
        self._kinds = {target.kind: facts for target, facts in zip(self._targets, kinds, strict=True)}
        self._moved = np.array([at for at, target in enumerate(self._targets) if target.body >= 0], np.intp)
        self._bodies = np.array([self._targets[at].body for at in self._moved], np.intp)
        self._middles = np.array([target.middle for target in self._targets]).reshape(-1, 3)
        self._bases = np.array([target.base for target in self._targets]).reshape(-1, 3)
        self._farthest = np.array([kind.farthest for kind in kinds])
        self._missed = np.array([kind.missed for kind in kinds])
        self._lines = np.array([target.kind == "line" for target in self._targets], bool)
        self._clear = mj.geom_rgba[:, 3] < _CLEAR
        self._roots = mj.body_rootid[mj.geom_bodyid]
        self._links = {
            target.body: np.flatnonzero(mj.body_rootid == target.body)
            for target in moving
            if target.kind == "robot"
        }

    def put(self, snapshot: Snapshot) -> None:
        """Put everything where it is in a state."""
        put_cameras(self._mj, self._data, snapshot.whole_qpos)
        self._middles[self._moved] = self._data.xpos[self._bodies]
        self._bases[self._moved] = self._middles[self._moved] * (1.0, 1.0, 0.0)

    def camera_place(self, camera: CameraFacts, time: float) -> CameraPlace:
        """Return where a camera is, in the world's frame."""
        at = self._mj.camera(self._prefix + camera.name).id
        right, up, back = self._data.cam_xmat[at].reshape(3, 3).T
        torso = self._data.xmat[self._root].reshape(3, 3)
        return CameraPlace(
            camera, time, self._data.cam_xpos[at].copy(), np.column_stack((-back, -right, up)), torso
        )

    def to_world(self, way: Array) -> Array:
        """Return a way of the robot's frame in the world's."""
        return np.asarray(self._turn().T @ way, np.float64)

    def see(self, place: CameraPlace, errors: _Errors | None) -> tuple[SeenThing, ...]:
        """Return what a camera shows, with the errors of one picture if there are any."""
        found = place.shows(self._middles)
        found &= np.linalg.norm(self._middles - place.eye, axis=1) < self._farthest
        lines = np.flatnonzero(found & self._lines)
        found[lines] = False
        found[lines[:: 1 + len(lines) // _MOST_LINES]] = True
        at, shares = self._unhidden(place, np.flatnonzero(found))
        if errors is not None:
            kept = errors.random.random(len(at)) >= self._missed[at]
            at, shares = at[kept], shares[kept]
        targets = [self._targets[each] for each in at.tolist()]
        middles, bases = self._middles[at], self._bases[at]
        seen = _Seen(middles, bases, [True] * len(targets), [0.0] * len(targets))
        if errors is not None and targets:
            seen = errors.of(targets, middles, bases)
        far = np.linalg.norm(middles - place.eye, axis=1) / self._farthest[at]
        certainties = (shares * (1.0 - 0.5 * far)).tolist()
        things = [
            Thing(target.kind, target.name, round(certainty, 3), known, error)
            for target, certainty, known, error in zip(
                targets, certainties, seen.known, seen.errors, strict=True
            )
        ]
        invented = [] if errors is None else [*self._invented(place, errors.random)]
        things += [Thing(kind, "", 0.4, True, 0.5) for kind, _ in invented]
        there = np.array([where for _, where in invented]).reshape(-1, 3)
        return self._in_frame(place if errors is None else errors.leaning(place)).see(
            things,
            self._to_frame(np.concatenate((seen.middles, there))),
            self._to_frame(np.concatenate((seen.bases, there))),
        )

    def _unhidden(self, place: CameraPlace, found: Indices) -> tuple[Indices, Array]:
        """Return which of some targets are seen, and how much of each, from 0 to 1."""
        samples: list[Array] = []
        owners: list[int] = []
        for at in found.tolist():
            own = self._samples(place, at)
            samples.append(own)
            owners += [at] * len(own)
        if not samples:
            return np.empty(0, np.intp), np.empty(0)
        ways = np.concatenate(samples) - place.eye
        lengths = np.linalg.norm(ways, axis=1)
        count = len(ways)
        geoms, distances = np.zeros(count, np.int32), np.zeros(count)
        directions = np.ascontiguousarray(ways / lengths[:, None]).ravel()
        camera = self._mj.camera(self._prefix + place.camera.name)
        head = int(camera.bodyid[0])
        cutoff = float(lengths.max())
        mujoco.mj_multiRay(
            self._mj,
            self._data,
            place.eye,
            directions,
            _OPAQUE,
            1,
            head,
            geoms,
            distances,
            None,
            count,
            cutoff,
        )
        owner = np.array(owners)
        slack = np.array([self._targets[at].slack for at in owners])
        roots = np.array([self._targets[at].body for at in owners])
        free = (geoms < 0) | (distances > lengths - slack) | self._clear[geoms]
        free |= (roots > 0) & (self._roots[geoms] == roots)
        seen, begins = np.unique(owner, return_index=True)
        shares = np.add.reduceat(free.astype(float), begins) / np.diff([*begins, count])
        enough = shares >= _ENOUGH
        return seen[enough], shares[enough]

    def _samples(self, place: CameraPlace, at: int) -> Array:
        """Return places of a target that are looked for: some are hidden if it is in part."""
        target, middle = self._targets[at], self._middles[at]
        if target.radius:
            aside = _SPREAD * target.radius * place.axes[:, 1:].T
            return np.asarray(np.vstack((middle, middle + aside, middle - aside)), np.float64)
        if target.kind == "robot":
            links = self._links[target.body]
            return np.asarray(self._data.xpos[links[:: max(1, len(links) // _LINKS)]], np.float64)
        return np.asarray(middle[None], np.float64)

    def _invented(self, place: CameraPlace, random: np.random.Generator) -> Iterator[tuple[str, Array]]:
        """Yield things that are not there, each with its place on the floor."""
        width, height = place.camera.sizes[0]
        half = math.tan(place.camera.horizontal_fov / 2)
        for kind, facts in self._kinds.items():
            if random.random() >= facts.invented:
                continue
            aside, up = random.uniform(-half, half), random.uniform(-half, half) * height / width
            way = place.axes @ (1.0, aside, up)
            there = place.eye - way * place.eye[2] / min(way[2], -1e-6)
            if np.linalg.norm(there - place.eye) < facts.farthest:
                yield kind, there

    def _in_frame(self, place: CameraPlace) -> CameraPlace:
        """Return where a camera is in the robot's frame."""
        turn = self._turn()
        eye = self._to_frame(place.eye[None])[0]
        return place._replace(eye=eye, axes=turn @ place.axes, torso=turn @ place.torso)

    def _to_frame(self, places: Array) -> Array:
        """Return places of the world in the robot's frame."""
        origin = self._data.xpos[self._root] * (1.0, 1.0, 0.0)
        return np.asarray((places - origin) @ self._turn().T, np.float64)

    def _turn(self) -> Array:
        """Return the turn from the world's frame to the robot's."""
        x, y, _ = self._data.xmat[self._root].reshape(3, 3)[:, 0]
        length = math.hypot(x, y) or 1.0
        return np.array(((x, y, 0.0), (-y, x, 0.0), (0.0, 0.0, length))) / length


class _Seen(NamedTuple):
    """Where things seem to be, in the world's frame."""

    middles: Array
    bases: Array
    known: list[bool]
    """Whether the distance of each is known."""
    errors: list[float]
    """Its standard deviation in m."""


class _Errors:
    """The errors of one picture: a robot does not know exactly how it leans, and each direction has its own.

    The distance of what is on the floor follows from where its ray meets that; all else has an error of its
    own.
    """

    def __init__(self, facts: Sight, eye: Array, lean: Array, random: np.random.Generator) -> None:
        """Take the part of the lean that lasts, a turn in the world's frame in rad."""
        self._facts = facts
        self._eye = eye
        self._lean = lean + random.normal(0.0, facts.sway, 3)
        self.random = random

    def leaning(self, place: CameraPlace) -> CameraPlace:
        """Return where a camera seems to be: in the picture and to the torso, nothing leans."""
        return place._replace(axes=self._leaning(place.axes.T).T, torso=self._leaning(place.torso.T).T)

    def _leaning(self, ways: Array) -> Array:
        return np.asarray(ways + np.cross(self._lean, ways), np.float64)

    def of(self, targets: list[Target], middles: Array, bases: Array) -> _Seen:
        """Return where things seem to be, given where they are."""
        count, random = len(targets), self.random
        facts = [self._facts.kinds[target.kind] for target in targets]
        own = np.array([each.direction for each in facts])
        turns = self._lean + own[:, None] * random.standard_normal((count, 3))
        scales = (1.0 + np.array([each.distance for each in facts]) * random.standard_normal(count)).tolist()
        ways, feet = middles - self._eye, bases - self._eye
        ways, feet = ways + np.cross(turns, ways), feet + np.cross(turns, feet)
        lengths = np.linalg.norm(ways, axis=1).tolist()
        spreads = np.hypot(own, math.hypot(self._facts.lean, self._facts.sway)).tolist()
        known, errors = [], []
        for at, target in enumerate(targets):
            scale, error = scales[at], facts[at].distance * lengths[at]
            if target.is_on_floor(float(middles[at, 2])):
                ray = ways[at] if target.radius else feet[at]
                falls = -float(ray[2]) / float(np.linalg.norm(ray))
                low = float(middles[at, 2]) if target.radius else 0.0
                sees = falls > _LEAST_FALL and self._eye[2] > low
                scale = float(self._eye[2] - low) / -float(ray[2]) if sees else math.inf
                error = spreads[at] * lengths[at] / falls if sees else math.inf
            known.append(math.isfinite(scale))
            errors.append(error)
            if known[-1]:
                ways[at] *= scale
                feet[at] *= scale
        return _Seen(self._eye + ways, self._eye + feet, known, errors)
