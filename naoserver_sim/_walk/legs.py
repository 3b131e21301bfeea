"""Forward and inverse kinematics of the legs, in closed form.

Frames are the torso's: x forward, y left, z up. A leg has six joints from the hip down: yaw and pitch about a
diagonal axis, roll, pitch, the pitch of the knee, pitch and roll of the ankle. One motor turns the first
joints of both, so that eleven motors control twelve values: positions, roll and pitch of the soles are exact,
and so is the difference of their yaws; the error of their common yaw is shared between the feet.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

from naoserver.bodies.capabilities import InertialReading, Vector
from naoserver.body import Body
from naoserver_sim._locomotion import STANDING_TICKS, STILL_RATE, yaw_rate

_DIAGONAL: Final = math.sqrt(0.5)  # the axis of the first joint lies at 45 degrees
_CLOSE_ENOUGH: Final = 1e-7
_USUAL_SLOPE: Final = math.sqrt(2.0)  # of the error over the hips' yaw, for legs that stand
_FLAT: Final = 1e-6
_LONGEST_STEP: Final = 0.2  # radians in a step towards the solution
_MOST_STEPS: Final = 8

_Rotation = tuple[float, float, float, float, float, float, float, float, float]
"""A rotation matrix, row by row."""
_Aim = tuple[Vector, Vector, Vector]
"""Target of the center of an ankle, and directions of the x and the z axis of its sole."""


@dataclass(frozen=True, slots=True)
class FootPose:
    """Position of the point of a sole below its ankle in m, and rotation of the sole in rad.

    The rotation is about x by `roll`, then about y by `pitch`, then about z by `yaw`, all about fixed axes.
    """

    x: float
    y: float
    z: float
    yaw: float = 0.0
    pitch: float = 0.0
    roll: float = 0.0


def leg_motors(body: Body) -> tuple[str, ...]:
    """Return the motors of a body's legs in the order of every solution."""
    left, right = body.groups.left_leg, body.groups.right_leg
    return (*left, *right[1:])


class Legs:
    """Solve for both legs, starting from the last solution."""

    def __init__(self, body: Body) -> None:
        hip, _, _, knee, ankle, _ = (body.joint[name] for name in body.groups.left_leg)
        _, self._hip_y, self._hip_z = hip.origin
        self._thigh = -knee.origin[2]
        self._tibia = -ankle.origin[2]
        self._foot_height = body.soles[0].height
        self._hip_range = hip.lower, hip.upper
        # The last solution: the next one is near.
        self._hip_yaw = 0.0
        self._slope = _USUAL_SLOPE

    def solve(self, left: FootPose, right: FootPose) -> list[float]:
        """Return the angles of `leg_motors` in rad; a foot out of reach comes as near as possible."""
        aim_left, aim_right = self._aim(left), self._aim(right)

        def legs(hip_yaw: float) -> tuple[list[float], list[float], float]:
            one, error_one = self._leg(1.0, hip_yaw, aim_left)
            other, error_other = self._leg(-1.0, hip_yaw, aim_right)
            return one, other, error_one - error_other

        lowest, highest = self._hip_range
        hip_yaw, slope = self._hip_yaw, self._slope
        one, other, error = legs(hip_yaw)
        for _ in range(_MOST_STEPS):
            if abs(error) < _CLOSE_ENOUGH or abs(slope) < _FLAT:
                break
            change = max(-_LONGEST_STEP, min(_LONGEST_STEP, -error / slope))
            change = max(lowest, min(highest, hip_yaw + change)) - hip_yaw
            if change == 0.0:
                break
            before = error
            hip_yaw += change
            one, other, error = legs(hip_yaw)
            slope = (error - before) / change  # the secant: as good as the derivative, and it costs nothing
        self._hip_yaw = hip_yaw
        self._slope = slope if slope > 0.5 * _USUAL_SLOPE else _USUAL_SLOPE
        return [hip_yaw, *one, *other]

    def sole(self, side: float, angles: Sequence[float]) -> Vector:
        """Return the point of a sole below its ankle in m, at the six angles of its joints.

        `side` is 1 for the left leg, -1 for the right.
        """
        hip_yaw, hip_roll, hip_pitch, knee_pitch, ankle_pitch, ankle_roll = angles
        knee, ankle = hip_pitch + knee_pitch, hip_pitch + knee_pitch + ankle_pitch
        foot = self._foot_height * math.cos(ankle_roll)
        x = -self._thigh * math.sin(hip_pitch) - self._tibia * math.sin(knee) - foot * math.sin(ankle)
        z = -self._thigh * math.cos(hip_pitch) - self._tibia * math.cos(knee) - foot * math.cos(ankle)
        aside = self._foot_height * math.sin(ankle_roll)
        cos_roll, sin_roll = math.cos(hip_roll), math.sin(hip_roll)
        y, z = aside * cos_roll - z * sin_roll, aside * sin_roll + z * cos_roll
        hip = _about_diagonal(side, hip_yaw)
        return (
            hip[0] * x + hip[1] * y + hip[2] * z,
            hip[3] * x + hip[4] * y + hip[5] * z + side * self._hip_y,
            hip[6] * x + hip[7] * y + hip[8] * z + self._hip_z,
        )

    def _aim(self, foot: FootPose) -> _Aim:
        cy, sy = math.cos(foot.yaw), math.sin(foot.yaw)
        cp, sp = math.cos(foot.pitch), math.sin(foot.pitch)
        cr, sr = math.cos(foot.roll), math.sin(foot.roll)
        up = (cy * sp * cr + sy * sr, sy * sp * cr - cy * sr, cp * cr)
        height = self._foot_height
        ankle = (foot.x + up[0] * height, foot.y + up[1] * height, foot.z + up[2] * height)
        return ankle, (cy * cp, sy * cp, -sp), up

    def _leg(self, side: float, hip_yaw: float, aim: _Aim) -> tuple[list[float], float]:
        """Return the angles below the first one, and the sine of the error in yaw, for the `side` 1 or -1."""
        hip = _about_diagonal(side, hip_yaw)
        (x, y, z), forward, up = aim
        along, aside, above = _turned_back(hip, (x, y - side * self._hip_y, z - self._hip_z))
        roll = math.atan2(aside, -above)
        below = math.hypot(aside, above)
        thigh, tibia = self._thigh, self._tibia
        reach = along * along + below * below
        cosine = (reach - thigh * thigh - tibia * tibia) / (2 * thigh * tibia)
        knee = math.acos(max(-1.0, min(1.0, cosine)))
        # A knee bends backwards: the thigh points ahead of the line from hip to ankle.
        pitch = -math.atan2(along, below) - math.atan2(tibia * math.sin(knee), thigh + tibia * math.cos(knee))
        # What is left of the foot's rotation below the roll of the hip is pitch, then the roll of the ankle.
        m02, m12, m22 = _turned_back(hip, up)
        _, m10, m20 = _turned_back(hip, forward)
        cos_roll, sin_roll = math.cos(roll), math.sin(roll)
        side_of_normal = cos_roll * m12 + sin_roll * m22
        height_of_normal = -sin_roll * m12 + cos_roll * m22
        ankle_roll = -math.asin(max(-1.0, min(1.0, side_of_normal)))
        ankle_pitch = math.atan2(m02, height_of_normal) - pitch - knee
        error = cos_roll * m10 + sin_roll * m20
        return [roll, pitch, knee, ankle_pitch, ankle_roll], error


