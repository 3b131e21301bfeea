"""The whole model of robot and world, compiled; and the robot put on its feet."""

from __future__ import annotations

import copy
import logging
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from importlib import resources
from typing import Final

import msgspec
import mujoco
import numpy as np
from numpy.typing import NDArray

from naoserver.bodies import DEFAULT_BODY, find_body
from naoserver.bodies.footsteps import Footsteps
from naoserver.bodies.looks.description import looks_of, start_of
from naoserver.bodies.parts import NO_TURN, CameraFacts, Coupling, JointFacts
from naoserver.body import Body
from naoserver.errors import RobotError
from naoserver_sim._body import BASE, MOUNT, SIDES, add_body, possible, sole
from naoserver_sim._footsteps.limbs import limbs_of
from naoserver_sim._footsteps.posture import walking_stance
from naoserver_sim._motors import Array
from naoserver_sim._surroundings import (
    SPECTATOR,
    START,
    about_z,
    add_movables,
    add_surroundings,
    spectator_of,
)
from naoserver_sim.appearance import add_appearance
from naoserver_sim.world import DEFAULT_WORLD, World, load_world

_log = logging.getLogger(__name__)

_WIDEST_IMAGE: Final = 1280
"""Pixels in a row of the largest image that scene.xml provides for."""
_SETTLING_TIME: Final = 1.0  # s
_NEAR_STANCE: Final = 0.1
"""Largest angle in rad between a posture and the stance of the walk, in which it begins instead."""
_ITERATIONS: Final = 50
"""Most iterations of the solver's line search with a heavy body on its feet: with fewer its feet creep."""
_GAP: Final = 0.0002
"""Height in m from which the robot is lowered to the floor."""
_CLEARANCE: Final = 0.05
"""Least height in m above the floor of what a mounted robot moves, at the start."""
_FARTHEST_FLOOR: Final = 10.0
"""Largest distance in m of the floor from a robot whose root is at the origin."""


@dataclass(frozen=True)
class DeviceIndex:
    """Indices of a device's joints in MuJoCo's arrays, in the order of `joints`."""

    joints: tuple[JointFacts, ...]
    qpos: NDArray[np.intp]
    dofs: NDArray[np.intp]
    motors: NDArray[np.intp]
    """The motor of each joint; a follower's is its leader's. A passive joint has none: its index is beyond
    the last one."""
    ratios: Array
    """Angle of each joint for each rad of its motor: 1 but for followers."""
    offsets: Array
    """Angle of each joint in rad where its motor is at 0."""
    leading: NDArray[np.intp]
    """Places of the joints with separate motors."""

    @property
    def own_motors(self) -> NDArray[np.intp]:
        """All motors, in the order of their joints."""
        return self.motors[self.leading]

    def commanded(self, setpoints: Array, qpos: Array) -> Array:
        """Return where the joints are to be by the setpoints of the motors; a passive one is where it is."""
        places = self.of_motors(setpoints, 0.0)
        if self._scales:
            places = self.offsets + self.ratios * places
        if self._has_passive:
            places = np.where(self.motors < len(setpoints), places, qpos[self.qpos])
        return places

    def of_motors(self, values: Array, passive: float) -> Array:
        """Return the value of each joint's motor, or that of a passive joint."""
        found: Array = (np.append(values, passive) if self._has_passive else values)[self.motors]
        return found

    @cached_property
    def _has_passive(self) -> bool:
        return any(joint.passive for joint in self.joints)

    @cached_property
    def _scales(self) -> bool:
        """Whether a joint is elsewhere than its motor."""
        return bool(np.any(self.ratios != 1.0) or np.any(self.offsets))


@dataclass(frozen=True)
class FreeIndex:
    """Indices of a free body in MuJoCo's arrays."""

    body: int
    qpos: int
    """The beginning of its position (3) and its quaternion (w, x, y, z)."""
    dof: int
    """The beginning of its velocity (3) in the world's frame and its turning rate (3) in its own."""


@dataclass(frozen=True)
class Model:
    """A compiled model with the indices of its parts."""

    mj: mujoco.MjModel
    body: Body
    robot: DeviceIndex
    world: World
    balls: Mapping[str, DeviceIndex]
    """The mechanisms of carried balls."""
    loose: Mapping[str, FreeIndex]
    """Other objects that can be placed: balls that roll, boxes that can be pushed."""
    cameras: tuple[CameraFacts, ...]
    base: FreeIndex
    """The root link of the body."""


def simulated_cameras(body: Body) -> tuple[CameraFacts, ...]:
    """Return the body's cameras and the spectator's, with the image sizes that the simulation renders."""
    cameras = []
    for camera in body.cameras:
        first_width, first_height = camera.sizes[0]
        if first_width > _WIDEST_IMAGE:
            raise RobotError(
                f"camera {camera.name}: its first size is wider than {_WIDEST_IMAGE} pixels, the most here"
            )
        sizes, rates = zip(
            *(
                (size, rate)
                for size, rate in zip(camera.sizes, camera.rates, strict=True)
                # Images of another aspect ratio would be crops of the sensor, without its full field of view.
                if size[0] * first_height == size[1] * first_width and size[0] <= _WIDEST_IMAGE
            ),
            strict=True,
        )
        cameras.append(msgspec.structs.replace(camera, sizes=sizes, rates=rates))
    return (*cameras, SPECTATOR)


