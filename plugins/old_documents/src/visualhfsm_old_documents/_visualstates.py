"""Translate the dialect of VisualStates, since 2017, to the native format.

It has five variants of nested states. A state with inner states becomes a state that owns an automaton; the
outermost state becomes the component. A state that is entered again restarts its automaton. Functions and
variables belonged to the component, to a state or to a namespace: here they belong to the automaton of that
state, and code uses them through `self`.
"""

from __future__ import annotations

import ast
import re
from collections import defaultdict
from collections.abc import Iterator
from dataclasses import replace
from itertools import count
from typing import Final

from codegen.hfsm.code.text import parse_piece
from codegen.hfsm.codes import Code
from codegen.hfsm.document import DEFAULT_PERIOD, NO_CHILD
from codegen.hfsm.formats.native import MAX_ID, NativeReader, Translation
from codegen.hfsm.formats.schema import DOCUMENT, INTERFACE, STATE, TRANSITION
from codegen.hfsm.formats.xml_tree import XmlElement, new_leaf
from codegen.messages import Message

_PSEUDO_STATE: Final = "pseudostate"
"""The element for the content of the outermost state, which is not a state of an automaton."""
_CODE: Final = ("functions", "variables")
_NO_CODE: Final[dict[str, str | None]] = dict.fromkeys(_CODE, "")
_STATE: Final = {tag: tag for tag in ("posx", "posy", "name", "code")}
_TRANSITION: Final = {
    **{tag: tag for tag in ("posx", "posy", "name")},
    "originid": "origin",
    "destinationid": "destiny",
    "code": "transcode",
}
_MOVED: Final[dict[str, Translation]] = dict.fromkeys(("state", "transition"), lambda _: [])
"""Elements that are moved out of a state."""
_TRIGGERS: Final = {"0": "time", "1": "condition"}
_INTERFACE: Final = {
    **{tag: tag for tag in ("ip", "port", "interface")},
    "name": "nameinterface",
    "proxyName": "nameproxy",
    "proxyname": "nameproxy",
    "interfaceName": "interface",
}
_OPERATIONS: Final = {"Publish": "publish", "Subscribe": "subscribe"}
_TYPES: Final = {"Boolean": "bool", "Integer": "int", "Float": "float", "String": "str", "Character": "str"}


def translate_visualstates(root: XmlElement, reader: NativeReader) -> XmlElement:
    """Return the root of a document of VisualStates as a native one."""
    return _Translator(root, reader).document()


