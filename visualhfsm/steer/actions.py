"""What the commands do that pause, step, set and send."""

from __future__ import annotations

import json
import time
from collections.abc import Iterable, Sequence
from typing import Final

import msgspec
import typer

from interfaces.hfsm import ComponentSnapshot, ComponentStatus
from visualhfsm.errors import VisualHfsmError
from visualhfsm.steer.addresses import did_you_mean
from visualhfsm.steer.target import Target
from visualhfsm.watch.automata import printable

__all__ = ["pause", "print_json", "run_steps", "send_event", "set_variables", "show_states"]

_PYTHON: Final = {"True": "true", "False": "false", "None": "null"}
_OPENING: Final = ("{", "[", '"')
_GAP: Final = 1.0
"""Seconds in which cycles that run when a component is paused ought to end."""
_PERIOD: Final = 0.02


def show_states(target: Target, *, as_json: bool = False) -> None:
    """Print what a component is doing: its status, its time and the path of current states."""
    snapshot = target.monitor.getSnapshot()
    if as_json:
        print_json(
            {
                "status": snapshot.status.name.lower(),
                "time": snapshot.time,
                "automata": [
                    {"id": a.id, "name": target.addresses.named(a.id), "state": _state(target, a.id, a.state),
                     "ghost": a.ghost, "finished": a.finished, "cycles": a.cycles, "inCycle": a.inCycle}
                    for a in snapshot.automata
                ],
            }
        )  # fmt: skip
        return
    status = snapshot.status.name.lower()
    typer.echo(f"{target.name} {status} at {snapshot.time:.3f} s: {target.states(snapshot)}")
    for one in snapshot.automata:
        if one.inCycle and snapshot.status is ComponentStatus.Paused:
            where = f"{target.addresses.named(one.id)} in the state {_state(target, one.id, one.state)}"
            typer.echo(f"but a cycle of {where} still runs: its code must not block", err=True)


def pause(target: Target) -> None:
    """Pause a component, and wait up to 1 s for the cycles that run to end."""
    target.monitor.pause()
    deadline = time.monotonic() + _GAP
    while any(one.inCycle for one in target.monitor.getSnapshot().automata) and time.monotonic() < deadline:
        time.sleep(_PERIOD)


def print_json(value: object) -> None:
    """Print a value, structures of the interfaces included, as JSON."""
    typer.echo(json.dumps(msgspec.to_builtins(value, enc_hook=str), indent=2, ensure_ascii=True))


def run_steps(target: Target, automaton: str, count: int) -> None:
    """Run cycles of an automaton, or of all; raises VisualHfsmError unless the component is paused.

    Tells on stderr when nothing runs, since the automaton is a ghost or has finished.
    """
    number = target.addresses.automaton(automaton).automaton if automaton else 0
    snapshot = target.monitor.getSnapshot()
    status = snapshot.status
    if status is not ComponentStatus.Paused:
        raise VisualHfsmError(
            f"{target.name} is {status.name.lower()}, not paused: visualhfsm pause {target.name}"
        )
    for chosen in snapshot.automata:
        if chosen.id == number and (chosen.ghost or chosen.finished):
            why = "is a ghost" if chosen.ghost else "has finished"
            typer.echo(f"nothing ran: {target.addresses.named(number)} {why}", err=True)
            return
    for _ in range(count):
        target.monitor.step(number)


def set_variables(target: Target, assignments: Sequence[tuple[str, str]], automaton: str) -> None:
    """Set variables by name; all that can be known to be wrong is told before the first is set."""
    snapshot = target.monitor.getSnapshot()
    found = [(_owner(target, snapshot, name, automaton), name, _json(value)) for name, value in assignments]
    for owner, name, text in found:
        target.monitor.setVariable(owner, name, text)
        whose = target.addresses.named(owner) if owner else "self"
        typer.echo(f"{whose}: {printable(name)} = {printable(text)}")


def send_event(target: Target, event: str, data: str) -> None:
    """Send an event; raises VisualHfsmError when no automaton waits for it."""
    known = {t.event for automaton in target.structure.automata for t in automaton.transitions if t.event}
    if event not in known:
        raise VisualHfsmError(
            f"no transition of {target.name} waits for an event {printable(event)}"
            f"{did_you_mean(event, map(printable, known))}"
        )
    target.monitor.sendEvent(event, _json(data) if data else "")
    typer.echo(f"{printable(event)} is sent")


def _owner(target: Target, snapshot: ComponentSnapshot, name: str, automaton: str) -> int:
    """Return the id of the automaton whose variable it is, 0 for a parameter."""
    if automaton:
        return 0 if automaton == "0" else target.addresses.automaton(automaton).automaton
    owners = [0] if any(parameter.name == name for parameter in target.structure.parameters) else []
    owners += [one.id for one in snapshot.automata if name in one.variables]
    if len(owners) == 1:
        return owners[0]
    if owners:
        raise VisualHfsmError(
            f"{printable(name)} is a variable of {_list(target, owners)}: say --automaton with one of them"
        )
    if len(snapshot.automata) == 1 and not target.structure.parameters:
        return snapshot.automata[0].id  # perhaps it has no value yet; the component knows
    known = {variable for one in snapshot.automata for variable in one.variables}
    known |= {parameter.name for parameter in target.structure.parameters}
    raise VisualHfsmError(
        f"{target.name} has no variable {printable(name)} that has a value"
        f"{did_you_mean(name, map(printable, known))}"
    )


def _list(target: Target, owners: Iterable[int]) -> str:
    return ", ".join(target.addresses.named(owner) if owner else "the component (0)" for owner in owners)


def _json(value: str) -> str:
    """Return JSON as it is, and a plain text as a text in JSON.

    Raises VisualHfsmError when it was meant to be JSON: it begins like some, or is a word of Python.
    """
    try:
        json.loads(value)
    except RecursionError as error:
        raise VisualHfsmError("the value is nested too deep") from error
    except ValueError as error:
        if value.strip() in _PYTHON:
            raise VisualHfsmError(
                f"a value is JSON: write {_PYTHON[value.strip()]}, not {value.strip()}"
            ) from error
        if value.lstrip().startswith(_OPENING):
            raise VisualHfsmError(f"{printable(value.strip()[:100])} is no JSON: {error}") from error
        return json.dumps(value)
    return value


def _state(target: Target, automaton: int, state: int) -> str:
    structures = (one for one in target.structure.automata if one.id == automaton)
    return next((s.name for one in structures for s in one.states if s.id == state), str(state))