def _spectator_of(mj: mujoco.MjModel, body: Body, robot: DeviceIndex) -> CameraFacts:
    """Return the spectator that sees all of the body in its rest."""
    data = mujoco.MjData(mj)
    data.qpos[robot.qpos] = [body.resting_angles[joint.name] for joint in robot.joints]
    mujoco.mj_kinematics(mj, data)
    own = np.flatnonzero(mj.body_rootid[mj.geom_bodyid] == mj.body(body.root.name).id)
    to_up = data.geom_xmat[own].reshape(-1, 3, 3)[:, 2]
    middles = data.geom_xpos[own, 2] + (to_up * mj.geom_aabb[own, :3]).sum(axis=1)
    halves = (np.abs(to_up) * mj.geom_aabb[own, 3:]).sum(axis=1)
    lowest = float((middles - halves).min(initial=math.inf))
    return spectator_of(float((middles + halves).max(initial=lowest)) - lowest)


def build_model(world: World | None = None, *, skin: bool = True, body: Body | None = None) -> Model:
    """Compile a body, with its skin or as bare blocks, and a world: by default both are the first."""
    body = body or find_body(DEFAULT_BODY)
    world = world or load_world(DEFAULT_WORLD)
    scene = resources.files("naoserver_sim").joinpath("scene.xml").read_text(encoding="utf-8")
    spec = mujoco.MjSpec.from_string(scene)
    cameras = simulated_cameras(body)
    add_surroundings(spec, world)
    if isinstance(body.walk, Footsteps):
        spec.option.ls_iterations = _ITERATIONS
    with possible(body):
        links = add_body(spec, body, cameras[:-1])
        add_appearance(spec, links, looks_of(body), skin=skin, colors=start_of(body))
        add_movables(spec, world)
        if body.mounted:
            _mount(spec, body)
        mj = spec.compile()
    robot = _index(mj, body.joints, body.following)
    spectator = _spectator_of(mj, body, robot)
    mj.camera(spectator.name).pos = spectator.position
    return Model(
        mj=mj,
        body=body,
        robot=robot,
        world=world,
        balls={ball.name: _index(mj, ball.joints, {}) for ball in world.carried_balls},
        loose={name: _free(mj, name, name) for name in world.loose},
        cameras=(*cameras[:-1], spectator),
        base=_free(mj, body.root.name, BASE),
    )


def _mount(spec: mujoco.MjSpec, body: Body) -> None:
    """Fix the root of a body to the place where the robot starts."""
    # Anchor (3), place and turn of the root in the frame of the start (7), share of the torque.
    data = [*[0.0] * 6, *NO_TURN, *[1.0] * (mujoco.mjNEQDATA - 10)]
    kind, weld = mujoco.mjtObj.mjOBJ_BODY, mujoco.mjtEq.mjEQ_WELD
    spec.add_equality(name=MOUNT, type=weld, objtype=kind, name1=START, name2=body.root.name, data=data)


def standing(model: Model, posture: Mapping[str, float]) -> mujoco.MjData:
    """Return the state, at time 0, in which the robot stands still on its soles in a posture.

    It and everything else are at their starting places.
    """
    mj = model.mj
    data = mujoco.MjData(mj)
    angles = model.body.complete(posture)
    data.qpos[model.robot.qpos] = [angles[joint.name] for joint in model.robot.joints]
    for ball in model.world.carried_balls:
        data.qpos[model.balls[ball.name].qpos] = ball.start
    mujoco.mj_forward(mj, data)
    balances = False
    walk = model.body.walk
    if isinstance(walk, Footsteps):
        # In its stance it does not settle without its walk, so it begins exactly where that wants it.
        places = model.robot.qpos
        stance = walking_stance(mj, limbs_of(mj, model.body), walk, data.qpos[places])
        balances = bool(np.abs(stance - data.qpos[places]).max() < _NEAR_STANCE)
        if balances:
            data.qpos[places] = stance
            mujoco.mj_forward(mj, data)
    _put_on_floor(model, data)
    for device in (model.robot, *model.balls.values()):
        data.ctrl[device.own_motors] = data.qpos[device.qpos[device.leading]]
    if not balances:
        mujoco.set_mju_user_warning(_log.debug)  # by default, it writes a file into the current directory
        mujoco.mj_step(mj, data, nstep=round(_SETTLING_TIME / mj.opt.timestep))
        _require_still_sound(model, data)
    data.time = 0.0
    mujoco.mj_forward(mj, data)
    return data


