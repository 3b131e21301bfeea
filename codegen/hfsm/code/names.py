"""Turn free names into valid names for Python, and write values and texts as Python."""

from __future__ import annotations

import keyword
import re
import unicodedata
from collections.abc import Collection
from typing import Final

from ..document import Document

RESERVED: Final = frozenset({"Automaton", "Component", "Proxy", "State", "Transition", "main", "self"})
"""Names that every generated component uses; `reserved_names` returns those of one document."""

COMPONENT_ATTRIBUTES: Final = frozenset({"automaton", "clock", "log", "mark", "send", "sleep"})
"""Attributes that every component has. A function of a document may override one of them."""

COMPONENT_ALIASES: Final = frozenset({"globalNamespace", "interfaces", "namespace", "rosNode"})
"""Names that VisualStates has for the component in places; each is the component itself."""

_LONGEST_NAME: Final = 100


def reserved_names(document: Document) -> frozenset[str]:
    """Return the names that the generated code of a document uses.

    Names of newer features are reserved only if the document uses them, so that older documents can still
    have a variable `Event`.
    """
    names = set(RESERVED)
    if any(
        transition.type == "event" for automaton in document.automata for transition in automaton.transitions
    ):
        names.add("Event")
    if document.parameters:
        names.add("Parameter")
    if document.ros:
        names |= {"ROS_TYPES", "Ros"}
    for name, is_used in (
        ("Input", any(automaton.inputs for automaton in document.automata)),
        ("Output", any(automaton.outputs for automaton in document.automata)),
    ):
        names |= {name, "bool", "float", "int", "object", "str"} if is_used else set()
    return frozenset(names)


def identifier(name: str, fallback: str) -> str:
    """Return a name as a Python identifier: `go to wall` as `go_to_wall`; `fallback` if nothing is left."""
    normal = unicodedata.normalize("NFKC", name)
    usable = "".join(character if f"a{character}".isidentifier() else " " for character in normal)
    joined = re.sub(r"_{2,}", "_", "_".join(usable.split())).strip("_")
    if not joined:
        return fallback
    if not joined.isidentifier() or keyword.iskeyword(joined):
        return f"{fallback}_{joined}" if joined[0].isdigit() else f"{joined}_"
    return joined


def is_name(name: str) -> bool:
    """Return whether Python keeps a name as it is written: it normalizes some characters."""
    normal = unicodedata.normalize("NFKC", name)
    return name.isidentifier() and not keyword.iskeyword(name) and name == normal


def component_name(stem: str) -> str:
    """Return the name of a document's component, in ASCII, since it is part of an identity."""
    plain = unicodedata.normalize("NFKD", stem).encode("ascii", "ignore").decode()
    return identifier(plain, "component")[:_LONGEST_NAME].rstrip("_")


def camel_case(name: str) -> str:
    """Return an identifier as a class name: `follow_ball` as `FollowBall`."""
    words = [word for word in name.split("_") if word]
    camel = "".join(word[0].upper() + word[1:] for word in words)
    return f"{camel}Component" if camel in RESERVED or keyword.iskeyword(camel) else camel


def unique(wanted: str, suffix: int | str, taken: Collection[str]) -> str:
    """Return a name that is not in `taken`: `wanted`, `wanted_<suffix>`, and so on."""
    if wanted not in taken:
        return wanted
    candidate = f"{wanted}_{suffix}"
    while candidate in taken:
        candidate += "_"
    return candidate


def literal(value: object) -> str:
    """Return a value as a literal; strings have double quotes."""
    return quoted(value) if isinstance(value, str) else repr(value)


def quoted(text: str) -> str:
    """Return a string literal, with double quotes unless that needs an escape."""
    written = repr(text)
    return f'"{written[1:-1]}"' if written.startswith("'") and '"' not in text else written


def docstring(text: str) -> str:
    """Return a text that is valid between triple quotes."""
    visible = "".join(character if character.isprintable() else " " for character in text)
    escaped = visible.replace("\\", "\\\\").replace('"""', '\\"\\"\\"')
    return f'{escaped[:-1]}\\"' if escaped.endswith('"') else escaped


def printable(name: str) -> str:
    """Return the name of a file in a form that is valid in a comment."""
    return "".join(character if character.isprintable() else "_" for character in name)
