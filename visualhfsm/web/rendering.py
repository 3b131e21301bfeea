"""Documents as the JSON that the page draws, of which only what changed is made and sent."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, TypeVar

import msgspec

from codegen.hfsm.document import NO_CHILD, Automaton, Document, State, Transition
from visualhfsm.editing.views import view

__all__ = ["Rendering", "full", "patch", "render"]

Item = TypeVar("Item", State, Transition)


@dataclass(frozen=True, slots=True)
class _Standing:
    """The state that owns an automaton, 0 for none, and what the automaton is called after it."""

    owner: int
    title: str


@dataclass(frozen=True, slots=True)
class Rendering:
    """A version of a document: what it says of itself as JSON, and its automata in their order.

    Versions share what did not change, so that two of them are compared quickly.
    """

    header: bytes
    automata: tuple[Automaton, ...]
    standings: tuple[_Standing, ...]

    @property
    def ids(self) -> list[int]:
        """The ids of the automata in their order."""
        return [automaton.id for automaton in self.automata]

    @property
    def is_numbered(self) -> bool:
        """Whether no two automata have the same id."""
        return len(set(self.ids)) == len(self.automata)


def render(document: Document, name: str) -> Rendering:
    """Return the rendering of a version of a document; `name` is what its root is called."""
    owners = _owners(document)
    return Rendering(
        msgspec.json.encode({"name": name, **view(document)}),
        document.automata,
        tuple(_standing(automaton, owners, name) for automaton in document.automata),
    )


def full(rendering: Rendering) -> msgspec.Raw:
    """Return the JSON of a whole document: its own fields, and `automata`."""
    automata = b",".join(map(_whole, rendering.automata, rendering.standings))
    return msgspec.Raw(rendering.header[:-1] + b',"automata":[' + automata + b"]}")


def patch(old: Rendering, new: Rendering) -> msgspec.Raw | None:
    """Return as JSON what changed from one version to another; what did not is left out.

    `document`: its own fields, if one changed; `automata`: those that are new; `parts`: what changed in
    those that were there, see `_part`; `removed`: ids; `order`: all ids in their order, if that changed.
    None when automata cannot be told apart by their ids.
    """
    if not (old.is_numbered and new.is_numbered):
        return None
    former = {each.id: (each, standing) for each, standing in zip(old.automata, old.standings, strict=True)}
    whole: list[bytes] = []
    parts: list[bytes] = []
    for automaton, standing in zip(new.automata, new.standings, strict=True):
        known = former.get(automaton.id)
        if known is not None and known[0] is automaton and known[1] == standing:
            continue
        part = None if known is None else _part(*known, automaton, standing)
        if part is None:
            whole.append(_whole(automaton, standing))
        elif part:
            parts.append(msgspec.json.encode({"id": automaton.id, **part}))
    found: dict[str, Any] = {}
    if old.header != new.header:
        found["document"] = msgspec.Raw(new.header)
    if whole:
        found["automata"] = [msgspec.Raw(each) for each in whole]
    if parts:
        found["parts"] = [msgspec.Raw(each) for each in parts]
    if old.ids != new.ids:
        kept = set(new.ids)
        found["removed"] = [number for number in old.ids if number not in kept]
        found["order"] = new.ids
    return msgspec.Raw(msgspec.json.encode(found))


def _part(
    old: Automaton, old_standing: _Standing, new: Automaton, standing: _Standing
) -> dict[str, Any] | None:
    """Return what changed in an automaton; None when its items cannot be told apart by their ids.

    `fields`: those of the automaton itself that changed; `states` and `transitions`: what changed in these.
    """
    part: dict[str, Any] = {}
    former = _fields(old, old_standing)
    fields = {name: value for name, value in _fields(new, standing).items() if value != former[name]}
    if fields:
        part["fields"] = fields
    states = _items(old.states, new.states)
    transitions = _items(old.transitions, new.transitions)
    if states is None or transitions is None:
        return None
    if states:
        part["states"] = states
    if transitions:
        part["transitions"] = transitions
    return part


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


def _whole(automaton: Automaton, standing: _Standing) -> bytes:
    return msgspec.json.encode({"owner": standing.owner, "title": standing.title, **view(automaton)})


def _fields(automaton: Automaton, standing: _Standing) -> dict[str, Any]:
    """Return all that the page has of an automaton but its states and transitions."""
    bare = view(replace(automaton, states=(), transitions=()))
    del bare["states"], bare["transitions"]
    return {"owner": standing.owner, "title": standing.title, **bare}


def _owners(document: Document) -> dict[int, State]:
    """Return by the ids of automata the states that own them."""
    owners: dict[int, State] = {}
    for _, state in document.states():
        for child in state.children:
            owners.setdefault(child, state)
    return owners


def _standing(automaton: Automaton, owners: dict[int, State], name: str) -> _Standing:
    owner = owners.get(automaton.id)
    if owner is not None:
        return _Standing(owner.id, owner.name)
    return _Standing(NO_CHILD, name if automaton.father == NO_CHILD else f"automaton {automaton.id}")
