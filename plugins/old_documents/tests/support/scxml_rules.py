"""Check a file against the rules of SCXML: W3C Recommendation of 1 September 2015, sections 3 to 6.

The tables are written from the recommendation's own, for what we write; nothing of the project is used.
"""

from __future__ import annotations

import re
import xml.etree.ElementTree as ET
from collections import Counter
from collections.abc import Iterator

NAMESPACE = "{http://www.w3.org/2005/07/scxml}"

_CODE = {"raise", "if", "foreach", "log", "assign", "script", "send", "cancel"}
_IN_STATES = {"onentry", "onexit", "transition", "state", "parallel", "history", "datamodel", "invoke"}
CHILDREN: dict[str, set[str]] = {
    "scxml": {"state", "parallel", "final", "datamodel", "script"},
    "state": _IN_STATES | {"initial", "final"},
    "parallel": _IN_STATES,
    "final": {"onentry", "onexit", "donedata"},
    "history": {"transition"},
    "initial": {"transition"},
    "transition": _CODE,
    "onentry": _CODE,
    "onexit": _CODE,
    "datamodel": {"data"},
    "data": set(),
    "script": set(),
    "send": {"param", "content"},
    "cancel": set(),
}
ATTRIBUTES: dict[str, tuple[set[str], set[str]]] = {
    # required, further ones
    "scxml": ({"version"}, {"initial", "name", "datamodel", "binding"}),
    "state": (set(), {"id", "initial"}),
    "parallel": (set(), {"id"}),
    "final": (set(), {"id"}),
    "history": (set(), {"id", "type"}),
    "initial": (set(), set()),
    "transition": (set(), {"event", "cond", "target", "type"}),
    "onentry": (set(), set()),
    "onexit": (set(), set()),
    "datamodel": (set(), set()),
    "data": ({"id"}, {"src", "expr"}),
    "script": (set(), {"src"}),
    "send": ({"event"}, {"target", "type", "id", "delay", "namelist"}),
    "cancel": ({"sendid"}, set()),
}
_AT_MOST_ONE = {"datamodel", "initial", "script"}
# Of what is not ASCII nearly all is allowed.
_NCNAME = re.compile(r"[A-Za-z_\u00c0-\U000effff][\w.\-\u00b7-\U000effff]*")
_EVENT = re.compile(r"[\w:\-\u00b7-\U000effff]+(\.[\w:\-\u00b7-\U000effff]+)*")
_DELAY = re.compile(r"\d*(\.\d+)?(ms|s|m|h|d)")


def violations(text: str) -> list[str]:
    """Return the violations of the rules in a file."""
    root = ET.fromstring(text.encode())
    if root.tag != f"{NAMESPACE}scxml" or root.get("version") != "1.0":
        return ["the root is no scxml of version 1.0"]
    return [
        *(found for element in _all(root) for found in _of_element(element)),
        *_of_ids(root),
    ]


def _of_element(element: ET.Element) -> Iterator[str]:
    name = _name(element)
    if name not in CHILDREN:
        yield f"{name} is no element that is written"
        return
    inside = Counter(_name(child) for child in _children(element))
    yield from (f"{child} in {name}" for child in inside.keys() - CHILDREN[name])
    yield from (f"{count} {child} in {name}" for child, count in inside.items() if count > 1 and child in _AT_MOST_ONE)  # fmt: skip
    required, further = ATTRIBUTES[name]
    plain = {attribute for attribute in element.attrib if not attribute.startswith("{")}
    yield from (f"{name} without {attribute}" for attribute in required - plain)
    yield from (f"{attribute} of {name}" for attribute in plain - required - further)
    if name == "scxml" and element.get("initial") is None and inside.keys() & {"state", "parallel", "final"}:
        yield "a document that does not say where it begins"
    if name not in ("script", "data") and (element.text or "").strip():
        yield f"text in {name}"
    if name == "transition":
        if not any(element.get(attribute) for attribute in ("event", "cond", "target")):
            yield "a transition without event, condition and target"
        if not all(map(_EVENT.fullmatch, (element.get("event") or "").split())):
            yield f"the event {element.get('event')!r}"
        if element.get("event") == "":
            yield "an event without a name"
    if name == "history":
        transitions = list(_children(element))
        if len(transitions) != 1 or transitions[0].get("event") or transitions[0].get("cond"):
            yield "a history without a default"
        if element.get("type") not in ("deep", "shallow"):
            yield "a history of another type"
    if name == "send" and not _DELAY.fullmatch(element.get("delay", "0s")):
        yield f"the delay {element.get('delay')!r}"


def _of_ids(root: ET.Element) -> Iterator[str]:
    ids = [element.get("id") for element in _all(root) if element.get("id") is not None]
    yield from (f"{count} elements with the id {name}" for name, count in Counter(ids).items() if count > 1)
    yield from (f"the id {name!r}" for name in ids if not _NCNAME.fullmatch(str(name)))
    targets = {e.get("id"): e for e in _all(root) if _name(e) in ("state", "parallel", "final", "history")}
    sends = {element.get("id") for element in _all(root) if _name(element) == "send"}
    for element in _all(root):
        name = _name(element)
        for target in (element.get("target") or "").split() if name == "transition" else ():
            if target not in targets:
                yield f"a transition to {target}, which is none"
        if name == "cancel" and element.get("sendid") not in sends:
            yield f"{element.get('sendid')} is not sent"
        below = {inner.get("id") for inner in element.iter() if inner is not element}
        yield from (
            f"{target} is not in what begins there"
            for target in (element.get("initial") or "").split()
            if target not in below
        )
        if name in ("state", "parallel"):
            for history in (child for child in _children(element) if _name(child) == "history"):
                for transition in _children(history):
                    yield from (
                        f"the history of {element.get('id')} leads out of it"
                        for target in (transition.get("target") or "").split()
                        if target not in below
                    )


def _all(element: ET.Element) -> Iterator[ET.Element]:
    """Yield the elements of SCXML, without the content of elements of other programs."""
    yield element
    for child in _children(element):
        yield from _all(child)


def _children(element: ET.Element) -> Iterator[ET.Element]:
    return (child for child in element if child.tag.startswith(NAMESPACE))


def _name(element: ET.Element) -> str:
    return element.tag.removeprefix(NAMESPACE)
