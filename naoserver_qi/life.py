"""The services by which programs look after the robot itself: its life, its battery, its system."""

from __future__ import annotations

from typing import Final

from naoserver.capabilities import Senses
from naoserver.errors import HardwareFailure
from naoserver_qi.arguments import chosen
from naoserver_qi.calls import VERSION
from naoserver_qi.memory import ALMemory

_STATES: Final = ("disabled", "solitary", "interactive", "safeguard")


class ALAutonomousLife:
    """Remember the state of a life that the robot does not have: nothing moves by itself in any state."""

    def __init__(self, memory: ALMemory) -> None:
        self._memory = memory
        self._state = _STATES[0]

    def getState(self) -> str:
        """Return the state, at first `disabled`."""
        return self._state

    def setState(self, state: object) -> None:
        """Take a state."""
        self._state = chosen(state, "state", _STATES)
        self._memory.raiseEvent("AutonomousLife/State", self._state)


class ALBattery:
    """Report the charge of the battery."""

    def __init__(self, senses: Senses | None) -> None:
        self._senses = senses

    def getBatteryCharge(self) -> int:
        """Return the charge in percent."""
        if self._senses is None:
            raise HardwareFailure("this robot has no battery")
        return round(100 * self._senses.read().battery.charge)


class ALSystem:
    """Describe the robot."""

    def __init__(self, name: str) -> None:
        self._name = name

    def robotName(self) -> str:
        """Return the name of the robot."""
        return self._name

    def systemVersion(self) -> str:
        """Return the version of NAOqi."""
        return VERSION
