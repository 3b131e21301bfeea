"""What the command `why` does: tell what keeps each transition from firing."""

from __future__ import annotations

import typer

from interfaces.hfsm import Explanation, TransitionExplanation
from visualhfsm.steer.actions import print_json
from visualhfsm.steer.target import Target
from visualhfsm.watch.automata import Automata, printable

__all__ = ["show_explanations"]


def show_explanations(target: Target, automaton: str, *, as_json: bool) -> None:
    """Explain one automaton, or all that are no ghosts."""
    if automaton:
        numbers = [target.addresses.automaton(automaton).automaton]
    else:
        numbers = [one.id for one in target.monitor.getSnapshot().automata if not one.ghost]
    explanations = [target.monitor.explain(number) for number in numbers]
    if as_json:
        print_json(explanations)
        return
    automata = Automata(target.structure)
    for number, explanation in enumerate(explanations):
        if number:
            typer.echo("")
        _show(target, automata, explanation)


def _show(target: Target, automata: Automata, explanation: Explanation) -> None:
    name = target.addresses.named(explanation.automaton)
    state = automata.state_name(explanation.automaton, explanation.state)
    by = ""
    if explanation.enteredBy:
        by = f", entered by {_transition(automata, explanation.automaton, explanation.enteredBy)}"
    typer.echo(f"{name} is {'a ghost ' if explanation.ghost else ''}in {state}{by}")
    for one in explanation.transitions:
        typer.echo(f"  {_line(automata, explanation.automaton, one)}")
    if not explanation.transitions:
        typer.echo(f"  {printable(explanation.summary)}")


def _line(automata: Automata, automaton: int, one: TransitionExplanation) -> str:
    name = _transition(automata, automaton, one.transition)
    destination = automata.destination_name(automaton, one.transition)
    return f"{one.order}. {name} to {destination}: {printable(one.reason)}"


def _transition(automata: Automata, automaton: int, id: int) -> str:
    found = automata.transition(automaton, id)
    if found is None:
        return f"transition {id}"
    origin = automata.state_name(automaton, found.origin)
    return found.name or f"{origin} -> {automata.state_name(automaton, found.destination)}"
