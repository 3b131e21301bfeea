"""What the parts of a user's robot are for: guessed from names, places and shapes, each with a reason."""

from __future__ import annotations

import math
import re
from collections import Counter
from collections.abc import Iterator
from copy import copy
from dataclasses import dataclass, field
from itertools import combinations, product
from typing import Any, Final

import mujoco
import numpy as np

from naoserver.bodies.kinematics import neighbors_of
from naoserver.body import Body
from naoserver.errors import RobotError
from naoserver_sim.model import build_model
from naoserver_sim.support_polygon import convex_hull, room_within
from naoserver_sim.world import load_world
from visualhfsm_own_robots._figure import GRAVITY, Array
from visualhfsm_own_robots._limbs import Limb, Limbs, Wheel
from visualhfsm_own_robots._model_file import ModelFile
from visualhfsm_own_robots._parts import FIELD_OF_VIEW, FRICTION, SPEED, Parts, View

Path = tuple[str | int, ...]

_ORDER: Final = (
    *("model", "name", "mounted", "rest", "slippery", "intangible", "overlapping", "groups", "hinges"),
    *("cameras", "walk", "couplings", "soles", "inertial_unit", "postures", "joint", "xacro"),
)
"""The keys of the file."""
_MOST_CAMERAS: Final = 4
_APART: Final = 0.03
"""Distance in m up to which links named after a camera are parts of one."""
_CAMERA: Final = re.compile(r"(?:^|[_\W])(?:cam|camera|rgb|rgbd)(?=[_\W\d]|$)|[Cc]amera", re.ASCII)
_OPTICAL: Final = re.compile(r"optical|depth|infra|imu|gyro|accel", re.IGNORECASE)
_UNIT: Final = re.compile(r"(?:^|[_\W])imu(?=[_\W\d]|$)", re.IGNORECASE)
_ALONG: Final = 0.9
"""Least cosine between an axis and the direction along which it is said to be."""
_LEVEL: Final = 0.99
"""Least cosine of the tilt of a foot's frame."""
_SOLE: Final = 0.01
"""Height in m up to which points of a foot belong to its sole, and its least width."""
_BESIDE: Final = 0.2
"""Angle in rad by which a leg may point ahead of its foot."""
_FLAT: Final = 0.3
"""Most that the axis of a joint rises which turns an arm up, as a sine."""
_RAISED: Final = 0.8
"""Angle in rad by which an arm is raised that lies on the floor."""
_CORNERS: Final = 12
"""Most corners of a sole's outline."""
_DRIVES: Final = 0.5
"""Speed in m/s of a cart of whose wheels nobody says how fast they turn."""
_USED: Final = 0.9
"""Share of the speed of its wheels at which a cart drives or turns."""
_MOST_NAMED: Final = 3
"""Entries of a list that are all named."""
_STILL: Final = 0.01
"""Least room in m between the center of mass and the edge of what carries it."""


@dataclass
class Guesses:
    """The TOML file of a robot, and why its entries are what they are."""

    document: dict[str, Any] = field(default_factory=dict)
    reasons: dict[Path, str] = field(default_factory=dict)
    """By the keys of an entry."""
    doubts: list[str] = field(default_factory=list)
    """A sentence for each part that could not be guessed."""

    def add(self, value: object, why: str, *path: str | int) -> None:
        """Put a value to a place in the file; a number is the place in a list."""
        at: Any = self.document
        *tables, last = path
        if isinstance(last, int):
            at.setdefault(tables[0], []).append(value)
        else:
            for key in tables:
                at = at.setdefault(key, {})
            at[last] = value
        self.reasons[path] = why

    def lines(self) -> Iterator[str]:
        """Yield what was taken for what, a line each; what is said for one reason in one line."""
        said: dict[tuple[str, str], list[str]] = {}
        for path, why in self.reasons.items():
            if path[0] == "postures":
                continue
            at: Any = self.document
            for key in path:
                at = at[key]
            name = ".".join(str(key) for key in path if not isinstance(key, int))
            if path[0] == "joint":
                name, at = f"joint.{path[2]}", path[1]
            said.setdefault((name, why), []).append(_short(at))
        for (name, why), values in said.items():
            yield f"{name}: {_short(values)} ({why})"


