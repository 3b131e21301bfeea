"""Kinematics of a body: places of its parts at given angles of the joints, and angles that reach a place.

Angles are in rad; those of sliding joints are ways in m. A joint without a given angle is at 0.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import lru_cache
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from naoserver.bodies.body import Body
from naoserver.bodies.capabilities import Vector
from naoserver.bodies.parts import Joint, Quaternion, Shape
from naoserver.errors import InvalidCommand

Matrix = NDArray[np.float64]
"""A homogeneous transform, shape (4, 4)."""
Goals = Mapping[str, tuple[Matrix, Sequence[float]]]
"""For each effector a place, and how much each of x, y, z and of the turns about them counts."""
_Wanted = Mapping[str, tuple[float, float]]
"""For joints an angle, and how much it counts."""
_Columns = Mapping[str, tuple[int, float]]
"""For each joint its motor, and the ratio to it."""

_HERE: Final[Matrix] = np.eye(4)
_WHOLE: Final = "Body"
"""The name of all links together."""
_MOST_STEPS: Final = 60
_NEAR_ENOUGH: Final = 1e-4  # rad
_LEAST_GAIN: Final = 0.99
"""Part of the squared error that is left after a step which gains too little for another one."""
_DAMPING: Final = 1e-4
_LARGEST_STEP: Final = 0.3  # rad
_NO_TURN: Final = 1e-9


@lru_cache(16)
def kinematics_of(body: Body) -> Kinematics:
    """Return the kinematics of a body, made when it is first used."""
    return Kinematics(body)


class Kinematics:
    """The places of a body's parts, in the frame of its root link, such as the torso."""

    def __init__(self, body: Body) -> None:
        self.body: Final = body
        ways: dict[str, tuple[_Segment, ...]] = {body.root.name: ()}
        for link in body.links[1:]:
            joint = body.moved_by[link.name]
            ways[link.name] = (*ways[joint.parent], _segment(joint))
        self._ways: Final = ways
        self._offsets: Final = {
            name: matrix_of((*effector.position, *effector.angles))
            for name, effector in body.effectors.items()
        }

    def place_of(self, name: str, angles: Mapping[str, float]) -> Matrix:
        """Return the place of an effector, or of a joint's frame, which is its link's, in the root's frame.

        Raises InvalidCommand for an unknown name.
        """
        return self._frames(name, angles)[1]

    def link_place(self, link: str, angles: Mapping[str, float]) -> Matrix:
        """Return the place of a link in the root's frame."""
        return self._link_frames(link, angles)[1]

    def joints_of(self, name: str) -> list[str]:
        """Return the joints between the root and an effector, or the link of a joint, the root's first."""
        joints = (segment.joint.name for segment in self._ways[self._link_of(name)])
        return [joint for joint in joints if joint in self.body.joint]

    def soles(self, angles: Mapping[str, float]) -> list[Matrix]:
        """Return the places of the soles in the root's frame, the left one first."""
        return [
            self.link_place(sole.link, angles) @ _shift((0.0, 0.0, -sole.height)) for sole in self.body.soles
        ]

    def torso_place(self, angles: Mapping[str, float], roll: float = 0.0, pitch: float = 0.0) -> Matrix:
        """Return the place of the root in the robot's frame: on the floor below it, upright, in its heading.

        `roll` and `pitch` are its angles to the vertical in rad. The lower sole stands on the floor; the
        lowest shape of a body without soles.
        """
        torso = rotation((0.0, 1.0, 0.0), pitch) @ rotation((1.0, 0.0, 0.0), roll)
        torso[2, 3] = -min(self._heights(torso, angles), default=0.0)
        return torso

    def _heights(self, torso: Matrix, angles: Mapping[str, float]) -> Iterable[float]:
        """Yield the heights of what may stand on the floor."""
        for sole in self.soles(angles):
            yield float((torso @ sole)[2, 3])
        if not self.body.soles:
            for shape in self.body.shapes:
                yield _lowest(shape, torso @ self.link_place(shape.link, angles))

    def reach(
        self, goals: Goals, angles: Mapping[str, float], base: Matrix = _HERE, wanted: _Wanted | None = None
    ) -> dict[str, float]:
        """Return angles of all joints with which effectors are as near to their goals as possible.

        The goals are in a frame in which the root is at `base`. The search starts at `angles` and moves only
        the joints between root and effectors, and those coupled to them, within their limits: damped least
        squares (Levenberg, Q. Appl. Math. 2, 1944; Marquardt, SIAM J. Appl. Math. 11, 1963). With `wanted`,
        angles that some of these joints are to have, and how much that counts, the root moves, too, as near
        to its own goal as possible. Raises InvalidCommand for an unknown effector.
        """
        found = dict(angles)
        moved = list(dict.fromkeys(joint for name in goals for joint, _ in self._frames(name, angles)[0]))
        pairs = self.body.following
        names = (joint.name for joint in moved if not joint.passive)
        leaders = dict.fromkeys(pairs[name].leader if name in pairs else name for name in names)
        motors = [_Motor(self.body, leader, angles) for leader in leaders]
        columns = {
            joint: (column, ratio)
            for column, motor in enumerate(motors)
            for joint, (ratio, _) in motor.joints.items()
        }
        count = len(motors) + (0 if wanted is None else 6)
        error, jacobian = self._errors(goals, found, base, wanted or {}, columns, count)
        damping = _DAMPING
        for _ in range(_MOST_STEPS):
            damped = jacobian @ jacobian.T + damping * np.eye(len(error))
            change = np.clip(jacobian.T @ np.linalg.solve(damped, error), -_LARGEST_STEP, _LARGEST_STEP)
            tried = dict(found)
            for motor, step in zip(motors, change.tolist(), strict=False):
                tried |= motor.moved(found, step)
            there = base if wanted is None else _moved(base, change[-6:])
            error_then, jacobian_then = self._errors(goals, tried, there, wanted or {}, columns, count)
            before, after = error @ error, error_then @ error_then
            if after < before:
                found, base, error, jacobian = tried, there, error_then, jacobian_then
                damping = max(damping / 3.0, _DAMPING)
            else:
                damping *= 10.0
            if np.abs(change).max(initial=0.0) < _NEAR_ENOUGH or _LEAST_GAIN * before < after < before:
                break
        return found

    def center_of_mass(self, name: str, angles: Mapping[str, float]) -> tuple[float, NDArray[np.float64]]:
        """Return the mass in kg of a part of the body and its center in m, in the root's frame.

        The part is `Body`, a joint with the link that it moves, or the chain of an effector. Raises
        InvalidCommand for another.
        """
        links = [link for link in self.body.links if link.name in self._links_of(name)]
        mass = sum(link.mass for link in links)
        weighted = sum(
            (
                link.mass * (self.link_place(link.name, angles) @ np.array([*link.com, 1.0]))[:3]
                for link in links
            ),
            start=np.zeros(3),
        )
        return mass, weighted / mass if mass else weighted

    def _links_of(self, name: str) -> frozenset[str]:
        """Return the links of a part. Raises InvalidCommand for an unknown one."""
        if name == _WHOLE:
            return frozenset(self._ways)
        if name in self.body.effectors:
            link = self.body.effectors[name].link
            return frozenset(segment.joint.child for segment in self._ways[link]) or frozenset({link})
        return frozenset({self._link_of(name, _WHOLE)})

    def _link_of(self, name: str, *others: str) -> str:
        """Return the link of an effector or a joint. Raises InvalidCommand, which also lists other names."""
        if name in self.body.effectors:
            return self.body.effectors[name].link
        if name in self.body.joint:
            return self.body.joint[name].child
        known = ", ".join((*others, *self.body.effectors, "the joints"))
        raise InvalidCommand("name", f"there is no part {name[:60]!r}; there are {known}")

    def _frames(self, name: str, angles: Mapping[str, float]) -> tuple[list[tuple[Joint, Matrix]], Matrix]:
        """Return the joints that move an effector or a joint's link, with their places, and its own place."""
        frames, place = self._link_frames(self._link_of(name), angles)
        return frames, place @ self._offsets[name] if name in self._offsets else place

    def _link_frames(
        self, link: str, angles: Mapping[str, float]
    ) -> tuple[list[tuple[Joint, Matrix]], Matrix]:
        """Return the joints that move a link, from the root on, with their places, and its own place."""
        place = _HERE
        frames: list[tuple[Joint, Matrix]] = []
        for segment in self._ways[link]:
            joint = segment.joint
            place = place @ segment.at(angles.get(joint.name, 0.0))
            if joint.name in angles:
                frames.append((joint, place))
        return frames, place

    def _errors(  # noqa: PLR0917 - what `reach` knows
        self,
        goals: Goals,
        angles: Mapping[str, float],
        base: Matrix,
        wanted: _Wanted,
        columns: _Columns,
        count: int,
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return how far all is from its goals, and how each motor changes that, and the root if it moves."""
        motors = {column for column, _ in columns.values()}
        errors, rows = [], []
        for name, (goal, counts) in goals.items():
            frames, place = self._frames(name, angles)
            place = base @ place
            effects = np.zeros((6, count))
            for joint, frame in frames:
                if joint.name not in columns:  # it is passive
                    continue
                column, ratio = columns[joint.name]
                axis = ratio * base[:3, :3] @ frame[:3, :3] @ np.array(joint.axis)
                if joint.sliding:
                    effects[:3, column] += axis
                else:
                    effects[:3, column] += np.cross(axis, place[:3, 3] - (base @ frame)[:3, 3])
                    effects[3:, column] += axis
            if count > len(motors):
                effects[:, -6:] = np.eye(6)
                x, y, z = (place - base)[:3, 3]
                effects[:3, -3:] = -_cross((x, y, z))[:3, :3]
            weights = np.array(counts, float)
            errors.append((weights * _difference(place, goal))[weights > 0.0])
            rows.append((weights[:, None] * effects)[weights > 0.0])
        for name, (angle, weight) in wanted.items():
            if name in columns:  # others move nothing here
                column, ratio = columns[name]
                errors.append(np.array([weight * (angle - angles[name])]))
                rows.append(weight * ratio * np.eye(1, count, column))
        return np.concatenate(errors), np.concatenate(rows)


class _Motor:
    """The joints that one motor drives, and the range in which they all can be."""

    def __init__(self, body: Body, leader: str, angles: Mapping[str, float]) -> None:
        pairs = [pair for pair in body.couplings if pair.leader == leader]
        ways = {leader: (1.0, 0.0)} | {pair.follower: (pair.ratio, pair.offset) for pair in pairs}
        self.joints: Final = {joint: way for joint, way in ways.items() if joint in angles}
        """Those that are to be found: the ratio and the offset of each to the leader."""
        lower, upper = [body.joint[leader].lower], [body.joint[leader].upper]
        for pair in pairs:
            joint, back = body.joint[pair.follower], pair.reversed()
            low, high = sorted((back.of(joint.lower), back.of(joint.upper)))
            lower.append(low)
            upper.append(high)
        self._lower: Final = max(lower)
        self._upper: Final = min(upper)

    def moved(self, angles: Mapping[str, float], step: float) -> dict[str, float]:
        """Return the angles of the joints after a step of the leader in rad, within their ranges."""
        joint, (ratio, offset) = next(iter(self.joints.items()))
        at = min(max((angles[joint] - offset) / ratio + step, self._lower), self._upper)
        return {joint: offset + ratio * at for joint, (ratio, offset) in self.joints.items()}


class _Segment(NamedTuple):
    """A joint, and the parts of the transform from its parent's frame to its child's.

    At an angle a, this is `still`, plus sin a times `sine`, plus (1 - cos a) times `versine`; of a sliding
    joint, it is `still` plus a times `slide`.
    """

    joint: Joint
    still: Matrix
    sine: Matrix
    versine: Matrix
    slide: Matrix

    def at(self, angle: float) -> Matrix:
        """Return the transform at an angle."""
        if self.joint.sliding:
            return self.still + angle * self.slide
        return self.still + math.sin(angle) * self.sine + (1.0 - math.cos(angle)) * self.versine


def _segment(joint: Joint) -> _Segment:
    still, cross = _shift(joint.origin) @ turned(joint.turn), _cross(joint.axis)
    return _Segment(joint, still, still @ cross, still @ cross @ cross, still @ (_shift(joint.axis) - _HERE))


def _lowest(shape: Shape, link: Matrix) -> float:
    """Return the height of the lowest point of a shape whose link is at a place."""
    size = shape.size
    if shape.points:
        return min(float((link @ [*point, 1.0])[2]) for point in shape.points)
    if shape.ends is not None:
        return min(float((link @ [*end, 1.0])[2]) for end in shape.ends) - size[0]
    place = link @ _shift(shape.position) @ turned(shape.turn)
    up = np.abs(place[2, :3])
    match shape.kind:
        case "sphere":
            depth = size[0]
        case "box":
            depth = float(up @ size)
        case "ellipsoid":
            depth = float(np.linalg.norm(up * size))
        case "capsule":
            depth = size[0] + size[1] * up[2]
        case "cylinder":
            depth = size[0] * math.hypot(up[0], up[1]) + size[1] * up[2]
    return float(place[2, 3]) - depth


def neighbors_of(body: Body) -> Callable[[str, str], bool]:
    """Return what says whether two links meet at joints in one point, or one carries the other there.

    The shapes of neighbors overlap.
    """
    carriers = body.moved_by
    # The joints of a hip, an ankle or a shoulder share a point: the links between them are one neighbor.
    cluster: dict[str, str] = {}
    for link in body.links:  # each after the one that carries it
        joint = carriers.get(link.name)
        if joint is None or any(joint.origin):
            cluster[link.name] = link.name
        else:
            cluster[link.name] = cluster[joint.parent]
    carrier = {name: cluster[joint.parent] for name, joint in carriers.items()}

    def are_neighbors(first: str, second: str) -> bool:
        one, other = cluster[first], cluster[second]
        return one == other or carrier.get(one) == other or carrier.get(other) == one

    return are_neighbors


def rotation(axis: Vector, angle: float) -> Matrix:
    """Return the rotation by an angle in rad, right-handed about a unit vector (Rodrigues)."""
    cross = _cross(axis)
    return _HERE + math.sin(angle) * cross + (1.0 - math.cos(angle)) * cross @ cross


def turned(quaternion: Quaternion) -> Matrix:
    """Return the rotation of a unit quaternion (w, x, y, z)."""
    w, *vector = quaternion
    size = math.hypot(*vector)
    if size == 0.0:
        return _HERE
    x, y, z = (part / size for part in vector)
    return rotation((x, y, z), 2.0 * math.atan2(size, w))


def _cross(axis: Vector) -> Matrix:
    """Return the matrix of the cross product of an axis with a vector; its last row and column are 0."""
    x, y, z = axis
    return np.array([[0.0, -z, y, 0.0], [z, 0.0, -x, 0.0], [-y, x, 0.0, 0.0], [0.0, 0.0, 0.0, 0.0]])


def _shift(vector: Vector) -> Matrix:
    moved = np.eye(4)
    moved[:3, 3] = vector
    return moved


def angles_of(matrix: Matrix) -> Vector:
    """Return the angles about x, y and z in rad of a transform that turns about x, then y, then z."""
    return (
        math.atan2(matrix[2, 1], matrix[2, 2]),
        math.atan2(-matrix[2, 0], math.hypot(matrix[2, 1], matrix[2, 2])),
        math.atan2(matrix[1, 0], matrix[0, 0]),
    )


def matrix_of(place: Sequence[float]) -> Matrix:
    """Return the transform of x, y and z in m and the angles about x, y and z in rad."""
    x, y, z, about_x, about_y, about_z = place
    turned = rotation((0.0, 0.0, 1.0), about_z) @ rotation((0.0, 1.0, 0.0), about_y)
    return _shift((x, y, z)) @ turned @ rotation((1.0, 0.0, 0.0), about_x)


def numbers_of(place: Matrix) -> list[float]:
    """Return x, y and z in m and the angles about x, y and z in rad of a transform: undo `matrix_of`."""
    return [*(float(part) for part in place[:3, 3]), *angles_of(place)]


def between(start: Matrix, goal: Matrix, share: float) -> Matrix:
    """Return the place at a share of the straight line, and of the shortest rotation, between two places."""
    return _moved(start, share * _difference(start, goal))


def _moved(start: Matrix, way: NDArray[np.float64]) -> Matrix:
    """Return a place after a translation in m and a rotation in rad, as a vector along its axis."""
    angle = float(np.linalg.norm(way[3:]))
    place = start.copy()
    place[:3, 3] += way[:3]
    if angle > _NO_TURN:
        x, y, z = (float(part) for part in way[3:] / angle)
        place[:3, :3] = rotation((x, y, z), angle)[:3, :3] @ start[:3, :3]
    return place


def _difference(place: Matrix, goal: Matrix) -> NDArray[np.float64]:
    """Return the translation in m and the rotation in rad, as a vector along its axis, from place to goal."""
    turn = goal[:3, :3] @ place[:3, :3].T
    axis = np.array([turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1]]) / 2.0
    size = float(np.linalg.norm(axis))
    angle = math.atan2(size, (float(np.trace(turn)) - 1.0) / 2.0)
    return np.concatenate([goal[:3, 3] - place[:3, 3], axis * (angle / size if size > _NO_TURN else 1.0)])
