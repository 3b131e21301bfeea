"""A running component, and its automata, states and transitions by name.

An automaton is named by the states above it (`followBall/green`), the root by the component; a state or a
transition by its automaton and its own name (`followBall/green/search`), or by its name alone where only one
has it. Ids work, too: `4`, `4/2`. A transition without a name is named by its states: `follow -> search`.
"""

from __future__ import annotations

import difflib
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cached_property
from typing import Final

from codegen.messages import Message
from interfaces import hfsm
from visualhfsm._base.errors import VisualHfsmError
from visualhfsm._monitor.realm.automata import Automata
from visualhfsm._monitor.realm.realm import MONITOR_PREFIX, did_you_mean, missing_component, refusals
from zenoh_ice import Communicator, ObjectNotExistException, Settings, initialize
from zenoh_ice.data.text import printable

_DISCOVERY_TIME: Final = 1.0
"""Seconds in which other components are discovered, for suggestions."""
_SHOWN: Final = 12
"""Addresses that an error names at most."""


@dataclass(frozen=True)
class Target:
    """A running component."""

    name: str
    monitor: hfsm.HfsmMonitorPrx
    structure: hfsm.ComponentStructure
    communicator: Communicator

    @cached_property
    def addresses(self) -> Addresses:
        """The names of its automata, states and transitions."""
        return Addresses(self.structure)

    @cached_property
    def automata(self) -> Automata:
        """Its automata as a tree."""
        return Automata(self.structure)


@contextmanager
def steered(settings: Settings, name: str) -> Iterator[Target]:
    """Connect to a component for the time of a `with` block, and report refusals in one line.

    Raises VisualHfsmError, and ConnectFailedException when there is no server at all.
    """
    with initialize(settings) as communicator:
        identity = f"{MONITOR_PREFIX}{name}"
        try:
            monitor = hfsm.HfsmMonitorPrx.checkedCast(communicator.stringToProxy(identity))
        except ObjectNotExistException as error:
            raise missing_component(communicator, name, _DISCOVERY_TIME) or error from error
        with refusals(name):
            yield Target(name, monitor, monitor.getStructure(), communicator)


@dataclass(frozen=True, slots=True)
class Address:
    """An automaton (`state` and `transition` are 0), a state or a transition, and its full name."""

    name: str
    automaton: int
    state: int = 0
    transition: int = 0

    @property
    def ids(self) -> str:
        """Its ids, which are unique: `4`, or `4/2`."""
        return (
            f"{self.automaton}/{self.state or self.transition}"
            if self.state or self.transition
            else str(self.automaton)
        )


class Addresses:
    """The names in one component."""

    def __init__(self, structure: hfsm.ComponentStructure) -> None:
        self._automata: dict[Address, set[str]] = {}
        self._states: dict[Address, set[str]] = {}
        self._transitions: dict[Address, set[str]] = {}
        automata = Automata(structure)
        for automaton in structure.automata:
            self._add(automaton, "/".join(automata.path(automaton.id)))

    def automaton(self, text: str) -> Address:
        """Return an automaton; raises VisualHfsmError when none or several have the name."""
        return _find(text, self._automata, Message("automaton"))

    def state(self, text: str) -> Address:
        """Return a state; raises VisualHfsmError when none or several have the name."""
        return _find(text, self._states, Message("state"))

    def transition(self, text: str) -> Address:
        """Return a transition; raises VisualHfsmError when none or several have the name."""
        return _find(text, self._transitions, Message("transition"))

    def element(self, text: str) -> Address:
        """Return a state or a transition; raises VisualHfsmError when none or several have the name."""
        return _find(text, {**self._states, **self._transitions}, Message("state or transition"))

    def named(self, automaton: int, state: int = 0, transition: int = 0) -> str:
        """Return the full name of the element with these ids, with the ids if the name is not unique."""
        wanted = Address("", automaton, state, transition).ids
        among = self._states if state else self._transitions if transition else self._automata
        name = next((address.name for address in among if address.ids == wanted), wanted)
        alone = sum(address.name == name for address in among) <= 1
        return name if alone else f"{name} ({wanted})"

    def _add(self, automaton: hfsm.AutomatonStructure, path: str) -> None:
        name = automaton.name
        prefixes = {str(automaton.id), path, name, f"{path} ({automaton.id})"}
        root = automaton.parent == 0
        self._automata[Address(path, automaton.id)] = prefixes
        for state in automaton.states:
            own = printable(state.name)
            address = Address(own if root else f"{path}/{own}", automaton.id, state=state.id)
            self._states[address] = _spellings(prefixes, {own, str(state.id)}) | {own}
        for transition in automaton.transitions:
            own_names = _names(automaton, transition)
            first = own_names[0]
            address = Address(first if root else f"{path}/{first}", automaton.id, transition=transition.id)
            self._transitions[address] = _spellings(prefixes, {*own_names, str(transition.id)}) | set(
                own_names
            )


def _find(text: str, among: dict[Address, set[str]], kind: Message) -> Address:
    found = _matches(text, among)
    if len(found) == 1:
        return found[0]
    if found:
        choices = ", ".join(f"{address.name} ({address.ids})" for address in found[:_SHOWN])
        if len(found) > _SHOWN:
            choices += ", ..."
        raise VisualHfsmError.because(
            "{text} may be {choices}: name one in full, or by its ids", text=printable(text), choices=choices
        )
    full = [address.name for address in among]
    names = [name for names in among.values() for name in names if not name.partition("/")[0].isdigit()]
    is_close = bool(difflib.get_close_matches(text[:200], names, 1))
    hint = did_you_mean(text, [*full, *names] if is_close else full)
    raise VisualHfsmError.because(
        "there is no {kind} {text}; {hint}", kind=kind, text=printable(text), hint=hint
    )


def _matches(text: str, among: dict[Address, set[str]]) -> list[Address]:
    """Return the elements of a name: the full name, or else any of their names."""
    exact = [address for address in among if address.name == text]
    if len(exact) == 1:
        return exact
    return [address for address, names in among.items() if text in names]


def _spellings(prefixes: set[str], names: set[str]) -> set[str]:
    return {f"{prefix}/{name}" for prefix in prefixes for name in names}


def _names(automaton: hfsm.AutomatonStructure, transition: hfsm.TransitionStructure) -> list[str]:
    states = {state.id: printable(state.name) for state in automaton.states}
    origin, destination = (
        states.get(transition.origin, str(transition.origin)),
        states.get(transition.destination, str(transition.destination)),
    )
    names = [f"{origin} -> {destination}", f"{origin}->{destination}"]
    return [printable(transition.name), *names] if transition.name.strip() else names