class Guesser:
    """Guess what the parts of a model are for, table by table."""

    def __init__(self, model: ModelFile, parts: Parts, found: Guesses) -> None:
        self._model, self._parts, self._found = model, parts, found
        self._figure, self._mj = parts.figure, parts.figure.mj
        self._limbs = Limbs(parts)
        self._driven = self._limbs.driven

    def guess(self) -> None:
        """Add all tables."""
        found = self._found
        mounted, why = self._mount()
        if mounted:
            found.add(mounted, why, "mounted")
        self._guess_rest(mounted=mounted)
        for group, joints, why in self._limbs.groups():
            found.add(list(joints), why, "groups", group)
        self._guess_neck()
        self._guess_cameras()
        self._guess_inertial_unit()
        if not mounted:
            self._guess_soles()
            self._guess_walk()
        for name in self._parts.unsaid:
            torque = self._figure.torque(self._parts.joints[name], mounted=mounted)
            found.add(torque, "torque by the mass that it carries", "joint", name, "max_torque")
        for name in self._parts.slow:
            if "max_velocity" not in found.document.get("joint", {}).get(name, {}):
                found.add(SPEED, "usual speed", "joint", name, "max_velocity")
        found.document = {key: found.document[key] for key in _ORDER if key in found.document}

    def _mount(self) -> tuple[bool, str]:
        """Return whether the robot is fixed to the floor, and why."""
        mj, figure = self._mj, self._figure
        if self._parts.tables.get("mounted"):
            return True, "the world carries it in its model"
        if not len(figure.points(*range(1, mj.nbody))):
            return True, "no link has a shape that touches the floor: it would fall without end"
        roots = [body for body in range(1, mj.nbody) if mj.body_parentid[body] == 0]
        if any(mj.body_jntnum[root] for root in roots):  # a free joint, as the reader leaves no other
            return False, ""
        if len(self._limbs.of("leg")) > 1 or len(self._limbs.wheels) > 1:
            return False, ""
        if self._model.kind == "mjcf":
            return True, "its root has no free joint"
        return self._topples()

    def _topples(self) -> tuple[bool, str]:
        """Return whether what is on the floor cannot hold the robot wherever its joints are, and why."""
        mj, data, figure = self._mj, self._figure.data, self._figure
        points = figure.points(*range(1, mj.nbody))
        low = points[points[:, 2] < figure.box[0][2] + _SOLE, :2]
        if float(np.ptp(low, axis=0).min()) < _SOLE:
            return True, "it has no base that it could stand on"
        masses = mj.body_mass[1:]
        center = masses @ data.xipos[1:, :2] / masses.sum()
        room = room_within(convex_hull(low), center)
        moves = 0.0
        for joint in {self._parts.joints[limb.joints[0]] for limb in self._limbs.limbs}:
            way = 1.0
            if figure.slides(joint):
                way = float(np.ptp(mj.jnt_range[joint]) * math.hypot(*figure.data.xaxis[joint][:2]))
            moves += way * figure.load(joint) / GRAVITY / float(masses.sum())
        if room < _STILL:
            return True, "its center of mass is not above its base"
        why = (
            f"its base extends {room:.2g} m beyond its center of mass, and its joints move that {moves:.2g} m"
        )
        return moves > room, why

    def _guess_rest(self, *, mounted: bool) -> None:
        """Let it begin in a keyframe of its model; or stand it on its feet, or raise its arm."""
        mj, figure = self._mj, self._figure
        angles: Array = figure.data.qpos.copy()
        name, why = "Rest", "joints whose range has no 0 are within it"
        if figure.key is not None:
            said = mj.key(figure.key).name
            name, why = said[:1].upper() + said[1:], f"keyframe {said!r} of the model"
        elif mounted and self._raise(angles):
            why = "its arm is off the floor"
        elif not mounted and self._stand(angles):
            name, why = "Stand", "its feet are below its hips"
        posture, moved = {}, figure.key is not None
        for joint in self._parts.tables["joints"]:
            lower, upper = joint.get("lower", -math.inf), joint.get("upper", math.inf)
            angle = float(angles[mj.jnt_qposadr[self._parts.joints[joint["name"]]]])
            posture[joint["name"]] = min(max(round(angle, 4), lower), upper)
            moved |= posture[joint["name"]] != min(max(0.0, lower), upper)
        if moved:
            self._found.add(name, why, "rest")
            self._found.add({"stance": "standing", "angles": posture}, why, "postures", name)

    def _raise(self, angles: Array) -> bool:
        """Turn an arm that lies on the floor up; return whether there is one."""
        mj, figure = self._mj, self._figure
        raised = False
        for limb in self._limbs.limbs:
            for joint in (self._parts.joints[name] for name in limb.joints if name in self._driven):
                bodies = figure.moved(joint)
                points = figure.points(*bodies)
                flat = abs(figure.data.xaxis[joint][2]) < _FLAT and not figure.slides(joint)
                if not flat or not len(points) or points[:, 2].min() > figure.box[0][2] + figure.near:
                    continue
                masses = mj.body_mass[bodies]
                arm = masses @ (figure.data.xipos[bodies] - figure.data.xanchor[joint])
                up = float(np.sign(np.cross(figure.data.xaxis[joint], arm)[2])) or 1.0
                low, high = mj.jnt_range[joint] if mj.jnt_limited[joint] else (-math.inf, math.inf)
                at = int(mj.jnt_qposadr[joint])
                angles[at] = min(max(angles[at] + up * _RAISED, low), high)
                raised = True
                break
        return raised

    def _stand(self, angles: Array) -> bool:
        """Turn legs so that each foot is below its hip; return whether that is needed, and can be."""
        mj, figure, turned = self._mj, self._figure, angles.copy()
        for limb in self._limbs.of("leg"):
            joints = [self._parts.joints[name] for name in limb.joints]
            bodies = figure.moved(joints[0])
            points = figure.points(*figure.moved(joints[-1]))
            hips = [joint for joint in joints if abs(figure.data.xaxis[joint][1]) > _ALONG]
            if not hips or not len(points) or not figure.stands(*bodies):
                return False
            foot = points[points[:, 2] < points[:, 2].min() + _SOLE].mean(axis=0)
            ahead, _, up = foot - figure.data.xanchor[hips[0]]
            turn = math.atan2(ahead, -up) * float(np.sign(figure.data.xaxis[hips[0]][1]))
            turned[mj.jnt_qposadr[hips[0]]] += turn
        if np.abs(turned - angles).max(initial=0.0) < _BESIDE:
            return False
        angles[:] = turned
        return True

    def _guess_neck(self) -> None:
        """Find the joints that turn a head to the left and down."""
        axes: dict[str, Any] = {}
        mj, straight = self._mj, copy(self._figure.data)
        heads = [(name, self._parts.joints[name]) for limb in self._limbs.of("head") for name in limb.joints]
        at = mj.jnt_qposadr[np.array([joint for _, joint in heads], int)]
        straight.qpos[at] = mj.qpos0[at]  # a head that is turned at rest tilts about no lateral axis
        mujoco.mj_kinematics(mj, straight)
        for name, joint in heads:
            if not self._figure.slides(joint):
                axis = straight.xaxis[joint]
                for key, along in (("pan", axis[2]), ("tilt", axis[1])):
                    if abs(along) > _ALONG and key not in axes and name in self._driven:
                        axes[key] = name if along > 0 else {"joint": name, "sign": -1}
        if axes:
            why = "in the head: pan about its vertical axis, tilt about its lateral one"
            self._found.add(axes, why, "hinges", "Neck")

    def _guess_cameras(self) -> None:
        """Take the cameras of the model, those on the head first; else links that are named so."""
        heads = {link for limb in self._limbs.of("head") for link in self._links_of(limb)}
        cameras = [
            (view, f"camera {view.name!r} of the model")
            for view in self._parts.views
            if math.hypot(*view.position) < self._limbs.size  # else it watches the robot
        ] or [
            (View(link, link, (0.0, 0.0, 0.0), 0.0, FIELD_OF_VIEW), f"link {link!r} is named so")
            for link in self._named(_CAMERA)
        ]
        carriers = {joint["child"]: joint["parent"] for joint in self._parts.tables["fixed_joints"]}
        cameras.sort(key=lambda each: heads.isdisjoint((each[0].link, carriers.get(each[0].link))))
        for number, (view, why) in enumerate(cameras[:_MOST_CAMERAS]):
            camera: dict[str, Any] = {"name": f"Camera{number + 1 if number else ''}", "link": view.link}
            camera["position"] = _rounded(view.position)
            camera |= {"tilt": round(view.tilt, 4)} if abs(view.tilt) > 1e-4 else {}
            camera["horizontal_fov"] = round(min(view.width, 3.0), 4)
            self._found.add(camera, why, "cameras", number)
        if (more := len(cameras) - _MOST_CAMERAS) > 0:
            self._found.doubts.append(f"{more} more cameras of the model are not served")

    def _links_of(self, limb: Limb) -> list[str]:
        bodies = self._figure.moved(self._parts.joints[limb.joints[0]])
        return [self._parts.frames[body].link for body in bodies if body in self._parts.frames]

    def _named(self, word: re.Pattern[str]) -> list[str]:
        """Return the links whose names have a word, one for each place."""
        found: list[tuple[str, Array]] = []
        for body, frame in self._parts.frames.items():
            place = self._figure.data.xpos[body]
            near = any(np.linalg.norm(place - other) < _APART for _, other in found)
            if word.search(frame.link) and not near and not (word is _CAMERA and _OPTICAL.search(frame.link)):
                found.append((frame.link, place))
        return [link for link, _ in found]

    def _guess_inertial_unit(self) -> None:
        """Take the accelerometer or gyroscope of the model, or a link named so, if the root has it."""
        mj, data = self._mj, self._figure.data
        kinds = (mujoco.mjtSensor.mjSENS_ACCELEROMETER, mujoco.mjtSensor.mjSENS_GYRO)
        units = [
            (int(mj.site_bodyid[site]), data.site_xpos[site], mj.site(site).name)
            for number in range(mj.nsensor)
            if int(mj.sensor_type[number]) in kinds and (site := int(mj.sensor_objid[number])) >= 0
        ]
        bodies = {frame.link: body for body, frame in self._parts.frames.items()}
        for sensor in self._model.sensors:
            if sensor.kind == "imu" and sensor.link in bodies:
                body = bodies[sensor.link]
                place = data.xmat[body].reshape(3, 3) @ sensor.pose[:3] + data.xpos[body]
                units.append((body, place, sensor.name))
        units += [(bodies[link], data.xpos[bodies[link]], link) for link in self._named(_UNIT)]
        for body, place, name in units:
            root = int(mj.body_weldid[body] or mj.body_rootid[body])
            frame = self._parts.frames[root]
            if frame.link == self._parts.tables["links"][0]["name"]:
                own = data.xmat[root].reshape(3, 3).T @ (place - data.xpos[root]) - frame.offset
                unit = {"accelerometer": _rounded(own), "gyrometer": _rounded(own)}
                self._found.add(unit, f"{name!r} on the root link", "inertial_unit")
                return
        if units:
            self._found.doubts.append(
                f"the inertial unit {units[0][2]!r} is not on the root link, so it is not served"
            )

    def _guess_soles(self) -> None:
        """Take the lowest links of two legs for feet."""
        left, right = self._limbs.of("leg", "left"), self._limbs.of("leg", "right")
        if len(left) != 1 or len(right) != 1:
            return
        soles = [self._sole(limb) for limb in (*left, *right)]
        if None in soles:
            self._found.doubts.append("its feet are not flat, or their frames not level: it has no soles")
            return
        for number, sole in enumerate(soles):
            self._found.add(sole, "the lowest link of the leg", "soles", number)
        self._found.doubts.append("it has no walk, and hence no balance: [walk] says how it steps")

    def _sole(self, limb: Limb) -> dict[str, Any] | None:
        """Return the sole of a leg; None if it is not flat, or not level at rest."""
        figure, data = self._figure, self._figure.data
        bodies = figure.moved(self._parts.joints[limb.joints[0]])
        touching = [body for body in bodies if len(figure.points(body))]
        if not figure.stands(*bodies):
            return None
        foot = min(touching, key=lambda body: float(figure.points(body)[:, 2].min()))
        axes = data.xmat[foot].reshape(3, 3)
        link, offset = self._parts.frames[foot]
        points = (figure.points(foot) - data.xpos[foot]) @ axes - offset
        bottom = float(points[:, 2].min())
        low = points[points[:, 2] < bottom + _SOLE, :2]
        if axes[2, 2] < _LEVEL or bottom > 0.0 or float(np.ptp(low, axis=0).min()) < _SOLE:
            return None
        turns = np.linspace(0.0, math.tau, _CORNERS, endpoint=False)
        corners = {int((low @ (math.cos(turn), math.sin(turn))).argmax()) for turn in turns}
        outline = [_rounded(corner) for corner in convex_hull(low[sorted(corners)])]
        return {"link": link, "outline": outline, "height": round(-bottom, 5)}

    def _guess_walk(self) -> None:
        """Take two driven wheels side by side for a drive."""
        wheels = [wheel for wheel in self._limbs.wheels if wheel.joint in self._driven]
        pairs = product(wheels, wheels)
        sides = [pair for pair in pairs if pair[0].place[1] > pair[1].place[1] and _pair(*pair)]
        if not wheels:
            return
        if not sides or any(wheel.steered for wheel in wheels):
            why = "that needs two side by side, with axes from left to right, and none steered"
            self._found.doubts.append(f"its wheels are joints, and no drive: {why}")
            return
        left, right = sides[0]
        for wheel in (left, right):
            self._drive_forwards(wheel)
        radius, distance = left.radius, left.place[1] - right.place[1]
        speeds = {joint["name"]: joint["max_velocity"] for joint in self._parts.tables["joints"]}
        given = self._found.document.get("joint", {})
        speeds |= {name: of["max_velocity"] for name, of in given.items() if "max_velocity" in of}
        fastest = _USED * min(speeds[left.joint], speeds[right.joint]) * radius
        walk = {"kind": "wheels", "left": left.joint, "right": right.joint, "radius": round(radius, 5)}
        walk |= {"distance": round(distance, 5), "fastest": round(fastest, 4)}
        walk |= {"fastest_turn": round(2 * fastest / distance, 4)}
        self._found.add(walk, "two round links on the floor, side by side", "walk")
        self._guess_casters()
        for pair in sides[1:]:
            for leader, follower in zip((left, right), pair, strict=True):
                if follower.joint not in (left.joint, right.joint):
                    self._drive_forwards(follower)
                    coupling = {"leader": leader.joint, "follower": follower.joint}
                    at = len(self._found.document.get("couplings", ()))
                    self._found.add(coupling, "wheels of one side turn together", "couplings", at)

    def _guess_casters(self) -> None:
        """Let what else is on the floor slide, where the model does not say how much it rubs."""
        mj, figure, frames = self._mj, self._figure, self._parts.frames
        rolling = {
            body for wheel in self._limbs.wheels for body in figure.moved(self._parts.joints[wheel.joint])
        }
        floor = figure.box[0][2] + _SOLE
        rough = {
            int(mj.geom_bodyid[geom])
            for geom, surface in figure.surfaces.items()
            if mj.geom_friction[geom, 0] == FRICTION and surface[:, 2].min() < floor
        }
        links = [frames[body].link for body in sorted(rough - rolling) if body in frames]
        if links:
            self._found.add(links, "they touch the floor and are no wheels", "slippery")

    def _drive_forwards(self, wheel: Wheel) -> None:
        """Let a wheel drive forwards at positive angles, and at some speed."""
        if wheel.axis[1] < 0.0:
            self._found.add(True, "its axis points right", "joint", wheel.joint, "reversed")
        if wheel.joint in self._parts.slow:
            speed = round(_DRIVES / wheel.radius, 3)
            self._found.add(speed, f"speed for {_DRIVES:g} m/s", "joint", wheel.joint, "max_velocity")


