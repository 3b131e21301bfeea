"""Steer a component and stop the robot: what the page may ask for, checked, and done without blocking."""

from __future__ import annotations

import asyncio
import inspect
import json
from collections.abc import Awaitable, Callable, Mapping
from concurrent.futures import Future
from typing import Annotated, Any, Final, get_type_hints

import msgspec
from msgspec import Meta

from interfaces.hfsm import (
    Breakpoint,
    Explanation,
    HfsmMonitorPrx,
    InvalidValue,
    NoSuchElement,
    ReloadRefused,
    ReloadReport,
)
from interfaces.jderobot import MotorsPrx
from interfaces.nao import JointsPrx, PoseHeadPrx, SafetyPrx
from visualhfsm.errors import VisualHfsmError
from visualhfsm.monitoring.realm import RELOAD_PATIENCE
from zenoh_ice import Communicator, ObjectPrx, ZenohIceError
from zenoh_ice.text import printable

__all__ = ["ACTIONS", "StopReport", "control", "reset_robot", "stop_robot"]

Id = Annotated[int, Meta(ge=0, le=2**31 - 1)]
Name = Annotated[str, Meta(max_length=1000)]
Count = Annotated[int, Meta(ge=1, le=1000)]

_LARGEST_VALUE: Final = 100_000
"""Characters of JSON."""
_STOP_LIMIT: Final = 1.0
"""Wall seconds in which the robot has to answer to being stopped."""
_REASON: Final = "STOP was pressed in the editor"


class _Steering:
    """What the page may do to a component: each method is an action, its parameters are the arguments."""

    def __init__(self, monitor: HfsmMonitorPrx) -> None:
        self._monitor = monitor

    async def pause(self) -> None:
        """Let running cycles end and start none."""
        await asyncio.wrap_future(self._monitor.pauseAsync())

    async def resume(self) -> None:
        """Go on after a pause."""
        await asyncio.wrap_future(self._monitor.resumeAsync())

    async def step(self, automaton: Id = 0, count: Count = 1) -> None:
        """Run cycles of one automaton, or of all with 0, while paused."""
        for _ in range(count):
            await asyncio.wrap_future(self._monitor.stepAsync(automaton))

    async def setBreakpoints(self, breakpoints: Annotated[list[Breakpoint], Meta(max_length=1000)]) -> None:
        """Replace all breakpoints."""
        await asyncio.wrap_future(self._monitor.setBreakpointsAsync(breakpoints))

    async def force(self, automaton: Id, transition: Id) -> None:
        """Fire a transition at the next cycle of its automaton, whatever its condition says."""
        await asyncio.wrap_future(self._monitor.forceTransitionAsync(automaton, transition))

    async def set(self, automaton: Id, name: Name, value: Any) -> None:  # noqa: ANN401 - JSON
        """Set a variable of an automaton, or with 0 a parameter of the component."""
        await asyncio.wrap_future(self._monitor.setVariableAsync(automaton, name, _json(value)))

    async def send(self, name: Name, data: Any = None) -> None:  # noqa: ANN401 - JSON
        """Send an event."""
        await asyncio.wrap_future(self._monitor.sendEventAsync(name, "" if data is None else _json(data)))

    async def explain(self, automaton: Id) -> Explanation:
        """Say of each transition out of the current state why it has not fired."""
        return await asyncio.wrap_future(self._monitor.explainAsync(automaton))

    async def reload(self) -> ReloadReport:
        """Load the component's file again and go on in it."""
        return await asyncio.wrap_future(self._monitor.ice_invocationTimeout(RELOAD_PATIENCE).reloadAsync())

    async def stop(self) -> None:
        """End the component; it stops the robot first."""
        await asyncio.wrap_future(self._monitor.stopAsync())


