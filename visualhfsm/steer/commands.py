"""The commands that steer a running component: `pause`, `step`, `break`, `force`, `set`, `why` and others."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Final

import typer

from zenoh_ice.command import finite, with_settings
from zenoh_ice.settings import Settings

__all__ = ["register"]

_Component = Annotated[str, typer.Argument(metavar="COMPONENT", help="Name of a running component.")]
_Automaton = Annotated[
    str, typer.Argument(metavar="AUTOMATON", help="As followBall/green, by the states above it, or its id.")
]
_Json = Annotated[bool, typer.Option("--json", help="Print JSON.")]

_PANEL: Final = "Steer a running component"
_shared = with_settings(defaults={"clock": "wall"})

_STEP: Final = """Examples:

visualhfsm step dance_and_follow

visualhfsm step dance_and_follow followBall/green --count 10"""

_BREAK: Final = """Examples:

visualhfsm break dance_and_follow

visualhfsm break dance_and_follow followBall/green

visualhfsm break dance_and_follow followBall/green/search --if "corner > 2" --wait 30

visualhfsm break dance_and_follow "to green" --delete

A condition is an expression over the automaton's variables and the parameters
of the component (self.NAME): comparisons, and, or, not, arithmetic, elements.
It calls nothing."""

_FORCE: Final = """Examples:

visualhfsm force dance_and_follow enough

visualhfsm force dance_and_follow "followBall/to green"

visualhfsm force dance_and_follow "followBall -> dance\""""

_SET: Final = """Examples:

visualhfsm set follow_ball corner=3

visualhfsm set dance_and_follow corner=0 --automaton followBall/green

visualhfsm set follow_ball speed=0.4 'path=[[0, 0], [1, 0.5]]'

A value is JSON, or a plain text such as hello. Which automaton is meant need not
be said when only one has the name, or the component's parameters do."""

_SEND: Final = """Examples:

visualhfsm send follow_ball ball_lost

visualhfsm send follow_ball ball_lost '{"color": "red"}'"""

_WHY: Final = """Examples:

visualhfsm why follow_ball

visualhfsm why dance_and_follow followBall/green --json"""

_RELOAD: Final = """Examples:

visualhfsm reload dance_and_follow

visualhfsm reload dance_and_follow behaviors/dance_and_follow.xml

The document is compiled first, and the component's file is written only when
it has no errors. A document that is not named is looked for in the working
directory and in behaviors/."""


def register(app: typer.Typer) -> None:
    """Add the commands to those of `visualhfsm`."""
    for name, command, epilog in (
        ("pause", pause, None),
        ("resume", resume, None),
        ("step", step, _STEP),
        ("break", break_, _BREAK),
        ("force", force, _FORCE),
        ("set", set_, _SET),
        ("send", send, _SEND),
        ("why", why, _WHY),
        ("reload", reload, _RELOAD),
        ("stop", stop, None),
    ):
        app.command(name, epilog=epilog, rich_help_panel=_PANEL)(_shared(command))


def pause(*, settings: Settings, component: _Component, json: _Json = False) -> None:
    """Pause a component: running cycles end, none begins, its time stands still."""
    from visualhfsm.steer import actions
    from visualhfsm.steer.actions import steered

    with steered(settings, component) as target:
        actions.pause(target)
        actions.show_states(target, as_json=json)


def resume(*, settings: Settings, component: _Component, json: _Json = False) -> None:
    """Let a component go on after a pause or a breakpoint."""
    from visualhfsm.steer.actions import show_states, steered

    with steered(settings, component) as target:
        target.monitor.resume()
        show_states(target, as_json=json)


def step(
    *,
    settings: Settings,
    component: _Component,
    automaton: _Automaton = "",
    count: Annotated[int, typer.Option("--count", min=1, max=10_000, help="Cycles to run.")] = 1,
    json: _Json = False,
) -> None:
    """Run one cycle of an automaton, or of all, of a component that is paused."""
    from visualhfsm.steer.actions import run_steps, show_states, steered

    with steered(settings, component) as target:
        run_steps(target, automaton, count)
        show_states(target, as_json=json)