def _pair(left: Wheel, right: Wheel) -> bool:
    """Return whether two wheels are side by side on one axis."""
    size = max(left.radius, right.radius)
    ahead = max(abs(left.place[axis] - right.place[axis]) for axis in (0, 2))
    across = min(abs(left.axis[1]), abs(right.axis[1]))
    return ahead < 0.2 * size and across > _ALONG and abs(left.radius - right.radius) < 0.1 * size


def _rounded(values: Any) -> list[float]:  # noqa: ANN401
    return [round(float(value), 5) + 0.0 for value in values]


def _short(value: object) -> str:
    """Return a value of the file in a few words."""
    if isinstance(value, dict):
        kept = {key: item for key, item in value.items() if key not in ("outline", "angles", "stance")}
        return ", ".join(f"{key} {_short(item)}" for key, item in kept.items())
    if not isinstance(value, list):
        return f"{value:g}" if isinstance(value, float) else f"{value}"
    if len(value) > _MOST_NAMED:
        return f"{_short(value[0])} to {_short(value[-1])} ({len(value)})"
    return " ".join(map(_short, value))


_MANY: Final = 3
"""Links that a link does not touch, from which that is not said of each."""
_OVERLAP: Final = 0.0005
"""Depth in m from which shapes overlap."""


def guess_overlaps(found: Guesses, model: Parts, body: Body, where: str) -> None:
    """Let links that the model keeps from touching, or that overlap at rest, pass through each other.

    Raises RobotError, beginning with `where`, when more links overlap than MuJoCo has memory for.
    """
    mj = model.figure.mj
    masks = {shape.link: [0, 0] for shape in body.shapes}
    for geom in model.figure.solid:
        mask = masks[model.frames[int(mj.geom_bodyid[geom])].link]
        mask[0] |= int(mj.geom_contype[geom])
        mask[1] |= int(mj.geom_conaffinity[geom])
    of = {body: frame.link for body, frame in model.frames.items()}
    apart = {(of.get(int(pair) >> 16, ""), of.get(int(pair) & 0xFFFF, "")) for pair in mj.exclude_signature}
    names, near, are_neighbors = sorted(masks), set(), neighbors_of(body)
    said = model.figure.says_what_touches
    for pair in combinations(names, 2):
        (types, affinities), (others, their) = (masks[link] for link in pair)
        if are_neighbors(*pair):
            near.add(pair)
        elif said and not (types & their or others & affinities):
            apart.add(pair)
    mine = build_model(load_world("empty"), skin=False, body=body)
    data = mujoco.MjData(mine.mj)
    data.qpos[mine.robot.qpos] = [body.resting_angles[joint.name] for joint in mine.robot.joints]
    try:
        mujoco.mj_fwdPosition(mine.mj, data)
    except mujoco.FatalError:  # its memory for contacts is full
        raise RobotError(f"{where}: too many of its links are in one place: move them apart") from None
    for contact in data.contact:
        if contact.dist < -_OVERLAP:
            first, second = (mine.mj.body(mine.mj.geom_bodyid[geom]).name for geom in contact.geom)
            apart.add((first, second))
    apart = {(min(pair), max(pair)) for pair in apart if len(set(pair) & masks.keys()) > 1}
    pairs = sorted(apart)
    parted = near.union(pairs)
    far, said_far = (Counter(link for pair in each for link in pair) for each in (parted, pairs))
    alone = {link for link in names if far[link] == len(names) - 1 and said_far[link] >= _MANY}
    if alone:
        found.add(sorted(alone), "they touch no other link in the model", "intangible")
    if rest := [list(pair) for pair in pairs if alone.isdisjoint(pair)]:
        found.add(rest, "kept apart in the model, or overlapping at rest", "overlapping")
