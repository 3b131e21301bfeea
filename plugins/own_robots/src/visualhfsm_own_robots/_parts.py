"""What the compiled model of a user's robot says of its links, joints, servos and contact shapes.

They are tables of a facts file (`naoserver.body`), in its units and frames.
"""

from __future__ import annotations

import math
import re
from collections.abc import Sized
from dataclasses import dataclass, field
from itertools import chain, count
from typing import Any, Final

import msgspec
import mujoco
import numpy as np
from msgspec import Struct

from naoserver.bodies.parts import MOST_PARTS, SHAPE_SIZES, Coupling, Gear
from naoserver.errors import RobotError
from visualhfsm_own_robots._couplings import Pull, couplings_of, gear_of, keep_in_range, loops_of
from visualhfsm_own_robots._figure import Array, Figure, matrix_of
from visualhfsm_own_robots._looks import KINDS, Frame
from visualhfsm_own_robots._model_file import ModelFile
from visualhfsm_own_robots._urdf import MOUNT, TENSOR

SPEED: Final = 3.0
"""Highest speed in rad/s or m/s of a joint of which neither the model nor the TOML file says it."""
_POINT: Final = 1e-3
"""Way in rad or m that does not matter."""
_LARGEST: Final = 1e6
"""Largest number of a link or a joint, in m, kg, and so on."""
_DIGITS: Final = 5
"""Digits behind the point, in m, of the corners of hulls: short enough for thousands of them."""
_ASPECT: Final = 4 / 3
"""Width of a picture by its height."""
FIELD_OF_VIEW: Final = 1.0
"""Horizontal one in rad of a camera of which the model does not say it."""
FRICTION: Final = 1.0
"""MuJoCo's friction of a shape that names none."""
_SLIPPERY: Final = 0.02
"""The friction of casters."""
_LEVEL: Final = 0.9999
"""Cosine of the tilt of a root link up to which its own frame is that of the robot."""
_ALIGNED: Final = 0.9998
"""Cosine of the angle up to which a camera looks straight ahead and is level."""
_FREE_RUNNING: Final = re.compile(r"caster|castor|swivel|roller|passive", re.IGNORECASE)
"""Names of joints in a URDF that have no motor if they have no torque either."""
_LONGEST_NAME: Final = 64
_FREE: Final = mujoco.mjtJoint.mjJNT_FREE


def fit_name(name: str) -> str:
    """Return a name as a `Body` may have it."""
    return "".join(letter if letter.isprintable() else "?" for letter in name)[:_LONGEST_NAME]


class OwnJoint(Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """Corrections of a joint."""

    max_velocity: float | None = None
    max_torque: float | None = None
    lower: float | None = None
    upper: float | None = None
    reversed: bool = False
    """True if it counts its angles the other way round than the model."""


class OwnServo(Gear, frozen=True, kw_only=True):
    """The gains of some joints."""

    joints: tuple[str, ...]


class OwnFile(Struct, frozen=True, kw_only=True):
    """What the TOML file has besides the parts of a `Body`."""

    model: str
    meshes: str = "."
    name: str = ""
    balance: bool | None = None
    """Whether inertias that no body can have are repaired; None to name each that is."""
    slippery: tuple[str, ...] = ()
    """Links that slide over the floor, such as casters."""
    xacro: dict[str, str | bool | int | float] = {}
    """Arguments of a model in xacro, which it reads as JSON has them, without quotes."""
    joint: dict[str, OwnJoint] = {}
    servo: dict[str, OwnServo] = {}


@dataclass(frozen=True)
class View:
    """A camera of the model: the link on which it is, and how it looks from there."""

    name: str
    link: str
    position: tuple[float, float, float]
    tilt: float
    width: float
    """Horizontal field of view in rad."""


@dataclass(frozen=True)
class Parts:
    """A model as parts of a body."""

    tables: dict[str, Any]
    """Tables of a facts file: `links`, `joints`, `fixed_joints`, `gears`, `shapes`."""
    figure: Figure
    frames: dict[int, Frame] = field(default_factory=dict)
    """The link of each body of the model."""
    joints: dict[str, int] = field(default_factory=dict)
    """The joint of the model that each joint is."""
    unsaid: list[str] = field(default_factory=list)
    """The joints whose largest torque nobody says."""
    slow: list[str] = field(default_factory=list)
    """The joints whose speed nobody says."""
    views: list[View] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)
    """A sentence for each part that was changed or cannot be kept."""


