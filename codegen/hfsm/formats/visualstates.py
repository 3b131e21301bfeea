"""Translate the dialect of VisualStates, since 2017, to the native format.

Its states stand inside states, in five variants. A state that holds states owns an automaton here; the
outermost state stands for the component. A state that is entered again restarts its automaton. Functions and
variables belonged to the component, to a state or to a namespace: here they belong to the automaton that the
state owns, and all are reached through `self`.
"""

from __future__ import annotations

import ast
import re
from collections import defaultdict
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import count
from typing import Final

from ..code.text import parse_piece
from ..codes import Code
from ..document import DEFAULT_PERIOD, NO_CHILD, Comment
from .native import MAX_ID, Children, NativeReader, Translation
from .schema import DOCUMENT, INTERFACE, STATE, TRANSITION
from .xml_tree import XmlElement, new_leaf

__all__ = ["translate_visualstates"]

_PSEUDO_STATE: Final = "pseudostate"
"""Holds what the outermost state has: it is no state of any automaton."""

_CODE: Final = ("functions", "variables")
_STATE: Final = {tag: tag for tag in ("posx", "posy", "name", "code")}
_TRANSITION: Final = {
    **{tag: tag for tag in ("posx", "posy", "name")},
    "originid": "origin",
    "destinationid": "destiny",
    "code": "transcode",
}
_TRIGGERS: Final = {"0": "time", "1": "condition"}
_INTERFACE: Final = {
    **{tag: tag for tag in ("ip", "port", "interface")},
    "name": "nameinterface",
    "proxyName": "nameproxy",
    "proxyname": "nameproxy",
    "interfaceName": "interface",
}
_PARAMETER_TYPES: Final = {
    "Boolean": "bool",
    "Integer": "int",
    "Float": "float",
    "String": "str",
    "Character": "str",
}


def translate_visualstates(root: XmlElement, reader: NativeReader) -> XmlElement:
    """Return the root of a document of VisualStates as that of a native one."""
    return _Translator(reader).document(root)


