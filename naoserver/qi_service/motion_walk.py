"""The operations of ALMotion that let the robot walk, and tell where it is."""

from __future__ import annotations

from dataclasses import astuple
from typing import Final

from naoserver.capabilities import WalkVelocity
from naoserver.errors import InvalidCommand
from naoserver.qi_service.calls import Call, long_call
from naoserver.qi_service.values import listed, number, text
from naoserver.qi_service.walking import Walking

__all__ = ["WalkOperations"]

_MOVE_CONFIG: Final = {
    "MaxStepX": (0.001, 0.04, 0.08),
    "MaxStepY": (0.101, 0.14, 0.16),
    "MaxStepTheta": (0.001, 0.349, 0.524),
    "MaxStepFrequency": (0.0, 1.0, 1.0),
    "StepHeight": (0.005, 0.02, 0.04),
    "TorsoWx": (-0.122, 0.0, 0.122),
    "TorsoWy": (-0.122, 0.0, 0.122),
}
"""Least, usual and greatest value of each parameter of NAOqi's own gait, of which this robot takes none."""


class WalkOperations:
    """Walk. Parameters of the gait are checked and have no effect: the robot has a gait of its own."""

    def __init__(self, walking: Walking) -> None:
        self._walking = walking

    def move(self, x: object, y: object, theta: object, moveConfig: object = ()) -> None:
        """Walk at a velocity in m/s and rad/s until further notice; returns at once."""
        _check_config(moveConfig)
        self._walking.go(WalkVelocity(number(x, "x"), number(y, "y"), number(theta, "theta")))

    def moveToward(self, x: object, y: object, theta: object, moveConfig: object = ()) -> None:
        """Walk at shares, from -1 to 1, of the highest velocities until further notice; returns at once."""
        _check_config(moveConfig)
        highest = self._walking.guard.limits
        self._walking.go(
            WalkVelocity(
                _share(x, "x") * highest.forward,
                _share(y, "y") * highest.left,
                _share(theta, "theta") * highest.turn,
            )
        )

    def setWalkTargetVelocity(
        self, x: object, y: object, theta: object, frequency: object, moveConfig: object = ()
    ) -> None:
        """Walk as moveToward does, as it was called before."""
        _share(frequency, "frequency")
        self.moveToward(x, y, theta, moveConfig)

    @long_call
    def moveTo(self, call: Call, *goal: object) -> bool:
        """Walk to x, y and theta in m and rad as the robot stands; returns at the end whether it came there.

        Instead of three numbers it takes a list of such places, one after the other.
        """
        if goal and isinstance(goal[0], (list, tuple)):
            places, rest = listed(goal[0], "controlPoints"), goal[1:]
        else:
            places, rest = [list(goal[:3])], goal[3:]
        if len(rest) > 1:
            raise InvalidCommand("goal", f"moveTo takes a goal and a configuration, not {len(rest)} more")
        for config in rest:
            if not isinstance(config, (int, float)):  # of old, the seconds that it should take
                _check_config(config)
        ways = [_place(place) for place in places]
        start = self._walking.guard.read()
        return all(self._walking.go_to(call, *way, start) for way in ways)

    def moveInit(self) -> None:
        """Do nothing, since the walk begins from any stance; raises when there is none."""
        _ = self._walking.guard

    def moveIsActive(self) -> bool:
        """Return whether it walks, or comes to stand."""
        return self._walking.moving

    @long_call
    def waitUntilMoveIsFinished(self, call: Call) -> None:
        """Return when it stands."""
        while self._walking.moving and not call.wait(0.05):
            pass

    def stopMove(self) -> None:
        """End the walk on both feet."""
        self._walking.stop()

    def killMove(self) -> None:
        """End the walk on both feet, as stopMove does."""
        self._walking.stop()

    def getMoveConfig(self, config: object) -> list[list[object]]:
        """Return the parameters of NAOqi's gait: `Min`, `Default` or `Max`."""
        names = ("Min", "Default", "Max")
        which = text(config, "config")
        if which not in names:
            raise InvalidCommand("config", f"there is no configuration {which[:60]!r}; there are {names}")
        return [[name, values[names.index(which)]] for name, values in _MOVE_CONFIG.items()]

    def getRobotPosition(self, useSensors: object) -> list[float]:  # noqa: ARG002 - it is always measured
        """Return where the robot believes to be, x and y in m and the heading in rad."""
        odometry = self._walking.guard.read()
        return [odometry.x, odometry.y, odometry.heading]

    def getNextRobotPosition(self) -> list[float]:
        """Return where the robot believes to be, since it looks no step ahead."""
        return self.getRobotPosition(True)

    def getRobotVelocity(self) -> list[float]:
        """Return the velocity at which it is to walk, in m/s and rad/s."""
        return list(astuple(self._walking.guard.commanded()))


def _share(value: object, what: str) -> float:
    share = number(value, what)
    if not -1.0 <= share <= 1.0:
        raise InvalidCommand(what, f"{what} is {share:g}: it must be from -1 to 1")
    return share


def _place(value: object) -> tuple[float, float, float]:
    parts = listed(value, "a place")
    if len(parts) != 3:
        raise InvalidCommand("place", f"a place has {len(parts)} entries, not 3: x, y and theta")
    return number(parts[0], "x"), number(parts[1], "y"), number(parts[2], "theta")


def _check_config(config: object) -> None:
    """Raise InvalidCommand unless it is a list of names, such as MaxStepX, and numbers."""
    for entry in listed(config, "moveConfig"):
        pair = listed(entry, "an entry of moveConfig")
        if len(pair) != 2:
            raise InvalidCommand("moveConfig", "an entry of moveConfig is a name and a number")
        name = text(pair[0], "a name in moveConfig").removeprefix("Left").removeprefix("Right")
        if name not in _MOVE_CONFIG and name != "Frequency":
            known = ", ".join(_MOVE_CONFIG)
            message = f"there is no parameter {name[:60]!r} of the walk; there are {known}"
            raise InvalidCommand("moveConfig", message)
        number(pair[1], name)