def _arguments_of(method: Callable[..., object]) -> type[msgspec.Struct]:
    hints = get_type_hints(method, include_extras=True)
    fields = [
        (name, hints[name]) if one.default is one.empty else (name, hints[name], one.default)
        for name, one in list(inspect.signature(method).parameters.items())[1:]
    ]
    return msgspec.defstruct(method.__name__, fields, forbid_unknown_fields=True)


ACTIONS: Final[Mapping[str, type[msgspec.Struct]]] = {
    name: _arguments_of(method) for name, method in vars(_Steering).items() if not name.startswith("_")
}
"""What a component can be asked to do, with the arguments."""


async def control(monitor: HfsmMonitorPrx, action: str, arguments: Mapping[str, Any]) -> object:
    """Do what is asked for; return what it gives, None for nothing. Raises VisualHfsmError."""
    try:
        if action not in ACTIONS:
            raise VisualHfsmError(f"a component cannot be asked to {printable(action)[:40]}")
        found = msgspec.convert(arguments, ACTIONS[action])
        method: Callable[..., Awaitable[object]] = getattr(_Steering(monitor), action)
        return await method(**msgspec.structs.asdict(found))
    except msgspec.ValidationError as error:
        raise VisualHfsmError(f"the component cannot be asked to {action}: {error}") from error
    except (NoSuchElement, InvalidValue) as error:
        raise VisualHfsmError(printable(error.what)) from error
    except ReloadRefused as error:
        raise VisualHfsmError(
            f"not reloaded, the component runs on as it was: {printable(error.reason)}"
        ) from error
    except ZenohIceError as error:
        raise VisualHfsmError(str(error)) from error


def _json(value: object) -> str:
    text = json.dumps(value)
    if len(text) > _LARGEST_VALUE:
        raise VisualHfsmError(f"the value is larger than {_LARGEST_VALUE} characters of JSON")
    return text


class StopReport(msgspec.Struct, frozen=True, rename="camel"):
    """What became of stopping the robot: the servants that have stopped, and why the others have not."""

    stopped: list[str]
    failed: dict[str, str]


_STOPS: Final[Mapping[str, Callable[[ObjectPrx], Future[Any]]]] = {
    "Safety": lambda proxy: SafetyPrx.uncheckedCast(proxy).emergencyStopAsync(_REASON),
    "Head": lambda proxy: PoseHeadPrx.uncheckedCast(proxy).stopAsync(),
    "Body": lambda proxy: JointsPrx.uncheckedCast(proxy).stopAsync(),
    "Motors": lambda proxy: MotorsPrx.uncheckedCast(proxy).stopAsync(),
}


async def stop_robot(communicator: Communicator) -> StopReport:
    """Stop a robot within a second: by its emergency stop, the head, the joints and the walk, all at once.

    What is not there is left out. A robot with an emergency stop takes no command until `reset_robot`.
    """
    calls: dict[str, asyncio.Future[Any]] = {}
    failed: dict[str, str] = {}
    for identity in sorted(set(communicator.identities()) & _STOPS.keys()):
        try:
            calls[identity] = asyncio.wrap_future(_STOPS[identity](communicator.stringToProxy(identity)))
        except ZenohIceError as error:
            failed[identity] = str(error)
    if calls:
        await asyncio.wait(calls.values(), timeout=_STOP_LIMIT)
    for identity, answer in calls.items():
        if not answer.done():
            answer.cancel()
            failed[identity] = f"it did not say within {_STOP_LIMIT:g} s that it has stopped"
        elif (failure := answer.exception()) is not None:
            failed[identity] = str(failure)
    # That the emergency stop is latched is published as long as it is, by `RobotMonitor.stop_reason`.
    return StopReport([name for name in calls if name not in failed and name != "Safety"], failed)


async def reset_robot(communicator: Communicator) -> None:
    """Let a robot take commands again after its emergency stop. Raises ZenohIceError when it cannot."""
    safety = SafetyPrx.uncheckedCast(communicator.stringToProxy("Safety"))
    await asyncio.wrap_future(safety.resetEmergencyStopAsync())
