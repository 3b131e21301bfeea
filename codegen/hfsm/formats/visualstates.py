"""Read the dialect of VisualStates, since 2017: states inside states, in five variants.

A state that holds states owns an automaton here; the outermost state stands for the component. A state that
is entered again restarts its automaton. Functions and variables belonged to the component, to a state or to
a namespace: here they belong to the automaton that the state owns, and all are reached through `self`.
"""

from __future__ import annotations

import ast
import re
from collections import defaultdict
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import count
from pathlib import Path
from typing import Final

from codegen.diagnostics import Diagnostics

from ..code.text import parse_piece
from ..codes import Code
from ..document import (
    DEFAULT_PERIOD,
    NO_CHILD,
    Automaton,
    Comment,
    Document,
    Element,
    Extra,
    Interface,
    Library,
    Parameter,
    State,
    Text,
    Transition,
)
from .elements import MAX_ID, NOTHING, ElementReader, Parts, node_fields, text_of
from .native import DOCUMENT_TAGS, INTERFACE_TAGS, STATE_TAGS, TRANSITION_TAGS
from .xml_tree import XmlComment, XmlElement

__all__ = ["PSEUDO_STATE", "VisualStatesReader"]

PSEUDO_STATE: Final = "pseudostate"
"""Holds what the outermost state has: it is no state of any automaton."""

_CODE: Final = ("functions", "variables")
_STATE_LEAVES: Final = ("posx", "posy", "name", "code", "timestep", *_CODE)
_STATE: Final = {"timestep": "", "functions": "", "variables": "", "namespace": ""}
_TRANSITION: Final = {
    "type": "",
    "originid": "origin",
    "destinationid": "destiny",
    "code": "transcode",
    "time": "trans",
    "condition": "trans",
}
_DOCUMENT: Final = {"functions": "", "variables": "", "global_namespace": "", "configs": ""}
_TRIGGERS: Final = {"0": "time", "1": "condition"}


