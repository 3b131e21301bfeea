"""Steer a component, its robot and the world of a simulation: the requests of a page as calls.

Arguments come from a page, and are checked against the interface's before the call.
"""

from __future__ import annotations

import asyncio
import math
from collections.abc import Mapping
from typing import Any, Final

import msgspec

from codegen.messages import Message
from codegen.reasons import reason
from interfaces.hfsm import Explanation, HfsmMonitorPrx
from interfaces.jderobot import InvalidValueException
from interfaces.nao import GroundTruthPrx, SafetyPrx, ScenePrx
from visualhfsm._base.errors import VisualHfsmError
from visualhfsm._monitor.realm.follower import Follower
from visualhfsm._monitor.realm.heard import heard_explanation
from visualhfsm._monitor.realm.realm import RELOAD_PATIENCE, refusals
from visualhfsm._monitor.realm.run_log import Intervention
from zenoh_ice import (
    Communicator,
    ConnectionLostException,
    MarshalException,
    ObjectPrx,
    TimeoutException,
    UnknownException,
    ZenohIceError,
    typed,
)
from zenoh_ice.application.emergency_stop import SAFETY
from zenoh_ice.interface import Operation
from zenoh_ice.text import printable

_SCENE: Final = "Scene"

OPERATIONS: Final[Mapping[str, Operation[..., Any]]] = {
    each.name: each
    for each in (
        HfsmMonitorPrx.pause,
        HfsmMonitorPrx.resume,
        HfsmMonitorPrx.step,
        HfsmMonitorPrx.setBreakpoints,
        HfsmMonitorPrx.forceTransition,
        HfsmMonitorPrx.setVariable,
        HfsmMonitorPrx.sendEvent,
        HfsmMonitorPrx.setSpeed,
        HfsmMonitorPrx.explain,
        HfsmMonitorPrx.reload,
        HfsmMonitorPrx.stop,
    )
}
"""Requests to a component: operations of its monitor, with their arguments."""


_INTERVENTIONS: Final = frozenset(
    each.name
    for each in (
        HfsmMonitorPrx.step,
        HfsmMonitorPrx.forceTransition,
        HfsmMonitorPrx.setVariable,
        HfsmMonitorPrx.reload,
    )
)
"""Requests that change what a component does; an event is seen in the transition that it causes."""

_UNANSWERED: Final = (ConnectionLostException, MarshalException, TimeoutException, UnknownException)
"""Errors of a call that may have been carried out."""


async def steer(follower: Follower, action: str, arguments: Mapping[str, Any]) -> object:
    """Execute a request to a component that is followed, and note in its log what changes the run.

    Returns its result, None for nothing. Raises VisualHfsmError.
    """
    log = follower.log  # that of this run: the component may be started again meanwhile
    since, _ = log.now()
    confirmed, refused = True, False
    try:
        return await control(follower.monitor, action, arguments)
    except VisualHfsmError as error:
        confirmed, refused = False, not isinstance(error.__cause__, _UNANSWERED)
        raise
    except asyncio.CancelledError:
        confirmed = False
        raise
    finally:
        if action in _INTERVENTIONS and not refused:
            _, time = log.now()
            done = {**arguments, "action": action, "since": since, "time": time, "confirmed": confirmed}
            follower.note(log, typed.convert(done, Intervention))


async def control(monitor: HfsmMonitorPrx, action: str, arguments: Mapping[str, Any]) -> object:
    """Execute a request; return its result, None for nothing. Raises VisualHfsmError."""
    operation = OPERATIONS.get(action)
    if operation is None:
        raise VisualHfsmError.because(
            "a component cannot be asked to {action}", action=printable(action)[:40]
        )
    if operation is HfsmMonitorPrx.reload:
        monitor = monitor.ice_invocationTimeout(RELOAD_PATIENCE)
    return await _request(monitor, operation, arguments, Message("the component"))


async def _request(
    proxy: ObjectPrx, operation: Operation[..., Any], arguments: Mapping[str, Any], whom: Message
) -> object:
    """Call an operation with arguments from the page. Raises VisualHfsmError."""
    codec = operation.arguments
    try:
        if unknown := arguments.keys() - set(codec.fields):
            raise msgspec.ValidationError(f"it takes no {printable(min(unknown))[:40]}")
        values = msgspec.structs.asdict(typed.convert(arguments, codec.struct))
        with refusals(whom):
            found = await asyncio.wrap_future(getattr(proxy, operation.method).begin(**values))
            return heard_explanation(found) if isinstance(found, Explanation) else found
    except msgspec.ValidationError as error:
        raise VisualHfsmError.because(
            "{whom} cannot be asked to {operation}: {reason}",
            whom=whom,
            operation=operation.name,
            reason=reason(error),
        ) from error
    except ZenohIceError as error:
        raise VisualHfsmError(reason(error)) from error


async def set_scene(communicator: Communicator, action: str, arguments: Mapping[str, Any]) -> object:
    """Move something in the world of a simulation, or push its robot. Raises VisualHfsmError."""
    if _SCENE not in communicator.identities():
        raise VisualHfsmError.because("there is no simulation: only its world can be changed")
    scene = ScenePrx.uncheckedCast(communicator.stringToProxy(_SCENE))
    return await _request(scene, getattr(ScenePrx, action), arguments, Message("the simulation"))


async def reset_robot(communicator: Communicator) -> None:
    """Let a robot accept commands again after its emergency stop. Raises ZenohIceError when it cannot."""
    safety = SafetyPrx.uncheckedCast(communicator.stringToProxy(SAFETY))
    await asyncio.wrap_future(safety.resetEmergencyStop.begin())


async def stand_robot(communicator: Communicator) -> None:
    """Put a simulated robot on its feet where it is. Raises VisualHfsmError where that is not possible."""
    scene = ScenePrx.uncheckedCast(communicator.stringToProxy(_SCENE))
    truth = GroundTruthPrx.uncheckedCast(communicator.stringToProxy("GroundTruth"))
    pose = (await asyncio.wrap_future(truth.getGroundTruth.begin())).torso
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
