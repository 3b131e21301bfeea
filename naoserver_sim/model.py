"""The whole model of robot and world, compiled."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from importlib import resources
from typing import Final

import msgspec
import mujoco
import numpy as np
from numpy.typing import NDArray

from naoserver.bodies import DEFAULT_BODY, find_body
from naoserver.bodies.description import looks_of, start_of
from naoserver.bodies.footsteps import Footsteps
from naoserver.bodies.parts import NO_TURN, CameraFacts, Coupling, JointFacts
from naoserver.body import Body
from naoserver.errors import RobotError
from naoserver_sim._body import BASE, MOUNT, add_body, possible
from naoserver_sim._motors import Array
from naoserver_sim._share import ALONE, Share
from naoserver_sim._surroundings import (
    SPECTATOR,
    START,
    add_movables,
    add_surroundings,
    spectator_of,
)
from naoserver_sim.appearance import add_appearance
from naoserver_sim.world import DEFAULT_WORLD, StartPose, World, load_world

WIDEST_IMAGE: Final = 1280
"""Pixels in a row of the largest image that scene.xml provides for."""
_ITERATIONS: Final = 50
"""Most iterations of the solver's line search with a heavy body on its feet: with fewer its feet creep."""


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
    """A compiled model of a robot with the indices of its parts, and what it stands in."""

    mj: mujoco.MjModel
    """The robot alone: what its controllers compute with. All indices are its own, unless said otherwise."""
    body: Body
    robot: DeviceIndex
    world: World
    """What it stands in, with others."""
    start: StartPose
    """Where it starts there."""
    balls: Mapping[str, DeviceIndex]
    """The mechanisms of carried balls."""
    loose: Mapping[str, FreeIndex]
    """Other objects that can be placed: balls that roll, boxes that can be pushed; indices of the whole."""
    cameras: tuple[CameraFacts, ...]
    base: FreeIndex
    """The root link of the body."""
    whole: mujoco.MjModel
    """What is simulated: the robot, its surroundings and all others; `mj` itself for a robot alone."""
    share: Share = ALONE
    """Where the robot is in the arrays of the whole."""
    others: Mapping[str, FreeIndex] = field(default_factory=dict)
    """The root links of the other robots, by their names; indices of the whole."""

    @cached_property
    def links(self) -> frozenset[int]:
        """The bodies of the whole that are the robot's links."""
        root = self.whole.body(self.share.prefix + self.body.root.name).id
        return frozenset(np.flatnonzero(self.whole.body_rootid == root).tolist())

    @property
    def links_of_others(self) -> frozenset[int]:
        """The bodies of the whole that are links of other robots."""
        roots = [other.body for other in self.others.values()]
        return frozenset(np.flatnonzero(np.isin(self.whole.body_rootid, roots)).tolist())


def is_simulated(camera: CameraFacts, size: tuple[int, int]) -> bool:
    """Return whether the simulation renders pictures of a size of a camera.

    Those of another shape than its first size would be crops of the sensor, without its full field of view.
    """
    (width, height), (first_width, first_height) = size, camera.sizes[0]
    return width * first_height == height * first_width and width <= WIDEST_IMAGE


def simulated_cameras(body: Body) -> tuple[CameraFacts, ...]:
    """Return the body's cameras and the spectator's, with the image sizes that the simulation renders."""
    cameras = []
    for camera in body.cameras:
        if camera.sizes[0][0] > WIDEST_IMAGE:
            raise RobotError(
                f"camera {camera.name}: its first size is wider than {WIDEST_IMAGE} pixels, the most here"
            )
        sizes, rates = zip(
            *(pair for pair in zip(camera.sizes, camera.rates, strict=True) if is_simulated(camera, pair[0])),
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
    spec = new_spec()
    cameras = simulated_cameras(body)
    add_surroundings(spec, world)
    add_robot(spec, world, body, skin=skin)
    with possible(body):
        mj = spec.compile()
    robot = _index(mj, body.joints, body.following)
    spectator = _spectator_of(mj, body, robot)
    mj.camera(spectator.name).pos = spectator.position
    return Model(
        mj=mj,
        body=body,
        robot=robot,
        world=world,
        start=world.robot,
        balls={ball.name: _index(mj, ball.joints, {}) for ball in world.carried_balls},
        loose={name: free_index(mj, name, name) for name in world.loose},
        cameras=(*cameras[:-1], spectator),
        base=free_index(mj, body.root.name, BASE),
        whole=mj,
    )


def new_spec() -> mujoco.MjSpec:
    """Return what every model begins with."""
    scene = resources.files("naoserver_sim").joinpath("scene.xml").read_text(encoding="utf-8")
    return mujoco.MjSpec.from_string(scene)


def add_robot(spec: mujoco.MjSpec, world: World, body: Body, *, skin: bool) -> None:
    """Add a robot, with its skin or as bare blocks, and after it all that moves in its world."""
    if isinstance(body.walk, Footsteps):
        spec.option.ls_iterations = _ITERATIONS
    with possible(body):
        links = add_body(spec, body, simulated_cameras(body)[:-1])
        add_appearance(spec, links, looks_of(body), skin=skin, colors=start_of(body))
        add_movables(spec, world)
        if body.mounted:
            _mount(spec, body)


def _mount(spec: mujoco.MjSpec, body: Body) -> None:
    """Fix the root of a body to the place where the robot starts."""
    # Anchor (3), place and turn of the root in the frame of the start (7), share of the torque.
    data = [*[0.0] * 6, *NO_TURN, *[1.0] * (mujoco.mjNEQDATA - 10)]
    kind, weld = mujoco.mjtObj.mjOBJ_BODY, mujoco.mjtEq.mjEQ_WELD
    spec.add_equality(name=MOUNT, type=weld, objtype=kind, name1=START, name2=body.root.name, data=data)


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


def free_index(mj: mujoco.MjModel, body: str, joint: str) -> FreeIndex:
    """Return the indices of a free body and its joint."""
    found = mj.joint(joint)
    return FreeIndex(int(mj.body(body).id), int(found.qposadr[0]), int(found.dofadr[0]))
