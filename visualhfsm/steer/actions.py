"""What the commands do that steer a component: pause, step, break, set, send, explain, reload."""

from __future__ import annotations

import json
import sys
import time
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Final

import msgspec
import typer

from codegen.diagnostics import Diagnostics
from codegen.hfsm import component_path
from interfaces.hfsm import (
    Breakpoint,
    ComponentSnapshot,
    ComponentStatus,
    ComponentStructure,
    Explanation,
    HfsmMonitorPrx,
    InvalidValue,
    NoSuchElement,
    ReloadRefused,
)
from visualhfsm.errors import VisualHfsmError
from visualhfsm.generate import generate_component
from visualhfsm.monitoring.automata import Automata
from visualhfsm.monitoring.realm import MONITOR_PREFIX, RELOAD_PATIENCE, did_you_mean, missing_component
from visualhfsm.steer.addresses import Address, Addresses
from zenoh_ice import ObjectNotExistException, Settings, TimeoutException, initialize
from zenoh_ice.text import printable

__all__ = [
    "Target",
    "delete_breakpoints",
    "pause",
    "reload_document",
    "run_steps",
    "send_event",
    "set_breakpoint",
    "set_variables",
    "show_breakpoints",
    "show_explanations",
    "show_states",
    "steered",
    "wait_for_stop",
]

_PYTHON: Final = {"True": "true", "False": "false", "None": "null"}
_OPENING: Final = ("{", "[", '"')
_GAP: Final = 1.0
"""Seconds in which cycles that run when a component is paused ought to end."""
_PERIOD: Final = 0.02
_PATIENCE: Final = 1.0
_SETTLING: Final = 1.0
"""Seconds in which other components become known, to name one that was meant."""
_PLACES: Final = (Path(), Path("behaviors"))


@dataclass(frozen=True)
class Target:
    """A running component."""

    name: str
    monitor: HfsmMonitorPrx
    structure: ComponentStructure

    @cached_property
    def addresses(self) -> Addresses:
        """What its automata, states and transitions are called."""
        return Addresses(self.structure)

    @cached_property
    def automata(self) -> Automata:
        """Its automata as a tree."""
        return Automata(self.structure)


@contextmanager
def steered(settings: Settings, name: str) -> Iterator[Target]:
    """Connect to a component for the time of a `with` block, and report in one line what it refuses.

    Raises VisualHfsmError, and ConnectFailedException when there is no server at all.
    """
    with initialize(settings) as communicator:
        identity = f"{MONITOR_PREFIX}{name}"
        try:
            monitor = HfsmMonitorPrx.checkedCast(communicator.stringToProxy(identity))
        except ObjectNotExistException as error:
            raise missing_component(communicator, name, _SETTLING) or error from error
        try:
            yield Target(name, monitor, monitor.getStructure())
        except (NoSuchElement, InvalidValue) as error:
            raise VisualHfsmError(printable(error.what)) from error
        except ReloadRefused as error:
            raise VisualHfsmError(
                f"not reloaded, {name} runs on as it was: {printable(error.reason)}"
            ) from error


def show_states(target: Target, *, as_json: bool = False) -> None:
    """Print what a component is doing: its status, its time and the path of current states."""
    snapshot = target.monitor.getSnapshot()
    status, automata = snapshot.status.name.lower(), target.automata
    if as_json:
        states = [
            {
                "id": one.id,
                "name": target.addresses.named(one.id),
                "state": automata.state_name(one.id, one.state),
                "ghost": one.ghost,
                "finished": one.finished,
                "cycles": one.cycles,
                "inCycle": one.inCycle,
            }
            for one in snapshot.automata
        ]
        _print_json({"status": status, "time": snapshot.time, "automata": states})
        return
    path = " > ".join(automata.current_path(snapshot))
    typer.echo(f"{target.name} {status} at {snapshot.time:.3f} s: {path}")
    for one in snapshot.automata:
        if one.inCycle and snapshot.status is ComponentStatus.Paused:
            where = f"{target.addresses.named(one.id)} in the state {automata.state_name(one.id, one.state)}"
            typer.echo(f"but a cycle of {where} still runs: its code must not block", err=True)


