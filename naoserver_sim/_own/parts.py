"""What the compiled model of a user's robot says of its links, joints, servos and contact shapes.

They are tables of a facts file (`naoserver.body`), in its units and frames.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from typing import Any, Final

import msgspec
import mujoco
import numpy as np
from msgspec import Struct
from numpy.typing import NDArray

from naoserver.errors import RobotError
from naoserver.parts import MOST_PARTS, SHAPE_SIZES, Gear
from naoserver_sim._body import KINDS
from naoserver_sim._own.couplings import Couplings, Pull, couplings_of, keep_in_range, loops_of
from naoserver_sim._own.hulls import hull_of
from naoserver_sim._own.looks import Frame
from naoserver_sim._own.model_file import ModelFile

Array = NDArray[np.float64]

_SPEED: Final = 3.0
"""Highest speed in rad/s or m/s of a joint of which neither the model nor the TOML file says it."""
_GIVES: Final = 0.1
"""Angle in rad by which a servo gives way at its largest torque, if nothing says how stiff it is."""
_INERTIA: Final = 0.01
"""Inertia of a rotor behind its gear in kg m2, if the model has none: keeps light links steady."""
_DIGITS: Final = 5
"""Digits behind the point, in m, of the corners of hulls: short enough for thousands of them."""
_FRICTION: Final = 1.0
"""MuJoCo's friction of a shape that names none."""