def _about_diagonal(side: float, angle: float) -> _Rotation:
    """Return the rotation of the first joint of a leg: about (0, 1, -side) / sqrt(2)."""
    c, s = math.cos(angle), math.sin(angle) * _DIAGONAL
    half, z = (1.0 - c) / 2.0, -side
    return (
        *(c, -s * z, s),
        *(s * z, c + half, half * z),
        *(-s, half * z, c + half),
    )


def _turned_back(rotation: _Rotation, vector: Vector) -> Vector:
    """Turn a vector by the inverse of a rotation."""
    x, y, z = vector
    return (
        rotation[0] * x + rotation[3] * y + rotation[6] * z,
        rotation[1] * x + rotation[4] * y + rotation[7] * z,
        rotation[2] * x + rotation[5] * y + rotation[8] * z,
    )


_LEFT: Final = 1.0
_RIGHT: Final = -1.0
_LARGEST_DELAY: Final = 5
"""Largest delay of the sensors in ticks."""


class Odometer:
    """Integrate the place of the torso on the floor, in the frame of its start."""

    def __init__(self, legs: Legs) -> None:
        self._legs = legs
        self._soles: tuple[Vector, Vector] | None = None
        self._unsure = 0  # ticks for which the soles do not count
        self._offset = 0.0  # of the yaw rate
        self._still = 0  # ticks over which that is the mean
        self.pose = (0.0, 0.0, 0.0)
        """x and y in m, and the heading in rad within (-pi, pi]."""

    def lose_footing(self) -> None:
        """Ignore movements of the soles until the sensors show their new places."""
        self._unsure = _LARGEST_DELAY

    def turn(self, seconds: float, inertial: InertialReading, *, resting: bool = False) -> None:
        """Advance only the heading by some seconds."""
        x, y, heading = self.pose
        rate = yaw_rate(inertial)
        if resting and max(map(abs, inertial.angular_velocity)) < STILL_RATE:
            self._still = min(self._still + 1, STANDING_TICKS)
            self._offset += (rate - self._offset) / self._still
        heading += (rate - self._offset) * seconds
        self.pose = (x, y, math.pi - (math.pi - heading) % math.tau)

    def tick(
        self,
        seconds: float,
        joints: Sequence[float],
        inertial: InertialReading,
        loads: tuple[float, float],
        *,
        resting: bool = False,
    ) -> None:
        """Advance by some seconds, at the end of which the sensors have these readings.

        `joints` are the angles of the legs' joints in rad, left and right, `loads` those of the soles in N,
        left and right. `resting` means that the legs are not walking.
        """
        self.turn(seconds, inertial, resting=resting)
        x, y, heading = self.pose
        soles = (
            _in_world(self._legs.sole(_LEFT, joints[:6]), inertial, heading),
            _in_world(self._legs.sole(_RIGHT, joints[6:]), inertial, heading),
        )
        total = loads[0] + loads[1]
        if self._unsure:
            self._unsure -= 1
        elif self._soles is not None and total > 0.0:
            for now, last, load in zip(soles, self._soles, loads, strict=True):
                x -= (now[0] - last[0]) * load / total
                y -= (now[1] - last[1]) * load / total
        self._soles = soles
        self.pose = (x, y, heading)


def _in_world(point: Vector, inertial: InertialReading, heading: float) -> Vector:
    """Turn a vector of the torso's frame about x by roll, about y by pitch and about z by heading."""
    x, y, z = point
    cosine, sine = math.cos(inertial.roll), math.sin(inertial.roll)
    y, z = y * cosine - z * sine, y * sine + z * cosine
    cosine, sine = math.cos(inertial.pitch), math.sin(inertial.pitch)
    x, z = x * cosine + z * sine, z * cosine - x * sine
    cosine, sine = math.cos(heading), math.sin(heading)
    return x * cosine - y * sine, x * sine + y * cosine, z