def parts_of(model: ModelFile, own: OwnFile, *, mounted: bool) -> Parts:
    """Return the parts of a model. Raises RobotError, naming the part, for what a body cannot be."""
    return _Reader(model, own, mounted=mounted).read()


class _Reader:
    """Read a compiled model, body by body."""

    def __init__(self, model: ModelFile, own: OwnFile, *, mounted: bool) -> None:
        self._mj, self._figure, self._where = model.compiled, model.figure, model.where
        self._model, self._own, self._mounted = model, own, mounted
        self._gears: dict[str, Any] = {
            name: {key: value for key, value in msgspec.to_builtins(servo).items() if key != "joints"}
            for name, servo in own.servo.items()
        }
        self._given = {joint: name for name, servo in own.servo.items() for joint in servo.joints}
        self._links: list[dict[str, Any]] = []
        self._fixed: list[dict[str, Any]] = []
        self._joints: list[dict[str, Any]] = []
        self._names: dict[str, set[str]] = {"link": set(), "joint": set()}
        self._moves = couplings_of(model)
        self._followers = {pair.follower for pair in self._moves.couplings}
        tables = {"links": self._links, "joints": self._joints, "fixed_joints": self._fixed}
        self._parts = Parts(tables | {"gears": self._gears}, model.figure)

    def read(self) -> Parts:
        mj, frames = self._mj, self._parts.frames
        bodies = [body for body in range(1, mj.nbody) if mj.body_mocapid[body] < 0]
        self._require_few("shapes that touch", self._figure.solid)
        for body in bodies:
            self._require_size(body)
        # The frame of a link is at its joint, which MJCF allows to be elsewhere.
        frames[0] = Frame(self._base(bodies), np.zeros(3))
        for body in bodies:
            if int(mj.body_parentid[body]) in frames:
                self._add_body(body)
        del frames[0]
        self._add_views()
        self._require_few("links", self._links)  # also those between the joints of a link
        self._couple()
        if not self._figure.says_what_touches:
            self._parts.notes.append(
                f"{self._where}: no link has a shape that touches, so what is seen of it touches"
            )
        solid = self._figure.solid
        self._parts.tables["shapes"] = [self._shape(geom) for geom in solid if mj.geom_bodyid[geom] in frames]
        return self._parts

    def _require_few(self, what: str, parts: Sized) -> None:
        if len(parts) > MOST_PARTS:
            raise RobotError(f"{self._where}: {len(parts)} {what}; a robot has at most {MOST_PARTS}")

    def _require_size(self, body: int) -> None:
        """Raise RobotError when a link, or one of its joints, is larger or heavier than any robot's."""
        mj, geoms, dofs = self._mj, self._mj.geom_bodyid == body, self._mj.dof_bodyid == body
        bearings = (mj.dof_armature, mj.dof_frictionloss, mj.dof_damping)
        sizes: dict[str, Any] = {
            "mass": mj.body_mass[body],
            "inertia": mj.body_inertia[body],
            "place": [mj.body_pos[body], mj.body_ipos[body]],
            "shape": [mj.geom_size[geoms], mj.geom_pos[geoms]],
            "joint's friction, damping or rotor": np.concatenate([each[dofs].ravel() for each in bearings]),
        }
        for what, values in sizes.items():
            if not (largest := float(np.abs(values).max(initial=0.0))) <= _LARGEST:
                name = mj.body(body).name
                at = self._model.at(name, "link", "body")
                raise RobotError(f"{at}: link {name!r}: its {what} is {largest:.4g}, at most {_LARGEST:g}")

    def _couple(self) -> None:
        """Add the joints that move together, and what closes loops of links."""
        mj, parts = self._mj, self._parts
        names = {mj.joint(joint).name: name for name, joint in parts.joints.items()}
        refs = {name: float(mj.qpos0[mj.jnt_qposadr[joint]]) for name, joint in parts.joints.items()}
        couplings = []
        for pair in self._moves.couplings:
            leader, follower = names[pair.leader], names[pair.follower]
            # An equality counts from where the joints are in the model, and angles from 0.
            offset = pair.offset + refs[follower] - pair.ratio * refs[leader]
            back, on = (self._sign(follower), self._sign(leader))
            couplings.append(Coupling(leader, follower, ratio=back * on * pair.ratio, offset=back * offset))
        before = [(joint.get("lower", -math.inf), joint.get("upper", math.inf)) for joint in self._joints]
        keep_in_range(self._joints, couplings, self._where)
        for joint, (low, high) in zip(self._joints, before, strict=True):
            if joint.get("lower", low) < low - _POINT or joint.get("upper", high) > high + _POINT:
                name = joint["name"]
                at = self._model.at(name, "joint")
                parts.notes.append(
                    f"{at}: joint {name!r} leaves its range, [{low:.4g}, {high:.4g}], to follow"
                )
        loops = loops_of(self._model, parts.frames)
        parts.tables["couplings"] = msgspec.to_builtins(couplings)
        parts.tables["loops"] = list(loops.loops)
        if loops.mounted:
            parts.tables["mounted"] = True
        parts.notes.extend((*self._moves.notes, *loops.notes))

    def _sign(self, joint: str) -> float:
        return -1.0 if joint in self._own.joint and self._own.joint[joint].reversed else 1.0

    def _base(self, bodies: list[int]) -> str:
        """Add a level link that carries the root if that is tilted; return its name, or an empty one."""
        mj = self._mj
        roots = [body for body in bodies if mj.body_parentid[body] == 0]
        if len(roots) != 1:
            names = ", ".join(mj.body(root).name for root in roots[:5]) or "none"
            raise RobotError(f"{self._where}: a robot is one tree of links; here are {len(roots)}: {names}")
        (root,) = roots
        mount = not mj.body_mass[root] and mj.body(root).name.rstrip("_") == MOUNT
        if self._model.fixed and (mount or self._model.kind == "urdf"):
            self._parts.tables["mounted"] = True
        if matrix_of(mj.body_quat[root])[2, 2] > _LEVEL:
            return ""
        name = self._fit("link", "base")
        self._links.append({"name": name, "mass": 0.0})
        return name

    def _add_body(self, body: int) -> None:
        """Add the link, or links, of a body, and the joints that move it."""
        mj, frames = self._mj, self._parts.frames
        name = self._fit("link", mj.body(body).name or f"link {body}")
        carrier, offset = frames[int(mj.body_parentid[body])]
        free = bool(mj.body_jntnum[body]) and mj.jnt_type[mj.body_jntadr[body]] == _FREE
        origin = np.zeros(3) if free else mj.body_pos[body] - offset
        turn: list[float] = mj.body_quat[body].tolist()
        offset = np.zeros(3)
        moved = [] if free else np.flatnonzero(mj.jnt_bodyid == body).tolist()
        for number, joint in enumerate(moved, 1):
            at, axis = mj.jnt_pos[joint].copy(), mj.jnt_axis[joint].copy()
            ref = float(mj.qpos0[mj.jnt_qposadr[joint]])
            origin = origin + _rotated(turn, at - offset)
            if self._figure.slides(joint):
                origin = origin - _rotated(turn, axis * ref)
            elif ref:
                turn = _after(turn, axis, -ref)
            child = name if number == len(moved) else self._fit("link", f"{name} {number}")
            place = {"parent": carrier, "child": child, "origin": origin.tolist(), "turn": turn}
            self._add_joint(joint, place)
            if child != name:
                self._links.append({"name": child, "mass": 0.0})
            carrier, origin, turn, offset = child, np.zeros(3), [1.0, 0.0, 0.0, 0.0], at
        if not moved and carrier:
            self._fix(name, carrier, origin, turn)
        frames[body] = Frame(name, offset)
        self._links.append(_link(mj, body, name, offset))

    def _fix(self, link: str, carrier: str, origin: Array, turn: list[float]) -> None:
        place = {"parent": carrier, "child": link, "origin": origin.tolist(), "turn": turn}
        still = {"axis": [0, 0, 1], "max_velocity": 0.0, "max_torque": 0.0}
        self._fixed.append({"name": self._fit("joint", f"{link} mount")} | place | still)

    def _fit(self, kind: str, name: str) -> str:
        """Return a name as a body may have it, which no other part of the kind has."""
        taken, fitting = self._names[kind], fit_name(name)
        others = (f"{fitting[: _LONGEST_NAME - 6]} {number}" for number in count(2))
        fitting = next(each for each in chain((fitting,), others) if each not in taken)
        if fitting != name:
            self._parts.notes.append(
                f"{self._model.at(name, kind, 'body')}: {kind} {name[:80]!r} is called {fitting!r}"
            )
        taken.add(fitting)
        return fitting

    def _add_joint(self, joint: int, place: dict[str, Any]) -> None:
        """Add what a model says of a joint, corrected by the TOML file, and its servo."""
        mj, said = self._mj, self._mj.joint(joint).name
        name = self._fit("joint", said)
        self._parts.joints[name] = joint
        own, sign = self._own.joint.get(name, OwnJoint()), self._sign(name)
        found: dict[str, Any] = {"name": name, "axis": (sign * mj.jnt_axis[joint]).tolist()}
        found["sliding"] = self._figure.slides(joint)
        if mj.jnt_limited[joint] and np.ptp(mj.jnt_range[joint]) < _LARGEST:  # else it turns without end
            found["lower"], found["upper"] = sorted((sign * mj.jnt_range[joint]).tolist())
        if (speed := self._speed(joint)) is not None:
            found["max_velocity"] = speed
        if (torque := self._torque(joint)) is not None:
            found["max_torque"] = torque
        corrected = msgspec.to_builtins(own)
        found |= {key: value for key, value in corrected.items() if value is not None and key != "reversed"}
        leads = said not in self._followers
        if "max_velocity" not in found:
            found["max_velocity"] = SPEED if leads else math.inf  # which its leader determines
            self._parts.slow.extend([name] if leads and found.get("max_torque") != 0.0 else [])
        if "max_torque" not in found:
            found["max_torque"] = self._figure.torque(joint, mounted=self._mounted)
            self._parts.unsaid.extend([name] if leads else [])
        gear = self._given.get(name)
        if gear is None:
            gear = name
            torque, pulls = float(found["max_torque"]), self._pulls(joint)
            gains = gear_of(self._figure, joint, pulls, torque, mounted=self._mounted)
            if "rest" in gains:
                gains["rest"] *= sign
            self._gears[gear] = gains
        self._joints.append(found | place | {"gear": gear})

    def _speed(self, joint: int) -> float | None:
        """Return the highest speed of a joint: a URDF's limit, or the range of what sets its velocity."""
        mj = self._mj
        if (said := self._model.speeds.get(mj.joint(joint).name)) is not None:
            return said
        for motor, lever in self._pulls(joint):
            by_speed = mj.actuator_biastype[motor] == mujoco.mjtBias.mjBIAS_AFFINE
            by_speed = by_speed and not mj.actuator_biasprm[motor, 1] and mj.actuator_biasprm[motor, 2] < 0.0
            control = mj.actuator_ctrladr[motor]
            if by_speed and mj.actuator_ctrllimited[control]:
                gear = lever * abs(float(mj.actuator_gear[motor, 0])) or 1.0
                return float(np.abs(mj.actuator_ctrlrange[control]).max()) / gear or None
        return None

    def _torque(self, joint: int) -> float | None:
        """Return the largest torque of a joint in N m; 0 for one without a motor, None if nobody says it."""
        mj = self._mj
        limits = []
        if mj.jnt_actfrclimited[joint]:
            limits.append(float(np.abs(mj.jnt_actfrcrange[joint]).max()))
        for motor, lever in self._pulls(joint):
            gear, control = lever * abs(float(mj.actuator_gear[motor, 0])), mj.actuator_ctrladr[motor]
            if mj.actuator_forcelimited[motor]:
                limits.append(gear * float(np.abs(mj.actuator_forcerange[motor]).max()))
            elif (
                mj.actuator_ctrllimited[control] and mj.actuator_biastype[motor] == mujoco.mjtBias.mjBIAS_NONE
            ):
                gain = abs(float(mj.actuator_gainprm[motor, 0]))
                limits.append(gear * gain * float(np.abs(mj.actuator_ctrlrange[control]).max()))
        if (least := min(limits, default=0.0)) > 0.0:
            return least
        return None if self._is_driven(joint) else 0.0

    def _pulls(self, joint: int) -> tuple[Pull, ...]:
        """Return what moves a joint."""
        return self._moves.pulls.get(self._mj.joint(joint).name, ())

    def _is_driven(self, joint: int) -> bool:
        """Return whether a joint without a torque nevertheless has a motor."""
        name = self._mj.joint(joint).name
        if self._mj.nu:
            return bool(self._pulls(joint))
        if self._model.actuated:
            return name in self._model.actuated
        return not _FREE_RUNNING.search(name)

    def _add_views(self) -> None:
        """Add the cameras that are fixed to links: those of an MJCF, and those that a URDF names."""
        mj, frames = self._mj, self._parts.frames
        for camera in range(mj.ncam):
            body = int(mj.cam_bodyid[camera])
            if body in frames and mj.cam_mode[camera] == mujoco.mjtCamLight.mjCAMLIGHT_FIXED:
                right, up, back = matrix_of(mj.cam_quat[camera]).T
                axes = np.stack((-back, -right, up), axis=1)
                name, place = mj.cam(camera).name or f"camera {camera + 1}", mj.cam_pos[camera]
                width = 2 * math.atan(_ASPECT * math.tan(math.radians(mj.cam_fovy[camera]) / 2))
                self._add_view(name, body, place, axes, width)
        bodies = {mj.body(body).name: body for body in frames}
        for sensor in self._model.sensors:
            if sensor.kind == "camera" and sensor.link in bodies:
                turn = np.zeros(4)
                mujoco.mju_euler2Quat(turn, np.array(sensor.pose[3:]), "XYZ")
                place, width = np.array(sensor.pose[:3]), sensor.horizontal_fov or FIELD_OF_VIEW
                self._add_view(sensor.name, bodies[sensor.link], place, matrix_of(turn), width)

    def _add_view(self, name: str, body: int, place: Array, axes: Array, width: float) -> None:
        """Add a camera whose view, left and up are `axes`; if it looks aside, on a link that is turned so."""
        link, offset = self._parts.frames[body]
        position = place - offset
        ahead = axes[:, 0]
        tilt = math.atan2(-ahead[2], ahead[0])
        if axes[1, 1] < _ALIGNED:
            turn = np.zeros(4)
            mujoco.mju_mat2Quat(turn, np.ascontiguousarray(axes).flatten())
            view = self._fit("link", f"{name} view")
            self._fix(view, link, position, turn.tolist())
            self._links.append({"name": view, "mass": 0.0})
            link, position, tilt = view, np.zeros(3), 0.0
        x, y, z = position.tolist()
        self._parts.views.append(View(name, link, (x, y, z), tilt, width))

    def _shape(self, geom: int) -> dict[str, Any]:
        """Return the contact shape of a geom: of a mesh its hull, or a box if it is flat."""
        mj = self._mj
        body = int(mj.geom_bodyid[geom])
        link, offset = self._parts.frames[body]
        place = mj.geom_pos[geom] - offset
        turn: list[float] = mj.geom_quat[geom].tolist()
        kind = KINDS.get(mujoco.mjtGeom(int(mj.geom_type[geom])))
        shape: dict[str, Any] = {"link": link}
        if len(points := self._figure.hulls[geom]):
            shape |= {"kind": "hull", "points": np.round(points - offset, _DIGITS).tolist()}
        else:
            size = mj.geom_aabb[geom, 3:] if kind is None else mj.geom_size[geom][: SHAPE_SIZES[kind]]
            place = place + _rotated(turn, mj.geom_aabb[geom, :3])
            shape |= {"kind": kind or "box", "size": np.maximum(size, 1e-4).tolist()}
            shape |= {"position": place.tolist(), "turn": turn}
        friction = float(mj.geom_friction[geom, 0])
        if friction == FRICTION and link in self._own.slippery:
            friction = _SLIPPERY
        return shape if friction == FRICTION else shape | {"friction": max(friction, 1e-3)}


def _link(mj: mujoco.MjModel, body: int, name: str, offset: Array) -> dict[str, Any]:
    axes = matrix_of(mj.body_iquat[body])
    inertia = axes @ np.diag(mj.body_inertia[body]) @ axes.T
    tensor = dict(zip(TENSOR, inertia[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]].tolist(), strict=True))
    com = (mj.body_ipos[body] - offset).tolist()
    return {"name": name, "mass": float(mj.body_mass[body]), "com": com, "inertia": tensor}


def _rotated(quaternion: list[float], vector: Array) -> Array:
    turned = np.zeros(3)
    mujoco.mju_rotVecQuat(turned, vector, np.array(quaternion))
    return turned


def _after(quaternion: list[float], axis: Array, angle: float) -> list[float]:
    """Return a rotation, followed by one about an axis in its frame."""
    step, both = np.zeros(4), np.zeros(4)
    mujoco.mju_axisAngle2Quat(step, axis, angle)
    mujoco.mju_mulQuat(both, np.array(quaternion), step)
    turned: list[float] = both.tolist()
    return turned
