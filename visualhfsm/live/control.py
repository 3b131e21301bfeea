"""Steer a component and stop the robot: what the page may ask for, checked, and done without blocking."""

from __future__ import annotations

import asyncio
import json
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Future
from typing import Annotated, Any, Final, TypeVar

import msgspec
from msgspec import Meta

from interfaces.hfsm import Breakpoint, HfsmMonitorPrx, InvalidValue, NoSuchElement, ReloadRefused
from interfaces.jderobot import MotorsPrx
from interfaces.nao import JointsPrx, PoseHeadPrx, SafetyPrx
from visualhfsm.errors import VisualHfsmError
from visualhfsm.monitoring.automata import printable
from visualhfsm.monitoring.realm import RELOAD_PATIENCE
from zenoh_ice import Communicator, ZenohIceError

__all__ = ["Action", "StopReport", "control", "decode_action", "reset_robot", "stop_robot"]

Id = Annotated[int, Meta(ge=0, le=2**31 - 1)]
Name = Annotated[str, Meta(max_length=1000)]

_LARGEST_VALUE: Final = 100_000
"""Characters of JSON."""
_STOP_LIMIT: Final = 1.0
"""Wall seconds in which the robot has to answer to being stopped."""
_REASON: Final = "STOP was pressed in the editor"

T = TypeVar("T")


class _Action(msgspec.Struct, frozen=True, tag_field="action", forbid_unknown_fields=True, rename="camel"):
    """What may be asked for."""


class Pause(_Action, frozen=True, tag="pause"):
    """Let running cycles end and start none."""


class Resume(_Action, frozen=True, tag="resume"):
    """Go on after a pause."""


class Step(_Action, frozen=True, tag="step"):
    """Run cycles of one automaton, or of all with 0, while paused."""

    automaton: Id = 0
    count: Annotated[int, Meta(ge=1, le=1000)] = 1


class SetBreakpoints(_Action, frozen=True, tag="setBreakpoints"):
    """Replace all breakpoints."""

    breakpoints: Annotated[list[Breakpoint], Meta(max_length=1000)]


class Force(_Action, frozen=True, tag="force"):
    """Fire a transition at the next cycle of its automaton, whatever its condition says."""

    automaton: Id
    transition: Id


class SetVariable(_Action, frozen=True, tag="set"):
    """Set a variable of an automaton, or with 0 a parameter of the component."""

    automaton: Id
    name: Name
    value: Any


class Send(_Action, frozen=True, tag="send"):
    """Send an event."""

    name: Name
    data: Any = None


class Explain(_Action, frozen=True, tag="explain"):
    """Say of each transition out of the current state why it has not fired."""

    automaton: Id


class Reload(_Action, frozen=True, tag="reload"):
    """Load the component's file again and go on in it."""


class Stop(_Action, frozen=True, tag="stop"):
    """End the component; it stops the robot first."""


Action = Pause | Resume | Step | SetBreakpoints | Force | SetVariable | Send | Explain | Reload | Stop


def decode_action(action: str, arguments: Mapping[str, Any]) -> Action:
    """Return an action by its name with its arguments; raises VisualHfsmError when there is no such thing."""
    try:
        found: Action = msgspec.convert({**arguments, "action": action}, Action)
    except msgspec.ValidationError as error:
        reason = f"the component cannot be asked to {printable(action)[:40]}: {error}"
        raise VisualHfsmError(reason) from error
    return found


async def control(monitor: HfsmMonitorPrx, action: Action) -> object:
    """Do what is asked for; return what it gives, None for nothing. Raises VisualHfsmError."""
    try:
        return await _do(monitor, action)
    except (NoSuchElement, InvalidValue) as error:
        raise VisualHfsmError(printable(error.what)) from error
    except ReloadRefused as error:
        raise VisualHfsmError(
            f"not reloaded, the component runs on as it was: {printable(error.reason)}"
        ) from error
    except ZenohIceError as error:
        raise VisualHfsmError(str(error)) from error


async def _do(monitor: HfsmMonitorPrx, action: Action) -> object:
    match action:
        case Pause():
            await _answer(monitor.pauseAsync())
        case Resume():
            await _answer(monitor.resumeAsync())
        case Step(automaton=automaton, count=count):
            for _ in range(count):
                await _answer(monitor.stepAsync(automaton))
        case SetBreakpoints(breakpoints=breakpoints):
            await _answer(monitor.setBreakpointsAsync(breakpoints))
        case Force(automaton=automaton, transition=transition):
            await _answer(monitor.forceTransitionAsync(automaton, transition))
        case SetVariable(automaton=automaton, name=name, value=value):
            await _answer(monitor.setVariableAsync(automaton, name, _json(value)))
        case Send(name=name, data=data):
            await _answer(monitor.sendEventAsync(name, "" if data is None else _json(data)))
        case Explain(automaton=automaton):
            return await _answer(monitor.explainAsync(automaton))
        case Reload():
            return await _answer(monitor.ice_invocationTimeout(RELOAD_PATIENCE).reloadAsync())
        case Stop():
            await _answer(monitor.stopAsync())
    return None


async def _answer(call: Future[T]) -> T:
    return await asyncio.wrap_future(call)


def _json(value: object) -> str:
    text = json.dumps(value)
    if len(text) > _LARGEST_VALUE:
        raise VisualHfsmError(f"the value is larger than {_LARGEST_VALUE} characters of JSON")
    return text


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
    # That the emergency stop is latched is published as long as it is, by `RobotMonitor.stop_reason`.
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
    return [JointsPrx.uncheckedCast(communicator.stringToProxy("Body")).stopAsync()]


def _stop_walk(communicator: Communicator) -> Sequence[Future[Any]]:
    return [MotorsPrx.uncheckedCast(communicator.stringToProxy("Motors")).stopAsync()]


_STOPS: Final[Mapping[str, Callable[[Communicator], Any]]] = {
    "Safety": _stop_all,
    "Head": _stop_head,
    "Body": _stop_body,
    "Motors": _stop_walk,
}