class VisualStatesReader(ElementReader):
    """Makes a document of a tree of XML by VisualStates; what it does not understand it reports."""

    strict = False

    def __init__(self, path: Path, diagnostics: Diagnostics, remarks: Diagnostics | None = None) -> None:
        super().__init__(path, diagnostics, remarks)
        self._parts: dict[XmlElement, Parts] = {}
        self._namespaces: dict[XmlElement, Parts] = {}
        self._ids: dict[XmlElement, int] = {}
        self._owned: dict[XmlElement, int] = {}
        self._kept_namespaces: set[XmlElement] = set()
        """The namespaces in which something has no word here."""
        self._functions: set[str] = set()
        self._renamed: defaultdict[XmlElement | _Level, dict[str, str]] = defaultdict(dict)
        """The new names of functions, for the code of a level and for that of one state."""

    def document(self, root: XmlElement) -> Document:
        """Return the document; worth nothing if the reader has `failed` afterwards."""
        parts = self.parts(
            root,
            nodes=("state",),
            leaves=_CODE,
            containers=("config", "configs", "libraries", "global_namespace"),
            taken=DOCUMENT_TAGS,
        )
        levels, self._ids = _levels_of(self, parts.all("state"))
        self._owned = {level.owner: level.id for level in levels if level.owner is not None}
        for level in levels:
            for state in (*level.states, level.owner):
                if state is not None and state not in self._parts:
                    self._read(state)
        shared_element = parts.first("global_namespace")
        shared = self._namespace(shared_element)
        code = {level: self._code_of(level, (parts, shared)) for level in levels}
        outgoing = self._outgoing(levels)
        self._ids |= self.ids(
            [each for level in levels for each, _ in outgoing[level]],
            lambda transition: transition.attributes.get("id"),
        )
        owners = [self._parts[each.owner].first("namespace") for each in levels if each.owner is not None]
        parameters = self._read_parameters([shared_element, *owners])
        automata = tuple(self._automaton(level, outgoing[level], code[level], parts) for level in levels)
        libraries, libraries_extras = _read_libraries(self, parts.first("libraries"))
        interfaces, config_extras = _read_interfaces(self, parts.first("config"), parts.first("configs"))
        fields = node_fields(
            root, parts, native={**_DOCUMENT, "configs": "" if parts.first("config") else "config"}
        )
        fields["extras"] += self._kept_namespace(shared_element)
        if levels[0].owner is not None:
            fields["extras"] += (self._pseudo_state(levels[0].owner),)
        return Document(
            parameters=parameters,
            automata=automata,
            libraries=libraries,
            interfaces=interfaces,
            libraries_extras=libraries_extras,
            config_extras=config_extras,
            **fields,
        )

    def _read(self, state: XmlElement) -> None:
        self._parts[state] = self.parts(
            state,
            nodes=("state", "transition"),
            leaves=_STATE_LEAVES,
            containers=("namespace",),
            taken=STATE_TAGS | {"state", "transition"},
        )
        self._namespaces[state] = self._namespace(self._parts[state].first("namespace"))

    def _namespace(self, element: XmlElement | None) -> Parts:
        """Return what a namespace holds; where anything in it is unknown all of it is kept, too."""
        if element is None:
            return NOTHING
        parts = self.parts(element, leaves=_CODE, containers=("parameters",))
        if parts.extras or parts.details:
            self._kept_namespaces.add(element)
        return parts

    def _code_of(self, level: _Level, shared: tuple[Parts, ...]) -> tuple[Text, ...]:
        """Return the functions and the variables of an automaton; the root has the `shared` ones, too."""
        around = list(shared) if level.is_root else []
        if level.owner is not None:
            around += [self._parts[level.owner], self._namespaces[level.owner]]
        for parts in around:
            self._rename_functions(parts.first("functions"), level, level)
        inside = [(state, self._parts[state]) for state in level.states if state not in self._owned]
        for state, parts in inside:
            self._rename_functions(parts.first("functions"), level, state)
        return tuple(self._code(tag, level, around, inside) for tag in _CODE)

    def _rename_functions(
        self, element: XmlElement | None, level: _Level, scope: XmlElement | _Level
    ) -> None:
        """Find new names for functions whose names are taken: each namespace had its own.

        `scope` is the level, or the one state whose functions they are.
        """
        tree = None if element is None else parse_piece(element.text)
        if element is None or tree is None:
            return
        names = {each.name for each in tree.body if isinstance(each, ast.FunctionDef)}
        suffix = f"{level.id}" if isinstance(scope, _Level) else f"{level.id}_{self._ids[scope]}"
        taken = sorted(names & self._functions)
        if taken:
            self._renamed[scope] |= {name: f"{name}_{suffix}" for name in taken}
            listed = ", ".join(f"`{name}`" for name in taken)
            message = f"another namespace has {listed}, too: here the names end with `_{suffix}`"
            self.warn(element, Code.OLD_CODE_CHANGED, message)
        self._functions |= names

    def _with_new_names(self, text: Text, *scopes: XmlElement | _Level | None) -> Text:
        """Return code in which functions of some scopes have their new names."""
        for scope in scopes:
            for old, new in self._renamed.get(scope, {}).items() if scope is not None else ():
                name = re.compile(
                    rf"(\bdef\s+|\bself\.(?:(?:namespace|interfaces|rosNode)\.)?){re.escape(old)}\b"
                )
                text = replace(text, text=name.sub(rf"\1{new}", text.text))
        return text

    def _automaton(
        self,
        level: _Level,
        transitions: list[tuple[XmlElement, XmlElement]],
        code: tuple[Text, ...],
        root: Parts,
    ) -> Automaton:
        owner = level.owner
        owned = NOTHING if owner is None else self._parts[owner]
        functions, variables = code
        period = text_of(owned.first("timestep"), default=DEFAULT_PERIOD)
        before = root if owner is None else owned
        return Automaton(
            id=level.id,
            father=level.father,
            states=tuple(
                self._state(state, level, period, before.comments_before(state)) for state in level.states
            ),
            transitions=tuple(self._transition(each, source, level) for each, source in transitions),
            iteration_time=period,
            variables=variables,
            functions=functions,
            comments=() if owner is None else root.comments_before(owner),
            line=0 if owner is None else owner.line,
            column=0 if owner is None else owner.column,
        )

    def _code(
        self, tag: str, level: _Level, around: Iterable[Parts], inside: Iterable[tuple[XmlElement, Parts]]
    ) -> Text:
        """Return the functions or variables of an automaton: those of the states around and inside it."""
        outer = [found for parts in around if (found := parts.first(tag)) is not None]
        inner = {found: state for state, parts in inside if (found := parts.first(tag)) is not None}
        pieces = [piece for piece in (*outer, *inner) if piece.text.strip()]
        if not pieces:
            return text_of(outer[-1]) if outer else Text()
        texts = [self._with_new_names(text_of(each), inner.get(each), level).text for each in pieces]
        joined = "".join(text if text.endswith("\n") else f"{text}\n" for text in texts[:-1])
        return Text(joined + texts[-1], pieces[0].text_line, pieces[0].text_column)

    def _state(
        self, element: XmlElement, level: _Level, period: Text, comments: tuple[Comment, ...]
    ) -> State:
        parts = self._parts[element]
        owned = self._owned.get(element, NO_CHILD)
        fields = node_fields(element, parts, "id", "initial", comments=comments, native=_STATE)
        timestep = parts.first("timestep")
        if timestep is not None and owned == NO_CHILD:
            if timestep.text.strip() != period.text.strip():
                message = "the `timestep` of a state that holds none is kept, and not used"
                self.remark(timestep, message)
            fields["extras"] += (self.kept(timestep),)
        namespace = parts.first("namespace")
        if namespace is not None and owned == NO_CHILD and not _is_blank(namespace):
            self.remark(element, "the namespace of a state that holds none is kept, and not used")
            self._kept_namespaces.add(namespace)
        fields["extras"] += self._kept_namespace(namespace)
        return State(
            id=self._ids[element],
            name=text_of(parts.first("name")).text,
            initial=self.parse_flag(element, "initial", element.attributes.get("initial")),
            x=self.number(parts.first("posx")),
            y=self.number(parts.first("posy")),
            children=() if owned == NO_CHILD else (owned,),
            history=Text() if owned == NO_CHILD else Text("restart", element.line, element.column),
            code=self._with_new_names(text_of(parts.first("code")), element, level),
            **fields,
        )

    def _outgoing(self, levels: list[_Level]) -> dict[_Level, list[tuple[XmlElement, XmlElement]]]:
        """Return the transitions of each automaton, each with the state in which it stands.

        They stand in the state that they leave; one that stands around that is found, too.
        """
        owned = {level.owner: level for level in levels}
        found: dict[_Level, list[tuple[XmlElement, XmlElement]]] = {level: [] for level in levels}
        if levels[0].owner is not None:
            outermost = levels[0].owner
            found[levels[0]] += [(each, outermost) for each in self._parts[outermost].all("transition")]
        for level in levels:
            own = {self._ids[state] for state in level.states}
            for state in level.states:
                below = {self._ids[inner] for inner in _states_in(state)}
                for each in self._parts[state].all("transition"):
                    origin = self._origin(each, state)
                    home = owned[state] if origin in below - own else level
                    found[home].append((each, state))
        return found

    def _origin(self, transition: XmlElement, state: XmlElement) -> int:
        """Return the id that a transition says it leaves, or that of the state in which it stands."""
        written = next((each for each in transition.elements() if each.tag == "originid"), None)
        if written is None or not written.text.strip():
            return self._ids.get(state, 0)
        digits = written.text.strip()
        return int(digits) if digits.isascii() and digits.isdigit() and len(digits) <= 10 else -1

    def _transition(self, element: XmlElement, state: XmlElement, level: _Level) -> Transition:
        tags = {each.tag: each.text.strip() for each in element.elements()}
        written = tags.get("type") or ("0" if "time" in tags else "1")
        kind = _TRIGGERS.get(written, written)
        trigger_tag = kind if kind in _TRIGGERS.values() else "condition"
        leaves = ("posx", "posy", "name", "type", "originid", "destinationid", "code", trigger_tag)
        parts = self.parts(element, leaves=leaves, taken=TRANSITION_TAGS)
        origin = parts.first("originid")
        return Transition(
            id=self._ids[element],
            name=text_of(parts.first("name")).text,
            x=self.number(parts.first("posx")),
            y=self.number(parts.first("posy")),
            origin=self._ids.get(state, 0)
            if origin is None or not origin.text.strip()
            else self.parse_id(origin, "originid", origin.text),
            destination=self.reference(element, parts.first("destinationid"), "destinationid"),
            type=kind,
            trigger=self._with_new_names(text_of(parts.first(trigger_tag)), state, level),
            code=self._with_new_names(text_of(parts.first("code")), state, level),
            **node_fields(
                element,
                parts,
                "id",
                comments=self._parts[state].comments_before(element),
                native=_TRANSITION,
            ),
        )

    def _kept_namespace(self, element: XmlElement | None) -> tuple[Extra, ...]:
        return () if element is None or element not in self._kept_namespaces else (self.kept(element),)

    def _pseudo_state(self, element: XmlElement) -> Element:
        """Return what the outermost state has, for it is no state of any automaton."""
        elsewhere = ("state", "transition", "namespace", "timestep", *_CODE)
        kept: list[Extra] = []
        comments: list[Extra] = []
        for child in element.children:
            if isinstance(child, XmlComment):
                comments.append(Comment(child.text))
                continue
            if child.tag not in elsewhere:
                kept += [*comments, self.kept(child)]
            comments.clear()
        parts = self._parts[element]
        kept += [*comments, *parts.lost_details(_STATE), *self._kept_namespace(parts.first("namespace"))]
        return Element(PSEUDO_STATE, tuple(element.attributes.items()), "", tuple(kept))

    def _read_parameters(self, namespaces: Iterable[XmlElement | None]) -> tuple[Parameter, ...]:
        """Return the parameters of namespaces; one with others that cannot be ours is kept."""
        found: dict[str, Parameter] = {}
        for namespace in namespaces:
            containers = () if namespace is None else namespace.elements()
            for element in (each for one in containers if one.tag == "parameters" for each in one.elements()):
                parameter = _parameter(element) if element.tag == "param" else None
                if parameter is not None and parameter.name not in found:
                    found[parameter.name] = parameter
                elif namespace is not None:
                    name = element.attributes.get("name", "")
                    self.remark(element, f"the parameter `{name}` is kept, and not used")
                    self._kept_namespaces.add(namespace)
        return tuple(found.values())


