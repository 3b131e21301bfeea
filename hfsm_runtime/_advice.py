"""Say in the words of the document what is wrong when its code fails."""

from __future__ import annotations

import difflib
from collections.abc import Iterator, Sequence
from inspect import isfunction
from typing import Final

from zenoh_ice.data.text import sentence

from ._automaton import Automaton
from ._variables import cells_of, functions_of
from .component import Component
from .errors import describe
from .loading import how_to_install

_LONGEST_NAME: Final = 100


def explain(error: BaseException, component: Component | None, automata: Sequence[Automaton]) -> str:
    """Return the name and the text of an exception, in words of the document where Python's do not help.

    `automata` are the one whose code has raised it, and those above it. What can be done follows a semicolon.
    """
    text = describe(error)
    match error:
        case ModuleNotFoundError():
            return f"{text}: {how_to_install(error)}"
        case AttributeError(name=str(name), obj=Component() as obj) if obj is component:
            # One that is declared says itself what is wrong, as an interface that is not connected.
            return text if hasattr(type(obj), name) else f"AttributeError: {_undeclared(name, obj)}"
        case NameError(name=str(name)):
            return _unset(name, component, automata) or text
    return text


def _undeclared(name: str, component: Component) -> str:
    names = object.__dir__(component)  # a document may define another one, which may fail
    known = {each for each in names if not each.startswith("_")}
    close = difflib.get_close_matches(name[:_LONGEST_NAME], sorted(known), 2)
    if close:
        meant = " or ".join(f"`self.{each}`" for each in close)
        advice = sentence(f"did you mean {meant}?")
    else:
        advice = sentence("declare an interface, function or parameter, or assign it first")
    return sentence(f"`self.{name}` is not declared") + f"; {advice}"


def _unset(name: str, component: Component | None, automata: Sequence[Automaton]) -> str:
    """Return why a variable has no value; empty for a name that no automaton has."""
    if not automata:
        return ""
    own, *above = automata
    is_assigned = name in cells_of(own)
    declared = [*_variables_above(component, own)]
    for index, automaton in enumerate(above):
        if name in cells_of(automaton) or (index < len(declared) and name in declared[index]):
            advice = sentence(f"pass it to {own.name} as an input, or write `self.{name}` in both")
            if is_assigned:
                advice = sentence(f"make it an output of {own.name}, or write `self.{name}` in both")
            why = sentence(f"`{name}` is a variable of {automaton.name}, and {own.name} has its own")
            return f"NameError: {why}; {advice}"
    if is_assigned:
        why = sentence(f"`{name}` has no value yet")
        return f"NameError: {why}; " + sentence(f"give it one in the variables of {own.name}")
    return ""


def _variables_above(component: Component | None, automaton: Automaton) -> Iterator[frozenset[str]]:
    """Yield the names in the methods that make the automata above one, the nearest first.

    A variable that no code of its automaton uses is in no closure.
    """
    methods = {name: found.__code__ for name, found in vars(type(component)).items() if isfunction(found)}
    code = next(iter(functions_of(automaton)), None)
    name = (f"{getattr(code, '__qualname__', '')}...").split(".")[1]
    seen = {name}
    while (name := next((each for each, made in methods.items() if name in made.co_names), "")) not in seen:
        seen.add(name)
        if name not in methods:
            return
        yield frozenset((*methods[name].co_varnames, *methods[name].co_cellvars))
