"""Bodies that have nothing in common with a Nao but the form of their description."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Any, Final

from naoserver.bodies.capabilities import Vector
from naoserver.bodies.parts import (
    Axis,
    Battery,
    Camera,
    Groups,
    HingeAxis,
    InertialUnit,
    Joint,
    Lamp,
    Link,
    Place,
    Shape,
    Sole,
    Sonar,
    SpeedRule,
    Steps,
    TouchSensor,
    Wheels,
)
from naoserver.body import Body

__all__ = ["ARM", "CART", "GIANT", "WHEEL_RADIUS"]

_X: Final = (1.0, 0.0, 0.0)
_Y: Final = (0.0, 1.0, 0.0)
_Z: Final = (0.0, 0.0, 1.0)

WHEEL_RADIUS: Final = 0.1


def _joint(
    name: str,
    links: tuple[str, str],
    axis: Vector,
    origin: Vector,
    **facts: Any,
) -> Joint:
    parent, child = links
    defaults = {"lower": -2.0, "upper": 2.0, "max_velocity": 4.0, "max_torque": 10.0}
    return Joint(name=name, parent=parent, child=child, axis=axis, origin=origin, **(defaults | facts))


def _links(names: Iterable[str]) -> tuple[Link, ...]:
    return tuple(Link(name=name, mass=1.0) for name in names)


def _wheel(name: str, side: float) -> Joint:
    links = ("chassis", f"wheel_{name}")
    place = (0.0, side * 0.2, WHEEL_RADIUS)
    return _joint(f"drive_{name}", links, _Y, place, lower=-math.inf, upper=math.inf, max_velocity=12.0)


CART: Final = Body(
    name="cart with a mast",
    title="Cart",
    links=_links(("chassis", "wheel_port", "wheel_starboard", "mast", "gimbal")),
    joints=(
        _wheel("port", 1.0),
        _wheel("starboard", -1.0),
        # It pans to the right, and looks ahead at 0.5 rad.
        _joint(
            "mast_turn",
            ("chassis", "mast"),
            (0.0, 0.0, -1.0),
            (0.1, 0.0, 0.5),
            turn=(math.cos(0.25), 0.0, 0.0, math.sin(0.25)),
            lower=-1.0,
        ),
        # At 0 it looks up.
        _joint(
            "gimbal_tilt",
            ("mast", "gimbal"),
            _Y,
            (0.0, 0.0, 0.1),
            turn=(math.cos(0.125), 0.0, -math.sin(0.125), 0.0),
            lower=-0.5,
            upper=1.0,
            max_velocity=3.0,
        ),
    ),
    groups=Groups(wheels=("drive_port", "drive_starboard"), head=("mast_turn", "gimbal_tilt")),
    hinges={
        "Neck": {
            Axis.PAN: HingeAxis(joint="mast_turn", sign=-1, zero=0.5),
            Axis.TILT: HingeAxis(joint="gimbal_tilt", zero=0.25),
        }
    },
    cameras=(
        Camera(
            name="Camera",
            link="gimbal",
            position=(0.05, 0.0, 0.0),
            tilt=0.0,
            horizontal_fov=1.0,
            sizes=((320, 240),),
            rates=(30.0,),
        ),
    ),
    sonar=Sonar(left=Place(link="chassis"), right=Place(link="chassis"), cone=0.5, nearest=0.1, farthest=4.0),
    touch={"Bumper": TouchSensor(link="chassis")},
    lights={"Lamp": Lamp(start=(0.0, 1.0, 0.0))},
    battery=Battery(voltage=12.0, energy=1e5),
    walk=Wheels(
        left="drive_port",
        right="drive_starboard",
        radius=WHEEL_RADIUS,
        distance=0.4,
        fastest=0.5,
        fastest_turn=1.5,
    ),
)
"""Two wheels, and a camera that pans and tilts; its root is on the floor."""

ARM: Final = Body(
    name="arm",
    links=_links(("base", "upper", "lower", "tool")),
    joints=(
        _joint("swivel", ("base", "upper"), _Z, (0.0, 0.0, 0.3), lower=-3.0, upper=3.0),
        _joint("bend", ("upper", "lower"), _Y, (0.0, 0.0, 0.4)),
        _joint("twist", ("lower", "tool"), _X, (0.3, 0.0, 0.0)),
    ),
    hinges={"Crane": {Axis.PAN: HingeAxis(joint="swivel"), Axis.TILT: HingeAxis(joint="bend", sign=-1)}},
)
"""Three joints, and nothing else."""

_SIDES: Final = ("port", "starboard")
_LEGS: Final = tuple(f"{side}_{joint}" for side in _SIDES for joint in ("thigh", "shin", "heel"))

GIANT: Final = Body(
    name="giant",
    links=_links(
        (
            "pelvis",
            "belt",
            "trunk",
            *(f"{side}_{part}" for side in _SIDES for part in ("arm", "hand", "leg", "calf", "sole")),
        )
    ),
    joints=(
        _joint("belt_turn", ("pelvis", "belt"), _Z, (0.0, 0.0, 0.1)),
        _joint("belt_bow", ("belt", "trunk"), _Y, (0.0, 0.0, 0.1)),
        *(
            joint
            for side, sign in zip(_SIDES, (1.0, -1.0), strict=True)
            for joint in (
                # Its arms hang at 0.
                _joint(f"{side}_swing", ("trunk", f"{side}_arm"), _Y, (0.0, sign * 0.2, 0.4), lower=-3.0),
                _joint(f"{side}_lift", (f"{side}_arm", f"{side}_hand"), _X, (0.0, 0.0, -0.3)),
                _joint(f"{side}_thigh", ("pelvis", f"{side}_leg"), _Y, (0.0, sign * 0.1, 0.0)),
                _joint(f"{side}_shin", (f"{side}_leg", f"{side}_calf"), _Y, (0.0, 0.0, -0.4)),
                _joint(f"{side}_heel", (f"{side}_calf", f"{side}_sole"), _Y, (0.0, 0.0, -0.4)),
            )
        ),
    ),
    speed_rules=(
        SpeedRule(
            slower=("port_swing", "starboard_swing"),
            fraction=0.25,
            while_below={"port_shin": 0.2, "starboard_shin": 0.2},
        ),
    ),
    groups=Groups(
        trunk=("belt_turn", "belt_bow"),
        left_arm=("port_swing", "port_lift"),
        right_arm=("starboard_swing", "starboard_lift"),
        left_leg=_LEGS[:3],
        right_leg=_LEGS[3:],
    ),
    hinges={
        "Neck": {Axis.PAN: HingeAxis(joint="belt_turn"), Axis.TILT: HingeAxis(joint="belt_bow")},
        "LeftShoulder": {Axis.TILT: HingeAxis(joint="port_swing", zero=-math.pi / 2)},
        "RightShoulder": {Axis.TILT: HingeAxis(joint="starboard_swing", zero=-math.pi / 2)},
    },
    cameras=(
        Camera(
            name="Camera",
            link="trunk",
            position=(0.1, 0.0, 0.5),
            tilt=0.3,
            horizontal_fov=1.0,
            sizes=((320, 240),),
            rates=(30.0,),
        ),
    ),
    inertial_unit=InertialUnit(accelerometer=(0.0, 0.0, 0.0), gyrometer=(0.0, 0.0, 0.0)),
    soles=tuple(
        Sole(
            link=f"{side}_sole", outline=((0.1, 0.05), (-0.1, 0.05), (-0.1, -0.05), (0.1, -0.05)), height=0.05
        )
        for side in _SIDES
    ),
    shapes=tuple(
        Shape(link=f"{side}_sole", kind="box", size=(0.1, 0.05, 0.02), position=(0.0, 0.0, -0.03))
        for side in _SIDES
    ),
    walk=Steps(),
)
"""A humanoid without a neck, whose camera its waist turns, and without wrists, hands, pressure sensors and battery."""
