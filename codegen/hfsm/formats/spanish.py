"""Read the dialect of February 2013, whose elements have Spanish names.

Its code is C++ and its libraries are the names of JdeRobot's drivers, such as `laser`: nothing to import.
"""

from __future__ import annotations

from typing import Final

from ..codes import Code
from ..document import (
    DEFAULT_PERIOD,
    NO_CHILD,
    Automaton,
    Comment,
    Document,
    Extra,
    Library,
    State,
    Text,
    Transition,
)
from .elements import NOTHING, ElementReader, Parts, node_fields, text_of
from .native import AUTOMATON_TAGS, DOCUMENT_TAGS, STATE_TAGS, TRANSITION_TAGS
from .xml_tree import XmlElement

__all__ = ["SpanishReader"]

# What the leaves are called in the native dialect.
_AUTOMATON: Final = {
    "idSub": "",
    "idPadre": "",
    "tiempoIteracion": "iteration_time",
    "variables_aux": "variables",
    "funciones_aux": "functions",
}
_STATE: Final = {
    "id": "",
    "origenX": "posx",
    "origenY": "posy",
    "nombre": "name",
    "hijo": "idSubautomataSon",
    "codigo": "code",
}
_TRANSITION: Final = {"nombre": "name", "destino": "destiny", "codigo": "trans", "tiempo": "trans"}


class SpanishReader(ElementReader):
    """Makes a document of a tree of XML in Spanish; what it does not understand it reports."""

    strict = False

    def document(self, root: XmlElement) -> Document:
        """Return the document; worth nothing if the reader has `failed` afterwards."""
        parts = self.parts(root, nodes=("SubAutomata",), taken=DOCUMENT_TAGS)
        elements = parts.all("SubAutomata")
        ids = self.ids(elements, lambda element: _child_text(element, "idSub"))
        owners = _owners(elements, ids)
        automata = tuple(
            self._automaton(element, ids[element], owners, parts.comments_before(element))
            for element in elements
        )
        return Document(
            root_tag=root.tag,
            automata=automata,
            libraries=_drivers(elements),
            **node_fields(root, parts),
        )

    def _automaton(
        self, element: XmlElement, id: int, owners: dict[int, int], comments: tuple[Comment, ...]
    ) -> Automaton:
        parts = self.parts(element, nodes=("Estado",), leaves=_AUTOMATON, taken=AUTOMATON_TAGS)
        states = parts.all("Estado")
        ids = self.ids(states, lambda state: _child_text(state, "id"))
        outgoing = {state: self._transitions_of(state) for state in states}
        transitions = [
            (transition, ids[state], outgoing[state].comments_before(transition))
            for state in states
            for transition in outgoing[state].all("transicion")
        ]
        numbers = self.ids(
            [transition for transition, _, _ in transitions],
            lambda transition: transition.attributes.get("id"),
            expected=False,
        )
        return Automaton(
            id=id,
            father=self._father(element, parts.first("idPadre"), owners.get(id, NO_CHILD)),
            states=tuple(
                self._state(each, ids[each], outgoing[each].extras, parts.comments_before(each))
                for each in states
            ),
            transitions=tuple(
                self._transition(each, numbers[each], origin, before) for each, origin, before in transitions
            ),
            iteration_time=text_of(parts.first("tiempoIteracion"), default=DEFAULT_PERIOD),
            variables=text_of(parts.first("variables_aux")),
            functions=text_of(parts.first("funciones_aux")),
            **node_fields(element, parts, comments=comments, native=_AUTOMATON),
        )

    def _father(self, element: XmlElement, written: XmlElement | None, owner: int) -> int:
        """Return the automaton above; where that is not written, the one whose state owns this."""
        if written is not None and written.text.strip():
            return self.parse_id(written, "idPadre", written.text)
        if owner != NO_CHILD:
            self.warn(
                element,
                Code.MISSING_ID,
                f"`SubAutomata` has no `idPadre`: a state of automaton {owner} owns it",
            )
        return owner

    def _state(
        self, element: XmlElement, id: int, extras: tuple[Extra, ...], comments: tuple[Comment, ...]
    ) -> State:
        parts = self.parts(
            element, leaves=_STATE, containers=("transiciones",), taken=STATE_TAGS | {"transiciones"}
        )
        child = parts.first("hijo")
        owned = NO_CHILD if child is None else self.optional_id(child, "hijo", child.text)
        # What stands around the transitions belongs to no element of the native dialect.
        native = {**_STATE, "transiciones": ""}
        fields = node_fields(element, parts, "estado_inicial", comments=comments, native=native)
        fields["extras"] += extras
        return State(
            id=id,
            name=text_of(parts.first("nombre")).text,
            initial=self.parse_flag(element, "estado_inicial", element.attributes.get("estado_inicial")),
            x=self.number(parts.first("origenX")),
            y=self.number(parts.first("origenY")),
            children=() if owned == NO_CHILD else (owned,),
            code=text_of(parts.first("codigo")),
            **fields,
        )

    def _transitions_of(self, state: XmlElement) -> Parts:
        """Return what the element around the transitions out of a state holds."""
        container = next((each for each in state.elements() if each.tag == "transiciones"), None)
        return NOTHING if container is None else self.parts(container, ("transicion",), taken=STATE_TAGS)

    def _transition(
        self, element: XmlElement, id: int, origin: int, comments: tuple[Comment, ...]
    ) -> Transition:
        # Of the time and the condition there is one; if both are there, the condition is kept as unknown.
        timed = bool(_child_text(element, "tiempo")) or _child_text(element, "codigo") is None
        trigger_tag = "tiempo" if timed else "codigo"
        parts = self.parts(element, leaves=("nombre", "destino", trigger_tag), taken=TRANSITION_TAGS)
        trigger = parts.first(trigger_tag)
        box = next((each for each in element.elements() if each.tag == "box"), None)
        return Transition(
            id=id,
            name=text_of(parts.first("nombre")).text,
            x=self._corner(box, "x1"),
            y=self._corner(box, "y1"),
            origin=origin,
            destination=self.reference(element, parts.first("destino"), "destino"),
            type="time" if timed and trigger is not None else "condition",
            trigger=Text("", element.line, element.column) if trigger is None else text_of(trigger),
            **node_fields(element, parts, "id", comments=comments, native=_TRANSITION),
        )

    def _corner(self, box: XmlElement | None, name: str) -> float:
        return 0.0 if box is None else self.parse_number(box, name, box.attributes.get(name, ""))