def _require_still_sound(model: Model, data: mujoco.MjData) -> None:
    """Raise RobotError when the robot flew apart while it settled."""
    kinds = mujoco.mjtWarning
    for kind in (kinds.mjWARN_BADQPOS, kinds.mjWARN_BADQVEL, kinds.mjWARN_BADQACC):
        if data.warning[kind].number:
            dof = min(int(data.warning[kind].lastinfo), model.mj.nv - 1)
            joint = model.mj.joint(int(model.mj.dof_jntid[dof])).name
            at = "its root" if joint == BASE else f"joint {joint!r}"
            raise RobotError(
                f"body {model.body.name} cannot be simulated: at the start it flies apart, first at {at}."
                " Links may be too light for their servos: give these softer gains or more `inertia`, by"
                " [servo.NAME]; or shapes push each other apart: name them in `overlapping`"
            )


def build_standing(
    world: World, posture: str | None, *, skin: bool, body: Body
) -> tuple[Model, mujoco.MjData]:
    """Return a model, and the state in which its robot stands in one of the body's postures, or at rest.

    The caller may change both. Programs that simulate one robot after the other, as tests do, wait only once
    for the compiler and for the robot to settle.
    """
    model, data = _first_standing(world, posture, skin, body)
    own = replace(model, mj=copy.copy(model.mj))
    own_data = mujoco.MjData(own.mj)
    mujoco.mj_copyData(own_data, own.mj, data)
    return own, own_data


@lru_cache(maxsize=4)
def _first_standing(world: World, posture: str | None, skin: bool, body: Body) -> tuple[Model, mujoco.MjData]:
    if posture is not None and posture not in body.postures:
        raise RobotError(f"there is no posture {posture!r}; there are {', '.join(body.postures)}")
    model = build_model(world, skin=skin, body=body)
    return model, standing(model, body.resting_angles if posture is None else body.postures[posture].angles)


def _put_on_floor(model: Model, data: mujoco.MjData) -> None:
    """Move the base so that the robot stands at its starting place.

    The soles are flat on the floor with that place between them; a robot without soles is upright, and its
    root is above that place.
    """
    mj, body, base = model.mj, model.body, model.base.qpos
    level = np.array((1.0, 0.0, 0.0, 0.0))
    if body.soles:
        mujoco.mju_mat2Quat(level, data.geom(sole("left")).xmat.reshape(3, 3).T.flatten())
    start = model.world.robot
    mujoco.mju_mulQuat(data.qpos[base + 3 : base + 7], np.array(about_z(start.heading)), level)
    mujoco.mj_forward(mj, data)
    data.qpos[base + 2] -= _height(model, data) - _GAP
    if body.soles:
        left, right = (data.body(foot.link).xpos[:2] for foot in body.soles)
        data.qpos[base : base + 2] = data.body(body.root.name).xpos[:2] - (left + right) / 2 + start.position
    else:
        data.qpos[base : base + 2] = start.position
    if body.mounted:
        relative = mj.equality(MOUNT).data[3:10]
        relative[:] = (0.0, 0.0, data.qpos[base + 2], 1.0, 0.0, 0.0, 0.0)
    mujoco.mj_forward(mj, data)


def _height(model: Model, data: mujoco.MjData) -> float:
    """Return the height in m of the lowest sole, or else of the lowest contact shape, above the floor."""
    mj = model.mj
    if model.body.soles:
        left, right = (data.geom(sole(side)) for side in SIDES)
        return float(min(left.xpos[2], right.xpos[2]) - mj.geom(sole("left")).size[2])
    own = np.flatnonzero((mj.body_rootid[mj.geom_bodyid] == model.base.body) & (mj.geom_contype != 0))
    floor, ends = mj.geom("floor").id, np.zeros(6)
    heights = [mujoco.mj_geomDistance(mj, data, floor, geom, _FARTHEST_FLOOR, ends) for geom in own]
    if model.body.mounted:
        # What moves on a mount is clear of the floor; the mount itself is on the floor, or has no shape.
        moving = mj.body_weldid[mj.geom_bodyid[own]] != mj.body_weldid[model.base.body]
        heights = [*(np.array(heights) - _CLEARANCE * moving), data.qpos[model.base.qpos + 2]]
    return float(min(heights, default=0.0))


def _index(
    mj: mujoco.MjModel, joints: Sequence[JointFacts], following: Mapping[str, Coupling]
) -> DeviceIndex:
    pairs = [following.get(joint.name) for joint in joints]
    moved = zip(joints, pairs, strict=True)
    return DeviceIndex(
        joints=tuple(joints),
        qpos=np.array([mj.joint(joint.name).qposadr[0] for joint in joints], dtype=np.intp),
        dofs=np.array([mj.joint(joint.name).dofadr[0] for joint in joints], dtype=np.intp),
        motors=np.array(
            [
                mj.nu if joint.passive else mj.actuator(pair.leader if pair else joint.name).id
                for joint, pair in moved
            ],
            dtype=np.intp,
        ),
        ratios=np.array([pair.ratio if pair else 1.0 for pair in pairs]),
        offsets=np.array([pair.offset if pair else 0.0 for pair in pairs]),
        leading=np.array(
            [at for at, joint in enumerate(joints) if not (joint.passive or pairs[at])], dtype=np.intp
        ),
    )


def _free(mj: mujoco.MjModel, body: str, joint: str) -> FreeIndex:
    found = mj.joint(joint)
    return FreeIndex(int(mj.body(body).id), int(found.qposadr[0]), int(found.dofadr[0]))