class _Translator:
    def __init__(self, root: XmlElement, reader: NativeReader) -> None:
        self._root = root
        self._reader = reader
        outermost = list(root.elements("state"))
        if len(outermost) > 1:
            message = Message("there are several outermost states: they become states of the root automaton")
            reader.warn(outermost[1], Code.SEVERAL_OUTERMOST_STATES, message)
        self._has_outermost = len(outermost) == 1
        around = XmlElement("state", {}, 0, 0, children=outermost)
        self._outermost = outermost[0] if self._has_outermost else around
        self._automata: dict[XmlElement, int] = {}
        """The ids of automata by the states that own them, parents first."""
        self._around: dict[XmlElement, int] = {}
        """The ids of the automata that contain the states."""
        self._members: dict[int, set[str]] = {}
        """The ids of the states of automata."""
        self._kept: set[XmlElement] = set()
        """Namespaces with unknown content, which are kept as a whole."""
        self._functions: set[str] = set()
        self._renamed: defaultdict[XmlElement | int, dict[str, str]] = defaultdict(dict)
        """The new names of functions, for the code of an automaton or of one state."""

    def document(self) -> XmlElement:
        """Return the root of the native document."""
        reader = self._reader
        self._number_automata()
        code = {owner: self._code_of(owner) for owner in self._automata}
        outgoing = {owner: list(self._transitions_of(owner)) for owner in self._automata}
        reader.number([each for found in outgoing.values() for each, _ in found])
        parameters = self._parameters()
        config = "configs" if self._root.first("config") is None else "config"
        namespace = self._namespace_of(self._root, "global_namespace")
        names = {**_NO_CODE, **namespace, "libraries": None, config: None}
        made = reader.translated(
            self._root, DOCUMENT.tag, DOCUMENT.children, names, {"state": _MOVED["state"]}
        )
        if self._has_outermost:
            made.children.append(self._pseudo_state())
        for owner in self._automata:
            made.children.append(self._automaton(owner, outgoing[owner], code[owner]))
        made.children.append(parameters)
        if (libraries := self._root.first("libraries")) is not None:
            nodes = {"library": lambda each: [replace(each, tag="lib")], "lib": lambda each: [each]}
            made.children.append(reader.translated(libraries, "libraries", (), {}, nodes))
        if (found := self._root.first(config)) is not None:
            made.children += [self._config(found), self._ros(found)]
        return made

    def _number_automata(self) -> None:
        """Assign ids to all states and automata.

        The id of an automaton is the id of its owner plus 1, so that it does not depend on the rest of the
        document. If two states have the same id, the second automaton gets a free id.
        """
        self._reader.number(list(_states_below(self._outermost)))
        written = self._outermost.attributes.get("id", "")
        around = self._reader.parse_id(self._outermost, "id", written) if written.strip() else 0
        used: set[int] = set()
        free = (number for number in count(1) if number not in used)
        owners = [self._outermost]
        for owner in owners:  # grows while it is read: the states below are appended
            wanted = (around if owner is self._outermost else self._id(owner)) + 1
            number = wanted if wanted not in used and wanted <= MAX_ID else next(free)
            used.add(number)
            states = list(owner.elements("state"))
            self._automata[owner] = number
            self._around |= dict.fromkeys(states, number)
            self._members[number] = {state.attributes["id"] for state in states}
            owners += [state for state in states if state.first("state") is not None]

    def _id(self, state: XmlElement) -> int:
        """Return the id of a state, or 0 for the outermost one."""
        return 0 if state is self._outermost else int(state.attributes["id"])

    # States and transitions.

    def _automaton(
        self, owner: XmlElement, transitions: list[tuple[XmlElement, XmlElement]], code: list[XmlElement]
    ) -> XmlElement:
        ids = {"id": str(self._automata[owner]), "idFather": str(self._around.get(owner, NO_CHILD))}
        comments = [] if owner in self._around else owner.comments
        timestep = owner.first("timestep")
        period = DEFAULT_PERIOD if timestep is None else timestep.text
        if timestep is not None:
            code.append(new_leaf("iteration_time", timestep.text, timestep))
        states = [self._state(each, self._automata[owner], period) for each in owner.elements("state")]
        inside = [*states, *(self._transition(*each, self._automata[owner]) for each in transitions), *code]
        return XmlElement("SubAutomata", ids, owner.line, owner.column, children=inside, comments=comments)

    def _state(self, element: XmlElement, automaton: int, period: str) -> XmlElement:
        reader, owned = self._reader, self._automata.get(element)
        timestep, namespace = element.first("timestep"), element.first("namespace")
        names = {**_STATE, **_NO_CODE}
        if owned is not None:
            names["timestep"] = ""
        elif timestep is not None:
            reader.expected.add(timestep)
            if timestep.text.strip() != period.strip():
                reader.remark(
                    timestep, Message("the `timestep` of a state without inner states is kept, but not used")
                )
        if namespace is not None and owned is None and not _is_blank(namespace):
            reader.remark(
                element, Message("the namespace of a state without inner states is kept, but not used")
            )
            self._kept.add(namespace)
        names |= self._namespace_of(element, "namespace")
        made = reader.translated(element, STATE.tag, STATE.children, names, _MOVED)
        for each in made.elements("code"):
            each.text = self._with_new_names(each.text, element, automaton)
        if owned is not None:
            made.children.append(new_leaf("idSubautomataSon", str(owned), element))
            made.children.append(new_leaf("history", "restart", element))
        return made

    def _pseudo_state(self) -> XmlElement:
        """Return an element with the content of the outermost state, which is not a state of an automaton."""
        names = {**_NO_CODE, "timestep": "", **self._namespace_of(self._outermost, "namespace")}
        made = replace(
            self._reader.translated(self._outermost, _PSEUDO_STATE, (), names, _MOVED), comments=[]
        )
        for each in made.elements():
            if each.tag not in _STATE:
                self._reader.remark_unknown(each)
        self._reader.expected.add(made)
        return made

    def _transitions_of(self, owner: XmlElement) -> Iterator[tuple[XmlElement, XmlElement]]:
        """Yield the transitions of an automaton, each with the state that contains it.

        They are in the state that they leave, or in one of the states around it.
        """
        inside = self._ids_inside(owner)
        for each in owner.elements("transition"):
            if owner is self._outermost or _origin(each) in inside:
                yield each, owner
        for state in owner.elements("state"):
            inside = self._ids_inside(state)
            yield from ((each, state) for each in state.elements("transition") if _origin(each) not in inside)

    def _ids_inside(self, state: XmlElement) -> set[str]:
        """Return the ids of the states inside a state that none of its siblings has."""
        if state is self._outermost or state not in self._automata:
            return set()
        return self._members[self._automata[state]] - self._members[self._around[state]]

    def _transition(self, element: XmlElement, state: XmlElement, automaton: int) -> XmlElement:
        tags = {each.tag: each.text.strip() for each in element.elements()}
        written = tags.get("type") or ("0" if "time" in tags else "1")
        kind = _TRIGGERS.get(written, written)
        trigger = kind if kind in _TRIGGERS.values() else "condition"
        names = {**_TRANSITION, trigger: "trans", "type": ""}
        made = self._reader.translated(element, TRANSITION.tag, TRANSITION.children, names)
        missing = [tag for tag in ("origin", "trans") if made.first(tag) is None]
        made.children += [new_leaf(tag, "", element) for tag in missing]
        for each in made.elements("trans", "transcode"):
            each.text = self._with_new_names(each.text, state, automaton)
        for each in made.elements("trans"):
            each.attributes = {**each.attributes, "type": kind}
        for each in made.elements("origin"):
            each.text = each.text if each.text.strip() else str(self._id(state))
        return made

    # Functions, variables and parameters.

    def _code_of(self, owner: XmlElement) -> list[XmlElement]:
        """Return the functions and variables of an automaton: those of its owner and of its states.

        The root also gets those of the component.
        """
        automaton = self._automata[owner]
        shared = [self._root, self._root.first("global_namespace")] if owner is self._outermost else []
        around = [each for each in (*shared, owner, owner.first("namespace")) if each is not None]
        inside = [state for state in owner.elements("state") if state not in self._automata]
        scopes: list[tuple[XmlElement, XmlElement | int]] = [(each, automaton) for each in around]
        scopes += [(state, state) for state in inside]
        for each, scope in scopes:
            self._rename_functions(each.first("functions"), automaton, scope)
        found: list[XmlElement] = []
        for tag in _CODE:
            written = [(piece, scope) for each, scope in scopes if (piece := each.first(tag)) is not None]
            pieces = [(piece, scope) for piece, scope in written if piece.text.strip()]
            texts = [self._with_new_names(piece.text, scope, automaton) for piece, scope in pieces]
            if pieces:
                ended = [text if text.endswith("\n") else f"{text}\n" for text in texts[:-1]]
                found.append(new_leaf(tag, "".join((*ended, texts[-1])), pieces[0][0]))
        return found

    def _rename_functions(self, element: XmlElement | None, automaton: int, scope: XmlElement | int) -> None:
        """Choose new names for functions of different namespaces with the same name.

        `scope` is the automaton, or the state that has the functions.
        """
        tree = None if element is None else parse_piece(element.text)
        if element is None or tree is None:
            return
        names = {each.name for each in tree.body if isinstance(each, ast.FunctionDef)}
        suffix = f"{automaton}" if isinstance(scope, int) else f"{automaton}_{self._id(scope)}"
        taken = sorted(names & self._functions)
        if taken:
            self._renamed[scope] |= {name: f"{name}_{suffix}" for name in taken}
            listed = ", ".join(f"`{name}`" for name in taken)
            message = Message(
                "another namespace also has {listed}: here `_{suffix}` is appended to the names",
                listed=listed,
                suffix=suffix,
            )
            self._reader.warn(element, Code.OLD_CODE_CHANGED, message)
        self._functions |= names

    def _with_new_names(self, text: str, *scopes: XmlElement | int) -> str:
        """Return code with the new names of the functions of some scopes."""
        for old, new in (pair for scope in scopes for pair in self._renamed.get(scope, {}).items()):
            name = re.compile(
                rf"(\bdef\s+|\bself\.(?:(?:namespace|interfaces|rosNode)\.)?){re.escape(old)}\b"
            )
            text = name.sub(rf"\1{new}", text)
        return text

    def _namespace_of(self, element: XmlElement, tag: str) -> dict[str, str | None]:
        """Return the native name of a namespace, or none for one with unknown content, which is kept."""
        namespace = element.first(tag)
        if namespace is None or namespace not in self._kept:
            return {tag: None}
        self._reader.expected.add(namespace)
        return {}

    def _parameters(self) -> XmlElement:
        """Return the parameters of namespaces; a namespace with anything else than code is kept."""
        found: dict[str, XmlElement] = {}
        namespaces = [owner.first("namespace") for owner in self._automata]
        for namespace in (self._root.first("global_namespace"), *namespaces):
            if namespace is None:
                continue
            if namespace.trailing or any(each.comments for each in namespace.children):
                self._kept.add(namespace)
            for child in namespace.children:
                if child.tag in _CODE:
                    self._reader.check_leaf(child)
                elif child.tag != "parameters":
                    self._kept.add(namespace)
                    self._reader.remark_unknown(child)
            for element in (each for one in namespace.elements("parameters") for each in one.elements()):
                name = element.attributes.get("name", "").strip()
                kind = _TYPES.get(element.attributes.get("type", ""))
                if element.tag == "param" and kind and name.isidentifier() and name not in found:
                    found[name] = _parameter(element, name, kind)
                else:
                    self._reader.remark(
                        element, Message("the parameter `{name}` is kept, but not used", name=name)
                    )
                    self._kept.add(namespace)
        return XmlElement("parameters", {}, 0, 0, children=[*found.values()])

    def _config(self, element: XmlElement) -> XmlElement:
        """Return the interfaces of a component, and the rest of its configuration.

        `config` is a list of interfaces, or has settings of ROS, of which `_ros` reads the topics; `configs`
        is the list of August 2017.
        """

        def interface(each: XmlElement) -> list[XmlElement]:
            return [self._reader.translated(each, INTERFACE.tag, INTERFACE.children, _INTERFACE)]

        names, native = {"interfaces": None, "topics": None}, (INTERFACE.tag,)
        made = self._reader.translated(element, "config", native, names, {"config": interface})
        self._reader.inline(made, element.first("interfaces"), native, {"interface": interface})
        return made

    def _ros(self, element: XmlElement) -> XmlElement:
        """Return the topics of a component, with the names that its generator gave their ends."""
        topics = element.first("topics")
        made = XmlElement(
            "ros", {}, element.line, element.column, trailing=[] if topics is None else topics.trailing
        )
        for topic in topics.children if topics is not None else ():
            texts = {each.tag: each.text.strip() for each in topic.children}
            kind = _OPERATIONS.get(texts.get("opType", ""), texts.get("opType", ""))
            target = texts.get("name", "")
            own_name = texts.get("methodname") or texts.get("variablename") or target.lstrip("/")
            name = re.sub(r"\W", "_", own_name) + ("Pub" if kind == "publish" else "Sub")
            type_name = re.sub(r"^(\w+)/(\w+)$", r"\1/msg/\2", texts.get("type", ""))
            interface = XmlElement(
                "rosinterface", {"kind": kind}, topic.line, topic.column, comments=topic.comments
            )
            values = {"name": name, "target": target, "type": type_name}
            interface.children += [new_leaf(tag, text, topic) for tag, text in values.items()]
            made.children.append(interface)
        return made


def _origin(transition: XmlElement) -> str:
    origin = transition.first("originid")
    return "" if origin is None else origin.text.strip()


def _parameter(element: XmlElement, name: str, kind: str) -> XmlElement:
    """Return a parameter of the component, with its name and type in Python."""
    value, description = element.first("value"), element.first("description")
    literal = _literal(kind, "" if value is None else value.text)
    made = XmlElement("parameter", {}, element.line, element.column)
    made.children += [new_leaf("name", name, element), new_leaf("type", kind, element)]
    made.children.append(new_leaf("default", literal, value or element))
    if description is not None:
        made.children.append(new_leaf("description", description.text, description))
    return made


def _literal(kind: str, value: str) -> str:
    if kind == "str":
        return repr(value)
    if kind == "bool":
        return {"true": "True", "false": "False"}.get(value.strip().lower(), value)
    return value.strip()


def _is_blank(element: XmlElement) -> bool:
    """Return whether an element is empty."""
    return not (element.text.strip() or element.trailing) and all(
        _is_blank(each) and not (each.attributes or each.comments) for each in element.children
    )


def _states_below(element: XmlElement) -> Iterator[XmlElement]:
    for state in element.elements("state"):
        yield state
        yield from _states_below(state)
