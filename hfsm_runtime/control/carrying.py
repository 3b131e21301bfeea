"""Carry what a component knows over to another version of it: its attributes and its variables."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from types import BuiltinFunctionType, FunctionType, MethodType, ModuleType
from typing import Any, Final

from ..automaton import Automaton
from ..component import Component, Parameter, Proxy, parameters_of, proxies_of
from ..variables import cells_of, values_of
from .expressions import plain

__all__ = ["FirstValues", "carry_variables", "first_values", "share_attributes", "take_attributes"]

FirstValues = Mapping[str, object]
"""Copies of the values that the variables of an automaton began with, by name, where they are plain data."""

_CODE: Final = (BuiltinFunctionType, FunctionType, MethodType, ModuleType, type)


def first_values(automaton: Automaton) -> FirstValues:
    """Return copies of the values that an automaton's variables have, as far as they are plain data."""
    values: dict[str, object] = {}
    for name, value in values_of(automaton).items():
        try:
            values[name] = plain(value)
        except ValueError:  # another object: whether it has changed since cannot be told
            continue
    return values


def carry_variables(old: Automaton, new: Automaton, first: FirstValues) -> list[str]:
    """Give the variables of a new version of an automaton the values that those of the old one have.

    A variable that still has its first value gets that of the new version: a number that was changed in the
    document counts. Functions, classes and modules are always those of the new version. Return the names of
    variables that have a value and are not in the new version.
    """
    cells = cells_of(new)
    lost = []
    for name, cell in cells_of(old).items():
        try:
            value = cell.cell_contents
        except ValueError:  # nothing has been assigned
            continue
        if _is_code(value):
            continue
        if name not in cells:
            lost.append(name)
            continue
        try:
            begins_with = cells[name].cell_contents
        except ValueError:
            cells[name].cell_contents = value
            continue
        if not _is_code(begins_with) and not (name in first and _same(value, first[name])):
            cells[name].cell_contents = value
    return sorted(lost)


def take_attributes(old: Component, new: Component) -> list[str]:
    """Give a new version of a component the attributes of the old one.

    Parameters and proxies that it declares differently are left out. Return what it could not take, for
    people.
    """
    kept, told = _kept(old, type(new))
    own = vars(new)
    own.update({name: value for name, value in vars(old).items() if name in kept})
    return told


def share_attributes(old: Component, new: Component) -> None:
    """Make the attributes of the old version of a component those of the new one.

    From then on they are one and the same: what a callback or a thread of the old version's code assigns is
    seen by the new one.
    """
    shared = vars(old)
    kept, _ = _kept(old, type(new))
    for name in [name for name in shared if name not in kept]:
        del shared[name]
    for name, value in vars(new).items():
        shared.setdefault(name, value)
    new.__dict__ = shared


def _kept(old: Component, new: type[Component]) -> tuple[set[str], list[str]]:
    """Return the names of the attributes that another version of a component takes, and what it does not."""
    told = list(_parameters_lost(old, new))
    parameters = {**parameters_of(old), **parameters_of(new)}
    former, present = proxies_of(old), proxies_of(new)
    kept = set()
    for name in vars(old):
        if name in parameters:
            keep = _same_type(parameters_of(old).get(name), parameters_of(new).get(name))
        elif name in former or name in present:
            keep = _same_servant(former.get(name), present.get(name))
        else:
            keep = not _defines(new, name) or _defines(type(old), name)
            if not keep:
                told.append(f"self.{name} was an attribute, and is now defined by the document")
        if keep:
            kept.add(name)
    return kept, told


def _parameters_lost(old: Component, new: type[Component]) -> Iterator[str]:
    present = parameters_of(new)
    for name, former in parameters_of(old).items():
        if name not in present:
            yield f"the parameter {name} is gone"
        elif name in vars(old) and not _same_type(former, present[name]):
            kind = type(present[name].default).__name__
            yield f"the parameter {name} is {kind} now and has its default again"


def _same_type(old: Parameter[Any] | None, new: Parameter[Any] | None) -> bool:
    return old is not None and new is not None and type(old.default) is type(new.default)


def _same_servant(old: Proxy[Any] | None, new: Proxy[Any] | None) -> bool:
    return old is not None and new is not None and (old.identity, old.type) == (new.identity, new.type)


def _defines(component: type[Component], name: str) -> bool:
    return any(name in vars(base) for base in _own_bases(component))


def _own_bases(component: type[Component]) -> Iterable[type]:
    return (base for base in component.__mro__ if base not in Component.__mro__)


def _is_code(value: object) -> bool:
    return issubclass(type(value), _CODE)


def _same(value: object, first: object) -> bool:
    try:
        present = plain(value)
    except ValueError:
        return False
    return type(present) is type(first) and repr(present) == repr(first)  # NaN is the same as NaN
