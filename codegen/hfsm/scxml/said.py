"""Tell which leaves of native elements SCXML says already, so that they need not stand there twice."""

from __future__ import annotations

from collections.abc import Collection

from ..document import Text
from ..formats.xml_tree import XmlComment, XmlElement
from .own_elements import is_plain_leaf, with_comments
from .placement import PlacedAutomaton, PlacedState, PlacedTransition
from .vocabulary import delay_text, milliseconds_text

__all__ = ["said_of_automaton", "said_of_state", "said_of_transition"]

_Parts = set[XmlElement | XmlComment]


def said_of_automaton(placed: PlacedAutomaton, *, variables: bool) -> _Parts:
    """Return what of an automaton stands elsewhere; its `variables` may be data."""
    misfits = {each.native for each in placed.misfits}
    left_out: _Parts = set()
    for comments, child in with_comments(placed.native):
        if child.tag == "state" or (child.tag == "transition" and child not in misfits):
            left_out |= {child, *comments}
    blank = {leaf.tag for leaf in placed.native.elements() if not leaf.text}
    said = blank & {"variables", "functions"} | ({"variables"} if variables else set())
    return left_out | _plain_leaves(placed.native, said)


def said_of_state(placed: PlacedState) -> _Parts:
    """Return the leaves of a state that SCXML says already."""
    state = placed.state
    said = {"entry", "exit"}
    if state.name == placed.id:
        said.add("name")
    if tuple(each.automaton.id for each in placed.automata) == state.children:
        said |= {"idSubautomataSon", "child"}
    if state.final:
        said.add("final")
    if placed.has_inside and state.history.text in ("", "restart"):
        said.add("history")
    if not state.code.text:
        said.add("code")
    return _plain_leaves(placed.native, said)


def said_of_transition(placed: PlacedTransition, condition: Text) -> _Parts:
    """Return the leaves of a transition that SCXML says already, with this text in `cond`."""
    said = {"origin", "destiny", "transcode"}
    guard = placed.transition.guard
    if placed.transition.type != "condition" and (not guard.is_blank or not guard.text):
        said.add("guard")
    found = _plain_leaves(placed.native, said)
    if _is_said_by_trigger(placed, condition):
        found |= _plain_leaves(placed.native, {"trans"}, ("type",))
    return found


def _plain_leaves(native: XmlElement, tags: Collection[str], known: Collection[str] = ()) -> _Parts:
    return {
        leaf
        for comments, leaf in with_comments(native)
        if leaf.tag in tags and is_plain_leaf(comments, leaf, known)
    }


def _is_said_by_trigger(placed: PlacedTransition, condition: Text) -> bool:
    transition = placed.transition
    match transition.type:
        case "time":
            delay = delay_text(transition.trigger.text)
            read = milliseconds_text(delay) if delay is not None else None
            return read is not None and read[0] == transition.trigger.text
        case "finished":
            return not transition.trigger.text
        case "condition":
            return transition.trigger.text == condition.text
    return True