def pause(target: Target) -> None:
    """Pause a component, and wait up to 1 s for the cycles that run to end."""
    target.monitor.pause()
    deadline = time.monotonic() + _GAP
    while any(one.inCycle for one in target.monitor.getSnapshot().automata) and time.monotonic() < deadline:
        time.sleep(_PERIOD)


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
    """Set variables by name; all that can be known to be wrong is reported before the first is set."""
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
        _print_json({"breakpoints": breakpoints, "stoppedAt": stopped})
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


def show_explanations(target: Target, automaton: str, *, as_json: bool) -> None:
    """Explain one automaton, or all that are no ghosts."""
    if automaton:
        numbers = [target.addresses.automaton(automaton).automaton]
    else:
        numbers = [one.id for one in target.monitor.getSnapshot().automata if not one.ghost]
    explanations = [target.monitor.explain(number) for number in numbers]
    if as_json:
        _print_json(explanations)
        return
    automata = target.automata
    for number, explanation in enumerate(explanations):
        if number:
            typer.echo("")
        _show_explanation(target.addresses.named(explanation.automaton), automata, explanation)


def _show_explanation(name: str, automata: Automata, explanation: Explanation) -> None:
    number = explanation.automaton
    state = automata.state_name(number, explanation.state)
    by = explanation.enteredBy
    entered = f", entered by {_transition_name(automata, number, by)}" if by else ""
    typer.echo(f"{name} is {'a ghost ' if explanation.ghost else ''}in {state}{entered}")
    for one in explanation.transitions:
        transition = _transition_name(automata, number, one.transition)
        destination = automata.destination_name(number, one.transition)
        typer.echo(f"  {one.order}. {transition} to {destination}: {printable(one.reason)}")
    if not explanation.transitions:
        typer.echo(f"  {printable(explanation.summary)}")


def _transition_name(automata: Automata, automaton: int, id: int) -> str:
    found = automata.transition(automaton, id)
    if found is None:
        return f"transition {id}"
    origin = automata.state_name(automaton, found.origin)
    return found.name or f"{origin} -> {automata.state_name(automaton, found.destination)}"


def reload_document(
    target: Target, document: Path | None, output: Path | None, include: Sequence[Path], *, as_json: bool
) -> None:
    """Compile a document, write the component's file, and reload the component.

    Errors of the document are shown and end the command with exit code 1 before anything is touched. When the
    component refuses, its file gets its former content back. Raises VisualHfsmError and ReloadRefused.
    """
    path = document or _find_document(target)
    file = component_path(path, output)
    former = file.read_bytes() if file.is_file() else None
    written = _generate(path, output, include)
    try:
        report = target.monitor.ice_invocationTimeout(RELOAD_PATIENCE).reload()
    except ReloadRefused:
        if former is not None:
            written.write_bytes(former)
        raise
    if as_json:
        _print_json(report)
        return
    typer.echo(f"{written} is written")
    typer.echo(f"{target.name} was reloaded, and held for {report.held * 1000:.1f} ms")
    for sentence in report.notKept:
        typer.echo(f"not kept: {printable(sentence)}")


def _find_document(target: Target) -> Path:
    """Return the document of a component; its file name is known."""
    name = Path(target.structure.document).name
    found = [place / name for place in _PLACES if name and (place / name).is_file()]
    if len(found) == 1:
        return found[0]
    places = " and ".join(str(path) for path in found) if found else "not here nor in behaviors/"
    raise VisualHfsmError(f"which document? {printable(name) or 'it'} is {places}: name it")


def _generate(document: Path, output: Path | None, include: Sequence[Path]) -> Path:
    diagnostics = Diagnostics()
    written = generate_component(document, output, diagnostics, include)
    if len(diagnostics):
        rendered = diagnostics.render(color=sys.stderr.isatty(), outcome="nothing was written or reloaded")
        typer.echo(rendered, err=True)
    if written is None:
        raise typer.Exit(1)
    return written


def _print_json(value: object) -> None:
    """Print a value, structures of the interfaces included, as JSON."""
    typer.echo(json.dumps(msgspec.to_builtins(value, enc_hook=str), indent=2, ensure_ascii=True))
