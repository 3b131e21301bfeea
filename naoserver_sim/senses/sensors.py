"""The sensors of the model: where MuJoCo measures, and where its measurements stand in `sensordata`."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

import mujoco

from naoserver.body import Body
from naoserver_sim.body import COLLISION_GROUP, TORSO

SIDES: Final = ("left", "right")
_UNIT: Final = "inertial unit"

# A bumper feels the forces of contacts that point into a space in front of its half of the toe. The half
# sizes of that in m; how far it is in front of the toe, and how far it reaches below the sole: by less than
# what rays of contacts with the floor fall on their way there.
_BUMPER: Final = (0.006, 0.03, 0.0225)
_BUMPER_AHEAD: Final = 0.0008
_BUMPER_BELOW: Final = 0.0008

# What a contact sensor tells, and how it makes one wrench of all contacts of a foot: MuJoCo's `netforce`.
_FORCE_TORQUE_PLACE: Final = sum(
    1 << int(field)
    for field in (
        mujoco.mjtConDataField.mjCONDATA_FORCE,
        mujoco.mjtConDataField.mjCONDATA_TORQUE,
        mujoco.mjtConDataField.mjCONDATA_POS,
    )
)
_NET_FORCE: Final = 3


def add_sensors(spec: mujoco.MjSpec, links: Mapping[str, mujoco.MjsBody], body: Body) -> None:
    """Add the inertial unit, the soles' wrenches and the bumpers to the body's links."""
    sensor, kind = mujoco.mjtSensor, mujoco.mjtObj
    torso = links[TORSO]
    torso.add_site(name=_UNIT, pos=body.facts["imu"]["accelerometer"], group=COLLISION_GROUP)
    for name, measure in (
        ("acceleration", sensor.mjSENS_ACCELEROMETER),
        ("turning", sensor.mjSENS_GYRO),
        ("attitude", sensor.mjSENS_FRAMEQUAT),
    ):
        spec.add_sensor(name=name, type=measure, objtype=kind.mjOBJ_SITE, objname=_UNIT)
    height = body.facts["dimensions"]["foot_height"]
    for side in SIDES:
        foot = links[f"{side[0]}_foot"]
        middle = f"{side} sole"
        foot.add_site(name=middle, pos=[0, 0, -height], group=COLLISION_GROUP)
        wrench = spec.add_sensor(
            name=f"{side} wrench", type=sensor.mjSENS_CONTACT, objtype=kind.mjOBJ_BODY, objname=foot.name
        )
        wrench.intprm[:3] = [_FORCE_TORQUE_PLACE, _NET_FORCE, 1]
        for name, measure in (
            ("place", sensor.mjSENS_FRAMEPOS),
            ("x", sensor.mjSENS_FRAMEXAXIS),
            ("y", sensor.mjSENS_FRAMEYAXIS),
            ("z", sensor.mjSENS_FRAMEZAXIS),
        ):
            spec.add_sensor(name=f"{side} {name}", type=measure, objtype=kind.mjOBJ_SITE, objname=middle)
        x, y = zip(*body.facts["sole"][side], strict=True)
        middle_y = (max(y) + min(y)) / 2
        for edge, leftward in (("Left", 1.0), ("Right", -1.0)):
            bumper = f"{side} {edge} bumper"
            foot.add_site(
                name=bumper,
                type=mujoco.mjtGeom.mjGEOM_BOX,
                pos=[
                    max(x) + _BUMPER_AHEAD + _BUMPER[0],
                    middle_y + leftward * _BUMPER[1],
                    _BUMPER[2] - height - _BUMPER_BELOW,
                ],
                size=_BUMPER,
                group=COLLISION_GROUP,
            )
            spec.add_sensor(name=bumper, type=sensor.mjSENS_TOUCH, objtype=kind.mjOBJ_SITE, objname=bumper)


@dataclass(frozen=True, slots=True)
class SensorLayout:
    """Where the measurements begin in `sensordata`."""

    acceleration: int
    """Specific force in the torso's frame, m/s2 (3)."""
    turning: int
    """Turning rate in the torso's frame, rad/s (3)."""
    attitude: int
    """The torso's orientation as a unit quaternion w, x, y, z (4)."""
    feet: tuple[int, int]
    """Of the left and of the right foot (21): force (3), torque (3) and place (3) of the wrench with which it
    presses on what it touches; place (3), x, y and z axes (9) of the sole. All in the world's frame."""

    bumpers: tuple[int, ...]
    """Forces on the bumpers in N: LFootBumperLeft, LFootBumperRight, RFootBumperLeft, RFootBumperRight."""

    @classmethod
    def of(cls, mj: mujoco.MjModel) -> SensorLayout:
        """Return the layout of a compiled model."""
        left, right = (_begin(mj, f"{side} wrench") for side in SIDES)
        bumpers = tuple(_begin(mj, f"{side} {edge} bumper") for side in SIDES for edge in ("Left", "Right"))
        return cls(
            _begin(mj, "acceleration"), _begin(mj, "turning"), _begin(mj, "attitude"), (left, right), bumpers
        )


def _begin(mj: mujoco.MjModel, name: str) -> int:
    return int(mj.sensor(name).adr[0])
