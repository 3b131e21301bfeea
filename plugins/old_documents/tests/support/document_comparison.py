"""Compare a document of any dialect with its conversion; both are read only with ElementTree.

Nothing of the project is used, so that an error in its model cannot hide a loss. Each file becomes plain
records: what one has and the other has not is returned as text.
"""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path


@dataclass
class Facts:
    """Everything that a conversion must keep."""

    states: Counter[tuple[object, ...]] = field(default_factory=Counter)
    """Path of names and ids from the root, whether it is initial, position, code, number of inner states."""
    transitions: Counter[tuple[object, ...]] = field(default_factory=Counter)
    """Path of the automaton, origin, destination, name, position, kind, trigger, code."""
    automata: Counter[tuple[object, ...]] = field(default_factory=Counter)
    """Path of the owner, period."""
    code: Counter[tuple[str, str]] = field(default_factory=Counter)
    """Functions and variables that are not blank."""
    libraries: Counter[str] = field(default_factory=Counter)
    interfaces: Counter[tuple[str | None, ...]] = field(default_factory=Counter)
    ids: Counter[tuple[object, ...]] = field(default_factory=Counter)
    """The ids of automata and transitions that the dialect has."""
    texts: Counter[str] = field(default_factory=Counter)
    """Every text and every value of an attribute, in any place."""


def differences(original: Path, converted: str) -> list[str]:
    """Return what a conversion lost or invented; an empty list if nothing."""
    before = ET.fromstring(original.read_bytes())
    after = ET.fromstring(converted.encode())
    old, new = _facts(before), _native(after)
    found = [
        f"{name}: {kind} {item!r}"
        for name in ("states", "transitions", "automata", "libraries", "interfaces")
        for kind, items in (
            ("lost", getattr(old, name) - getattr(new, name)),
            ("made up", getattr(new, name) - getattr(old, name)),
        )
        for item in items
    ]
    for tag, text in old.code:
        if not any(tag == kind and text in written for kind, written in new.code):
            found.append(f"code: lost {tag} {text!r}")
    found += [f"id: lost {item!r}" for item in old.ids - new.ids]
    known = "\n".join(new.texts)
    topics = {text for each in before.iterfind("config/topics/topic") for text in _texts(each)}  # see above
    found += [
        f"text: lost {text!r}"
        for text in old.texts
        if text not in known and text not in topics and not _is_translated(text)
    ]
    return found


def counts(converted: str) -> dict[str, int]:
    """Return the counts of a document in the native dialect."""
    root = ET.fromstring(converted.encode())
    automata = {each.get("id"): each for each in root.iter("SubAutomata")}
    owned = {
        key: [state.findtext("idSubautomataSon") for state in each.findall("state")]
        for key, each in automata.items()
    }

    def depth(key: str | None) -> int:
        return 1 + max((depth(child) for child in owned[key] if child in owned), default=0)

    return {
        "automata": len(automata),
        "states": len(list(root.iterfind("SubAutomata/state"))),
        "transitions": len(list(root.iterfind("SubAutomata/transition"))),
        "time_transitions": len(list(root.iterfind("SubAutomata/transition/trans[@type='time']"))),
        "composite_states": sum(child != "0" for children in owned.values() for child in children),
        "depth": max(depth(key) for key, each in automata.items() if each.get("idFather") == "0"),
    }


def _facts(root: ET.Element) -> Facts:
    if root.find("SubAutomata/idSub") is not None:
        return _spanish(root)
    return _visualstates(root) if root.find("state") is not None else _native(root)


# The native dialect: a list of automata, owned by the states that name them.