def _is_blank(element: XmlElement) -> bool:
    """Return whether nothing is written in an element."""
    return not element.text.strip() and all(
        not each.attributes and _is_blank(each) for each in element.elements()
    )


@dataclass(frozen=True, slots=True)
class _Level:
    """The states of one automaton, and the state around them that owns it."""

    id: int
    father: int
    owner: XmlElement | None
    states: tuple[XmlElement, ...]

    @property
    def is_root(self) -> bool:
        """Whether nothing stands around it but what stands for the component."""
        return self.father == NO_CHILD


def _levels_of(
    reader: ElementReader, outermost: Sequence[XmlElement]
) -> tuple[list[_Level], dict[XmlElement, int]]:
    """Return the automata, the root first and each before those below it, and the ids of all states.

    An automaton's id is that of the state that owns it and one, so that it does not change with what is
    drawn elsewhere; where two states have one id, the second automaton gets a free one.
    """
    owner = outermost[0] if len(outermost) == 1 else None
    if len(outermost) > 1:
        message = "there are several outermost states: they are taken for those of the root"
        reader.warn(outermost[1], Code.SEVERAL_OUTERMOST_STATES, message)
    top = tuple(outermost) if owner is None else _states_in(owner)
    every = [state for outer in top for state in _with_states_below(outer)]
    ids = reader.ids(every, lambda state: state.attributes.get("id"))
    used: set[int] = set()

    def number(wanted: int) -> int:
        is_free = wanted not in used and wanted <= MAX_ID
        found = wanted if is_free else next(n for n in count(1) if n not in used)
        used.add(found)
        return found

    around = 0 if owner is None else reader.optional_id(owner, "id", owner.attributes.get("id"))
    levels = [_Level(number(around + 1), NO_CHILD, owner, top)]
    # What an automaton has below it follows in the list, which grows while it is walked.
    for level in levels:
        for state in level.states:
            inside = _states_in(state)
            if inside:
                levels.append(_Level(number(ids[state] + 1), level.id, state, inside))
    return levels, ids


