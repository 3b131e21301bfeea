"""A mounted body whose links do not only hang on each other: a four-bar linkage, and fingers of one motor."""

from __future__ import annotations

from typing import Any, Final

from naoserver.bodies.capabilities import Vector
from naoserver.bodies.parts import Coupling, Gear, Inertia, Joint, Link, Loop, Shape
from naoserver.body import Body

__all__ = ["LINKAGE"]

_ARM: Final = 0.1
"""Length of crank and rocker in m."""
_ROD: Final = 0.2


def _link(name: str, mass: float, com: Vector) -> Link:
    return Link(name=name, mass=mass, com=com, inertia=Inertia(ixx=1e-4, iyy=1e-4, izz=1e-4))


def _joint(name: str, links: tuple[str, str], origin: Vector, **facts: Any) -> Joint:
    parent, child = links
    common = {"lower": -1.5, "upper": 1.5, "max_velocity": 2.0, "max_torque": 5.0, "gear": "servo"}
    given: dict[str, Any] = common | facts
    return Joint(name=name, parent=parent, child=child, axis=(0.0, 1.0, 0.0), origin=origin, **given)


_PASSIVE: Final[dict[str, Any]] = {"max_torque": 0.0, "gear": "bearing"}

LINKAGE: Final = Body(
    name="Linkage",
    links=(
        _link("base", 2.0, (0.0, 0.0, 0.0)),
        _link("crank", 0.1, (0.0, 0.0, _ARM / 2)),
        _link("rod", 0.1, (_ROD / 2, 0.0, 0.0)),
        _link("rocker", 0.1, (0.0, 0.0, _ARM / 2)),
        _link("finger", 0.05, (0.0, 0.0, 0.02)),
        _link("thumb", 0.05, (0.0, 0.0, 0.02)),
    ),
    joints=(
        _joint("drive", ("base", "crank"), (0.0, 0.0, 0.1)),
        _joint("pin", ("crank", "rod"), (0.0, 0.0, _ARM), **_PASSIVE),
        _joint("swing", ("base", "rocker"), (_ROD, 0.0, 0.1), **_PASSIVE),
        _joint("grip", ("base", "finger"), (0.0, 0.2, 0.1), lower=-0.2, upper=0.6),
        _joint("pinch", ("base", "thumb"), (0.1, 0.2, 0.1), max_velocity=6.0),
    ),
    gears={
        "servo": Gear(stiffness=50.0, damping=2.0, inertia=0.01),
        "bearing": Gear(stiffness=0.0, friction_damping=0.001),
    },
    couplings=(Coupling(leader="grip", follower="pinch", ratio=-2.0, offset=0.1),),
    loops=(Loop(first="rod", second="rocker", place=(_ROD, 0.0, 0.0), other=(0.0, 0.0, _ARM)),),
    shapes=(Shape(link="base", kind="box", size=(0.2, 0.2, 0.05)),),
    mounted=True,
)
"""The joint `drive` swings the crank, and the rod swings the rocker alike; `pinch` follows `grip`."""
