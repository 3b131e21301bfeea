"""The maker's rt/arm_sdk: arms and waist follow a program by a weight, beside the walk; no DDS.

The maker's programs leave the modes at 0 here, in C++ the checksum, too, and give no gains to motors that
they do not mean.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from functools import partial
from typing import Final

from interfaces.nao import JointCommand
from naoserver.bodies import find_body
from naoserver.errors import HardwareFailure
from visualhfsm_makers._programs import Programs
from visualhfsm_makers._unitree._joints import unpack

_WEIGHT: Final = 29
"""The motor whose position is the weight."""
_FIRST: Final = 12
"""The first motor of the waist, which the arms follow; the legs come before it."""


class Arms:
    """Pass commands of arms and waist on to the guard of gains, by their weight."""

    def __init__(self, programs: Programs) -> None:
        self._programs = programs
        self.obey: Final = partial(programs.obey, "a command of rt/arm_sdk", self._follow)
        self._joints = [joint.name for joint in find_body("G1").joints][_FIRST:]
        self._least = {name: programs.gains.own[name] for name in programs.robot.body.groups.trunk}
        """The least gains of the waist, in which the trunk would fold with those of the maker's examples."""

    def _follow(self, data: bytes, client: str) -> Mapping[str, JointCommand]:
        """Let arms and waist follow a command by its weight; return what was limited."""
        _values, motors = unpack(data)
        _mode, weight, *_ = motors[_WEIGHT]
        if not math.isfinite(weight):
            raise HardwareFailure("its weight, the position of motor 29, is not a number")
        if weight <= 0.0:  # everybody may let go
            self._programs.gains.let_go(client)
            return {}
        commands, weights = {}, {}
        for name, motor in zip(self._joints, motors[_FIRST:_WEIGHT], strict=True):
            _mode, position, velocity, torque, kp, kd = motor
            least_kp, least_kd = self._least.get(name, (kp, kd))
            commands[name] = JointCommand(position, velocity, torque, max(kp, least_kp), max(kd, least_kd))
            weights[name] = min(weight, 1.0) if torque or kp or kd else 0.0
        return self._programs.gains.command(commands, client, weights)