def _child_text(element: XmlElement, tag: str) -> str | None:
    """Return the text of the first child with a tag, without white space around it, or None."""
    return next((each.text.strip() for each in element.elements() if each.tag == tag), None)


def _owners(automata: list[XmlElement], ids: dict[XmlElement, int]) -> dict[int, int]:
    """Return for each automaton, by its id, the id of the automaton whose state names it as its child."""
    owners: dict[int, int] = {}
    for automaton in automata:
        for state in automaton.elements():
            child = _child_text(state, "hijo") if state.tag == "Estado" else None
            if child and child.isdecimal() and len(child) <= 10 and int(child) != ids[automaton]:
                owners.setdefault(int(child), ids[automaton])
    return owners


def _drivers(automata: list[XmlElement]) -> tuple[Library, ...]:
    """Return the libraries that any automaton names, each once; the lists themselves are kept as they are."""
    found = {
        lib.text.strip(): lib
        for automaton in reversed(automata)
        for libraries in automaton.elements()
        if libraries.tag == "Librerias"
        for lib in reversed(list(libraries.elements()))
        if lib.tag == "lib"
    }
    ordered = sorted(found.values(), key=lambda lib: (lib.line, lib.column))
    return tuple(
        Library(name=text_of(lib), kind="driver", line=lib.line, column=lib.column) for lib in ordered
    )
