"""The commands that steer a running component by names: `step`, `break`, `force`, `set`, `why` and others.

What needs no names is an operation of the monitor like any other: `nao call Hfsm.NAME.pause`.
"""

from __future__ import annotations

import json
import sys
import time
from collections.abc import Iterable, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Annotated, Final

import msgspec
import typer

from codegen.diagnostics import Diagnostics
from codegen.options import require_directories
from codegen.reasons import reason
from interfaces.hfsm import Breakpoint, ComponentSnapshot, ComponentStatus, Explanation, ReloadRefused
from visualhfsm._base.errors import VisualHfsmError
from visualhfsm._base.options import AsJson, Include, examples
from visualhfsm._monitor.realm.automata import Automata
from visualhfsm._monitor.realm.faults import failing_now
from visualhfsm._monitor.realm.realm import MONITOR_PREFIX, RELOAD_PATIENCE, did_you_mean
from visualhfsm._monitor.target import Address, Target, steered
from zenoh_ice import TimeoutException
from zenoh_ice.application.cli import finite, with_settings
from zenoh_ice.data.text import printable
from zenoh_ice.settings import Settings

_Component = Annotated[str, typer.Argument(metavar="COMPONENT", help="Name of a running component.")]
_Automaton = Annotated[
    str, typer.Argument(metavar="AUTOMATON", help="A path of states such as followBall/green, or an id.")
]

_PANEL: Final = "Steer a running component"
_PYTHON: Final = {"True": "true", "False": "false", "None": "null"}
_OPENING: Final = ("{", "[", '"')
_ANSWER_LIMIT: Final = 1.0  # s
_PLACES: Final = (Path(), Path("behaviors"))
_shared = with_settings(defaults={"clock": "wall"})


_STEP: Final = examples("step dance_and_follow", "step dance_and_follow followBall/green --count 10")
_BREAK: Final = examples(
    "break dance_and_follow",
    "break dance_and_follow followBall/green",
    'break dance_and_follow followBall/green/search --if "corner > 2" --wait 30',
    'break dance_and_follow "to green" --delete',
    notes="""A condition is an expression over the automaton's variables and the parameters
of the component (self.NAME): comparisons, and, or, not, arithmetic, elements.
It calls nothing.""",
)
_FORCE: Final = examples(
    "force dance_and_follow enough",
    'force dance_and_follow "followBall/to green"',
    'force dance_and_follow "followBall -> dance"',
)
_SET: Final = examples(
    "set follow_ball corner=3",
    "set dance_and_follow corner=0 --automaton followBall/green",
    "set follow_ball speed=0.4 'path=[[0, 0], [1, 0.5]]'",
    notes="""A value is JSON, or a plain text such as hello. Name the automaton only when
several have the variable.""",
)
_WHY: Final = examples("why follow_ball", "why dance_and_follow followBall/green --json")
_RELOAD: Final = examples(
    "reload dance_and_follow",
    "reload dance_and_follow behaviors/dance_and_follow.xml",
    notes="""The document is compiled first, and the component's file is written only when
it has no errors. Without a name, the document is searched for in the
working directory and in behaviors/.""",
)


def register(app: typer.Typer) -> None:
    """Add the commands to those of `visualhfsm`."""
    for name, command, epilog in (
        ("step", step, _STEP),
        ("break", break_, _BREAK),
        ("force", force, _FORCE),
        ("set", set_, _SET),
        ("why", why, _WHY),
        ("reload", reload, _RELOAD),
        ("stop", stop, None),
    ):
        app.command(name, epilog=epilog, rich_help_panel=_PANEL)(_shared(command))


def step(
    *,
    settings: Settings,
    component: _Component,
    automaton: _Automaton = "",
    count: Annotated[int, typer.Option("--count", min=1, max=10_000, help="Cycles to run.")] = 1,
    as_json: AsJson = False,
) -> None:
    """Run one cycle of an automaton, or of all, in a paused component.

    When nothing runs, stderr says why: the automaton is a ghost or has finished.
    """
    with steered(settings, component) as target:
        number = target.addresses.automaton(automaton).automaton if automaton else 0
        snapshot = target.monitor.getSnapshot()
        status = snapshot.status
        if status is not ComponentStatus.Paused:
            pause = f"nao call {MONITOR_PREFIX}{target.name}.pause"
            raise VisualHfsmError.because(
                "{target} is {status}, not paused: {pause}",
                target=target.name,
                status=status.name.lower(),
                pause=pause,
            )
        for chosen in snapshot.automata:
            if chosen.id == number and (chosen.ghost or chosen.finished):
                why = "is a ghost" if chosen.ghost else "has finished"
                typer.echo(f"nothing ran: {target.addresses.named(number)} {why}", err=True)
                break
        else:
            for _ in range(count):
                target.monitor.step(number)
        _show_states(target, as_json=as_json)


