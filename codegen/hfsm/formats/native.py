"""Read the native dialect: VisualHFSM's of 2013 to 2017, and what has been added to it since."""

from __future__ import annotations

from dataclasses import replace
from typing import Final

from ..codes import Code
from ..document import (
    DEFAULT_PERIOD,
    NO_CHILD,
    Argument,
    Automaton,
    Comment,
    Document,
    Event,
    Import,
    Interface,
    Leaf,
    Library,
    Parameter,
    Property,
    State,
    Transition,
)
from .elements import NOTHING, ElementReader, Parts, node_fields, text_of
from .xml_tree import XmlElement

__all__ = [
    "AUTOMATON_TAGS",
    "DOCUMENT_TAGS",
    "INTERFACE_TAGS",
    "STATE_TAGS",
    "TRANSITION_TAGS",
    "NativeReader",
]

_LISTS: Final = ("parameters", "events", "properties")
_CONTAINERS: Final = (*_LISTS, "libraries", "config")
_DOCUMENT_LEAVES: Final = ("description", "onerror", "onrefused", "dialect", "language")
_AUTOMATON_NODES: Final = ("state", "transition", "input")
_AUTOMATON_LEAVES: Final = ("import", "iteration_time", "variables", "functions")
_STATE_NODES: Final = ("child", "argument")
_STATE_LEAVES: Final = (
    *("posx", "posy", "name", "idSubautomataSon"),
    *("final", "history", "entry", "code", "exit"),
)
_INTERFACE_LEAVES: Final = ("nameinterface", "nameproxy", "ip", "port", "interface")
_TRANSITION_LEAVES: Final = (
    *("posx", "posy", "origin", "destiny"),
    *("transcode", "name", "trans", "guard", "priority"),
)

DOCUMENT_TAGS: Final = frozenset(("SubAutomata", *_CONTAINERS, *_DOCUMENT_LEAVES))
AUTOMATON_TAGS: Final = frozenset((*_AUTOMATON_NODES, *_AUTOMATON_LEAVES))
STATE_TAGS: Final = frozenset((*_STATE_NODES, *_STATE_LEAVES))
TRANSITION_TAGS: Final = frozenset(_TRANSITION_LEAVES)
INTERFACE_TAGS: Final = frozenset(_INTERFACE_LEAVES)


