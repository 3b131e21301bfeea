"""The scene around the simulated robot: read, and changed between two ticks of the physics."""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Final, Literal

import mujoco
import numpy as np
from numpy.typing import NDArray

from naoserver.bodies.capabilities import Pose, Truth, Vector, WorldShape
from naoserver.bodies.description import rounded
from naoserver.bodies.parts import NO_TURN
from naoserver.errors import InvalidCommand
from naoserver.soccer_field import Field
from naoserver_sim._motors import Array
from naoserver_sim._simulator import Simulator, Snapshot
from naoserver_sim._surroundings import WHITE, about_z
from naoserver_sim.appearance import color_of
from naoserver_sim.model import FreeIndex, Model

_FARTHEST_PLACE: Final = 50.0
"""Largest distance in m from the origin at which objects can be placed."""
_STRONGEST: Final = 1000.0
"""Largest force in N of a push: a hundred times what the robot withstands."""
_MOST_PUSHES: Final = 16
"""Maximum number of simultaneous pushes."""
_LONGEST_PUSH: Final = 60.0
"""Longest duration of a push or press in s."""
_SHALLOW: Final = 0.005
"""Depth in m to which a placed object may overlap another, which then pushes it out."""


@dataclass(slots=True)
class _Push:
    force: Array
    left: float
    """Its duration in s."""