class _Translator:
    def __init__(self, reader: NativeReader) -> None:
        self._reader = reader
        self._ids: dict[XmlElement, int] = {}
        self._owned: dict[XmlElement, _Level] = {}
        """The automata of states that hold states."""
        self._comments: dict[XmlElement, list[Comment]] = {}
        """The comments before states and transitions, which are put elsewhere."""
        self._kept: set[XmlElement] = set()
        """The namespaces in which something has no word here: they are kept whole."""
        self._functions: set[str] = set()
        self._renamed: defaultdict[XmlElement | _Level, dict[str, str]] = defaultdict(dict)
        """The new names of functions, for the code of a level and for that of one state."""

    def document(self, root: XmlElement) -> XmlElement:
        """Return the root of the native document."""
        levels, self._ids = _levels_of(self._reader, list(root.elements("state")))
        self._owned = {level.owner: level for level in levels if level.owner is not None}
        shared = root.first("global_namespace")
        code = {level: self._code_of(level, (root, shared)) for level in levels}
        outgoing = self._outgoing(levels)
        transitions = [each for level in levels for each, _ in outgoing[level]]
        self._reader.number(transitions)
        parameters = self._parameters([shared, *(each.first("namespace") for each in self._owned)])
        made = self._reader.translated(
            root,
            DOCUMENT.tag,
            DOCUMENT.children,
            {
                **dict.fromkeys(("config", "configs", "libraries"), lambda comments, _: [*comments]),
                **dict.fromkeys(_CODE, self._reader.read_elsewhere),
                "global_namespace": self._namespace,
            },
            {"state": self._moved},
        )
        if levels[0].owner is not None:
            made.children.append(self._pseudo_state(levels[0].owner))
        for level in levels:
            made.children += self._automaton(level, outgoing[level], code[level])
        made.children += [parameters, self._libraries(root), self._config(root)]
        return made

    def _moved(self, comments: list[Comment], element: XmlElement) -> Children:
        """Take an element out of the one around it, to be put elsewhere."""
        self._comments[element] = comments
        return []

    # States and transitions.

    def _automaton(
        self, level: _Level, transitions: list[tuple[XmlElement, XmlElement]], code: list[XmlElement]
    ) -> Children:
        """Return an automaton, with the comments before it."""
        owner = level.owner
        timestep = None if owner is None else owner.first("timestep")
        period = DEFAULT_PERIOD if timestep is None else timestep.text
        ids = {"id": str(level.id), "idFather": str(level.father)}
        made = XmlElement("SubAutomata", ids, *((0, 0) if owner is None else (owner.line, owner.column)))
        for state in level.states:
            element = self._state(state, level, period)
            made.children += [*self._comments.get(state, ()), element]
        for transition, source in transitions:
            element = self._transition(transition, source, level)
            made.children += [*self._comments.get(transition, ()), element]
        if timestep is not None:
            made.children.append(replace(timestep, tag="iteration_time", attributes={}, children=[]))
        made.children += code
        before = self._comments.get(owner, []) if owner is not None and level.is_root else []
        return [*before, made]

    def _state(self, element: XmlElement, level: _Level, period: str) -> XmlElement:
        owned = self._owned.get(element)

        def timestep(comments: list[Comment], found: XmlElement) -> Children:
            if owned is not None:
                return self._reader.read_elsewhere(comments, found)
            if found.text.strip() != period.strip():
                message = "the `timestep` of a state that holds none is kept, and not used"
                self._reader.remark(found, message)
            self._reader.expected.add(found)
            return [*comments, found]

        namespace = element.first("namespace")
        if namespace is not None and owned is None and not _is_blank(namespace):
            message = "the namespace of a state that holds none is kept, and not used"
            self._reader.remark(element, message)
            self._kept.add(namespace)
        code = dict.fromkeys(_CODE, self._reader.read_elsewhere)
        names: dict[str, str | Translation] = {
            **_STATE,
            **code,
            "timestep": timestep,
            "namespace": self._namespace,
        }
        nodes = {"state": self._moved, "transition": self._moved}
        made = self._reader.translated(element, "state", STATE.children, names, nodes)
        for each in made.elements("code"):
            each.text = self._with_new_names(each.text, element, level)
        if owned is not None:
            made.children.append(new_leaf("idSubautomataSon", str(owned.id), element))
            made.children.append(new_leaf("history", "restart", element))
        return made

    def _pseudo_state(self, element: XmlElement) -> XmlElement:
        """Return what the outermost state has, for it is no state of any automaton."""
        names = dict.fromkeys(("timestep", *_CODE), self._reader.read_elsewhere)
        nodes = {"state": self._moved, "transition": self._moved}
        made = self._reader.translated(
            element, _PSEUDO_STATE, (), {**names, "namespace": self._namespace}, nodes
        )
        for each in made.elements():
            if each.tag not in (*_STATE, "namespace"):
                self._reader.remark_unknown(each)
        self._reader.expected.add(made)
        return made

    def _outgoing(self, levels: list[_Level]) -> dict[_Level, list[tuple[XmlElement, XmlElement]]]:
        """Return the transitions of each automaton, each with the state in which it stands.

        They stand in the state that they leave; one that stands around that is found, too.
        """
        found: dict[_Level, list[tuple[XmlElement, XmlElement]]] = {level: [] for level in levels}
        if levels[0].owner is not None:
            outermost = levels[0].owner
            found[levels[0]] += [(each, outermost) for each in outermost.elements("transition")]
        for level in levels:
            own = {self._ids[state] for state in level.states}
            for state in level.states:
                below = {self._ids[inner] for inner in state.elements("state")}
                for each in state.elements("transition"):
                    home = self._owned[state] if self._origin(each, state) in below - own else level
                    found[home].append((each, state))
        return found

    def _origin(self, transition: XmlElement, state: XmlElement) -> int:
        """Return the id that a transition says it leaves, or that of the state in which it stands."""
        written = transition.first("originid")
        if written is None or not written.text.strip():
            return self._ids.get(state, 0)
        digits = written.text.strip()
        return int(digits) if digits.isascii() and digits.isdigit() and len(digits) <= 10 else -1

    def _transition(self, element: XmlElement, state: XmlElement, level: _Level) -> XmlElement:
        tags = {each.tag: each.text.strip() for each in element.elements()}
        written = tags.get("type") or ("0" if "time" in tags else "1")
        kind = _TRIGGERS.get(written, written)
        trigger = kind if kind in _TRIGGERS.values() else "condition"
        names: dict[str, str | Translation] = {
            **_TRANSITION,
            trigger: "trans",
            "type": self._reader.read_elsewhere,
        }
        made = self._reader.translated(element, "transition", TRANSITION.children, names)
        made.children += [
            new_leaf(tag, "", element) for tag in ("origin", "trans") if made.first(tag) is None
        ]
        for each in made.elements("origin", "trans", "transcode"):
            if each.tag != "origin":
                each.text = self._with_new_names(each.text, state, level)
            elif not each.text.strip():
                each.text = str(self._ids.get(state, 0))
            if each.tag == "trans":
                each.attributes = {**each.attributes, "type": kind}
        return made

    # Functions, variables and parameters.

    def _code_of(self, level: _Level, shared: Sequence[XmlElement | None]) -> list[XmlElement]:
        """Return the functions and the variables of an automaton; the root has the `shared` ones, too."""
        around = list(shared) if level.is_root else []
        if level.owner is not None:
            around += [level.owner, level.owner.first("namespace")]
        outer = [each for each in around if each is not None]
        inside = [state for state in level.states if state not in self._owned]
        for each in outer:
            self._rename_functions(each.first("functions"), level, level)
        for state in inside:
            self._rename_functions(state.first("functions"), level, state)
        return [found for tag in _CODE if (found := self._joined(tag, level, outer, inside)) is not None]

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
            self._reader.warn(element, Code.OLD_CODE_CHANGED, message)
        self._functions |= names

    def _with_new_names(self, text: str, *scopes: XmlElement | _Level) -> str:
        """Return code in which functions of some scopes have their new names."""
        for scope in scopes:
            for old, new in self._renamed.get(scope, {}).items():
                name = re.compile(
                    rf"(\bdef\s+|\bself\.(?:(?:namespace|interfaces|rosNode)\.)?){re.escape(old)}\b"
                )
                text = name.sub(rf"\1{new}", text)
        return text

    def _joined(
        self, tag: str, level: _Level, outer: Iterable[XmlElement], inside: Iterable[XmlElement]
    ) -> XmlElement | None:
        """Return the functions or variables of an automaton: those of the states around and inside it."""
        scoped: list[tuple[XmlElement, XmlElement | _Level]] = [
            *((each, level) for each in outer),
            *((state, state) for state in inside),
        ]
        pieces = [
            (found, scope) for each, scope in scoped if (found := each.first(tag)) and found.text.strip()
        ]
        if not pieces:
            return None
        texts = [self._with_new_names(each.text, scope, level) for each, scope in pieces]
        joined = "".join(text if text.endswith("\n") else f"{text}\n" for text in texts[:-1])
        return replace(pieces[0][0], attributes={}, children=[], text=joined + texts[-1])

    def _namespace(self, comments: list[Comment], element: XmlElement) -> Children:
        """Return a namespace in which something has no word here, and nothing of any other."""
        self._reader.expected.add(element)
        return [*comments, element] if element in self._kept else [*comments]

    def _parameters(self, namespaces: Iterable[XmlElement | None]) -> XmlElement:
        """Return the parameters of namespaces; a namespace with anything else but code is kept."""
        found: dict[str, XmlElement] = {}
        for namespace in namespaces:
            if namespace is None:
                continue
            for comments, child in namespace.commented():
                is_code = (
                    child is not None and child.tag in _CODE and not (child.attributes or child.children)
                )
                if comments or (child is not None and not is_code and child.tag != "parameters"):
                    self._kept.add(namespace)
                if child is not None and child.tag not in (*_CODE, "parameters"):
                    self._reader.remark_unknown(child)
            for element in (each for one in namespace.elements("parameters") for each in one.elements()):
                name = element.attributes.get("name", "").strip()
                kind = _PARAMETER_TYPES.get(element.attributes.get("type", ""))
                if element.tag == "param" and kind and name.isidentifier() and name not in found:
                    found[name] = _parameter(element, name, kind)
                else:
                    message = f"the parameter `{element.attributes.get('name', '')}` is kept, and not used"
                    self._reader.remark(element, message)
                    self._kept.add(namespace)
        return XmlElement("parameters", {}, 0, 0, children=[*found.values()])

    # Libraries and interfaces.

    def _libraries(self, root: XmlElement) -> XmlElement:
        def library(comments: list[Comment], element: XmlElement) -> Children:
            return [*comments, replace(element, tag="lib")]

        found = root.first("libraries") or XmlElement("libraries", {}, 0, 0)
        nodes = {"library": library, "lib": library}
        return self._reader.translated(found, "libraries", (), {}, nodes)

    def _config(self, root: XmlElement) -> XmlElement:
        """Return the interfaces of a component, and what else its configuration says.

        `config` holds a list of interfaces, or what ROS needs to know; `configs` is the list of August 2017.
        """

        def interfaces(comments: list[Comment], element: XmlElement) -> Children:
            self._reader.check_leaf(replace(element, children=[]))
            nodes = {"interface": self._interface}
            return [*comments, *self._reader.translated(element, "config", native, {}, nodes).children]

        native = (INTERFACE.tag,)
        made = XmlElement("config", {}, 0, 0)
        for tag, names, nodes in (
            ("config", {"interfaces": interfaces}, {}),
            ("configs", {}, {"config": self._interface}),
        ):
            if (found := root.first(tag)) is not None:
                part = self._reader.translated(found, "config", native, names, nodes)
                made.attributes |= part.attributes
                made.children += part.children
        return made

    def _interface(self, comments: list[Comment], element: XmlElement) -> Children:
        made = self._reader.translated(element, INTERFACE.tag, INTERFACE.children, _INTERFACE)
        return [*comments, made]


