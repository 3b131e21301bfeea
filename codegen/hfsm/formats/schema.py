"""The native format in tables: which element holds which field of the model, in the order of the file.

Reader, writer and the readers of old dialects share them. The format is VisualHFSM's of 2013 to 2017, with
what has been added to it since.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from enum import Enum, auto
from typing import Final

from ..document import (
    Argument,
    Automaton,
    Document,
    Event,
    Import,
    Interface,
    Library,
    Node,
    Parameter,
    Property,
    State,
    Transition,
)

__all__ = [
    "AUTOMATON",
    "DOCUMENT",
    "INTERFACE",
    "LIBRARY",
    "PARAMETER",
    "STATE",
    "TRANSITION",
    "Items",
    "Leaf",
    "NodeKind",
    "Value",
]


class Value(Enum):
    """What a leaf holds."""

    TEXT = auto()
    """Text with its place in the file."""
    STRING = auto()
    NUMBER = auto()
    """Pixels."""
    FLAG = auto()
    ID = auto()
    """An id, or 0 for none."""
    REFERENCE = auto()
    """The id of something that has to be there."""
    CHILD = auto()
    """The id of the first automaton that a state owns."""
    CHILDREN = auto()
    """The ids of the others, each in an element of its own."""


@dataclass(frozen=True, slots=True)
class Leaf:
    """An element or attribute that holds one value; an `optional` one is left out for the model's default.

    `attribute` is an attribute of the element that holds the field of the same name.
    """

    field: str
    value: Value = Value.TEXT
    optional: bool = False
    attribute: str = ""


@dataclass(frozen=True, slots=True)
class NodeKind:
    """An element of the model: its tag, its attributes and its children, both in the order of the file.

    One with a `text` holds the field of that name and has no children.
    """

    tag: str
    model: type[Node]
    attributes: Mapping[str, Leaf] = field(default_factory=dict)
    children: Mapping[str, Leaf | Items] = field(default_factory=dict)
    text: str = ""


@dataclass(frozen=True, slots=True)
class Items:
    """Nodes of one kind: side by side, at most `one`, or `listed` in an element around them.

    A list that is not `optional` is written even when it is empty.
    """

    field: str
    kind: NodeKind
    one: bool = False
    listed: bool = False
    optional: bool = False


_STRING: Final = Value.STRING
_NUMBER: Final = Value.NUMBER
_POSITION: Final = {"posx": Leaf("x", _NUMBER), "posy": Leaf("y", _NUMBER)}

PARAMETER: Final = NodeKind(
    "parameter",
    Parameter,
    children={
        "name": Leaf("name", _STRING),
        "type": Leaf("type"),
        "default": Leaf("default", optional=True),
        "description": Leaf("description", optional=True),
    },
)
_EVENT: Final = NodeKind(
    "event",
    Event,
    children={"name": Leaf("name", _STRING), "description": Leaf("description", optional=True)},
)
_PROPERTY: Final = NodeKind(
    "property",
    Property,
    {"kind": Leaf("kind", _STRING)},
    {
        "name": Leaf("name", _STRING),
        "within": Leaf("within", optional=True),
        "expression": Leaf("expression"),
    },
)
_ARGUMENT: Final = NodeKind(
    "argument",
    Argument,
    {"name": Leaf("name", _STRING), "child": Leaf("child", Value.ID, optional=True)},
    text="value",
)
_IMPORT: Final = NodeKind(
    "import", Import, {"automaton": Leaf("automaton", Value.ID, optional=True)}, text="file"
)
LIBRARY: Final = NodeKind("lib", Library, {"kind": Leaf("kind", _STRING, optional=True)}, text="name")
INTERFACE: Final = NodeKind(
    "iceinterface",
    Interface,
    children={
        "nameinterface": Leaf("name", _STRING),
        "nameproxy": Leaf("proxy", _STRING, optional=True),
        "ip": Leaf("ip", _STRING, optional=True),
        "port": Leaf("port", _STRING, optional=True),
        "interface": Leaf("type", _STRING),
    },
)
STATE: Final = NodeKind(
    "state",
    State,
    {"initial": Leaf("initial", Value.FLAG), "id": Leaf("id", Value.ID)},
    {
        **_POSITION,
        "name": Leaf("name", _STRING),
        "idSubautomataSon": Leaf("children", Value.CHILD),
        "child": Leaf("children", Value.CHILDREN),
        "final": Leaf("final", Value.FLAG, optional=True),
        "history": Leaf("history", optional=True),
        "entry": Leaf("entry", optional=True),
        "code": Leaf("code"),
        "exit": Leaf("exit", optional=True),
        "argument": Items("arguments", _ARGUMENT),
    },
)
TRANSITION: Final = NodeKind(
    "transition",
    Transition,
    {"id": Leaf("id", Value.ID)},
    {
        **_POSITION,
        "origin": Leaf("origin", Value.REFERENCE),
        "destiny": Leaf("destination", Value.REFERENCE),
        "transcode": Leaf("code"),
        "name": Leaf("name", _STRING),
        "trans": Leaf("trigger", attribute="type"),
        "guard": Leaf("guard", optional=True),
        "priority": Leaf("priority", optional=True),
    },
)
AUTOMATON: Final = NodeKind(
    "SubAutomata",
    Automaton,
    {"id": Leaf("id", Value.ID), "idFather": Leaf("father", Value.ID)},
    {
        "state": Items("states", STATE),
        "transition": Items("transitions", TRANSITION),
        "input": Items("inputs", replace(PARAMETER, tag="input")),
        "import": Items("imported", _IMPORT, one=True),
        "iteration_time": Leaf("iteration_time"),
        "variables": Leaf("variables"),
        "functions": Leaf("functions"),
    },
)
DOCUMENT: Final = NodeKind(
    "VisualHFSM",
    Document,
    children={
        "description": Leaf("description", optional=True),
        "onerror": Leaf("on_error", optional=True),
        "onrefused": Leaf("on_refused", optional=True),
        "dialect": Leaf("dialect", optional=True),
        "language": Leaf("language", optional=True),
        "parameters": Items("parameters", PARAMETER, listed=True, optional=True),
        "events": Items("events", _EVENT, listed=True, optional=True),
        "properties": Items("properties", _PROPERTY, listed=True, optional=True),
        "SubAutomata": Items("automata", AUTOMATON),
        "libraries": Items("libraries", LIBRARY, listed=True),
        "config": Items("interfaces", INTERFACE, listed=True),
    },
)
