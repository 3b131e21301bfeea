"""Read the variables of an automaton while its code runs, and set them.

The code of an automaton shares its variables as a closure, so they can be read and set without its help, and
without stopping it.
"""

from __future__ import annotations

import difflib
import itertools
import reprlib
from collections.abc import Callable, Collection, Iterable
from numbers import Integral, Real
from types import CellType, ModuleType
from typing import Final

import msgspec

from zenoh_ice import Sample
from zenoh_ice.data.text import sentence

from ._automaton import Automaton
from .errors import UnknownElementError, ValueTypeError

_LONGEST_VALUE: Final = 120
_KINDS: Final = (Real, str, (list, tuple), dict)


def variables_of(automaton: Automaton) -> dict[str, str]:
    """Return the variables that the automaton's code uses, by name, each as its repr cut to 120 characters.

    Variables that no code has assigned yet are left out, and so are functions, classes and modules.
    """
    return {name: short_repr(value) for name, value in sorted(values_of(automaton).items())}


def values_of(automaton: Automaton) -> dict[str, object]:
    """Return the values of the variables that the automaton's code uses, by name, as `variables_of` does."""
    values: dict[str, object] = {}
    for name, cell in cells_of(automaton).items():
        try:
            value = cell.cell_contents
        except ValueError:  # nothing has been assigned
            continue
        if not _is_code(value):
            values[name] = value
    return values


def _is_code(value: object) -> bool:
    # By its type alone: a proxy of an object that is gone raises an exception when asked for its class.
    return callable(value) or issubclass(type(value), ModuleType)


def functions_of(automaton: Automaton) -> list[Callable[..., object]]:
    """Return the code of an automaton."""
    functions: list[Callable[..., object] | None] = [automaton.set_inputs, automaton.get_outputs]
    for state in automaton.states:
        functions += [state.entry, state.code, state.exit, state.arguments, state.results]
    for transition in automaton.transitions:
        functions += [transition.guard, transition.code]
    return [each for each in functions if each is not None]


def cells_of(automaton: Automaton) -> dict[str, CellType]:
    """Return the closure cells of an automaton's variables, by name."""
    cells: dict[str, CellType] = {}
    for code in functions_of(automaton):
        closure = getattr(code, "__closure__", None)
        if closure:
            for name, cell in zip(code.__code__.co_freevars, closure, strict=True):
                cells.setdefault(name, cell)
    return {name: cell for name, cell in cells.items() if name != "self" and not name.startswith("__")}


def assign(automaton: Automaton, name: str, value: object) -> None:
    """Set a variable that the automaton's code uses.

    Values arrive as JSON, which has no tuples: a list for a variable that is a tuple becomes a tuple.

    Raises UnknownElementError when it uses none of this name, or the name is that of a function, and
    ValueTypeError when it is an input or an output of another type.
    """
    cell = cells_of(automaton).get(name)
    if cell is None:
        known = values_of(automaton)
        raise UnknownElementError(
            f"the code of automaton {automaton.id} ({automaton.name}) uses no variable {name!r}"
            f"{did_you_mean(name, known)}"
        )
    try:
        if _is_code(cell.cell_contents):
            raise UnknownElementError(f"{name} is not a variable of automaton {automaton.id}: it is code")
        value = _with_tuples(value, cell.cell_contents)
    except ValueError:  # nothing has been assigned
        pass
    for kind, declared in (("input", automaton.inputs), ("output", automaton.outputs)):
        wanted = next((each.type for each in declared if each.name == name), None)
        if wanted is not None:
            value = convert(value, wanted, f"the {kind} {name}")
    cell.cell_contents = value


def _with_tuples(value: object, present: object) -> object:
    """Return a value with tuples where the present one has them, at any depth."""
    if isinstance(value, list) and isinstance(present, list | tuple):
        beside = itertools.chain(present, itertools.repeat(present[-1] if present else None))
        items = [_with_tuples(each, other) for each, other in zip(value, beside, strict=False)]
        return tuple(items) if isinstance(present, tuple) else items
    if isinstance(value, dict) and isinstance(present, dict):
        return {key: _with_tuples(each, present.get(key)) for key, each in value.items()}
    return value


def check_kind(automaton: Automaton, name: str, value: object) -> None:
    """Raise ValueTypeError for a value of another kind than the present one of a variable.

    Kinds are numbers, texts, lists and dictionaries; None may become anything, and anything None.
    """
    present = values_of(automaton).get(name)
    kind = next((kind for kind in _KINDS if isinstance(present, kind)), None)
    if kind is not None and value is not None and not isinstance(value, kind):
        now, given = type(present).__name__, type(value).__name__
        raise ValueTypeError(f"{name} is {now} now ({short_repr(present)}), not {given}: {value!r:.80}")


