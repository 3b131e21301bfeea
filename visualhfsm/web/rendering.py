"""Documents as the JSON that the page draws, made in pieces so that only what changed is made and sent."""

from __future__ import annotations

from dataclasses import dataclass

import msgspec

from codegen.hfsm.document import NO_CHILD, Automaton, Document, State
from visualhfsm.editing.views import automaton_view, document_view

__all__ = ["Renderer", "Rendering", "full", "patch"]


@dataclass(frozen=True, slots=True)
class Rendering:
    """A document as JSON: what it says of itself, and its automata in their order."""

    header: bytes
    ids: tuple[int, ...]
    automata: tuple[bytes, ...]

    @property
    def is_numbered(self) -> bool:
        """Whether no two automata have the same id."""
        return len(set(self.ids)) == len(self.ids)


class Renderer:
    """Renders the versions of one document; not for several threads at a time."""

    def __init__(self) -> None:
        # By identity: the automata are immutable, and kept here as long as their ids are.
        self._known: dict[int, tuple[Automaton, bytes]] = {}

    def render(self, document: Document, name: str) -> Rendering:
        """Return the rendering of a version of the document; `name` is what its root is called."""
        self._known = {id(automaton): self._rendered(automaton) for automaton in document.automata}
        owners = _owners(document)
        return Rendering(
            _with_fields(msgspec.json.encode(document_view(document)), name=name),
            tuple(automaton.id for automaton in document.automata),
            tuple(
                _with_fields(self._known[id(automaton)][1], **_standing(automaton, owners, name))
                for automaton in document.automata
            ),
        )

    def _rendered(self, automaton: Automaton) -> tuple[Automaton, bytes]:
        return self._known.get(id(automaton)) or (automaton, msgspec.json.encode(automaton_view(automaton)))


def full(rendering: Rendering) -> msgspec.Raw:
    """Return the JSON of a whole document: its own fields, and `automata`."""
    automata = b'"automata":[' + b",".join(rendering.automata) + b"]}"
    return msgspec.Raw(rendering.header[:-1] + b"," + automata)


def patch(old: Rendering, new: Rendering) -> msgspec.Raw | None:
    """Return as JSON what changed from one version to another.

    `document`: its own fields, if one changed; `automata`: those that changed or are new; `removed`: ids;
    `order`: all ids in their order, if that changed. None when automata cannot be told apart by their ids.
    """
    if not (old.is_numbered and new.is_numbered):
        return None
    former = dict(zip(old.ids, old.automata, strict=True))
    changed = [
        content
        for number, content in zip(new.ids, new.automata, strict=True)
        if former.get(number) != content
    ]
    parts = [b'"automata":[' + b",".join(changed) + b"]"]
    if old.header != new.header:
        parts.insert(0, b'"document":' + new.header)
    if old.ids != new.ids:
        kept = set(new.ids)
        parts.append(
            b'"removed":' + msgspec.json.encode([number for number in old.ids if number not in kept])
        )
        parts.append(b'"order":' + msgspec.json.encode(new.ids))
    return msgspec.Raw(b"{" + b",".join(parts) + b"}")


def _owners(document: Document) -> dict[int, State]:
    """Return by the ids of automata the states that own them."""
    owners: dict[int, State] = {}
    for _, state in document.states():
        for child in state.children:
            owners.setdefault(child, state)
    return owners


def _standing(automaton: Automaton, owners: dict[int, State], name: str) -> dict[str, object]:
    """Return the state that owns an automaton, 0 for none, and what the automaton is called after it."""
    owner = owners.get(automaton.id)
    if owner is not None:
        return {"owner": owner.id, "title": owner.name}
    return {"owner": NO_CHILD, "title": name if automaton.father == NO_CHILD else f"automaton {automaton.id}"}


def _with_fields(content: bytes, **fields: object) -> bytes:
    """Return a JSON object with further fields in front; it has some of its own."""
    return msgspec.json.encode(fields)[:-1] + b"," + content[1:]