def _native(root: ET.Element) -> Facts:
    facts = Facts()
    automata = {each.get("id"): each for each in root.findall("SubAutomata")}
    owners = {
        child: (automaton, state)
        for automaton in automata.values()
        for state in automaton.findall("state")
        if (child := (state.findtext("idSubautomataSon") or "0").strip()) in automata
    }

    def path(automaton: ET.Element) -> tuple[object, ...]:
        owner = owners.get(str(automaton.get("id")))
        return () if owner is None else (*path(owner[0]), _key(owner[1].get("id"), owner[1].findtext("name")))

    for automaton in automata.values():
        here = path(automaton)
        facts.automata[here, _text(automaton, "iteration_time", "100")] += 1
        facts.ids["automaton", here, automaton.get("id")] += 1
        for tag in ("functions", "variables"):
            _add_code(facts, tag, _text(automaton, tag))
        for state in automaton.findall("state"):
            owned = automata.get((state.findtext("idSubautomataSon") or "0").strip())
            facts.states[
                here,
                _key(state.get("id"), state.findtext("name")),
                state.get("initial", "").lower() == "true",
                _position(state, "posx", "posy"),
                _text(state, "code"),
                0 if owned is None else len(owned.findall("state")),
            ] += 1
        for transition in automaton.findall("transition"):
            trigger = transition.find("trans")
            assert trigger is not None
            facts.ids["transition", here, transition.get("id")] += 1
            facts.transitions[
                here,
                _text(transition, "origin"),
                _text(transition, "destiny"),
                _text(transition, "name"),
                _position(transition, "posx", "posy"),
                trigger.get("type"),
                trigger.text or "",
                _text(transition, "transcode"),
            ] += 1
    facts.libraries.update(lib.text or "" for lib in root.iterfind("libraries/lib"))
    _add_interfaces(
        facts, root, "config/iceinterface", ("nameinterface", "nameproxy", "ip", "port", "interface")
    )
    for ros in root.iterfind("ros/rosinterface"):
        facts.interfaces[ros.get("kind"), *(ros.findtext(tag) for tag in ("name", "target", "type"))] += 1
    facts.texts.update(_texts(root))
    return facts


# The dialect of 2013: transitions are in the state that they leave, and have no ids.


def _spanish(root: ET.Element) -> Facts:
    facts = Facts()
    automata = {_text(each, "idSub"): each for each in root.findall("SubAutomata")}
    owners = {
        child: (automaton, state)
        for automaton in automata.values()
        for state in automaton.findall("Estado")
        if (child := _text(state, "hijo")) in automata
    }

    def path(automaton: ET.Element) -> tuple[object, ...]:
        owner = owners.get(_text(automaton, "idSub"))
        return (
            () if owner is None else (*path(owner[0]), _key(_text(owner[1], "id"), _text(owner[1], "nombre")))
        )

    for automaton in automata.values():
        here = path(automaton)
        facts.automata[here, _text(automaton, "tiempoIteracion", "100")] += 1
        facts.ids["automaton", here, _text(automaton, "idSub")] += 1
        _add_code(facts, "functions", _text(automaton, "funciones_aux"))
        _add_code(facts, "variables", _text(automaton, "variables_aux"))
        for state in automaton.findall("Estado"):
            owned = automata.get(_text(state, "hijo"))
            facts.states[
                here,
                _key(_text(state, "id"), _text(state, "nombre")),
                state.get("estado_inicial") == "true",
                _position(state, "origenX", "origenY"),
                _text(state, "codigo"),
                0 if owned is None else len(owned.findall("Estado")),
            ] += 1
            for transition in state.iterfind("transiciones/transicion"):
                box = transition.find("box")
                timed = transition.find("tiempo") is not None
                facts.transitions[
                    here,
                    _text(state, "id"),
                    _text(transition, "destino"),
                    _text(transition, "nombre"),
                    (0.0, 0.0) if box is None else (float(box.get("x1", 0)), float(box.get("y1", 0))),
                    "time" if timed else "condition",
                    _text(transition, "tiempo" if timed else "codigo"),
                    "",
                ] += 1
    facts.libraries.update({lib.text or "" for lib in root.iterfind("SubAutomata/Librerias/lib")})
    facts.texts.update(_texts(root))
    return facts