def _show_states(target: Target, *, as_json: bool = False) -> None:
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


def break_(
    *,
    settings: Settings,
    component: _Component,
    element: Annotated[
        str, typer.Argument(metavar="ELEMENT", help="A state or a transition; none lists the breakpoints.")
    ] = "",
    condition: Annotated[
        str, typer.Option("--if", metavar="EXPRESSION", help="Pause only if this condition is true.")
    ] = "",
    state: Annotated[bool, typer.Option("--state", help="ELEMENT is a state.")] = False,
    transition: Annotated[bool, typer.Option("--transition", help="ELEMENT is a transition.")] = False,
    delete: Annotated[
        bool, typer.Option("--delete", help="Delete the breakpoints at ELEMENT, or all.")
    ] = False,
    wait: Annotated[
        float | None,
        typer.Option(
            metavar="SECONDS", min=0.0, callback=finite, help="Wait this long for the component to pause."
        ),
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Set, list and delete breakpoints, and wait until the component pauses at one.

    A component pauses when the state has been entered, or the transition has fired, before the code of the
    state runs. `step` and `nao call Hfsm.NAME.resume` continue from there.
    """
    if condition and (delete or not element):
        raise typer.BadParameter("--if needs an ELEMENT to pause at")
    if state and transition:
        raise typer.BadParameter("ELEMENT is a state or a transition, not both")
    with steered(settings, component) as target:
        addresses = target.addresses
        find = addresses.state if state else addresses.transition if transition else addresses.element
        if element:
            _change_breakpoint(target, find(element), condition, delete=delete)
        elif delete:
            target.monitor.setBreakpoints([])
        if wait is not None:
            _wait_for_stop(target, wait)
        _show_breakpoints(target, as_json=as_json)


def _change_breakpoint(target: Target, found: Address, condition: str, *, delete: bool) -> None:
    """Add a breakpoint, or delete it; one at the same element gets the new condition."""
    ids = (found.automaton, found.state, found.transition)
    before = target.monitor.getBreakpoints()
    others = [one for one in before if (one.automaton, one.state, one.transition) != ids]
    if delete and len(others) == len(before):
        raise VisualHfsmError.because("there is no breakpoint at {name}", name=found.name)
    target.monitor.setBreakpoints(others if delete else [*others, Breakpoint(*ids, condition)])


def _show_breakpoints(target: Target, *, as_json: bool) -> None:
    """Print the breakpoints, and those at which the component is paused."""
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


def _wait_for_stop(target: Target, seconds: float) -> None:
    """Wait until a component is paused at a breakpoint; raises VisualHfsmError when it is not in time."""
    deadline = time.monotonic() + seconds
    stream = target.monitor.getSnapshot
    snapshot = stream()
    while not snapshot.stoppedAt:
        left = deadline - time.monotonic()
        if left <= 0:
            raise VisualHfsmError.because(
                "{target} reached no breakpoint within {seconds:g} s", target=target.name, seconds=seconds
            )
        with suppress(TimeoutException):
            snapshot = stream.wait(after=stream.latest(), timeout=min(left, _ANSWER_LIMIT)).value


def force(
    *,
    settings: Settings,
    component: _Component,
    transition: Annotated[str, typer.Argument(metavar="TRANSITION", help="Its name, or `from -> to`.")],
) -> None:
    """Fire a transition at the next cycle of its automaton, whatever its condition."""
    with steered(settings, component) as target:
        found = target.addresses.transition(transition)
        target.monitor.forceTransition(found.automaton, found.transition)
        typer.echo(f"{found.name} fires at the next cycle")


def set_(
    *,
    settings: Settings,
    component: _Component,
    assignments: Annotated[
        list[str], typer.Argument(metavar="NAME=VALUE...", help="VALUE is JSON or a text.")
    ],
    automaton: Annotated[
        str,
        typer.Option(
            "--automaton", metavar="AUTOMATON", help="The automaton of the variables; 0 for parameters."
        ),
    ] = "",
) -> None:
    """Set variables of an automaton, or parameters of a component, while it runs."""
    pairs = [text.partition("=") for text in assignments]
    wrong = next((text for text, (_, sign, _) in zip(assignments, pairs, strict=True) if not sign), None)
    if wrong is not None:
        raise typer.BadParameter(f"{wrong!r} is not NAME=VALUE")
    with steered(settings, component) as target:
        snapshot = target.monitor.getSnapshot()
        # All detectable errors are reported before the first variable is set.
        found = [
            (_owner(target, snapshot, name.strip(), automaton), name.strip(), _json_of(value))
            for name, _, value in pairs
        ]
        for owner, name, text in found:
            target.monitor.setVariable(owner, name, text)
            whose = target.addresses.named(owner) if owner else "self"
            typer.echo(f"{whose}: {printable(name)} = {printable(text)}")


def _owner(target: Target, snapshot: ComponentSnapshot, name: str, automaton: str) -> int:
    """Return the id of the automaton whose variable it is, 0 for a parameter."""
    if automaton:
        return 0 if automaton == "0" else target.addresses.automaton(automaton).automaton
    owners = [0] if any(parameter.name == name for parameter in target.structure.parameters) else []
    owners += [one.id for one in snapshot.automata if name in one.variables]
    if len(owners) == 1:
        return owners[0]
    if owners:
        raise VisualHfsmError.because(
            "{name} is a variable of {list}: name one with --automaton",
            name=printable(name),
            list=_list(target, owners),
        )
    if len(snapshot.automata) == 1 and not target.structure.parameters:
        return snapshot.automata[0].id  # perhaps it has no value yet; the component knows
    known = {variable for one in snapshot.automata for variable in one.variables}
    known |= {parameter.name for parameter in target.structure.parameters}
    raise VisualHfsmError.because(
        "{target} has no variable {name} that has a value; {hint}",
        target=target.name,
        name=printable(name),
        hint=did_you_mean(name, map(printable, known)),
    )


def _list(target: Target, owners: Iterable[int]) -> str:
    return ", ".join(target.addresses.named(owner) if owner else "the component (0)" for owner in owners)


def _json_of(value: str) -> str:
    """Return JSON as it is, and a plain text as a text in JSON.

    Raises VisualHfsmError for a text that looks like malformed JSON, or is a word of Python.
    """
    try:
        json.loads(value)
    except RecursionError as error:
        raise VisualHfsmError.because("the value is nested too deep") from error
    except ValueError as error:
        if value.strip() in _PYTHON:
            raise VisualHfsmError.because(
                "a value is JSON: write {python}, not {value}",
                python=_PYTHON[value.strip()],
                value=value.strip(),
            ) from error
        if value.lstrip().startswith(_OPENING):
            raise VisualHfsmError.because(
                "{text} is not JSON: {reason}", text=printable(value.strip()[:100]), reason=reason(error)
            ) from error
        return json.dumps(value)
    return value


def why(
    *, settings: Settings, component: _Component, automaton: _Automaton = "", as_json: AsJson = False
) -> None:
    """Explain why automata are in their states: what keeps each transition from firing.

    Without AUTOMATON, for all that run.
    """
    with steered(settings, component) as target:
        if automaton:
            numbers = [target.addresses.automaton(automaton).automaton]
        else:
            numbers = [one.id for one in target.monitor.getSnapshot().automata if not one.ghost]
        explanations = [target.monitor.explain(number) for number in numbers]
        if as_json:
            _print_json(explanations)
            return
        for position, explanation in enumerate(explanations):
            if position:
                typer.echo("")
            _show_explanation(target.addresses.named(explanation.automaton), target.automata, explanation)
        for fault in failing_now(target.communicator):
            typer.echo(f"made to fail: {fault}")


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


def reload(
    *,
    settings: Settings,
    component: _Component,
    document: Annotated[
        Path | None, typer.Argument(metavar="DOCUMENT", dir_okay=False, help="Its edited document.")
    ] = None,
    output: Annotated[
        Path | None,
        typer.Option(
            "--output", "-o", metavar="DIR", file_okay=False,
            help="Directory of the component's file, by default that of the document.",
        ),
    ] = None,
    include: Include = None,
    as_json: AsJson = False,
) -> None:  # fmt: skip
    """Compile a document and continue in it, without a restart.

    All states, timers and variables that still exist are kept. Nothing changes when the document has errors,
    and when the component refuses it.
    """
    from codegen.hfsm import component_path

    with steered(settings, component) as target:
        path = document or _find_document(target)
        file = component_path(path, output)
        former = file.read_bytes() if file.is_file() else None
        written = _generate(path, output, require_directories(include))
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
        typer.echo(f"{target.name} was reloaded, and paused for {report.held * 1000:.1f} ms")
        for sentence in report.notKept:
            typer.echo(f"not kept: {printable(sentence)}")


def _find_document(target: Target) -> Path:
    """Return the document of a component; its file name is known."""
    name = Path(target.structure.document).name
    found = [place / name for place in _PLACES if name and (place / name).is_file()]
    if len(found) == 1:
        return found[0]
    places = " and ".join(str(path) for path in found) if found else "neither here nor in behaviors/"
    raise VisualHfsmError.because(
        "which document? {name} is {places}: name it", name=printable(name) or "it", places=places
    )


def _generate(document: Path, output: Path | None, include: Sequence[Path]) -> Path:
    from visualhfsm._document.generate import (
        generate_component,  # imported here: other commands need no compiler
    )

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


def stop(*, settings: Settings, component: _Component) -> None:
    """Stop a component: running cycles end, the robot stops, and the process exits."""
    with steered(settings, component) as target:
        target.communicator.presence.needs_links = False  # the link ends with the component
        target.monitor.stop()
        typer.echo(f"{target.name} ends")