def convert(value: object, wanted: type, what: str) -> object:
    """Return a value as the type of a parameter, an input or an output; raises ValueTypeError.

    NumPy's numbers count as Python's.
    """
    truth = isinstance(value, bool) or type(value).__name__ in ("bool_", "bool")
    if wanted is object or (wanted is str and isinstance(value, str)):
        return value
    if wanted is bool and truth:
        return bool(value)
    if wanted is int and isinstance(value, Integral) and not truth:
        return int(value)
    if wanted is float and isinstance(value, Real) and not truth:
        try:
            return float(value)
        except OverflowError:
            raise ValueTypeError(
                sentence(f"{what} is too large for a float: {short_repr(value)[:80]}")
            ) from None
    given = type(value).__name__
    raise ValueTypeError(sentence(f"{what} is {wanted.__name__}, not {given}: {short_repr(value)[:80]}"))


def did_you_mean(name: str, known: Iterable[str]) -> str:
    """Return `: did you mean ...?` with the known names that resemble one, or `: there are ...`."""
    names = sorted(known)
    close = difflib.get_close_matches(name[:_LONGEST_VALUE], names, 3)
    if close:
        return f": did you mean {' or '.join(close)}?"
    return f": there are {', '.join(names)}" if names else ": there are none"


def short_repr(value: object) -> str:
    """Return the repr of any object, cut to 120 characters, whatever its repr raises."""
    try:
        text = _BoundedRepr().repr(value)
    except KeyboardInterrupt:
        raise
    except BaseException as error:  # noqa: BLE001 - a repr is user code, and may meet an object that changes
        text = f"<{type(value).__name__}: its repr raised {type(error).__name__}>"
    if len(text) > _LONGEST_VALUE:
        text = text[: _LONGEST_VALUE - 3] + "..."
    return text.encode("utf-8", "backslashreplace").decode()


class _BoundedRepr(reprlib.Repr):
    """A repr that does not walk through a million elements to show twenty. Use it for one value only."""

    def __init__(self) -> None:
        super().__init__()
        self.maxlevel = 6
        # An element takes three characters at least.
        self.maxlist = self.maxtuple = self.maxset = self.maxfrozenset = self.maxdeque = (
            _LONGEST_VALUE // 3 + 1
        )
        self.maxdict = self.maxarray = _LONGEST_VALUE // 3 + 1
        self.maxstring = self.maxother = self.maxlong = 4 * _LONGEST_VALUE
        self._left = _LONGEST_VALUE + 1

    def repr1(self, x: object, level: int) -> str:
        """Return the repr of an element; each takes a character, so that at some depth none shows."""
        self._left -= 1
        return super().repr1(x, level) if self._left >= 0 else "..."

    # reprlib's methods sort the elements: Python does not, and it costs as much as showing all of them.

    def repr_dict(self, value: dict[object, object], level: int) -> str:
        if value and level <= 0:
            return "{...}"
        shown = list(itertools.islice(value.items(), self.maxdict))
        items = [f"{self.repr1(key, level - 1)}: {self.repr1(item, level - 1)}" for key, item in shown]
        return "{" + ", ".join(items + ["..."] * (len(value) > len(shown))) + "}"

    def repr_set(self, value: set[object], level: int) -> str:
        return f"{{{self._elements(value, level)}}}" if value else "set()"

    def repr_frozenset(self, value: frozenset[object], level: int) -> str:
        return f"frozenset({{{self._elements(value, level)}}})" if value else "frozenset()"

    def repr_bytes(self, value: bytes | bytearray, level: int) -> str:  # noqa: ARG002 - reprlib calls it so
        return repr(value[:_LONGEST_VALUE])

    repr_bytearray = repr_bytes

    def repr_instance(self, x: object, level: int) -> str:
        # Images and their samples: their own repr would write out every byte.
        if isinstance(x, msgspec.Struct):
            names = x.__struct_fields__ if level > 0 else ()
            members = ", ".join(f"{name}={self.repr1(getattr(x, name), level - 1)}" for name in names)
            return f"{type(x).__name__}({members or '...'})"
        if isinstance(x, Sample):
            return f"<sample {x.sequence} at {x.time:.3f} s: {self.repr1(x.value, level - 1)}>"
        return super().repr_instance(x, level)

    def _elements(self, values: Collection[object], level: int) -> str:
        if level <= 0:
            return "..."
        shown = list(itertools.islice(values, self.maxset))
        items = [self.repr1(value, level - 1) for value in shown]
        return ", ".join(items + ["..."] * (len(values) > len(shown)))