class OwnJoint(Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """Corrections of a joint."""

    max_velocity: float | None = None
    max_torque: float | None = None
    lower: float | None = None
    upper: float | None = None


class OwnServo(Gear, frozen=True, kw_only=True):
    """The gains of some joints."""

    joints: tuple[str, ...]


class OwnFile(Struct, frozen=True, kw_only=True):
    """What the TOML file has besides the parts of a `Body`."""

    model: str
    meshes: str = "."
    name: str = ""
    joint: dict[str, OwnJoint] = {}
    servo: dict[str, OwnServo] = {}


def parts_of(
    mj: mujoco.MjModel, model: ModelFile, own: OwnFile, where: str
) -> tuple[dict[str, Any], dict[int, Frame]]:
    """Return links, joints, gears and shapes of a model, as in a facts file, and the frames of its bodies."""
    bodies = list(range(1, mj.nbody))
    if len(bodies) > MOST_PARTS:
        raise RobotError(f"{where}: {len(bodies)} links; a robot has at most {MOST_PARTS}")
    roots = [body for body in bodies if mj.body_parentid[body] == 0]
    if len(roots) != 1:
        names = ", ".join(mj.body(root).name for root in roots[:5])
        raise RobotError(f"{where}: a robot is one tree of links; here are {len(roots)}: {names}")
    inertias = _inertias(mj)
    moves = couplings_of(mj, where, {})
    links: list[dict[str, Any]] = []
    joints: list[dict[str, Any]] = []
    fixed: list[dict[str, Any]] = []
    gears: dict[str, Any] = {
        name: {key: value for key, value in msgspec.to_builtins(servo).items() if key != "joints"}
        for name, servo in own.servo.items()
    }
    given = {joint: name for name, servo in own.servo.items() for joint in servo.joints}
    # The frame of a link is at its joint, which MJCF allows to be elsewhere.
    frames = {0: Frame("", np.zeros(3))}
    for body in bodies:
        name = mj.body(body).name or f"link{body}"
        parent = int(mj.body_parentid[body])
        moved = [j for j in _joints(mj, body) if mj.jnt_type[j] != mujoco.mjtJoint.mjJNT_FREE]
        carrier, offset = frames[parent]
        origin = mj.body_pos[body] - offset
        turn: list[float] = mj.body_quat[body].tolist()
        offset = np.zeros(3)
        for number, joint in enumerate(moved):
            at = mj.jnt_pos[joint].copy()
            step = _rotated(turn, at - offset) if number == 0 else at - offset
            child = name if number == len(moved) - 1 else f"{name} {number + 1}"
            joints.append(
                _joint(mj, joint, model, own, moves, where=where)
                | {"parent": carrier, "child": child, "origin": (origin + step).tolist(), "turn": turn}
            )
            gear = given.get(joints[-1]["name"])
            if gear is None:
                gear = joints[-1]["name"]
                torque, pulls = float(joints[-1]["max_torque"]), moves.pulls.get(gear, ())
                gears[gear] = _gear(mj, joint, torque, pulls, inertias) if torque else _bearing(mj, joint)
            joints[-1]["gear"] = gear
            if child != name:
                links.append({"name": child, "mass": 0.0})
            carrier, origin, turn, offset = child, np.zeros(3), [1.0, 0.0, 0.0, 0.0], at
        if not moved and parent:
            link = {"name": f"{name} mount", "parent": carrier, "child": name, "origin": origin.tolist()}
            fixed.append(link | {"turn": turn, "axis": [0, 0, 1], "max_velocity": 0.0, "max_torque": 0.0})
        frames[body] = Frame(name, offset)
        links.append(_link(mj, body, name, offset))
    del frames[0]
    keep_in_range(joints, moves.couplings, where)
    loops = loops_of(mj, frames, where, {})
    shapes = [shape for geom in range(mj.ngeom) for shape in _shape(mj, geom, frames)]
    parts = {"links": links, "joints": joints, "fixed_joints": fixed, "gears": gears, "shapes": shapes}
    parts |= {
        "couplings": msgspec.to_builtins(moves.couplings),
        "loops": loops.loops,
        "notes": [*moves.notes, *loops.notes],
    }
    return parts | ({"mounted": True} if loops.mounted else {}), frames


def _joints(mj: mujoco.MjModel, body: int) -> range:
    first = int(mj.body_jntadr[body])
    return range(first, first + int(mj.body_jntnum[body]))


def _link(mj: mujoco.MjModel, body: int, name: str, offset: Array) -> dict[str, Any]:
    turned = np.zeros(9)
    mujoco.mju_quat2Mat(turned, mj.body_iquat[body])
    axes = turned.reshape(3, 3)
    inertia = axes @ np.diag(mj.body_inertia[body]) @ axes.T
    xx, yy, zz = np.diag(inertia).tolist()
    tensor = {"ixx": xx, "iyy": yy, "izz": zz}
    tensor |= {"ixy": float(inertia[0, 1]), "ixz": float(inertia[0, 2]), "iyz": float(inertia[1, 2])}
    com = (mj.body_ipos[body] - offset).tolist()
    return {"name": name, "mass": float(mj.body_mass[body]), "com": com, "inertia": tensor}


def _joint(
    mj: mujoco.MjModel, joint: int, model: ModelFile, own: OwnFile, moves: Couplings, *, where: str
) -> dict[str, Any]:
    """Return what a model says of a joint, corrected by the TOML file."""
    name = mj.joint(joint).name
    if not name:
        raise RobotError(f"{where}: a joint of {mj.body(mj.jnt_bodyid[joint]).name!r} has no name")
    if mj.jnt_type[joint] == mujoco.mjtJoint.mjJNT_BALL:
        raise RobotError(
            f"{where}: joint {name!r} is a ball joint; joints turn about one axis or slide along it"
        )
    torque = 0.0 if name in moves.passive else _torque(mj, joint, moves.pulls.get(name, ()))
    found: dict[str, Any] = {
        "name": name,
        "axis": mj.jnt_axis[joint].tolist(),
        "sliding": bool(mj.jnt_type[joint] == mujoco.mjtJoint.mjJNT_SLIDE),
        "max_velocity": model.speeds.get(name, _SPEED),
    }
    if mj.jnt_limited[joint]:
        found["lower"], found["upper"] = mj.jnt_range[joint].tolist()
    if torque is not None:
        found["max_torque"] = torque
    if name in own.joint:
        corrected = msgspec.to_builtins(own.joint[name])
        found |= {key: value for key, value in corrected.items() if value is not None}
    if name in moves.passive or any(pair.follower == name for pair in moves.couplings):
        found.setdefault("max_torque", 0.0)
    elif not found.get("max_torque", 0.0) > 0.0:
        raise RobotError(
            f"{where}: joint {name!r} has no largest torque: give one, [joint.{name}] max_torque"
        )
    return found


def _torque(mj: mujoco.MjModel, joint: int, pulls: Iterable[Pull]) -> float | None:
    """Return the largest torque of a joint in N m, by its motor or by itself; None when nothing limits it."""
    limits = []
    if mj.jnt_actfrclimited[joint]:
        limits.append(float(np.abs(mj.jnt_actfrcrange[joint]).max()))
    for motor, lever in pulls:
        gear = lever * abs(float(mj.actuator_gear[motor, 0]))
        if mj.actuator_forcelimited[motor]:
            limits.append(gear * float(np.abs(mj.actuator_forcerange[motor]).max()))
        elif mj.actuator_ctrllimited[motor] and mj.actuator_biastype[motor] == mujoco.mjtBias.mjBIAS_NONE:
            limits.append(gear * float(np.abs(mj.actuator_ctrlrange[motor]).max()))
    return min(limits, default=None)


def _bearing(mj: mujoco.MjModel, joint: int) -> dict[str, float]:
    """Return the bearings of a joint, and the spring of one without a motor."""
    dof = int(mj.jnt_dofadr[joint])
    return {
        "stiffness": float(np.ravel(mj.jnt_stiffness[joint])[0]),
        "rest": float((mj.qpos_spring - mj.qpos0)[mj.jnt_qposadr[joint]]),
        "friction_damping": float(np.ravel(mj.dof_damping[dof])[0]),
        "friction": float(mj.dof_frictionloss[dof]),
        "inertia": float(mj.dof_armature[dof]),
    }


def _gear(
    mj: mujoco.MjModel, joint: int, torque: float, pulls: Iterable[Pull], inertias: Array
) -> dict[str, float]:
    """Return the gains of a joint's servo; without one, gains at which it neither sags nor swings."""
    dof = int(mj.jnt_dofadr[joint])
    inertia = float(mj.dof_armature[dof]) or _INERTIA
    gear = _bearing(mj, joint) | {"rest": 0.0, "inertia": inertia}
    for motor, lever in pulls:
        if (
            mj.actuator_biastype[motor] == mujoco.mjtBias.mjBIAS_AFFINE
            and mj.actuator_biasprm[motor, 1] < 0.0
        ):
            stiffness, damping = (-lever * mj.actuator_biasprm[motor, 1:3]).tolist()
            return gear | {"stiffness": stiffness, "damping": max(damping, 0.0)}
    stiffness = torque / _GIVES
    return gear | {"stiffness": stiffness, "damping": 2.0 * math.sqrt(stiffness * (inertias[dof] + inertia))}


def _inertias(mj: mujoco.MjModel) -> Array:
    """Return the inertia that each joint moves, at the angle 0 of all."""
    data = mujoco.MjData(mj)
    mujoco.mj_forward(mj, data)
    full = np.zeros((mj.nv, mj.nv))
    mujoco.mj_fullM(mj, data, full)
    return np.diag(full).copy()


def _shape(mj: mujoco.MjModel, geom: int, frames: dict[int, Frame]) -> Iterator[dict[str, Any]]:
    """Yield the contact shape of a geom, if it is one: of a mesh its hull, or a box if it is flat."""
    body = int(mj.geom_bodyid[geom])
    if body not in frames or not (mj.geom_contype[geom] or mj.geom_conaffinity[geom]):
        return
    link, offset = frames[body]
    place = mj.geom_pos[geom] - offset
    turn: list[float] = mj.geom_quat[geom].tolist()
    kind = KINDS.get(mujoco.mjtGeom(int(mj.geom_type[geom])))
    shape: dict[str, Any] = {"link": link}
    if len(points := hull_of(mj, geom)):
        shape |= {"kind": "hull", "points": np.round(points - offset, _DIGITS).tolist()}
    elif kind is not None or mj.geom_type[geom] == mujoco.mjtGeom.mjGEOM_MESH:
        size = mj.geom_aabb[geom, 3:] if kind is None else mj.geom_size[geom][: SHAPE_SIZES[kind]]
        place = place + _rotated(turn, mj.geom_aabb[geom, :3])
        shape |= {"kind": kind or "box", "size": np.maximum(size, 1e-4).tolist()}
        shape |= {"position": place.tolist(), "turn": turn}
    else:
        return
    friction = float(mj.geom_friction[geom, 0])
    yield shape if friction == _FRICTION else shape | {"friction": max(friction, 1e-3)}


def _rotated(quaternion: list[float], vector: Array) -> Array:
    turned = np.zeros(3)
    mujoco.mju_rotVecQuat(turned, vector, np.array(quaternion))
    return turned
