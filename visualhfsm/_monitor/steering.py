"""Steer a component, its robot and the world of a simulation: the requests of a page as calls.

Arguments come from a page, and are checked against the interface's before the call.
"""

from __future__ import annotations

import asyncio
import math
from collections.abc import Mapping
from typing import Any, Final

from codegen.messages import Message
from interfaces.hfsm import Explanation, HfsmMonitorPrx, ReloadReport
from interfaces.jderobot import InvalidValueException
from interfaces.nao import FaultsPrx, GroundTruthPrx, SafetyPrx, ScenePrx
from visualhfsm._base.errors import VisualHfsmError
from visualhfsm._base.recognition import recognized
from visualhfsm._monitor.realm.explanations import translate_explanation
from visualhfsm._monitor.realm.faults import FAULTS
from visualhfsm._monitor.realm.realm import RELOAD_PATIENCE, refusals
from zenoh_ice import (
    Communicator,
    ZenohIceError,
)
from zenoh_ice.application.emergency_stop import SAFETY
from zenoh_ice.data.text import printable

_SCENE: Final = "Scene"


async def operate(monitor: HfsmMonitorPrx, action: str, arguments: Mapping[str, Any]) -> object:
    """Call an operation of a monitor; return its result, None for nothing. Raises VisualHfsmError."""
    if action == "reload":
        monitor = monitor.ice_invocationTimeout(RELOAD_PATIENCE)
    found = await _call(getattr(monitor, action), arguments, Message("the component"))
    if isinstance(found, ReloadReport):
        found.notKept = [recognized(printable(each)) for each in found.notKept]
    return translate_explanation(found) if isinstance(found, Explanation) else found


async def _call(operation: Any, arguments: Mapping[str, Any], whom: Message) -> Any:  # noqa: ANN401
    """Call an operation of a proxy. Raises VisualHfsmError."""
    try:
        with refusals(whom):
            return await asyncio.wrap_future(operation.begin(**arguments))
    except ZenohIceError as error:
        raise VisualHfsmError(recognized(str(error))) from error


async def set_scene(communicator: Communicator, action: str, arguments: Mapping[str, Any]) -> object:
    """Move something in the world of a simulation, or push its robot. Raises VisualHfsmError."""
    if _SCENE not in communicator.identities():
        raise VisualHfsmError.because("there is no simulation: only its world can be changed")
    scene = ScenePrx.uncheckedCast(communicator.stringToProxy(_SCENE))
    return await _call(getattr(scene, action), arguments, Message("the simulation"))


async def set_faults(communicator: Communicator, action: str, arguments: Mapping[str, Any]) -> None:
    """Let a part of a robot that is not real fail, or heal it. Raises VisualHfsmError."""
    if FAULTS not in communicator.identities():
        raise VisualHfsmError.because("there is no robot here whose parts can be made to fail")
    faults = FaultsPrx.uncheckedCast(communicator.stringToProxy(FAULTS))
    await _call(getattr(faults, action), arguments, Message("the robot"))


async def reset_robot(communicator: Communicator) -> None:
    """Let a robot accept commands again after its emergency stop. Raises VisualHfsmError when it cannot."""
    safety = SafetyPrx.uncheckedCast(communicator.stringToProxy(SAFETY))
    await _call(safety.resetEmergencyStop, {}, Message("the robot"))


async def stand_robot(communicator: Communicator) -> None:
    """Put a simulated robot on its feet where it is. Raises VisualHfsmError where that is not possible."""
    scene = ScenePrx.uncheckedCast(communicator.stringToProxy(_SCENE))
    truth = GroundTruthPrx.uncheckedCast(communicator.stringToProxy("GroundTruth"))
    pose = (await _call(truth.getGroundTruth, {}, Message("the simulation"))).torso
    turn = pose.orientation
    # The angle about the vertical, https://en.wikipedia.org/wiki/Conversion_between_quaternions_and_Euler_angles
    heading = math.atan2(
        2.0 * (turn.w * turn.z + turn.x * turn.y), 1.0 - 2.0 * (turn.y * turn.y + turn.z * turn.z)
    )
    try:
        await asyncio.wrap_future(scene.placeRobot.begin(pose.position.x, pose.position.y, heading))
    except InvalidValueException as error:
        raise VisualHfsmError.because(
            "the robot cannot stand here: {reason}", reason=printable(error.what)
        ) from error
    except ZenohIceError as error:
        raise VisualHfsmError(recognized(str(error))) from error