def break_(
    *,
    settings: Settings,
    component: _Component,
    element: Annotated[
        str, typer.Argument(metavar="ELEMENT", help="A state or a transition; none lists the breakpoints.")
    ] = "",
    condition: Annotated[
        str, typer.Option("--if", metavar="EXPRESSION", help="Pause only when this is true, too.")
    ] = "",
    state: Annotated[bool, typer.Option("--state", help="ELEMENT is a state.")] = False,
    transition: Annotated[bool, typer.Option("--transition", help="ELEMENT is a transition.")] = False,
    delete: Annotated[
        bool, typer.Option("--delete", help="Delete the breakpoints at ELEMENT, or all.")
    ] = False,
    wait: Annotated[
        float | None,
        typer.Option(
            metavar="SECONDS", min=0.0, callback=finite, help="Wait so long until the component stands."
        ),
    ] = None,
    json: _Json = False,
) -> None:
    """Set, list and delete breakpoints, and wait until the component stands at one.

    A component pauses when the state has been entered, or the transition has
    fired, before the code of the state runs. `step` and `resume` go on from
    there.
    """
    from visualhfsm.steer.actions import (
        delete_breakpoints,
        set_breakpoint,
        show_breakpoints,
        steered,
        wait_for_stop,
    )

    if condition and (delete or not element):
        raise typer.BadParameter("--if needs an ELEMENT to pause at")
    if state and transition:
        raise typer.BadParameter("ELEMENT is a state or a transition, not both")
    kind = "state" if state else "transition" if transition else ""
    with steered(settings, component) as target:
        if delete:
            delete_breakpoints(target, element, kind)
        elif element:
            set_breakpoint(target, element, kind, condition)
        if wait is not None:
            wait_for_stop(target, wait)
        show_breakpoints(target, as_json=json)


def force(
    *,
    settings: Settings,
    component: _Component,
    transition: Annotated[str, typer.Argument(metavar="TRANSITION", help="Its name, or `from -> to`.")],
) -> None:
    """Fire a transition at the next cycle of its automaton, whatever its condition says."""
    from visualhfsm.steer.actions import steered

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
        str, typer.Option("--automaton", metavar="AUTOMATON", help="Whose variables; 0 is for parameters.")
    ] = "",
) -> None:
    """Set variables of an automaton, or parameters of a component, while it runs."""
    from visualhfsm.steer.actions import set_variables, steered

    pairs = [text.partition("=") for text in assignments]
    wrong = next((text for text, (_, sign, _) in zip(assignments, pairs, strict=True) if not sign), None)
    if wrong is not None:
        raise typer.BadParameter(f"{wrong!r} is not NAME=VALUE")
    with steered(settings, component) as target:
        set_variables(target, [(name.strip(), value) for name, _, value in pairs], automaton)


def send(
    *,
    settings: Settings,
    component: _Component,
    event: Annotated[str, typer.Argument(metavar="EVENT", help="Its name.")],
    data: Annotated[str, typer.Argument(metavar="DATA", help="What goes with it, in JSON.")] = "",
) -> None:
    """Send an event to every active automaton of a component."""
    from visualhfsm.steer.actions import send_event, steered

    with steered(settings, component) as target:
        send_event(target, event, data)


def why(
    *, settings: Settings, component: _Component, automaton: _Automaton = "", json: _Json = False
) -> None:
    """Say why automata are where they are: what keeps each transition from firing.

    Without an AUTOMATON of all that run.
    """
    from visualhfsm.steer.actions import show_explanations, steered

    with steered(settings, component) as target:
        show_explanations(target, automaton, as_json=json)


def reload(
    *,
    settings: Settings,
    component: _Component,
    document: Annotated[
        Path | None, typer.Argument(metavar="DOCUMENT", dir_okay=False, help="Its document, as edited.")
    ] = None,
    output: Annotated[
        Path | None,
        typer.Option(
            "--output", "-o", metavar="DIR", file_okay=False,
            help="Directory of the component's file; that of the document otherwise.",
        ),
    ] = None,
    include: Annotated[
        list[Path] | None,
        typer.Option("--include", "-I", metavar="DIR", file_okay=False, help="Further interfaces."),
    ] = None,
    json: _Json = False,
) -> None:  # fmt: skip
    """Compile a document and go on in it, without a restart.

    All states, timers and variables that it still has are kept. Nothing is
    touched when the document has errors, and the component runs on as it was
    when it refuses.
    """
    from visualhfsm.steer.actions import reload_document, steered

    with steered(settings, component) as target:
        reload_document(target, document, output, include or [], as_json=json)


def stop(*, settings: Settings, component: _Component) -> None:
    """End a component: running cycles end, the robot is stopped, the process exits."""
    from visualhfsm.steer.actions import steered

    with steered(settings, component) as target:
        target.monitor.stop()
        typer.echo(f"{target.name} ends")
