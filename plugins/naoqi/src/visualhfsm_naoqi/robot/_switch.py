"""The dead man's switch of a Nao: NAOqi walks, and moves joints to their goals, until somebody stops it."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Final

from visualhfsm_naoqi.robot._link import RobotAddress
from visualhfsm_naoqi.robot.calls import CallLink, call
from visualhfsm_naoqi.robot.dead_man import attend

SWITCH: Final = "visualhfsm_naoqi.robot._switch"
"""The module that is the process of the switch: this one."""
_HOLD_FRACTION: Final = 0.1


def stops_of(link: CallLink) -> list[Callable[[], object]]:
    """Return what stops walk, posture and joints. Raises HardwareFailure when NAOqi does not name these."""
    joints = [str(name) for name in call(link, "ALMotion.getBodyNames", "Body")]
    stay = ([0.0] * len(joints), _HOLD_FRACTION)
    return [
        partial(call, link, "ALMotion.stopMove"),
        partial(call, link, "ALRobotPosture.stopMove"),
        partial(call, link, "ALMotion.changeAngles", joints, *stay),
    ]


def main() -> None:
    """Be the process of a switch."""
    from visualhfsm_naoqi.robot._libqi_link import connect

    attend(RobotAddress, connect, stops_of)


if __name__ == "__main__":
    main()
