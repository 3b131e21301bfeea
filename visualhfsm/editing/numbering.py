"""Choose ids and names for what is new."""

from __future__ import annotations

import re
from collections.abc import Collection, Iterable, Iterator
from itertools import count
from typing import Final

from codegen.hfsm.document import Automaton, Document

from .nodes import MAX_ID

__all__ = ["automaton_ids", "free_ids", "free_name", "state_ids", "transition_ids"]

_NUMBERED: Final = re.compile(r"^(?P<stem>.*?)\s+\d{1,9}$", re.DOTALL)


def free_ids(used: Iterable[int]) -> Iterator[int]:
    """Yield ids that are not used: those above all others first, so that none comes back soon."""
    taken = {0, *used}
    yield from range(max(taken) + 1, MAX_ID + 1)
    yield from (number for number in range(1, MAX_ID + 1) if number not in taken)


def automaton_ids(document: Document) -> Iterator[int]:
    """Yield ids for new automata; one that is only referred to counts as used."""
    used = {automaton.id for automaton in document.automata}
    used.update(automaton.father for automaton in document.automata)
    for _, state in document.states():
        used.update(state.children)
    return free_ids(used)


def state_ids(automaton: Automaton) -> Iterator[int]:
    """Yield ids for new states; one that is only referred to counts as used."""
    used = {state.id for state in automaton.states}
    for transition in automaton.transitions:
        used |= {transition.origin, transition.destination}
    return free_ids(used)


def transition_ids(automaton: Automaton) -> Iterator[int]:
    """Yield ids for new transitions."""
    return free_ids(transition.id for transition in automaton.transitions)


def free_name(wanted: str, taken: Collection[str], separator: str = " ") -> str:
    """Return a name that is not taken: `wanted`, or with the next number behind it: `wait 2`."""
    if wanted not in taken:
        return wanted
    numbered = _NUMBERED.match(wanted) if separator == " " else None
    stem = numbered["stem"] if numbered else wanted
    return next(name for number in count(2) if (name := f"{stem}{separator}{number}") not in taken)