class NativeReader(ElementReader):
    """Makes a document of a tree of XML; what it does not understand it reports."""

    leaf_attributes = frozenset((("trans", "type"), ("import", "automaton")))

    def document(self, root: XmlElement) -> Document:
        """Return the document; worth nothing if the reader has `failed` afterwards."""
        parts = self.parts(root, nodes=("SubAutomata",), leaves=_DOCUMENT_LEAVES, containers=_CONTAINERS)
        parameters = self._list(parts, "parameters", "parameter")
        events = self._list(parts, "events", "event")
        properties = self._list(parts, "properties", "property")
        libraries = self._list(parts, "libraries", "lib")
        config = self._list(parts, "config", "iceinterface")
        for tag, found in zip(_LISTS, (parameters, events, properties), strict=True):
            if found.extras:
                parts.details[tag] = replace(parts.details.get(tag, Leaf(tag)), children=found.extras)
        automata = parts.all("SubAutomata")
        ids = self.ids(automata, lambda element: element.attributes.get("id"))
        return Document(
            root_tag=root.tag,
            description=text_of(parts.first("description")),
            on_error=text_of(parts.first("onerror")),
            on_refused=text_of(parts.first("onrefused")),
            dialect=text_of(parts.first("dialect")),
            language=text_of(parts.first("language")),
            parameters=self._parameters(parameters, "parameter"),
            events=tuple(self._event(each, events.comments_before(each)) for each in events.all("event")),
            properties=tuple(
                self._property(each, properties.comments_before(each)) for each in properties.all("property")
            ),
            automata=tuple(
                self._automaton(each, ids[each], parts.comments_before(each)) for each in automata
            ),
            libraries=tuple(
                self._library(each, libraries.comments_before(each)) for each in libraries.all("lib")
            ),
            interfaces=tuple(
                self._interface(each, config.comments_before(each)) for each in config.all("iceinterface")
            ),
            libraries_extras=libraries.extras,
            config_extras=config.extras,
            **node_fields(root, parts),
        )

    def _list(self, parts: Parts, container: str, tag: str) -> Parts:
        element = parts.first(container)
        return NOTHING if element is None else self.parts(element, nodes=(tag,))

    def _automaton(self, element: XmlElement, id: int, comments: tuple[Comment, ...]) -> Automaton:
        parts = self.parts(element, nodes=_AUTOMATON_NODES, leaves=_AUTOMATON_LEAVES)
        states, transitions = parts.all("state"), parts.all("transition")
        ids = self.ids(states, lambda each: each.attributes.get("id"))
        ids |= self.ids(transitions, lambda each: each.attributes.get("id"))
        return Automaton(
            id=id,
            father=self.optional_id(element, "idFather", element.attributes.get("idFather")),
            states=tuple(self._state(each, ids[each], parts.comments_before(each)) for each in states),
            transitions=tuple(
                self._transition(each, ids[each], parts.comments_before(each)) for each in transitions
            ),
            inputs=self._parameters(parts, "input"),
            imported=self._import(parts.first("import")),
            iteration_time=text_of(parts.first("iteration_time"), default=DEFAULT_PERIOD),
            variables=text_of(parts.first("variables")),
            functions=text_of(parts.first("functions")),
            **node_fields(element, parts, "id", "idFather", comments=comments),
        )

    def _state(self, element: XmlElement, id: int, comments: tuple[Comment, ...]) -> State:
        parts = self.parts(element, nodes=_STATE_NODES, leaves=_STATE_LEAVES)
        final = parts.first("final")
        return State(
            id=id,
            name=text_of(parts.first("name")).text,
            initial=self.parse_flag(element, "initial", element.attributes.get("initial")),
            x=self.number(parts.first("posx")),
            y=self.number(parts.first("posy")),
            children=self._children(parts),
            final=final is not None and self.parse_flag(final, "final", final.text),
            history=text_of(parts.first("history")),
            entry=text_of(parts.first("entry")),
            code=text_of(parts.first("code")),
            exit=text_of(parts.first("exit")),
            arguments=tuple(
                self._argument(each, parts.comments_before(each)) for each in parts.all("argument")
            ),
            **node_fields(element, parts, "id", "initial", comments=comments),
        )

    def _children(self, parts: Parts) -> tuple[int, ...]:
        """Return the automata of a state: the one that the origin knows, then the further ones."""
        for each in parts.all("child"):
            if each.attributes or each.children or parts.comments_before(each):
                what = "attributes of `child`, and comments before and inside it, are not kept on saving"
                self.warn(each, Code.LOST_ON_SAVING, what)
        first = parts.first("idSubautomataSon")
        found = [] if first is None else [self.optional_id(first, first.tag, first.text)]
        found += [self.optional_id(each, each.tag, each.text) for each in parts.all("child")]
        return tuple(child for child in found if child != NO_CHILD)

    def _transition(self, element: XmlElement, id: int, comments: tuple[Comment, ...]) -> Transition:
        parts = self.parts(element, leaves=_TRANSITION_LEAVES)
        trigger = parts.first("trans")
        return Transition(
            id=id,
            name=text_of(parts.first("name")).text,
            x=self.number(parts.first("posx")),
            y=self.number(parts.first("posy")),
            origin=self.reference(element, parts.first("origin"), "origin"),
            destination=self.reference(element, parts.first("destiny"), "destiny"),
            type=self._type_of(trigger),
            trigger=text_of(trigger),
            guard=text_of(parts.first("guard")),
            priority=text_of(parts.first("priority")),
            code=text_of(parts.first("transcode")),
            **node_fields(element, parts, "id", comments=comments),
        )

    def _type_of(self, trigger: XmlElement | None) -> str:
        """Return the type of a trigger; without one a transition has a condition that is not written yet."""
        if trigger is None:
            return "condition"
        if "type" in trigger.attributes:
            return trigger.attributes["type"]
        kind = "time" if trigger.text.strip().isdecimal() else "condition"
        self.warn(
            trigger, Code.TRIGGER_WITHOUT_TYPE, f"`trans` has no `type`: its text is taken for a {kind}"
        )
        return kind

    def _argument(self, element: XmlElement, comments: tuple[Comment, ...]) -> Argument:
        return Argument(
            name=self._attribute(element, "name"),
            child=self.optional_id(element, "child", element.attributes.get("child")),
            value=text_of(element),
            **self.text_fields(element, "name", "child", comments=comments),
        )

    def _parameters(self, container: Parts, tag: str) -> tuple[Parameter, ...]:
        return tuple(self._parameter(each, container.comments_before(each)) for each in container.all(tag))

    def _parameter(self, element: XmlElement, comments: tuple[Comment, ...]) -> Parameter:
        parts = self.parts(element, leaves=("name", "type", "default", "description"))
        return Parameter(
            name=text_of(parts.first("name")).text,
            type=text_of(parts.first("type")),
            default=text_of(parts.first("default")),
            description=text_of(parts.first("description")),
            **node_fields(element, parts, comments=comments),
        )

    def _import(self, element: XmlElement | None) -> Import | None:
        if element is None:
            return None
        return Import(
            file=text_of(element),
            automaton=self.optional_id(element, "automaton", element.attributes.get("automaton")),
            line=element.line,
            column=element.column,
        )

    def _event(self, element: XmlElement, comments: tuple[Comment, ...]) -> Event:
        parts = self.parts(element, leaves=("name", "description"))
        return Event(
            name=text_of(parts.first("name")).text,
            description=text_of(parts.first("description")),
            **node_fields(element, parts, comments=comments),
        )

    def _property(self, element: XmlElement, comments: tuple[Comment, ...]) -> Property:
        parts = self.parts(element, leaves=("name", "within", "expression"))
        return Property(
            name=text_of(parts.first("name")).text,
            kind=self._attribute(element, "kind"),
            within=text_of(parts.first("within")),
            expression=text_of(parts.first("expression")),
            **node_fields(element, parts, "kind", comments=comments),
        )

    def _library(self, element: XmlElement, comments: tuple[Comment, ...]) -> Library:
        return Library(
            name=text_of(element),
            kind=element.attributes.get("kind", "module"),
            **self.text_fields(element, "kind", comments=comments),
        )

    def _interface(self, element: XmlElement, comments: tuple[Comment, ...]) -> Interface:
        parts = self.parts(element, leaves=_INTERFACE_LEAVES)
        proxy, ip, port = (parts.first(tag) for tag in ("nameproxy", "ip", "port"))
        return Interface(
            name=text_of(parts.first("nameinterface")).text,
            proxy=None if proxy is None else proxy.text,
            ip=None if ip is None else ip.text,
            port=None if port is None else port.text,
            type=text_of(parts.first("interface")).text,
            **node_fields(element, parts, comments=comments),
        )

    def _attribute(self, element: XmlElement, name: str) -> str:
        if name not in element.attributes:
            self.error(element, Code.MALFORMED_ELEMENT, f"`{element.tag}` needs the attribute `{name}`")
        return element.attributes.get(name, "")
