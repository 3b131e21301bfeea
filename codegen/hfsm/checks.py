"""Check that the structure of a document is complete: what a component needs before it can be generated."""

from __future__ import annotations

import keyword
import math
import re
import unicodedata
from collections.abc import Iterable
from pathlib import Path
from typing import Final

from ..diagnostics import Diagnostics, Location, Note, did_you_mean
from .document import NO_CHILD, Automaton, Document, Interface, State, Text, Transition
from .known_interfaces import KnownInterfaces

__all__ = ["COMPONENT_ATTRIBUTES", "ON_ERROR", "check_structure", "milliseconds"]

ON_ERROR: Final = ("stop", "continue")
"""What a component may do after an error in its code; the first is the default."""

COMPONENT_ATTRIBUTES: Final = frozenset({"automaton", "clock", "log", "sleep"})
"""Attributes that every component has and that a document must not redefine."""

_MAX_MILLISECONDS: Final = 1e12
_MAX_DEPTH: Final = 64
"""Automata above one another: far more than a person draws, far less than Python's stack."""
_IDENTITY: Final = re.compile(r"[A-Za-z0-9_.\-]+(@[A-Za-z0-9_.\-]+)?")


def milliseconds(text: Text) -> float | None:
    """Return a positive time in ms, or None when the text is none."""
    try:
        value = float(text.text.strip().replace("_", "?"))
    except ValueError:
        return None
    return value if math.isfinite(value) and 0.000_001 <= value <= _MAX_MILLISECONDS else None


def check_structure(
    document: Document, path: Path, interfaces: KnownInterfaces, diagnostics: Diagnostics
) -> None:
    """Report everything in the structure of a document that keeps a component from being generated."""
    checker = _Checker(document, path, diagnostics)
    checker.component()
    checker.tree()
    for automaton in document.automata:
        checker.automaton(automaton)
    checker.interfaces(interfaces)


_Item = Automaton | State | Transition | Interface