# The dialect of VisualStates: nested states, below an outermost one for the component.


def _visualstates(root: ET.Element) -> Facts:
    facts = Facts()
    outermost = root.find("state")
    assert outermost is not None
    for holder in (root, *root.findall("global_namespace"), outermost, *outermost.findall("namespace")):
        for tag in ("functions", "variables"):
            _add_code(facts, tag, _text(holder, tag))
    facts.automata[(), _text(outermost, "timestep", "100")] += 1
    _visualstates_level(facts, outermost, ())
    facts.libraries.update(lib.text or "" for lib in root.iterfind("libraries/library"))
    newer = ("name", "proxyName", "ip", "port", "interfaceName")
    older = ("name", "proxyname", "ip", "port", "interface")
    _add_interfaces(facts, root, "config/interfaces/interface", newer)
    _add_interfaces(facts, root, "configs/config", older)
    for topic in root.iterfind("config/topics/topic"):
        facts.interfaces[_topic(topic)] += 1
    facts.texts.update(_texts(root))
    return facts


def _visualstates_level(facts: Facts, around: ET.Element, here: tuple[object, ...]) -> None:
    for state in around.findall("state"):
        key = _key(state.get("id"), state.findtext("name"))
        inside = state.findall("state")
        position = _position(state, "posx", "posy")
        initial = state.get("initial", "").lower() == "true"
        facts.states[here, key, initial, position, _text(state, "code"), len(inside)] += 1
        for holder in (state, *state.findall("namespace")):
            for tag in ("functions", "variables"):
                _add_code(facts, tag, _text(holder, tag))
        for transition in state.findall("transition"):
            facts.ids["transition", here, transition.get("id")] += 1
            timed = _text(transition, "type") == "0"
            facts.transitions[
                here,
                _text(transition, "originid"),
                _text(transition, "destinationid"),
                _text(transition, "name"),
                _position(transition, "posx", "posy"),
                "time" if timed else "condition",
                _text(transition, "time" if timed else "condition"),
                _text(transition, "code"),
            ] += 1
        if inside:
            facts.automata[(*here, key), _text(state, "timestep", "100")] += 1
            _visualstates_level(facts, state, (*here, key))


# Shared by all dialects.


def _key(id: str | None, name: str | None) -> tuple[str, str]:
    return (id or "").strip(), name or ""


def _text(element: ET.Element, tag: str, default: str = "") -> str:
    return element.findtext(tag, default) or ""


def _position(element: ET.Element, x: str, y: str) -> tuple[float, float]:
    return float(_text(element, x) or 0), float(_text(element, y) or 0)


def _add_code(facts: Facts, tag: str, text: str) -> None:
    if text.strip():
        facts.code[tag, text] += 1


_ENDS = {"Publish": ("publish", "Pub"), "Subscribe": ("subscribe", "Sub")}


def _topic(topic: ET.Element) -> tuple[str | None, ...]:
    """Return a topic of ROS 1 as it is in the native dialect."""
    kind, end = _ENDS[topic.findtext("opType") or ""]
    target = topic.findtext("name") or ""
    package, _, short = (topic.findtext("type") or "").partition("/")
    return kind, target[1:].replace("/", "_") + end, target, f"{package}/msg/{short}"


def _add_interfaces(facts: Facts, root: ET.Element, path: str, tags: tuple[str, ...]) -> None:
    for interface in root.iterfind(path):
        facts.interfaces[tuple(interface.findtext(tag) for tag in tags)] += 1


def _texts(root: ET.Element) -> Iterator[str]:
    for element in root.iter():
        if element.text and element.text.strip():
            yield element.text
        yield from (value for value in element.attrib.values() if value.strip())


def _is_translated(text: str) -> bool:
    """Return whether a text is a number or a truth value, whose spelling may change."""
    try:
        float(text)
    except ValueError:
        return text.lower() in ("true", "false")
    return True
