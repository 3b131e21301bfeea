"""Documents as the JSON that the page draws, of which only what changed is made and sent.

Versions of a document share what did not change, so that two of them are compared quickly.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any, NamedTuple, TypeVar

import msgspec

from codegen.hfsm.document import Automaton, Document, State, Transition
from visualhfsm.editing.views import view

__all__ = ["Version", "full", "patch"]

Item = TypeVar("Item", State, Transition)


class Version(NamedTuple):
    """A document at one moment, and what it is called."""

    document: Document
    name: str

    def header(self) -> dict[str, Any]:
        """Return all that the page has of it but its automata."""
        return {"name": self.name, **view(self.document)}


def full(version: Version) -> msgspec.Raw:
    """Return the JSON of a whole document: its own fields, and `automata`."""
    automata = [view(automaton) for automaton in version.document.automata]
    return _json({**version.header(), "automata": automata})


def patch(old: Version, new: Version) -> msgspec.Raw | None:
    """Return as JSON what changed from one version to another; what did not is left out.

    `document`: its own fields, if one changed; `automata`: those that are new; `parts`: what changed in
    those that were there, see `_part`; `removed`: ids; `order`: all ids in their order, if that changed.
    None when ids of automata are not unique.
    """
    former = {automaton.id: automaton for automaton in old.document.automata}
    now = {automaton.id: automaton for automaton in new.document.automata}
    if len(former) < len(old.document.automata) or len(now) < len(new.document.automata):
        return None
    whole: list[dict[str, Any]] = []
    parts: list[dict[str, Any]] = []
    for automaton in now.values():
        known = former.get(automaton.id)
        if known is automaton:
            continue
        part = None if known is None else _part(known, automaton)
        if part is None:
            whole.append(view(automaton))
        elif part:
            parts.append({"id": automaton.id, **part})
    found: dict[str, Any] = {}
    if (header := new.header()) != old.header():
        found["document"] = header
    if whole:
        found["automata"] = whole
    if parts:
        found["parts"] = parts
    if list(former) != list(now):
        found["removed"] = [number for number in former if number not in now]
        found["order"] = list(now)
    return _json(found)


def _part(old: Automaton, new: Automaton) -> dict[str, Any] | None:
    """Return what changed in an automaton; None when ids of its items are not unique.

    `fields`: those of the automaton itself that changed; `states` and `transitions`: what changed in these.
    """
    states = _items(old.states, new.states)
    transitions = _items(old.transitions, new.transitions)
    if states is None or transitions is None:
        return None
    former = view(replace(old, states=(), transitions=()))
    now = view(replace(new, states=(), transitions=()))
    fields = {name: value for name, value in now.items() if value != former[name]}
    changed = {"fields": fields, "states": states, "transitions": transitions}
    return {name: value for name, value in changed.items() if value}


def _items(old: tuple[Item, ...], new: tuple[Item, ...]) -> dict[str, Any] | None:
    """Return what changed in a list; None when two of it have the same id.

    `changed`: the items that differ, and the new ones, which stand at the end; `removed`: ids; `order`: all
    ids in their order, if that is another one then.
    """
    if old is new:
        return {}
    former = {each.id: each for each in old}
    now = {each.id: each for each in new}
    if len(former) < len(old) or len(now) < len(new):
        return None
    found: dict[str, Any] = {}
    # Most are the very same: comparing them costs nothing.
    changed = [each for each in new if (known := former.get(each.id)) is not each and known != each]
    if changed:
        found["changed"] = [view(each) for each in changed]
    if removed := former.keys() - now.keys():
        found["removed"] = sorted(removed)
    kept = [number for number in former if number in now]
    order = list(now)
    if kept + [number for number in order if number not in former] != order:
        found["order"] = order
    return found


def _json(value: object) -> msgspec.Raw:
    return msgspec.Raw(msgspec.json.encode(value))