def _states_in(element: XmlElement) -> tuple[XmlElement, ...]:
    """Return the states that stand directly inside an element."""
    return tuple(each for each in element.elements() if each.tag == "state")


def _with_states_below(state: XmlElement) -> Iterator[XmlElement]:
    yield state
    for inner in _states_in(state):
        yield from _with_states_below(inner)


_INTERFACE: Final = {
    "name": "nameinterface",
    "proxyName": "nameproxy",
    "proxyname": "nameproxy",
    "ip": "ip",
    "port": "port",
    "interfaceName": "interface",
    "interface": "interface",
}
_PARAMETER_TYPES: Final = {
    "Boolean": "bool",
    "Integer": "int",
    "Float": "float",
    "String": "str",
    "Character": "str",
}


def _read_interfaces(
    reader: ElementReader, config: XmlElement | None, oldest: XmlElement | None
) -> tuple[tuple[Interface, ...], tuple[Extra, ...]]:
    """Return the interfaces of a component, and what else its configuration says.

    `config` holds a list of interfaces, or what ROS needs to know; `oldest` is the list of August 2017.
    """
    inside = NOTHING if config is None else reader.parts(
        config, containers=("interfaces",), taken=("iceinterface",)
    )  # fmt: skip
    listed = inside.first("interfaces")
    newer = NOTHING if listed is None else reader.parts(listed, ("interface",), taken=("iceinterface",))
    older = NOTHING if oldest is None else reader.parts(oldest, ("config",), taken=("iceinterface",))
    found = [_interface(reader, each, newer.comments_before(each)) for each in newer.all("interface")]
    found += [_interface(reader, each, older.comments_before(each)) for each in older.all("config")]
    extras = inside.lost_details({"interfaces": ""}) + inside.extras + newer.extras + older.extras
    return tuple(found), extras