class SimulatedStage:
    """Report the places of everything, move objects, push the robot.

    Implements `capabilities.Stage`. Its methods may be called from any thread; their changes take
    effect at the next control tick, in the thread of the physics. `press` presses touch sensors; `moved` is
    called by that thread when the robot was placed, which ends its actions.
    """

    def __init__(
        self,
        model: Model,
        simulator: Simulator,
        *,
        press: Callable[[str, float], None],
        moved: Callable[[], None],
    ) -> None:
        self._model = model
        self._data = simulator.data
        self._whole = simulator.physics.data
        self._simulator = simulator
        self._press = press
        self._moved = moved
        self._start_qpos: Array = self._data.qpos.copy()
        self._start_of_all: Array = self._whole.qpos.copy()
        self._start_ctrl: Array = self._data.ctrl.copy()
        self._pushes: list[_Push] = []
        self._robot_qpos = np.array(
            [*range(model.base.qpos, model.base.qpos + 7), *model.robot.qpos], dtype=np.intp
        )
        self._robot_dofs = np.array(
            [*range(model.base.dof, model.base.dof + 6), *model.robot.dofs], dtype=np.intp
        )

    @cached_property
    def shapes(self) -> Sequence[WorldShape]:
        return describe_world(self._model)

    @property
    def objects(self) -> tuple[str, ...]:
        return (*self._model.balls, *self._model.loose)

    def truth(self) -> Truth:
        snapshot, model = self._simulator.newest(), self._model
        objects = {name: Pose(self._carried_at(snapshot, name), NO_TURN) for name in model.balls}
        for name, index in (*model.loose.items(), *model.others.items()):
            objects[name] = _pose(snapshot.whole_qpos, index)
        torso = _pose(snapshot.qpos, model.base)
        along_x, along_y, along_z, *own = snapshot.qvel[model.base.dof : model.base.dof + 6].tolist()
        turning = _turned(torso.orientation, *own)
        return Truth(snapshot.time, torso, (along_x, along_y, along_z), turning, objects)

    def reset(self) -> None:
        """Put the robot and all objects back to their start, motors stiff and cool; time continues.

        Other robots stay where they are. Raises InvalidCommand when one of them is in the way.
        """
        if self._model.others:
            there = self._simulator.newest().whole_qpos.copy()
            self._restore_objects(there)
            there[self._model.share.qpos] = self._start_qpos
            self._require_free("", there, self._model.links)

        def restore() -> None:
            self._simulator.motors.cool()
            self._restore_objects(self._whole.qpos)
            for index in self._model.loose.values():
                self._whole.qvel[index.dof : index.dof + 6] = 0.0
            self._restore(self._start_qpos)

        self._simulator.order(restore)

    def place_object(self, name: str, position: Vector) -> None:
        if name not in self.objects:
            raise InvalidCommand("name", f"there is no object {name!r}; there are {', '.join(self.objects)}")
        _require(-_FARTHEST_PLACE, _FARTHEST_PLACE, "m", **dict(zip("xyz", position, strict=True)))
        if name in self._model.balls:
            self._place_carried(name, position)
        else:
            self._place_loose(name, position)

    def place_robot(
        self, x: float, y: float, heading: float, end_motion: Callable[[], None] = lambda: None
    ) -> None:
        """Put the robot as it began, its motors stiff. Raises InvalidCommand when the place is occupied."""
        if self._model.body.mounted:
            raise InvalidCommand("x", "the robot is mounted where it is")
        _require(-_FARTHEST_PLACE, _FARTHEST_PLACE, "m", x=x, y=y)
        _require(-math.tau, math.tau, "rad", heading=heading)
        qpos = self._start_qpos.copy()
        base, start = self._model.base.qpos, self._model.start
        turn = np.array(about_z(heading - start.heading))
        offset = np.zeros(3)
        mujoco.mju_rotVecQuat(offset, qpos[base : base + 3] - [*start.position, 0.0], turn)
        turned = np.zeros(4)
        mujoco.mju_mulQuat(turned, turn, qpos[base + 3 : base + 7])
        qpos[base : base + 3] = offset + np.array((x, y, 0.0))
        qpos[base + 3 : base + 7] = turned
        there = self._simulator.newest().whole_qpos.copy()
        there[self._model.share.qpos][self._robot_qpos] = qpos[self._robot_qpos]
        self._require_free("x", there, self._model.links)
        end_motion()
        self._simulator.order(lambda: self._restore(qpos, only_robot=True))

    def push(self, force: Vector, seconds: float) -> None:
        _require(-_STRONGEST, _STRONGEST, "N", **dict(zip(("x", "y", "z"), force, strict=True)))
        _require(0.0, _LONGEST_PUSH, "s", seconds=seconds)
        if len(self._pushes) >= _MOST_PUSHES:
            raise InvalidCommand("seconds", f"{_MOST_PUSHES} pushes are already active: wait until one ends")
        push = _Push(np.array(force), seconds)

        def begin() -> None:
            if len(self._pushes) < _MOST_PUSHES:  # including pushes since the last tick
                self._pushes.append(push)

        self._simulator.order(begin)

    def press(self, sensor: str, seconds: float) -> None:
        _require(0.0, _LONGEST_PUSH, "s", seconds=seconds)
        self._press(sensor, seconds)

    def tick(self, seconds: float) -> None:
        """Apply the pushes for the next tick; for the thread of the physics only."""
        if not self._pushes:
            return
        applied = self._data.xfrc_applied[self._model.base.body]
        applied[:3] = 0.0
        self._pushes = [push for push in self._pushes if push.left > 0.0]
        for push in self._pushes:
            # A push that ends within the tick is weaker for the whole tick, which gives the same impulse.
            applied[:3] += push.force * min(1.0, push.left / seconds)
            push.left -= seconds
        np.clip(applied[:3], -_STRONGEST, _STRONGEST, out=applied[:3])

    # -- places ------------------------------------------------------------------------------------------

    def _carried_at(self, snapshot: Snapshot, name: str) -> Vector:
        """Return the place of a ball that is carried round the robot's start by pan, distance and height."""
        pan, distance, height = snapshot.qpos[self._model.balls[name].qpos].tolist()
        start = self._model.start
        angle = start.heading + pan
        x, y = start.position
        return x + distance * math.cos(angle), y + distance * math.sin(angle), height

    def _place_carried(self, name: str, position: Vector) -> None:
        index, start = self._model.balls[name], self._model.start
        x, y = position[0] - start.position[0], position[1] - start.position[1]
        pan = math.remainder(math.atan2(y, x) - start.heading, math.tau)
        places = np.array([pan, math.hypot(x, y), position[2]])
        for joint, value, what in zip(index.joints, places, ("pan", "distance", "height"), strict=True):
            if not joint.lower <= value <= joint.upper:
                limits = f"{joint.lower:g} to {joint.upper:g}"
                message = f"{name} is carried: its {what} would be {value:.3g}, and can be {limits}"
                raise InvalidCommand("position", message)

        def put() -> None:
            self._simulator.put(index.qpos, index.dofs, places)
            self._simulator.hold(index.motors, places)

        self._simulator.order(put)

    def _place_loose(self, name: str, position: Vector) -> None:
        index = self._model.loose[name]
        pose = np.array([*position, *self._start_of_all[index.qpos + 3 : index.qpos + 7]])
        there = self._simulator.newest().whole_qpos.copy()
        there[index.qpos : index.qpos + 7] = pose
        self._require_free("position", there, {index.body})

        def put() -> None:
            self._whole.qpos[index.qpos : index.qpos + 7] = pose
            self._whole.qvel[index.dof : index.dof + 6] = 0.0

        self._simulator.order(put)

    def _restore_objects(self, qpos: Array) -> None:
        """Change positions of everything so that the objects are where they began."""
        for index in self._model.loose.values():
            pose = slice(index.qpos, index.qpos + 7)
            qpos[pose] = self._start_of_all[pose]

    def _restore(self, qpos: Array, *, only_robot: bool = False) -> None:
        """Put the robot, or everything, at rest where it began, or elsewhere on the floor."""
        data, model = self._data, self._model
        places = self._robot_qpos if only_robot else np.arange(model.mj.nq)
        dofs = self._robot_dofs if only_robot else np.arange(model.mj.nv)
        motors = model.robot.own_motors if only_robot else np.arange(model.mj.nu)
        data.qpos[places] = qpos[places]
        data.qvel[dofs] = 0.0
        data.qacc_warmstart[:] = 0.0
        data.xfrc_applied[model.base.body] = 0.0
        self._pushes.clear()
        self._simulator.hold(motors, self._start_ctrl[motors])
        self._simulator.motors.stiffen(motors, np.ones(len(motors)), 0.0)
        self._moved()

    def _require_free(self, field: str, qpos: Array, bodies: Collection[int]) -> None:
        """Raise InvalidCommand if, at `qpos`, some bodies would overlap others."""
        mj, data = self._model.whole, mujoco.MjData(self._model.whole)
        data.qpos[:] = qpos
        mujoco.mj_fwdPosition(mj, data)
        for contact in data.contact:
            touching = {int(mj.geom_bodyid[contact.geom1]), int(mj.geom_bodyid[contact.geom2])}
            beyond = touching.difference(bodies)
            if contact.dist < -_SHALLOW and len(beyond) < len(touching) and beyond:
                (other,) = beyond
                raise InvalidCommand(field, f"there is no room: {self._name(other)} is in the way")

    def _name(self, body: int) -> str:
        mj = self._model.whole
        if body in self._model.links:
            return "the robot"
        for name, other in self._model.others.items():
            if mj.body_rootid[body] == other.body:
                return name
        return "the floor or a wall" if body == 0 else str(mj.body(body).name)


