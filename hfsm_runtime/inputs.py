"""Hand the values of a state to the inputs of its automata, type-checked."""

from __future__ import annotations

from collections.abc import Mapping
from numbers import Integral, Real
from typing import Final

from .automaton import REQUIRED, Automaton, Input, State
from .errors import ArgumentError

__all__ = ["hand_over"]

_NOTHING: Final[Mapping[str, object]] = {}


def hand_over(state: State, arguments: Mapping[int, Mapping[str, object]]) -> None:
    """Set the inputs of a state's automata; those without an argument keep their value.

    `arguments` are values by the automaton's id and the input's name. Nothing is set when one of them cannot
    be: raises ArgumentError.
    """
    unknown = arguments.keys() - {child.id for child in state.children}
    if unknown:
        raise ArgumentError(f"the state {state.name!r} owns no automaton {min(unknown)}")
    checked = [(child, _check(state, child, arguments.get(child.id, _NOTHING))) for child in state.children]
    for child, values in checked:
        if values and child.set_inputs is not None:
            child.set_inputs(values)


def _check(state: State, child: Automaton, values: Mapping[str, object]) -> dict[str, object]:
    inputs = {declared.name: declared for declared in child.inputs}
    label = f"automaton {child.id} ({child.name!r}) of the state {state.name!r}"
    for name in values:
        if name not in inputs:
            raise ArgumentError(f"{label} has no input {name!r}: it has {', '.join(inputs) or 'none'}")
    for declared in child.inputs:
        if declared.default is REQUIRED and declared.name not in values:
            raise ArgumentError(f"{label} is not handed its input {declared.name!r}, which has no default")
    return {name: _convert(value, inputs[name], label) for name, value in values.items()}


def _convert(value: object, declared: Input, label: str) -> object:
    """Return a value as the input's type; NumPy's numbers count as Python's."""
    wanted = declared.type
    if wanted is object:
        return value
    truth = isinstance(value, bool) or type(value).__name__ in ("bool_", "bool")
    if wanted is bool and truth:
        return bool(value)
    if wanted is int and isinstance(value, Integral) and not truth:
        return int(value)
    if wanted is float and isinstance(value, Real) and not truth:
        return float(value)
    if wanted is str and isinstance(value, str):
        return value
    raise ArgumentError(
        f"the input {declared.name!r} of {label} is {wanted.__name__} and was handed a "
        f"{type(value).__name__}: {value!r:.80}"
    )
