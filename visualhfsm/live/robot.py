"""What the robot's servers tell of it, and its red stop button."""

from __future__ import annotations

import asyncio
import math
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Future
from typing import Any, Final

import msgspec

from interfaces.jderobot import CameraPrx, MotorsPrx
from interfaces.nao import HealthPrx, JointLimits, JointsPrx, PoseHeadPrx, SafetyPrx
from visualhfsm.watch.automata import printable
from visualhfsm.watch.fact import Fact
from visualhfsm.watch.scene import STALE, STALE_HEALTH
from visualhfsm.watch.streams import Newest
from zenoh_ice import Communicator, ZenohIceError
from zenoh_ice.transport import Target

from .values import RobotState

__all__ = ["RobotFacts", "RobotWatch", "StopReport", "has_interface", "reset_robot", "stop_robot"]

_STOP_LIMIT: Final = 1.0
"""Wall seconds in which the robot has to answer to being stopped."""
_REASON: Final = "STOP was pressed in the editor"
_LONGEST_REASON: Final = 200
_BODY: Final = "Body"


class RobotFacts(msgspec.Struct, frozen=True, rename="camel"):
    """What does not change: the cameras' names, and the limits of the joints once they are known."""

    cameras: list[str]
    limits: list[JointLimits]


class RobotWatch:
    """Listen to the robot of a realm; nothing of it needs to be there. `update` it a few times a second."""

    def __init__(self, communicator: Communicator) -> None:
        self._communicator = communicator
        proxy = communicator.stringToProxy
        self._head = PoseHeadPrx.uncheckedCast(proxy("Head"))
        self._body = JointsPrx.uncheckedCast(proxy(_BODY))
        self._health = HealthPrx.uncheckedCast(proxy("Health"))
        self._pose = Newest(self._head.getPose.latest, STALE)
        self._joints = Newest(self._body.getJointState.latest, STALE)
        self._condition = Newest(self._health.getHealth.latest, STALE_HEALTH)
        self._safety = Newest(SafetyPrx.uncheckedCast(proxy("Safety")).getSafetyState.latest, STALE_HEALTH)
        self._names = Fact(self._body.getJointNamesAsync)
        self._limits = Fact(self._body.getJointLimitsAsync)

    def update(self) -> None:
        """Ask for what is missing; without a robot nothing is asked."""
        if _BODY in self._communicator.identities():
            self._names.poll()
            self._limits.poll()
        elif self._names.value is not None:
            self._names.forget()  # another robot may come
            self._limits.forget()

    def facts(self) -> RobotFacts:
        """Return what does not change."""
        return RobotFacts(self.cameras(), list(self._limits.value or ()))

    def cameras(self) -> list[str]:
        """Return the identities of the cameras that are there."""
        return [
            identity
            for identity in self._communicator.identities()
            if has_interface(self._communicator, identity, CameraPrx.ice_interface.type_id)
        ]

    def joints(self) -> dict[str, float]:
        """Return the angles of the joints in rad by name; none when they are unknown or too old."""
        body, names = self._joints(), self._names.value
        if body is None or names is None:
            return {}
        pairs = zip(names, body.value.positions, strict=False)
        return {name: angle for name, angle in pairs if math.isfinite(angle)}

    def tilt(self) -> float | None:
        """Return the angle between the torso's z axis and the vertical in rad; None when it is unknown."""
        health = self._condition()
        tilt = math.nan if health is None else health.value.torsoTilt
        return tilt if math.isfinite(tilt) else None

    def stop_reason(self) -> str:
        """Return why the robot's emergency stop is latched; empty while it is not, as far as is known."""
        safety = self._safety()
        if safety is None or not safety.value.stopped:
            return ""
        return printable(safety.value.reason)[:_LONGEST_REASON] or "emergency stop"

    def read(self) -> RobotState:
        """Return what is known now, without waiting."""
        head, health = self._pose(), self._condition()
        return RobotState(
            joints=self.joints(),
            pan=head.value.pan if head else None,
            tilt=head.value.tilt if head else None,
            health=health.value if health else None,
            trouble=self._trouble(),
        )

    def _trouble(self) -> str:
        """Return why the joints of a robot that is there are not known, such as an interface that differs."""
        if _BODY not in self._communicator.identities():
            return ""
        return printable(self._joints.trouble or self._names.trouble)[:_LONGEST_REASON]


def has_interface(communicator: Communicator, identity: str, type_id: str) -> bool:
    """Return whether a servant that is there has an interface."""
    return type_id in communicator.presence.interfaces(Target(communicator.realm, identity))


class StopReport(msgspec.Struct, frozen=True, rename="camel"):
    """What became of stopping the robot: the servants that have stopped, and why the others have not."""

    stopped: list[str]
    failed: dict[str, str]


async def stop_robot(communicator: Communicator) -> StopReport:
    """Stop a robot within a second: by its emergency stop, the head, the joints and the walk, all at once.

    What is not there is left out. A robot with an emergency stop takes no command until `reset_robot`.
    """
    present = set(communicator.identities())
    calls: dict[str, list[Future[Any]]] = {}
    failed: dict[str, str] = {}
    for identity in sorted(present & _STOPS.keys()):
        try:
            calls[identity] = _STOPS[identity](communicator)
        except ZenohIceError as error:
            failed[identity] = str(error)
    waiting = {name: asyncio.gather(*map(asyncio.wrap_future, each)) for name, each in calls.items()}
    if waiting:
        await asyncio.wait(waiting.values(), timeout=_STOP_LIMIT)
    for name, answer in waiting.items():
        if not answer.done():
            answer.cancel()
            failed[name] = f"it did not say within {_STOP_LIMIT:g} s that it has stopped"
        elif (failure := answer.exception()) is not None:
            failed[name] = str(failure)
    # That the emergency stop is latched is told as long as it is, by `RobotWatch.stop_reason`.
    return StopReport([name for name in calls if name not in failed and name != "Safety"], failed)


async def reset_robot(communicator: Communicator) -> None:
    """Let a robot take commands again after its emergency stop. Raises ZenohIceError when it cannot."""
    safety = SafetyPrx.uncheckedCast(communicator.stringToProxy("Safety"))
    await asyncio.wrap_future(safety.resetEmergencyStopAsync())


def _stop_all(communicator: Communicator) -> Sequence[Future[Any]]:
    return [SafetyPrx.uncheckedCast(communicator.stringToProxy("Safety")).emergencyStopAsync(_REASON)]


def _stop_head(communicator: Communicator) -> Sequence[Future[Any]]:
    return [PoseHeadPrx.uncheckedCast(communicator.stringToProxy("Head")).stopAsync()]


def _stop_body(communicator: Communicator) -> Sequence[Future[Any]]:
    return [JointsPrx.uncheckedCast(communicator.stringToProxy(_BODY)).stopAsync()]


def _stop_walk(communicator: Communicator) -> Sequence[Future[Any]]:
    return [MotorsPrx.uncheckedCast(communicator.stringToProxy("Motors")).stopAsync()]


_STOPS: Final[Mapping[str, Callable[[Communicator], Any]]] = {
    "Safety": _stop_all,
    "Head": _stop_head,
    _BODY: _stop_body,
    "Motors": _stop_walk,
}