def _require(lowest: float, highest: float, unit: str, **values: float) -> None:
    """Raise InvalidCommand, naming the value, unless each is within limits."""
    for name, value in values.items():
        if not lowest <= value <= highest:
            message = f"{name} is {value:g}: it must be from {lowest:g} to {highest:g} {unit}"
            raise InvalidCommand(name, message)


def _pose(qpos: Array, index: FreeIndex) -> Pose:
    x, y, z, w, i, j, k = qpos[index.qpos : index.qpos + 7].tolist()
    return Pose((x, y, z), (w, i, j, k))


def _turned(orientation: tuple[float, float, float, float], x: float, y: float, z: float) -> Vector:
    """Return a vector of a frame in the world, by the frame's orientation there."""
    w, i, j, k = orientation
    twice_x, twice_y, twice_z = 2.0 * (j * z - k * y), 2.0 * (k * x - i * z), 2.0 * (i * y - j * x)
    return (
        x + w * twice_x + j * twice_z - k * twice_y,
        y + w * twice_y + k * twice_x - i * twice_z,
        z + w * twice_z + i * twice_y - j * twice_x,
    )


_LIFT: Final = 0.001
"""Height of lines above the floor in m."""
_KINDS: Final[dict[int, Literal["Plane", "Box", "Sphere", "Capsule"]]] = {
    mujoco.mjtGeom.mjGEOM_PLANE: "Plane",
    mujoco.mjtGeom.mjGEOM_BOX: "Box",
    mujoco.mjtGeom.mjGEOM_SPHERE: "Sphere",
    mujoco.mjtGeom.mjGEOM_CAPSULE: "Capsule",
}
"""The forms of which the surroundings are made."""


def describe_world(model: Model) -> list[WorldShape]:
    """Return everything visible around a robot except others, and the lines of its field."""
    mj, data = model.whole, mujoco.MjData(model.whole)
    mujoco.mj_kinematics(mj, data)
    objects = {int(mj.body(name).id): name for name in (*model.balls, *model.loose)}
    robots = model.links | model.links_of_others
    shapes = []
    for geom in range(mj.ngeom):
        body = int(mj.geom_bodyid[geom])
        # The picture of a sign is a plane in front of its board.
        picture = mj.geom_type[geom] == mujoco.mjtGeom.mjGEOM_PLANE and mj.geom(geom).name != "floor"
        if picture or body in robots:
            continue
        if body in objects:
            place, turn = mj.geom_pos[geom], mj.geom_quat[geom]
        else:
            place, turn = data.geom_xpos[geom], np.zeros(4)
            mujoco.mju_mat2Quat(turn, data.geom_xmat[geom])
        w, x, y, z = turn.tolist()
        red, green, blue, opacity = color_of(mj, geom)
        shapes.append(
            WorldShape(
                kind=_KINDS[int(mj.geom_type[geom])],
                size=_rounded(mj.geom_size[geom]),
                pose=Pose(_rounded(place), (w, x, y, z)),
                color=(red, green, blue),
                opacity=opacity,
                object=objects.get(body, ""),
            )
        )
    return [*shapes, *(() if model.world.field is None else _lines(model.world.field))]


def _lines(field: Field) -> Iterator[WorldShape]:
    for (x, y), (half_x, half_y) in field.lines():
        for place in dict.fromkeys((side_x * x, side_y * y) for side_x in (1, -1) for side_y in (1, -1)):
            pose = Pose((*place, 0.0), NO_TURN)
            yield WorldShape("Box", (half_x, half_y, _LIFT), pose, WHITE)
    circle = (field.circle_diameter / 2, field.line / 2, 0.0)
    yield WorldShape("Ring", circle, Pose((0.0, 0.0, _LIFT), NO_TURN), WHITE)


def _rounded(values: NDArray[np.float64]) -> tuple[float, float, float]:
    x, y, z = rounded(values)
    return x, y, z
