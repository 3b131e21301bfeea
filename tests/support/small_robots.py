"""Robots of one part only: an arm, a head, wheels; for the conformance suite, as `--robot` takes them."""

from __future__ import annotations

import math
from functools import partial
from typing import Any, Final

from naoserver.bodies.capabilities import Vector
from naoserver.bodies.parts import Axis, Camera, Gear, Groups, HingeAxis, Inertia, Joint, Link, Shape, Wheels
from naoserver.body import Body
from naoserver.fake import FakeRobot
from naoserver.robot import Robot
from tests.support.robot_server import clock_at

__all__ = ["ARM", "HEAD", "SMALL", "SPEED", "WHEELS"]

SPEED: Final = 4.0
_SERVO: Final = {
    "servo": Gear(stiffness=20.0, damping=0.5, friction_damping=0.05, friction=0.02, inertia=0.003)
}
_WHEEL: Final = {"servo": Gear(stiffness=5.0, damping=0.1, friction=0.01, inertia=0.0005)}


def _link(name: str, mass: float = 0.2) -> Link:
    moment = mass * 0.002
    return Link(name=name, mass=mass, inertia=Inertia(ixx=moment, iyy=moment, izz=moment))


def _joint(name: str, between: tuple[str, str], axis: Vector, origin: Vector, **facts: Any) -> Joint:
    limits = {"lower": -1.5, "upper": 1.5, "max_velocity": 4.0, "max_torque": 5.0}
    parent, child = between
    facts = {**limits, **facts, "gear": "servo"}
    return Joint(name=name, parent=parent, child=child, axis=axis, origin=origin, **facts)


ARM: Final = Body(
    name="small arm",
    links=(_link("base", 2.0), _link("upper"), _link("lower"), _link("hand", 0.1), _link("finger", 0.02)),
    joints=(
        _joint("swivel", ("base", "upper"), (0.0, 0.0, 1.0), (0.0, 0.0, 0.1), lower=-3.0, upper=3.0),
        _joint("lift", ("upper", "lower"), (0.0, 1.0, 0.0), (0.0, 0.0, 0.1)),
        _joint("bend", ("lower", "hand"), (0.0, 1.0, 0.0), (0.15, 0.0, 0.0)),
        _joint(
            "grip",
            ("hand", "finger"),
            (0.0, 1.0, 0.0),
            (0.05, 0.0, 0.0),
            sliding=True,
            lower=0.0,
            upper=0.06,
            max_velocity=0.1,
        ),
    ),
    gears={**_SERVO},
    mounted=True,
)
"""Four joints on a table, the last of which slides."""

HEAD: Final = Body(
    name="small head",
    links=(_link("base", 1.0), _link("neck"), _link("head")),
    joints=(
        _joint("pan", ("base", "neck"), (0.0, 0.0, 1.0), (0.0, 0.0, 0.3)),
        _joint("tilt", ("neck", "head"), (0.0, 1.0, 0.0), (0.0, 0.0, 0.05), lower=-0.6, upper=0.6),
    ),
    gears={**_SERVO},
    groups=Groups(head=("pan", "tilt")),
    hinges={"Neck": {Axis.PAN: HingeAxis(joint="pan"), Axis.TILT: HingeAxis(joint="tilt")}},
    cameras=(
        Camera(
            name="Camera",
            link="head",
            position=(0.03, 0.0, 0.0),
            tilt=0.0,
            horizontal_fov=1.0,
            sizes=((320, 240),),
            rates=(30.0,),
        ),
    ),
    mounted=True,
)
"""A camera that pans and tilts."""


def _wheel(name: str, side: float) -> Joint:
    ends = {"lower": -math.inf, "upper": math.inf, "max_velocity": 12.0, "max_torque": 0.4}
    return _joint(name, ("chassis", f"{name}_wheel"), (0.0, 1.0, 0.0), (0.0, side * 0.12, 0.0), **ends)


WHEELS: Final = Body(
    name="small cart",
    links=(_link("chassis", 2.0), _link("left_wheel"), _link("right_wheel")),
    joints=(_wheel("left", 1.0), _wheel("right", -1.0)),
    gears=_WHEEL,
    groups=Groups(wheels=("left", "right")),
    walk=Wheels(
        left="left",
        right="right",
        radius=0.04,
        distance=0.24,
        fastest=0.3,
        fastest_turn=1.9,
        acceleration=0.9,
    ),
    shapes=(
        Shape(link="chassis", kind="box", size=(0.1, 0.1, 0.02), position=(0.0, 0.0, 0.02)),
        Shape(link="chassis", kind="sphere", size=(0.012,), position=(0.1, 0.0, -0.028), friction=0.02),
        Shape(link="chassis", kind="sphere", size=(0.012,), position=(-0.1, 0.0, -0.026), friction=0.02),
        *(
            Shape(link=f"{side}_wheel", kind="ellipsoid", size=(0.04, 0.01, 0.04), friction=1.0)
            for side in ("left", "right")
        ),
    ),
)
"""Two wheels, and what slides on the floor before and behind them."""

SMALL: Final = (ARM, HEAD, WHEELS)


def _fake(body: Body) -> Robot:
    return FakeRobot(clock_at(SPEED), body=body)


def _simulated(body: Body) -> Robot:
    from naoserver_sim.robot import SimulatedRobot
    from tests.support.camera_limits import PATIENT_CAMERAS

    return SimulatedRobot(speed=SPEED, skin=False, body=body, camera_limits=PATIENT_CAMERAS)


fake_arm, fake_head, fake_wheels = (partial(_fake, body) for body in SMALL)
simulated_arm, simulated_head, simulated_wheels = (partial(_simulated, body) for body in SMALL)
