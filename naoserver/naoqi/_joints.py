"""The joints: conversion of commands of positions, velocities and stiffnesses to calls of ALMotion."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

from naoserver.hardware.background import BackgroundCalls, CoalescingQueue
from naoserver.hardware.connection import CallConnection
from naoserver.hardware.link import CallLink, Reply
from naoserver.hardware.reporter import Reporter
from naoserver.naoqi._state import NaoqiState

_SLOWEST_FRACTION: Final = 0.002
"""Smallest fraction of a joint's full speed in a call."""
_FEW: Final = 4
"""Number of different speeds sent unchanged; more are rounded, because each needs its own call."""
_STEP: Final = math.log(1.1)
_HOLD_FRACTION: Final = 0.1


@dataclass(frozen=True, slots=True)
class Order:
    """Command for a joint: go to a target at a fraction of its full speed; without a target, stay."""

    target: float | None = None
    fraction: float = 0.0


class NaoqiJoints:
    """Command the joints of a robot, as in `JointDevice`; a lost robot gets no commands."""

    def __init__(
        self, connection: CallConnection, state: NaoqiState, calls: BackgroundCalls, reporter: Reporter
    ) -> None:
        self._state = state
        self._joints = {joint.name: joint for joint in state.facts.joints}
        self._calls = calls
        self.orders: Final[CoalescingQueue[Order]] = CoalescingQueue(
            "joints", connection, reporter, self._send_orders, lambda order: order.target is None
        )
        self._stiffnesses: CoalescingQueue[tuple[float, float]] = CoalescingQueue(
            "stiffness", connection, reporter, self._send_stiffnesses, lambda _change: False
        )

    def close(self) -> None:
        """Send the waiting commands, and end the threads."""
        self.orders.close()
        self._stiffnesses.close()

    def forget(self) -> None:
        """Drop all commands not yet sent: the robot is lost."""
        self.orders.forget()
        self._stiffnesses.forget()

    def command_positions(self, targets: Mapping[str, float], max_speeds: Mapping[str, float]) -> None:
        self._send({joint: (target, max_speeds[joint]) for joint, target in targets.items()})

    def command_velocities(self, velocities: Mapping[str, float]) -> None:
        held = [joint for joint, velocity in velocities.items() if velocity == 0.0]
        if held:
            self._state.hold(held)
            self.orders.post(dict.fromkeys(held, Order()))
        ways = {}
        for joint, velocity in velocities.items():
            if velocity != 0.0:
                facts = self._joints[joint]
                ways[joint] = (facts.upper if velocity > 0.0 else facts.lower, abs(velocity))
        self._send(ways)

    def command_stiffnesses(self, stiffnesses: Mapping[str, float], seconds: float) -> None:
        self._stiffnesses.post({joint: (value, seconds) for joint, value in stiffnesses.items()})

    def _send(self, ways: Mapping[str, tuple[float, float]]) -> None:
        orders = {}
        for joint in self._state.send(ways):
            target, speed = ways[joint]
            orders[joint] = Order(target, speed / self._joints[joint].max_velocity)
        if orders:
            self.orders.post(orders)

    def _send_orders(self, link: CallLink, orders: Mapping[str, Order]) -> list[Reply]:
        return [link.begin(method, *arguments) for method, *arguments in calls_of(orders)]

    def _send_stiffnesses(self, link: CallLink, wanted: Mapping[str, tuple[float, float]]) -> list[Reply]:
        at_once = {joint: value for joint, (value, seconds) in wanted.items() if seconds <= 0.0}
        slowly = {joint: change for joint, change in wanted.items() if change[1] > 0.0}
        if slowly:  # it answers when the last motor has arrived: the next change does not wait for that
            columns = ([[part] for part in column] for column in zip(*slowly.values(), strict=True))
            self._calls.run("ALMotion.stiffnessInterpolation", list(slowly), *columns)
        if not at_once:
            return []
        return [link.begin("ALMotion.setStiffnesses", list(at_once), list(at_once.values()))]


def calls_of(orders: Mapping[str, Order]) -> list[tuple[str, list[str], list[float], float]]:
    """Return the calls that carry out orders: method, joints, values and the fraction of full speed.

    setAngles takes one fraction for all its joints, so there is a call for each fraction. If there are many,
    they are rounded down, by less than a tenth.
    """
    held = [joint for joint, order in orders.items() if order.target is None]
    targets = {joint: order.target for joint, order in orders.items() if order.target is not None}
    fractions = {joint: min(1.0, max(_SLOWEST_FRACTION, orders[joint].fraction)) for joint in targets}
    if len(set(fractions.values())) > _FEW:
        fractions = {joint: _rounded(fraction) for joint, fraction in fractions.items()}
    groups: dict[float, list[str]] = {}
    for joint, fraction in fractions.items():
        groups.setdefault(fraction, []).append(joint)
    calls = [
        ("ALMotion.setAngles", joints, [targets[joint] for joint in joints], fraction)
        for fraction, joints in groups.items()
    ]
    if held:
        # Relative to their present setpoints, which only the robot knows at this moment.
        calls.append(("ALMotion.changeAngles", held, [0.0] * len(held), _HOLD_FRACTION))
    return calls


def _rounded(fraction: float) -> float:
    return max(_SLOWEST_FRACTION, math.exp(math.floor(math.log(fraction) / _STEP + 1e-9) * _STEP))