class _Checker:
    def __init__(self, document: Document, path: Path, diagnostics: Diagnostics) -> None:
        self._document = document
        self._path = path
        self._diagnostics = diagnostics
        self._automata: dict[int, Automaton] = {}
        for automaton in document.automata:
            self._automata.setdefault(automaton.id, automaton)

    def component(self) -> None:
        on_error = self._document.on_error
        if on_error.text.strip() not in ("", *ON_ERROR):
            message = f"`onerror` is {' or '.join(f'`{policy}`' for policy in ON_ERROR)}"
            self._error("E510", f"{message}, not `{on_error.text.strip()[:40]}`", on_error)

    def tree(self) -> None:
        """Check that the automata are a tree: one root, and every other owned by a state of its father."""
        document = self._document
        roots = [automaton for automaton in document.automata if automaton.father == NO_CHILD]
        if not roots:
            what = "there is no automaton" if not document.automata else "no automaton is the root"
            self._error("E511", f'{what}: one `SubAutomata` has `idFather="0"`', document)
        for second in roots[1:]:
            self._error("E511", f"automaton {second.id} is a second root", second, [self._first_is(roots[0])])
        self._unique_ids(document.automata, "automaton")
        owners: dict[int, tuple[Automaton, State]] = {}
        for automaton, state in document.states():
            for number in state.children:
                child = self._automata.get(number)
                if child is None:
                    message = f"state `{state.name}` owns automaton {number}, which does not exist"
                    self._error("E512", message, state)
                elif number in owners:
                    first = self._first_is(owners[number][1])
                    self._error("E512", f"automaton {number} already has an owner", state, [first])
                else:
                    owners[number] = (automaton, state)
                    if child.father != automaton.id:
                        message = f"automaton {number} says that its father is {child.father}"
                        note = Note(f"but a state of automaton {automaton.id} owns it", self._place(state))
                        self._error("E512", message, child, [note])
        for automaton in document.automata:
            if automaton.father != NO_CHILD and automaton.id not in owners:
                message = f"no state owns automaton {automaton.id}"
                self._error("E512", message, automaton)
            else:
                self._check_ancestors(automaton)

    def automaton(self, automaton: Automaton) -> None:
        if not automaton.states:
            self._error("E513", f"automaton {automaton.id} has no state", automaton)
        else:
            self._initial_state(automaton)
        self._unique_ids(automaton.states, "state")
        self._unique_ids(automaton.transitions, "transition")
        self._state_names(automaton)
        if milliseconds(automaton.iteration_time) is None:
            written = automaton.iteration_time.text.strip()[:40]
            message = f"`iteration_time` is a positive number of milliseconds, not `{written}`"
            self._error("E516", message, automaton.iteration_time)
        states = {state.id for state in automaton.states}
        for transition in automaton.transitions:
            self._transition(automaton, transition, states)

    def _initial_state(self, automaton: Automaton) -> None:
        initial = [state for state in automaton.states if state.initial]
        if not initial:
            message = f"automaton {automaton.id} has no initial state"
            note = Note('one of its states needs `initial="true"`')
            self._error("E513", message, automaton, [note])
        for second in initial[1:]:
            message = f"`{second.name}` is a second initial state of automaton {automaton.id}"
            self._error("E513", message, second, [self._first_is(initial[0])])

    def _state_names(self, automaton: Automaton) -> None:
        first: dict[str, State] = {}
        for state in automaton.states:
            name = state.name.strip()
            if not name:
                self._warning("W510", f"state {state.id} has no name", state)
            elif name in first:
                message = f"a second state is called `{name}` in automaton {automaton.id}"
                self._warning("W511", message, state, [self._first_is(first[name])])
            else:
                first[name] = state

    def _transition(self, automaton: Automaton, transition: Transition, states: set[int]) -> None:
        label = f"transition `{transition.name}`" if transition.name else f"transition {transition.id}"
        for end, state in (("leaves", transition.origin), ("enters", transition.destination)):
            if state not in states:
                message = f"{label} {end} state {state}, which automaton {automaton.id} does not have"
                self._error("E514", message, transition)
        if transition.type == "time":
            if milliseconds(transition.trigger) is None:
                written = transition.trigger.text.strip()[:40]
                message = f"the time of {label} is a positive number of milliseconds, not `{written}`"
                self._error("E515", message, transition.trigger)
        elif transition.type not in ("condition", "event", "finished"):
            message = f'{label} has the type `{transition.type[:40]}`: it is "time" or "condition"'
            self._error("E515", message, transition.trigger)

    def interfaces(self, known: KnownInterfaces) -> None:
        first: dict[str, Interface] = {}
        for interface in self._document.interfaces:
            name = interface.name
            if not _is_attribute(name):
                message = f"`{name}` cannot be an attribute of `self`: a name has letters, digits and _"
                self._error("E530", message, interface)
            elif name in COMPONENT_ATTRIBUTES or name.startswith("_"):
                self._error("E530", f"`self.{name}` belongs to every component: choose another", interface)
            elif name in first:
                message = f"a second interface is called `{name}`"
                self._error("E530", message, interface, [self._first_is(first[name])])
            first.setdefault(name, interface)
            if not _IDENTITY.fullmatch(interface.identity):
                message = f"`{interface.identity[:60]}` cannot be the identity of a servant"
                note = Note("an identity has letters, digits and _ . -; `@realm` may follow it")
                self._error("E531", message, interface, [note])
            self._interface_type(interface, known)

    def _interface_type(self, interface: Interface, known: KnownInterfaces) -> None:
        found = known.find(interface.type)
        if len(found) == 1:
            return
        if found:
            names = ", ".join(f"`{candidate.scoped_name}`" for candidate in found)
            self._error("E532", f"`{interface.type}` may be {names}: write which", interface)
            return
        notes = [
            *did_you_mean(interface.type, known.by_name),
            Note("run codegen on its IDL; proxies outside the package `interfaces` are found with -I"),
        ]
        self._error("E532", f"there is no proxy for an interface `{interface.type}`", interface, notes)

    def _check_ancestors(self, automaton: Automaton) -> None:
        above: set[int] = set()
        current = self._automata.get(automaton.father)
        while current is not None and current.id not in above:  # a ring above it is told of its own members
            if current is automaton:
                self._error("E512", f"automaton {automaton.id} is its own ancestor", automaton)
                return
            above.add(current.id)
            if len(above) == _MAX_DEPTH:
                message = f"automaton {automaton.id} is nested deeper than {_MAX_DEPTH}"
                self._error("E512", message, automaton)
                return
            current = self._automata.get(current.father)

    def _unique_ids(self, items: Iterable[_Item], kind: str) -> None:
        first: dict[int, _Item] = {}
        for item in items:
            assert not isinstance(item, Interface)
            if item.id == 0:
                self._error("E517", f"the id of a {kind} is at least 1", item)
            elif item.id in first:
                self._error(
                    "E517", f"a second {kind} has the id {item.id}", item, [self._first_is(first[item.id])]
                )
            first.setdefault(item.id, item)

    def _first_is(self, item: _Item) -> Note:
        return Note("the first is here", self._place(item))

    def _place(self, item: _Item | Document | Text) -> Location:
        return Location(self._path, item.line, max(1, item.column))

    def _error(
        self, code: str, message: str, item: _Item | Document | Text, notes: Iterable[Note] = ()
    ) -> None:
        self._diagnostics.error(code, message, self._place(item), notes)

    def _warning(self, code: str, message: str, item: _Item, notes: Iterable[Note] = ()) -> None:
        self._diagnostics.warning(code, message, self._place(item), notes)


def _is_attribute(name: str) -> bool:
    """Return whether Python takes a name as it is written: it reads some characters as others."""
    normal = unicodedata.normalize("NFKC", name)
    return name.isidentifier() and not keyword.iskeyword(name) and name == normal
