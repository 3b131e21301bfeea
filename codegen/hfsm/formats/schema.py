"""Tables of the native format: the element of each field of the model, in the order of the file.

The reader, the writer and the readers of old dialects share them. The format is VisualHFSM's of 2013 to
2017, with later additions.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import MISSING, dataclass, fields, replace
from typing import Final, get_type_hints

from codegen.hfsm import document as model


@dataclass(frozen=True, slots=True)
class Leaf:
    """An element or attribute with one value of a `type`: `Text`, `str`, `float`, `bool` or an id.

    An `optional` leaf is omitted if the value is the model's `default`. One that `repeats` has one of several
    ids.
    """

    field: str
    type: object
    default: object
    optional: bool
    repeats: bool

    @property
    def is_id(self) -> bool:
        """Whether it is an id that must exist."""
        return self.type is int and self.default is MISSING


@dataclass(frozen=True, slots=True)
class NodeKind:
    """An element of the model: its tag, and its attributes and children in the order of the file.

    One with `text` has the field of that name as its text, and no children.
    """

    tag: str
    model: type[model.Node]
    attributes: Mapping[str, Leaf]
    children: Mapping[str, Leaf | Items]
    text: str = ""


@dataclass(frozen=True, slots=True)
class Items:
    """Child nodes of one kind: any number, at most `one`, or `listed` in an enclosing element.

    A list that is not `optional` is written even if it is empty.
    """

    field: str
    kind: NodeKind
    one: bool = False
    listed: bool = False
    optional: bool = False

    @property
    def repeats(self) -> bool:
        """Whether there may be several elements with the tag."""
        return not (self.one or self.listed)


_LEAF: Final = re.compile(r"(?P<tag>\w+)(=(?P<field>\w+))?(?P<mark>[?*]?)")


def _leaves(kind: type[model.Node], table: str) -> dict[str, Leaf]:
    """Return leaves by tag from a table of `tag=field`; `=field` is omitted if both names are equal.

    `?` means optional, and `*` repeated.
    """
    types = get_type_hints(kind)
    defaults = {each.name: each.default for each in fields(kind)}
    found: dict[str, Leaf] = {}
    for match in map(_LEAF.fullmatch, table.split()):
        assert match is not None, table
        name, mark = match["field"] or match["tag"], match["mark"]
        found[match["tag"]] = Leaf(name, types[name], defaults[name], mark == "?", mark == "*")
    return found


def _kind(
    tag: str, node: type[model.Node], attributes: str = "", leaves: str = "", text: str = "", **items: Items
) -> NodeKind:
    """Return a kind of element whose children are leaves and items."""
    return NodeKind(tag, node, _leaves(node, attributes), {**_leaves(node, leaves), **items}, text)


_PARAMETER: Final = _kind("parameter", model.Parameter, leaves="name type default? description?")
_EVENT: Final = _kind("event", model.Event, leaves="name description?")
_PROPERTY: Final = _kind("property", model.Property, "kind", "name within? expression")
_SURVIVES: Final = _kind("survives", model.Survives, "part kind amount? after? must?")
_LIBRARY: Final = _kind("lib", model.Library, "kind?", text="name")
INTERFACE: Final = _kind(
    "iceinterface",
    model.Interface,
    leaves="nameinterface=name nameproxy=proxy? ip? port? interface=type",
)
_ROS: Final = _kind("rosinterface", model.RosInterface, "kind", "name target type qos? stop?")
STATE: Final = _kind(
    "state",
    model.State,
    "initial id",
    "posx=x posy=y name idSubautomataSon=children child=children* final? history? entry? code exit?",
    argument=Items("arguments", _kind("argument", model.Argument, "name child?", text="value")),
    result=Items("results", _kind("result", model.Result, "name child?", text="variable")),
)
TRANSITION: Final = _kind(
    "transition",
    model.Transition,
    "id",
    "posx=x posy=y origin destiny=destination transcode=code name trans=trigger guard? priority?",
)
ANNOTATION: Final = _kind(
    "annotation",
    model.Annotation,
    "id kind",
    "posx=x posy=y width height color? text",
)
AUTOMATON: Final = NodeKind(
    "SubAutomata",
    model.Automaton,
    _leaves(model.Automaton, "id idFather=father"),
    {
        "state": Items("states", STATE),
        "transition": Items("transitions", TRANSITION),
        "annotation": Items("annotations", ANNOTATION),
        "input": Items("inputs", replace(_PARAMETER, tag="input")),
        "output": Items("outputs", replace(_PARAMETER, tag="output")),
        "import": Items("imported", _kind("import", model.Import, "automaton?", text="file"), one=True),
        **_leaves(model.Automaton, "iteration_time variables functions"),
    },
)
DOCUMENT: Final = _kind(
    "VisualHFSM",
    model.Document,
    leaves="description? onerror=on_error? onrefused=on_refused? world? dialect? language?",
    shelf=Items("shelf", _kind("shelf", model.Shelf, leaves="title? category? icon? words?"), one=True),
    parameters=Items("parameters", _PARAMETER, listed=True, optional=True),
    events=Items("events", _EVENT, listed=True, optional=True),
    properties=Items("properties", _PROPERTY, listed=True, optional=True),
    survives=Items("survives", _SURVIVES),
    SubAutomata=Items("automata", AUTOMATON),
    libraries=Items("libraries", _LIBRARY, listed=True),
    config=Items("interfaces", INTERFACE, listed=True),
    ros=Items("ros", _ROS, listed=True, optional=True),
)


def enclosing_tags(tag: str) -> list[str]:
    """Return the tags of the elements in which an element has a meaning, none for an unknown one."""
    found: list[str] = []
    pending = [DOCUMENT]
    for kind in pending:  # grows
        found += [kind.tag] if tag in kind.children else []
        for around, child in kind.children.items():
            if isinstance(child, Items):
                found += [around] if child.listed and tag == child.kind.tag else []
                pending.append(child.kind)
    return found
