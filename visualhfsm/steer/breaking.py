"""What the command `break` does."""

from __future__ import annotations

import time
from typing import Final

import typer

from interfaces.hfsm import Breakpoint, ComponentSnapshot
from visualhfsm.errors import VisualHfsmError
from visualhfsm.steer.actions import print_json
from visualhfsm.steer.addresses import Address
from visualhfsm.steer.target import Target
from visualhfsm.watch.automata import printable
from zenoh_ice import TimeoutException

__all__ = ["delete_breakpoints", "set_breakpoint", "show_breakpoints", "wait_for_stop"]

_PATIENCE: Final = 1.0


def set_breakpoint(target: Target, element: str, kind: str, condition: str) -> None:
    """Add a breakpoint; one at the same element gets the new condition."""
    found = _element(target, element, kind)
    others = [one for one in target.monitor.getBreakpoints() if not _at(one, found)]
    added = Breakpoint(found.automaton, found.state, found.transition, condition)
    target.monitor.setBreakpoints([*others, added])


def delete_breakpoints(target: Target, element: str, kind: str) -> None:
    """Delete the breakpoint at an element, or all; raises VisualHfsmError when there is none."""
    if not element:
        target.monitor.setBreakpoints([])
        return
    found = _element(target, element, kind)
    before = target.monitor.getBreakpoints()
    others = [one for one in before if not _at(one, found)]
    if len(others) == len(before):
        raise VisualHfsmError(f"there is no breakpoint at {found.name}")
    target.monitor.setBreakpoints(others)


def show_breakpoints(target: Target, *, as_json: bool) -> None:
    """Print the breakpoints, and at which of them the component stands."""
    breakpoints, stopped = target.monitor.getBreakpoints(), target.monitor.getSnapshot().stoppedAt
    if as_json:
        print_json({"breakpoints": breakpoints, "stoppedAt": stopped})
        return
    for one in breakpoints:
        where = target.addresses.named(one.automaton, one.state, one.transition)
        kind = "state" if one.state else "transition"
        condition = f" if {printable(one.condition)}" if one.condition else ""
        typer.echo(f"{'*' if one in stopped else ' '} {kind} {where}{condition}")
    if not breakpoints:
        typer.echo("no breakpoints")


def wait_for_stop(target: Target, seconds: float) -> None:
    """Wait until a component stands at a breakpoint; raises VisualHfsmError when it does not in time."""
    deadline = time.monotonic() + seconds
    snapshot = target.monitor.getSnapshot()
    while not snapshot.stoppedAt:
        left = deadline - time.monotonic()
        if left <= 0:
            raise VisualHfsmError(f"{target.name} came to no breakpoint within {seconds:g} s")
        snapshot = _newer(target, min(left, _PATIENCE)) or snapshot


def _newer(target: Target, timeout: float) -> ComponentSnapshot | None:
    stream = target.monitor.getSnapshot
    try:
        return stream.wait(after=stream.latest(), timeout=timeout).value
    except TimeoutException:
        return None


def _element(target: Target, element: str, kind: str) -> Address:
    if kind == "state":
        return target.addresses.state(element)
    if kind == "transition":
        return target.addresses.transition(element)
    return target.addresses.element(element)


def _at(one: Breakpoint, place: Address) -> bool:
    return (one.automaton, one.state, one.transition) == (place.automaton, place.state, place.transition)
