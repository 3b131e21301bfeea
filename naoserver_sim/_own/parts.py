"""What the compiled model of a user's robot says of its links, joints, servos and contact shapes.

They are tables of a facts file (`naoserver.body`), in its units and frames.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from itertools import count
from typing import Any, Final, NamedTuple

import msgspec
import mujoco
import numpy as np
from msgspec import Struct
from numpy.typing import NDArray

from naoserver.errors import RobotError
from naoserver.parts import MOST_PARTS, SHAPE_SIZES, Coupling, Gear
from naoserver_sim._body import KINDS
from naoserver_sim._own.couplings import Pull, couplings_of, keep_in_range, loops_of
from naoserver_sim._own.figure import Figure
from naoserver_sim._own.looks import Frame
from naoserver_sim._own.model_file import ModelFile

Array = NDArray[np.float64]

SPEED: Final = 3.0
"""Highest speed in rad/s or m/s of a joint of which neither the model nor the TOML file says it."""
_GIVES: Final = 0.1
"""Angle in rad by which a servo gives way at its largest torque, if nothing says how stiff it is."""
_STRONGEST: Final = 20.0
"""Largest such torque, as a multiple of what gravity asks of it: more would only make light links tremble."""
_SPARE: Final = 2.0
"""What is added to it, in N m: grips and wheels need more than gravity asks."""
_SAGS: Final = 0.01
"""Angle in rad by which the weight that a joint carries may bend such a servo."""
_FIRM: Final = 1.5
"""Stiffness of a leg's joint, as a multiple of that with which the robot would just not fall about it."""
_QUICKEST: Final = 150.0
"""Highest natural frequency of such a servo in rad/s: steps of the physics take 2.5 ms."""
_SLOWEST: Final = 10.0
"""Lowest such frequency."""
_LARGEST_ROTOR: Final = 0.1
"""Largest inertia of a rotor in kg m2 that is added for it, if the model has none."""
_DIGITS: Final = 5
"""Digits behind the point, in m, of the corners of hulls: short enough for thousands of them."""
_FRICTION: Final = 1.0
"""MuJoCo's friction of a shape that names none."""
_LEVEL: Final = 0.9999
"""Cosine of the tilt of a root link up to which its own frame is that of the robot."""
_ALIGNED: Final = 0.9998
"""Cosine of the angle up to which a camera looks straight ahead and is level."""
_FREE_RUNNING: Final = re.compile(r"caster|castor|swivel|roller|passive", re.IGNORECASE)
"""Names of joints in a URDF that have no motor if they have no torque either."""
_LONGEST_NAME: Final = 64
"""Characters of a name in a `Body`."""
_BALL: Final = mujoco.mjtJoint.mjJNT_BALL
_FREE: Final = mujoco.mjtJoint.mjJNT_FREE
_SLIDE: Final = mujoco.mjtJoint.mjJNT_SLIDE


class OwnJoint(Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """Corrections of a joint."""

    max_velocity: float | None = None
    max_torque: float | None = None
    lower: float | None = None
    upper: float | None = None
    reversed: bool = False
    """Whether it counts its angles the other way round than the model."""


class OwnServo(Gear, frozen=True, kw_only=True):
    """The gains of some joints."""

    joints: tuple[str, ...]


class OwnFile(Struct, frozen=True, kw_only=True):
    """What the TOML file has besides the parts of a `Body`."""

    model: str = ""
    """Without one, the file has all facts itself."""
    meshes: str = "."
    name: str = ""
    joint: dict[str, OwnJoint] = {}
    servo: dict[str, OwnServo] = {}


@dataclass(frozen=True)
class View:
    """A camera of the model: the link on which it is, and how it looks from there."""

    name: str
    link: str
    position: tuple[float, float, float]
    tilt: float
    fovy: float
    """Vertical field of view in rad."""


@dataclass(frozen=True)
class Parts:
    """A model as parts of a body."""

    tables: dict[str, Any]
    """Tables of a facts file: `links`, `joints`, `fixed_joints`, `gears`, `shapes`."""
    figure: Figure
    frames: dict[int, Frame] = field(default_factory=dict)
    """The link of each body of the model."""
    joints: dict[str, int] = field(default_factory=dict)
    """The joint of the model that each hinge and slide is."""
    unsaid: dict[str, int] = field(default_factory=dict)
    """The joints whose largest torque nobody says, with those of the model."""
    slow: list[str] = field(default_factory=list)
    """The joints whose speed nobody says."""
    views: list[View] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)
    """What was changed or cannot be kept, a sentence each."""