def _interface(reader: ElementReader, element: XmlElement, comments: tuple[Comment, ...]) -> Interface:
    parts = reader.parts(element, leaves=_INTERFACE, taken=INTERFACE_TAGS)
    proxy = parts.first("proxyName") or parts.first("proxyname")
    ip, port = parts.first("ip"), parts.first("port")
    return Interface(
        name=text_of(parts.first("name")).text,
        proxy=None if proxy is None else proxy.text,
        ip=None if ip is None else ip.text,
        port=None if port is None else port.text,
        type=text_of(parts.first("interfaceName") or parts.first("interface")).text,
        **node_fields(element, parts, comments=comments, native=_INTERFACE),
    )


def _read_libraries(
    reader: ElementReader, container: XmlElement | None
) -> tuple[tuple[Library, ...], tuple[Extra, ...]]:
    """Return the libraries of a component, and what else stands among them."""
    parts = NOTHING if container is None else reader.parts(container, nodes=("library", "lib"))
    elements = sorted(parts.all("library") + parts.all("lib"), key=lambda each: (each.line, each.column))
    libraries = tuple(
        Library(
            name=text_of(each),
            **reader.text_fields(each, comments=parts.comments_before(each)),
        )
        for each in elements
    )
    return libraries, parts.extras


def _parameter(element: XmlElement) -> Parameter | None:
    """Return a parameter of the component, or None when its name or its type are none of Python."""
    name = element.attributes.get("name", "").strip()
    kind = _PARAMETER_TYPES.get(element.attributes.get("type", ""))
    if kind is None or not name.isidentifier():
        return None
    inside = {each.tag: each for each in element.elements()}
    value = text_of(inside.get("value"))
    return Parameter(
        name=name,
        type=Text(kind, element.line, element.column),
        default=Text(_literal(kind, value.text), value.line, value.column),
        description=text_of(inside.get("description")),
        line=element.line,
        column=element.column,
    )


def _literal(kind: str, value: str) -> str:
    if kind == "str":
        return repr(value)
    if kind == "bool":
        return {"true": "True", "false": "False"}.get(value.strip().lower(), value)
    return value.strip()
