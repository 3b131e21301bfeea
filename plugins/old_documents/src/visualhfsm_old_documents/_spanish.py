"""Translate the Spanish dialect of February 2013 to the native format.

Its code is C++. Its libraries are names of JdeRobot's drivers, such as `laser`, and cannot be imported.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Final

from codegen.hfsm.codes import Code
from codegen.hfsm.document import NO_CHILD
from codegen.hfsm.formats.native import NativeReader
from codegen.hfsm.formats.schema import AUTOMATON, DOCUMENT, STATE, TRANSITION
from codegen.hfsm.formats.xml_tree import XmlElement, new_leaf
from codegen.messages import Message

_AUTOMATON: Final = {
    "idSub": "",
    "idPadre": "",
    "tiempoIteracion": "iteration_time",
    "variables_aux": "variables",
    "funciones_aux": "functions",
}
_STATE: Final = {
    "id": "",
    "transiciones": None,
    "origenX": "posx",
    "origenY": "posy",
    "nombre": "name",
    "hijo": "idSubautomataSon",
    "codigo": "code",
}


def translate_spanish(root: XmlElement, reader: NativeReader) -> XmlElement:
    """Return the root of a Spanish document as a native one."""
    automata = list(root.elements("SubAutomata"))
    _number(automata, "idSub", reader)
    owners = _owners(automata)

    def automaton(element: XmlElement) -> list[XmlElement]:
        return [_automaton(element, reader, owners.get(element.attributes["id"], NO_CHILD))]

    made = reader.translated(root, root.tag, DOCUMENT.children, {}, {"SubAutomata": automaton})
    made.children.append(XmlElement("libraries", {}, root.line, root.column, children=_drivers(automata)))
    return made


def _automaton(element: XmlElement, reader: NativeReader, owner: int) -> XmlElement:
    states = list(element.elements("Estado"))
    _number(states, "id", reader)
    around = [found for state in states if (found := state.first("transiciones")) is not None]
    reader.number([each for found in around for each in found.elements("transicion")], expected=False)
    nodes = {"Estado": lambda state: _state(state, reader)}
    made = reader.translated(element, AUTOMATON.tag, AUTOMATON.children, _AUTOMATON, nodes)
    father = _text(element, "idPadre")
    if not father and owner != NO_CHILD:
        message = Message("`SubAutomata` has no `idPadre`: a state of automaton {owner} owns it", owner=owner)
        reader.warn(element, Code.MISSING_ID, message)
    made.attributes["idFather"] = father or str(owner)
    return made


def _state(element: XmlElement, reader: NativeReader) -> list[XmlElement]:
    """Return a state and its transitions, which are inside it in this dialect."""
    transitions: list[XmlElement] = []

    def transition(each: XmlElement) -> list[XmlElement]:
        transitions.append(_transition(each, reader, element.attributes["id"]))
        return []

    made = reader.translated(element, STATE.tag, STATE.children, _STATE)
    reader.inline(made, element.first("transiciones"), STATE.children, {"transicion": transition})
    made.attributes["initial"] = made.attributes.pop("estado_inicial", "")
    return [made, *transitions]


def _transition(element: XmlElement, reader: NativeReader, origin: str) -> XmlElement:
    # A transition has a time or a condition; if it has both, the condition is kept as unknown.
    timed = element.first("codigo") is None or bool(_text(element, "tiempo"))
    trigger = "tiempo" if timed else "codigo"
    names = {"nombre": "name", "destino": "destiny", trigger: "trans"}
    made = reader.translated(element, "transition", TRANSITION.children, names)
    if made.first("trans") is None:
        timed = False
        made.children.append(new_leaf("trans", "", element))
    for each in made.elements("trans"):
        each.attributes = {**each.attributes, "type": "time" if timed else "condition"}
    made.children.append(new_leaf("origin", origin, element))
    box = element.first("box")
    for tag, corner in (("posx", "x1"), ("posy", "y1")):
        if box is not None and corner in box.attributes:
            made.children.append(replace(new_leaf(tag, box.attributes[corner], box), name=corner))
    return made


def _number(elements: Sequence[XmlElement], tag: str, reader: NativeReader) -> None:
    for each in elements:
        each.attributes["id"] = _text(each, tag)
    reader.number(elements)


def _text(element: XmlElement, tag: str) -> str:
    """Return the stripped text of the first child with a tag."""
    child = element.first(tag)
    return "" if child is None else child.text.strip()


def _owners(automata: list[XmlElement]) -> dict[str, int]:
    """Return the id of the father of each automaton by id: a state of the father owns the automaton."""
    owners: dict[str, int] = {}
    for automaton in automata:
        for state in automaton.elements("Estado"):
            child = _text(state, "hijo")
            if child.isdecimal() and len(child) <= 10 and str(int(child)) != automaton.attributes["id"]:
                owners.setdefault(str(int(child)), int(automaton.attributes["id"]))
    return owners


def _drivers(automata: list[XmlElement]) -> list[XmlElement]:
    """Return the libraries of all automata, each once; the original lists are kept as they are."""
    lists = [each for automaton in automata for each in automaton.elements("Librerias")]
    found: dict[str, XmlElement] = {}
    for lib in (each for libraries in lists for each in libraries.elements("lib")):
        found.setdefault(
            lib.text.strip(), replace(new_leaf("lib", lib.text, lib), attributes={"kind": "driver"})
        )
    return list(found.values())