def _parameter(element: XmlElement, name: str, kind: str) -> XmlElement:
    """Return a parameter of the component, with its name and its type in Python."""
    value = element.first("value") or element
    description = element.first("description")
    made = XmlElement("parameter", {}, element.line, element.column)
    made.children += [new_leaf("name", name, element), new_leaf("type", kind, element)]
    made.children.append(
        new_leaf("default", _literal(kind, value.text if value is not element else ""), value)
    )
    if description is not None:
        made.children.append(replace(description, attributes={}))
    return made


def _literal(kind: str, value: str) -> str:
    if kind == "str":
        return repr(value)
    if kind == "bool":
        return {"true": "True", "false": "False"}.get(value.strip().lower(), value)
    return value.strip()


def _is_blank(element: XmlElement) -> bool:
    """Return whether nothing is written in an element."""
    return not element.text.strip() and all(
        isinstance(each, XmlElement) and not each.attributes and _is_blank(each) for each in element.children
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
    reader: NativeReader, outermost: Sequence[XmlElement]
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
    reader.number(every)
    ids = {state: int(state.attributes["id"]) for state in every}
    used: set[int] = set()

    def number(wanted: int) -> int:
        is_free = wanted not in used and wanted <= MAX_ID
        found = wanted if is_free else next(n for n in count(1) if n not in used)
        used.add(found)
        return found

    written = "" if owner is None else owner.attributes.get("id", "")
    around = reader.parse_id(outermost[0], "id", written) if written.strip() else 0
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
    return tuple(element.elements("state"))


def _with_states_below(state: XmlElement) -> Iterator[XmlElement]:
    yield state
    for inner in _states_in(state):
        yield from _with_states_below(inner)
