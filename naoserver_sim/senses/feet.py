"""What the four sensors of a sole feel of the wrench with which the foot presses on the floor."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

from naoserver.body import Body

SENSORS: Final = ("FrontLeft", "FrontRight", "RearLeft", "RearRight")
"""The sensors of a sole in the order of every reading."""

Four = tuple[float, float, float, float]


def load(foot: Sequence[float]) -> float:
    """Return what presses on a sole at right angles in N, of a foot as `SensorLayout.feet` has it."""
    pressing = -(foot[0] * foot[18] + foot[1] * foot[19] + foot[2] * foot[20])
    return pressing if pressing > 0.0 else 0.0


class SoleSensors:
    """The sensors of one sole: together they carry the load, each the more the nearer its center is.

    The load is shared bilinearly, so that the sum of the four is the load and their center of pressure is
    that of the foot wherever it lies between them; beyond them the outermost carry all.
    """

    def __init__(self, body: Body, side: str) -> None:
        places = {name: body.facts["fsr"][side][name] for name in SENSORS}
        self._front = (places["FrontLeft"][0] + places["FrontRight"][0]) / 2
        self._rear = (places["RearLeft"][0] + places["RearRight"][0]) / 2
        # Left and right ends of the line between the front and between the rear sensors.
        self._front_ends = places["FrontLeft"][1], places["FrontRight"][1]
        self._rear_ends = places["RearLeft"][1], places["RearRight"][1]

    def pressures(self, foot: Sequence[float]) -> Four:
        """Return what the sensors carry in N, of a foot as `SensorLayout.feet` has it."""
        fx, fy, fz, tx, ty, tz, px, py, pz, ox, oy, oz, ax, ay, az, bx, by, bz, cx, cy, cz = foot
        carried = -(fx * cx + fy * cy + fz * cz)
        if carried <= 0.0:
            return 0.0, 0.0, 0.0, 0.0
        rx, ry, rz = px - ox, py - oy, pz - oz
        mx, my, mz = ry * fz - rz * fy + tx, rz * fx - rx * fz + ty, rx * fy - ry * fx + tz
        # The moment about the sole's middle is that of the load at the center of pressure.
        x = (mx * bx + my * by + mz * bz) / carried
        y = -(mx * ax + my * ay + mz * az) / carried
        forward = _within_unit((x - self._rear) / (self._front - self._rear))
        left = self._rear_ends[0] + forward * (self._front_ends[0] - self._rear_ends[0])
        right = self._rear_ends[1] + forward * (self._front_ends[1] - self._rear_ends[1])
        leftward = _within_unit((y - right) / (left - right))
        front, rear = carried * forward, carried * (1.0 - forward)
        return front * leftward, front * (1.0 - leftward), rear * leftward, rear * (1.0 - leftward)


def _within_unit(value: float) -> float:
    return 0.0 if value < 0.0 else min(value, 1.0)
