"""What is known of all code of a document: evaluating a piece reads it, and adds to it."""

from __future__ import annotations

import ast
from abc import ABC, abstractmethod
from typing import Final

from ._definitions import Definitions
from ._literals import literals_of
from ._piece_effects import Effects, ProxyCall, anything
from ._possible_values import (
    CONTAINER,
    DATA,
    NOTHING,
    SELF,
    UNSURE,
    Names,
    Value,
    Values,
    defaults_of,
    united,
)
from .analysis import Analysis
from .code.names import COMPONENT_ALIASES, COMPONENT_ATTRIBUTES, identifier

NOWHERE: Final = ast.Module([], [])
_HIDDEN: Final = frozenset({"automaton", "_hfsm_send", "_hfsm_clock", "_hfsm_sleep", "_hfsm_mark"})


class KnownCode(ABC):
    """The values and the effects that were found so far."""

    def __init__(self, analysis: Analysis) -> None:
        self.analysis: Final = analysis
        self.definitions = Definitions(analysis)
        self.attributes: Names = {}
        """The values of attributes that code assigns."""
        self.escaped: set[Value] = {SELF} if self.definitions.is_exposed else set()
        """The capabilities that code has which cannot be followed, and `DATA` if it may change in place."""
        self.contents: Values = NOTHING
        """What may be in containers."""
        self.local: dict[str, Effects] = {}
        self.parameters: dict[str, Names] = {}
        """The effects of nested functions and lambdas, and the values of their parameters."""
        self.waited: Final = sorted(
            {
                each.trigger.text.strip()
                for automaton in analysis.document.automata
                for each in automaton.transitions
                if each.type == "event"
            }
        )
        """The events that transitions wait for."""
        self.literals: Final = literals_of(analysis)
        self.is_total: dict[ast.Compare, bool] = {}
        """Whether what each comparison compares is in order: whole numbers, or texts."""
        self.called_kinds: dict[ast.Call, frozenset[str]] = {}
        """The kinds of what each call may call."""

    @abstractmethod
    def called(self, name: str, passed: Names) -> Effects:
        """Return the effects of a function of the document for these values of its parameters."""

    def effects_of(self, value: Value) -> Effects:
        """Return what code may do that has a capability."""
        match value.kind:
            case "self":
                return anything(NOWHERE)
            case "send":
                return Effects(any_event=[NOWHERE])
            case "proxy":
                return Effects(any_call=[NOWHERE])
            case "operation":
                return Effects(possible={ProxyCall(*value.name.split(".", 1))})
            case "function":
                function = self.definitions.functions[value.name]
                found = self.called(value.name, dict.fromkeys(defaults_of(function), UNSURE))
                self._give_away(found.returned)
                return found
            case "local":
                local = self.local.get(value.name, Effects())
                self._give_away(local.returned)
                return local
        return Effects()

    def _give_away(self, values: Values) -> None:
        """Let others have what a function returns: they may change it in place."""
        self.escaped |= values & {DATA}
        if values & CONTAINER:
            self.contents = united(self.contents, UNSURE)

    def names_of_component(self) -> set[str]:
        """Return the attributes of the component that code can read, without special ones."""
        known, states = self.definitions, self.analysis.document.states()
        names = {*_HIDDEN, *COMPONENT_ATTRIBUTES, *COMPONENT_ALIASES, *known.proxies, *known.defined}
        for _, state in states:  # what builds the automata again
            method = f"automaton_{identifier(state.name, 'state')}"
            names |= {method, *(f"{method}_{child}" for child in state.children)}
        return names
