"""Steer a component: what the page may ask for, checked, and done without blocking anybody."""

from __future__ import annotations

import asyncio
import json
from collections.abc import Mapping
from concurrent.futures import Future
from typing import Annotated, Any, Final, TypeVar

import msgspec
from msgspec import Meta

from interfaces.hfsm import Breakpoint, HfsmMonitorPrx, InvalidValue, NoSuchElement, ReloadRefused
from visualhfsm.errors import VisualHfsmError
from visualhfsm.steer.reloading import RELOAD_PATIENCE
from visualhfsm.watch.automata import printable
from zenoh_ice import ZenohIceError

__all__ = ["Action", "control", "decode_action"]

Id = Annotated[int, Meta(ge=0, le=2**31 - 1)]
Name = Annotated[str, Meta(max_length=1000)]

_LARGEST_VALUE: Final = 100_000
"""Characters of JSON."""

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
