"""Find the automata in VisualStates' states inside states, and give them ids."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import count

from ...document import NO_CHILD
from ..xml_tree import XmlElement
from .elements import MAX_ID, ElementReader

__all__ = ["Level", "levels_of", "states_in"]


@dataclass(frozen=True, slots=True)
class Level:
    """The states of one automaton, and the state around them that owns it."""

    id: int
    father: int
    owner: XmlElement | None
    states: tuple[XmlElement, ...]

    @property
    def is_root(self) -> bool:
        """Whether nothing stands around it but what stands for the component."""
        return self.father == NO_CHILD


def levels_of(
    reader: ElementReader, outermost: Sequence[XmlElement]
) -> tuple[list[Level], dict[XmlElement, int]]:
    """Return the automata, the root first and each before those below it, and the ids of all states.

    An automaton's id is that of the state that owns it and one, so that it does not change with what is
    drawn elsewhere; where two states have one id, the second automaton gets a free one.
    """
    owner = outermost[0] if len(outermost) == 1 else None
    if len(outermost) > 1:
        message = "there are several outermost states: they are taken for those of the root"
        reader.warn(outermost[1], "W505", message)
    top = tuple(outermost) if owner is None else states_in(owner)
    every = [state for outer in top for state in _with_states_below(outer)]
    ids = reader.ids(every, lambda state: state.attributes.get("id"))
    used: set[int] = set()

    def number(wanted: int) -> int:
        is_free = wanted not in used and wanted <= MAX_ID
        found = wanted if is_free else next(n for n in count(1) if n not in used)
        used.add(found)
        return found

    around = 0 if owner is None else reader.optional_id(owner, "id", owner.attributes.get("id"))
    levels = [Level(number(around + 1), NO_CHILD, owner, top)]
    # What an automaton has below it follows in the list, which grows while it is walked.
    for level in levels:
        for state in level.states:
            inside = states_in(state)
            if inside:
                levels.append(Level(number(ids[state] + 1), level.id, state, inside))
    return levels, ids


def states_in(element: XmlElement) -> tuple[XmlElement, ...]:
    """Return the states that stand directly inside an element."""
    return tuple(each for each in element.elements() if each.tag == "state")


def _with_states_below(state: XmlElement) -> Iterator[XmlElement]:
    yield state
    for inner in states_in(state):
        yield from _with_states_below(inner)
