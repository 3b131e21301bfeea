"""Elements of a document as JSON objects, for the page to draw.

An object has all fields of an element that the page can change, under their names in camelCase; the period of
an automaton is `period`. `x` and `y` are pixels: of a state its middle, of a transition its handle.
"""

from __future__ import annotations

from dataclasses import fields
from typing import Annotated, Any, Final

import msgspec

from codegen.hfsm import document
from codegen.hfsm.document import Automaton, Document, Interface, Node, Text

_KEPT_ALONE: Final = frozenset(each.name for each in fields(Node))
"""Fields that are kept for the file and not shown."""
_HIDDEN: Final[dict[type, frozenset[str]]] = {
    Document: frozenset(("automata", "dialect", "format", "functions", "lists", "root_tag", "shelf")),
    Interface: frozenset(("ip", "port")),
}
_NAMES: Final[dict[tuple[type, str], str]] = {(Automaton, "iteration_time"): "period"}


def of_page(name: str) -> msgspec.Meta:
    """Return what annotates a type with its name in the page, where that says more."""
    return msgspec.Meta(extra={"page": name})


AutomatonView = Annotated[dict[str, Any], of_page("Automaton")]
"""What `view` returns of an automaton."""


def view(node: Node) -> dict[str, Any]:
    """Return an element with all below it; of a document all but its automata.

    The result depends on nothing else and can be cached. An interface also has its effective `identity`.
    """
    found = {name: _value(getattr(node, field)) for field, name in SHOWN[type(node)]}
    if isinstance(node, Interface):
        found |= {"proxy": node.proxy or "", "identity": node.identity}
    return found


def _value(value: object) -> object:
    if isinstance(value, Text):
        return value.text
    if isinstance(value, Node):
        return view(value)
    return [_value(each) for each in value] if isinstance(value, tuple) else value


def _camel(name: str) -> str:
    first, *others = name.split("_")
    return first + "".join(each.capitalize() for each in others)


def _shown_fields(kind: type) -> tuple[tuple[str, str], ...]:
    """Return the fields of a kind of element that are shown, each with its name in JSON."""
    hidden = _KEPT_ALONE | _HIDDEN.get(kind, frozenset())
    return tuple(
        (each.name, _NAMES.get((kind, each.name)) or _camel(each.name))
        for each in fields(kind)
        if each.name not in hidden
    )


SHOWN: Final = {
    kind: _shown_fields(kind)
    for kind in vars(document).values()
    if isinstance(kind, type) and issubclass(kind, Node)
}
"""The fields of each kind of element that are shown, each with its name in JSON."""
