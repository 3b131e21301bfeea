"""Do to the component of a replay what somebody did to it while it was recorded."""

from __future__ import annotations

from contextlib import suppress
from typing import Any

import msgspec

from hfsm_recording.messages import Action

from ..component import parameters_of
from ..errors import ComponentError
from ..events import make_event
from ..tree import Run
from ..variables import assign
from .host import Host

__all__ = ["act"]


def act(host: Host, action: Action, now: int) -> None:
    """Do what an action says at a component time in ns; one that was refused is refused again."""
    arguments = action.arguments
    with suppress(ComponentError, ValueError):
        match action.kind:
            case "pause":
                host.tree.held = True
            case "resume":
                host.tree.held = False
            case "force":
                _force(_run(host, arguments), arguments.get("transition"))
            case "set":
                _set(host, arguments)
            case "send":
                host.tree.send(make_event(str(arguments.get("name")), _value(arguments)), now)


def _force(run: Run | None, transition: object) -> None:
    if run is not None:
        for each in run.automaton.outgoing(run.current):
            if each.id == transition:
                run.forced = each


def _set(host: Host, arguments: dict[str, Any]) -> None:
    name, run = str(arguments.get("name")), _run(host, arguments)
    if run is not None:
        assign(run.automaton, name, _value(arguments))
    elif name in parameters_of(host.component):
        setattr(host.component, name, _value(arguments))


def _run(host: Host, arguments: dict[str, Any]) -> Run | None:
    number = arguments.get("automaton")
    return host.tree.run(number) if isinstance(number, int) else None


def _value(arguments: dict[str, Any]) -> Any:  # noqa: ANN401 - JSON
    return msgspec.json.decode(str(arguments.get("json")).encode())