class _Axis(NamedTuple):
    """A joint of a body of the model, or one of the three axes of a ball joint."""

    joint: int
    name: str
    axis: Array
    dof: int
    range: tuple[float, float] | None
    ref: float = 0.0
    sliding: bool = False


def parts_of(figure: Figure, model: ModelFile, own: OwnFile, where: str, *, mounted: bool) -> Parts:
    """Return the parts of a compiled model. Raises RobotError, naming the part, for what a body cannot be."""
    return _Reader(figure, model, own, where, mounted=mounted).read()


class _Reader:
    """Read a compiled model, body by body."""

    def __init__(self, figure: Figure, model: ModelFile, own: OwnFile, where: str, *, mounted: bool) -> None:
        mj = self._mj = figure.mj
        self._model, self._own, self._where, self._mounted = model, own, where, mounted
        gears: dict[str, Any] = {
            name: {key: value for key, value in msgspec.to_builtins(servo).items() if key != "joints"}
            for name, servo in own.servo.items()
        }
        self._given = {joint: name for name, servo in own.servo.items() for joint in servo.joints}
        self._links: list[dict[str, Any]] = []
        self._fixed: list[dict[str, Any]] = []
        self._joints: list[dict[str, Any]] = []
        self._names: dict[str, set[str]] = {"link": set(), "joint": set()}
        self._moves = couplings_of(mj, where, model.lines)
        self._followers = {pair.follower for pair in self._moves.couplings}
        self._gears = gears
        tables = {
            "links": self._links,
            "joints": self._joints,
            "fixed_joints": self._fixed,
            "gears": gears,
        }
        self._parts = Parts(tables, figure)

    def read(self) -> Parts:
        mj, frames = self._mj, self._parts.frames
        bodies = [body for body in range(1, mj.nbody) if mj.body_mocapid[body] < 0]
        if len(bodies) > MOST_PARTS:
            raise RobotError(f"{self._where}: {len(bodies)} links; a robot has at most {MOST_PARTS}")
        # The frame of a link is at its joint, which MJCF allows to be elsewhere.
        frames[0] = Frame(self._base(bodies), np.zeros(3))
        for body in bodies:
            if int(mj.body_parentid[body]) in frames:
                self._add_body(body)
        for camera in range(mj.ncam):
            if int(mj.cam_bodyid[camera]) in frames and mj.cam_bodyid[camera]:
                self._add_view(camera)
        del frames[0]
        self._couple()
        if not self._parts.figure.says_what_touches:
            self._parts.notes.append(
                f"{self._where}: no link has a shape that touches, so what is seen of it touches"
            )
        self._parts.tables["shapes"] = [
            shape for geom in self._parts.figure.solid for shape in self._shapes(geom)
        ]
        return self._parts

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
        keep_in_range(self._joints, couplings, self._where)
        loops = loops_of(mj, parts.frames, self._where, self._model.lines)
        parts.tables["couplings"] = msgspec.to_builtins(couplings)
        parts.tables["loops"] = list(loops.loops)
        if loops.mounted:
            parts.tables["mounted"] = True
        parts.notes.extend((*self._moves.notes, *loops.notes))

    def _sign(self, joint: str) -> float:
        return -1.0 if joint in self._own.joint and self._own.joint[joint].reversed else 1.0

    def _base(self, bodies: list[int]) -> str:
        """Add the link that carries all others if that is no body of the model; return its name, or ''."""
        mj = self._mj
        roots = [body for body in bodies if mj.body_parentid[body] == 0]
        free = [root for root in roots if any(mj.jnt_type[j] == _FREE for j in _joints(mj, root))]
        if not roots or (free and len(roots) > 1):
            names = ", ".join(mj.body(root).name for root in roots[:5]) or "none"
            raise RobotError(f"{self._where}: a robot is one tree of links; here are {len(roots)}: {names}")
        (root, *more) = roots
        moved = not free and mj.body_jntnum[root]
        level = _matrix(mj.body_quat[root])[2, 2] > _LEVEL
        if level and not moved and not more:
            return ""
        name = self._fit("link", "base" if free else "ground")
        if not free:
            self._parts.tables["mounted"] = True
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
        axes = [] if free else [axis for joint in _joints(mj, body) for axis in self._axes(joint)]
        for number, axis in enumerate(axes):
            at = mj.jnt_pos[axis.joint].copy()
            origin = origin + _rotated(turn, at - offset)
            if axis.sliding:
                origin = origin - _rotated(turn, axis.axis * axis.ref)
            elif axis.ref:
                turn = _after(turn, axis.axis, -axis.ref)
            child = name if number == len(axes) - 1 else self._fit("link", f"{name} {number + 1}")
            self._add_joint(
                axis, {"parent": carrier, "child": child, "origin": origin.tolist(), "turn": turn}
            )
            if child != name:
                self._links.append({"name": child, "mass": 0.0})
            carrier, origin, turn, offset = child, np.zeros(3), [1.0, 0.0, 0.0, 0.0], at
        if not axes and carrier:
            self._fix(name, carrier, origin, turn)
        frames[body] = Frame(name, offset)
        self._links.append(_link(mj, body, name, offset))

    def _fix(self, link: str, carrier: str, origin: Array, turn: list[float]) -> None:
        joint: dict[str, Any] = {
            "name": self._fit("joint", f"{link} mount"),
            "parent": carrier,
            "child": link,
        }
        joint |= {"origin": origin.tolist(), "turn": turn, "axis": [0, 0, 1]}
        self._fixed.append(joint | {"max_velocity": 0.0, "max_torque": 0.0})

    def _fit(self, kind: str, name: str) -> str:
        """Return a name as a body may have it, which no other part of the kind has."""
        fitting = re.sub(r"[\x00-\x1f\x7f\ud800-\udfff]", "?", name)[:_LONGEST_NAME]
        taken = self._names[kind]
        if fitting in taken:
            fitting = next(
                other
                for number in count(2)
                if (other := f"{fitting[: _LONGEST_NAME - 6]} {number}") not in taken
            )
        if fitting != name:
            self._parts.notes.append(f"{self._at(kind, name)}{kind} {name[:80]!r} is called {fitting!r}")
        taken.add(fitting)
        return fitting

    def _at(self, kind: str, name: str) -> str:
        kinds = (kind, "body") if kind == "link" else (kind,)
        line = next((self._model.lines[each, name] for each in kinds if (each, name) in self._model.lines), 0)
        return f"{self._where}:{line}: " if line else f"{self._where}: "

    def _axes(self, joint: int) -> Iterator[_Axis]:
        """Yield the axes about which a joint turns, or along which it slides."""
        mj = self._mj
        name, dof = mj.joint(joint).name, int(mj.jnt_dofadr[joint])
        limits = tuple(mj.jnt_range[joint].tolist()) if mj.jnt_limited[joint] else None
        if mj.jnt_type[joint] != _BALL:
            slides = bool(mj.jnt_type[joint] == _SLIDE)
            name = self._fit("joint", name)
            self._parts.joints[name] = joint
            ref = float(mj.qpos0[mj.jnt_qposadr[joint]])
            yield _Axis(joint, name, mj.jnt_axis[joint].copy(), dof, limits, ref, slides)
            return
        half = (-limits[1], limits[1]) if limits else (-math.pi, math.pi)
        self._parts.notes.append(f"{self._at('joint', name)}ball joint {name!r} is served as three hinges")
        for number, letter in enumerate("xyz"):
            yield _Axis(joint, self._fit("joint", f"{name} {letter}"), np.eye(3)[number], dof + number, half)

    def _add_joint(self, of: _Axis, place: dict[str, Any]) -> None:
        """Add what a model says of a joint, corrected by the TOML file, and its servo."""
        own = self._own.joint.get(of.name, OwnJoint())
        sign = self._sign(of.name)
        found: dict[str, Any] = {"name": of.name, "axis": (sign * of.axis).tolist(), "sliding": of.sliding}
        if of.range is not None:
            found["lower"], found["upper"] = sorted(sign * limit for limit in of.range)
        if (speed := self._speed(of)) is not None:
            found["max_velocity"] = speed
        if (torque := self._torque(of)) is not None:
            found["max_torque"] = torque
        corrected = msgspec.to_builtins(own)
        found |= {key: value for key, value in corrected.items() if value is not None and key != "reversed"}
        if "max_velocity" not in found:
            found["max_velocity"] = SPEED
            if found.get("max_torque") != 0.0 and self._mj.joint(of.joint).name not in self._followers:
                self._parts.slow.append(of.name)
        if "max_torque" not in found:
            found["max_torque"] = self._parts.figure.torque(of.joint, mounted=self._mounted)
            if self._mj.joint(of.joint).name not in self._followers:
                self._parts.unsaid[of.name] = of.joint
        gear = self._given.get(of.name)
        if gear is None:
            gear = of.name
            self._gears[gear] = self._gear(of, float(found["max_torque"]))
        self._joints.append(found | place | {"gear": gear})

    def _speed(self, of: _Axis) -> float | None:
        """Return the highest speed of a joint: a URDF's limit, or the range of what sets its velocity."""
        if (said := self._model.speeds.get(self._mj.joint(of.joint).name)) is not None:
            return said
        mj = self._mj
        for motor, lever in self._pulls(of):
            by_speed = mj.actuator_biastype[motor] == mujoco.mjtBias.mjBIAS_AFFINE
            by_speed = by_speed and not mj.actuator_biasprm[motor, 1] and mj.actuator_biasprm[motor, 2] < 0.0
            if by_speed and mj.actuator_ctrllimited[motor]:
                gear = lever * abs(float(mj.actuator_gear[motor, 0])) or 1.0
                return float(np.abs(mj.actuator_ctrlrange[motor]).max()) / gear or None
        return None

    def _torque(self, of: _Axis) -> float | None:
        """Return the largest torque of a joint in N m; 0 for one without a motor, None if nobody says it."""
        mj, joint = self._mj, of.joint
        limits = []
        if mj.jnt_actfrclimited[joint]:
            limits.append(float(np.abs(mj.jnt_actfrcrange[joint]).max()))
        for motor, lever in self._pulls(of):
            gear = lever * abs(float(mj.actuator_gear[motor, 0]))
            if mj.actuator_forcelimited[motor]:
                limits.append(gear * float(np.abs(mj.actuator_forcerange[motor]).max()))
            elif mj.actuator_ctrllimited[motor] and mj.actuator_biastype[motor] == mujoco.mjtBias.mjBIAS_NONE:
                limits.append(
                    gear
                    * abs(float(mj.actuator_gainprm[motor, 0]))
                    * float(np.abs(mj.actuator_ctrlrange[motor]).max())
                )
        if (least := min(limits, default=0.0)) > 0.0:
            return least
        return None if self._is_driven(of) else 0.0

    def _pulls(self, of: _Axis) -> tuple[Pull, ...]:
        """Return what moves a joint."""
        return self._moves.pulls.get(self._mj.joint(of.joint).name, ())

    def _is_driven(self, of: _Axis) -> bool:
        """Return whether a joint without a torque has a motor all the same."""
        name = self._mj.joint(of.joint).name
        if self._mj.nu:
            return bool(self._pulls(of))
        if self._model.actuated:
            return name in self._model.actuated
        return not _FREE_RUNNING.search(name)

    def _gear(self, of: _Axis, torque: float) -> dict[str, float]:
        """Return the gains of a joint's servo; without one, gains at which it neither sags nor swings."""
        mj, joint, dof, figure = self._mj, of.joint, of.dof, self._parts.figure
        rotor = float(mj.dof_armature[dof])
        gear = {
            "friction_damping": float(np.ravel(mj.dof_damping[dof])[0]),
            "friction": float(mj.dof_frictionloss[dof]),
            "inertia": rotor,
        }
        if not torque:
            rest = float(mj.qpos_spring[mj.jnt_qposadr[joint]]) if mj.jnt_type[joint] != _BALL else 0.0
            return gear | {"stiffness": float(np.ravel(mj.jnt_stiffness[joint])[0]), "rest": rest}
        for motor, lever in self._pulls(of):
            affine = mj.actuator_biastype[motor] == mujoco.mjtBias.mjBIAS_AFFINE
            if affine and mj.actuator_biasprm[motor, 1] < 0.0:
                square = (lever * float(mj.actuator_gear[motor, 0])) ** 2
                stiffness, damping = (-square * mj.actuator_biasprm[motor, 1:3]).tolist()
                return gear | {"stiffness": stiffness, "damping": max(damping, 0.0)}
        held, free = (float(each[dof]) for each in figure.inertias)
        load, standing = figure.load(joint), figure.standing(joint, mounted=self._mounted)
        stiffness = max(
            min(torque, _STRONGEST * max(load, standing) + _SPARE) / _GIVES,
            load / _SAGS,
            _FIRM * figure.tips(joint, mounted=self._mounted),
            _SLOWEST**2 * held,
        )
        wanted = stiffness / _QUICKEST**2 - free
        added = 0.0 if rotor else min(max(wanted, 0.0), _LARGEST_ROTOR)
        stiffness = min(stiffness, _QUICKEST**2 * (free + added))
        damping = 2.0 * math.sqrt(stiffness * (held + added))
        return gear | {"inertia": rotor + added, "stiffness": stiffness, "damping": damping}

    def _add_view(self, camera: int) -> None:
        """Add a camera of the model; one that is not level, or looks aside, gets a link that is turned so."""
        mj = self._mj
        if mj.cam_mode[camera] != mujoco.mjtCamLight.mjCAMLIGHT_FIXED:
            return  # a spectator's
        link, offset = self._parts.frames[int(mj.cam_bodyid[camera])]
        name = mj.cam(camera).name or f"camera {camera + 1}"
        position = mj.cam_pos[camera] - offset
        right, up, back = _matrix(mj.cam_quat[camera]).T
        ahead = -back
        tilt = math.atan2(-ahead[2], ahead[0])
        if -right[1] < _ALIGNED:
            axes, turn = np.stack((ahead, -right, up), axis=1), np.zeros(4)
            mujoco.mju_mat2Quat(turn, axes.flatten())
            view = self._fit("link", f"{name} view")
            self._fix(view, link, position, turn.tolist())
            self._links.append({"name": view, "mass": 0.0})
            link, position, tilt = view, np.zeros(3), 0.0
        x, y, z = position.tolist()
        fovy = math.radians(float(mj.cam_fovy[camera]))
        self._parts.views.append(View(name, link, (x, y, z), tilt, fovy))

    def _shapes(self, geom: int) -> Iterator[dict[str, Any]]:
        """Yield the contact shape of a geom: of a mesh its hull, or a box if it is flat."""
        mj = self._mj
        body = int(mj.geom_bodyid[geom])
        if body not in self._parts.frames:
            return
        link, offset = self._parts.frames[body]
        place = mj.geom_pos[geom] - offset
        turn: list[float] = mj.geom_quat[geom].tolist()
        kind = KINDS.get(mujoco.mjtGeom(int(mj.geom_type[geom])))
        shape: dict[str, Any] = {"link": link}
        if len(points := self._parts.figure.hulls[geom]):
            shape |= {"kind": "hull", "points": np.round(points - offset, _DIGITS).tolist()}
        else:
            size = mj.geom_aabb[geom, 3:] if kind is None else mj.geom_size[geom][: SHAPE_SIZES[kind]]
            place = place + _rotated(turn, mj.geom_aabb[geom, :3])
            shape |= {"kind": kind or "box", "size": np.maximum(size, 1e-4).tolist()}
            shape |= {"position": place.tolist(), "turn": turn}
        friction = float(mj.geom_friction[geom, 0])
        yield shape if friction == _FRICTION else shape | {"friction": max(friction, 1e-3)}


def _joints(mj: mujoco.MjModel, body: int) -> range:
    first = int(mj.body_jntadr[body])
    return range(first, first + int(mj.body_jntnum[body]))


def _link(mj: mujoco.MjModel, body: int, name: str, offset: Array) -> dict[str, Any]:
    axes = _matrix(mj.body_iquat[body])
    inertia = axes @ np.diag(mj.body_inertia[body]) @ axes.T
    xx, yy, zz = np.diag(inertia).tolist()
    tensor = {"ixx": xx, "iyy": yy, "izz": zz}
    tensor |= {"ixy": float(inertia[0, 1]), "ixz": float(inertia[0, 2]), "iyz": float(inertia[1, 2])}
    com = (mj.body_ipos[body] - offset).tolist()
    return {"name": name, "mass": float(mj.body_mass[body]), "com": com, "inertia": tensor}


def _matrix(quaternion: Array) -> Array:
    matrix = np.zeros(9)
    mujoco.mju_quat2Mat(matrix, quaternion)
    return matrix.reshape(3, 3)


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
