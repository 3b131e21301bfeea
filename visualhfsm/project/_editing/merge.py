"""Merge two versions of a document with a common ancestor.

Changes of only one side are taken over; texts, such as code, are merged line by line. Where both changed
the same part of an element, mine is kept, and the element is a conflict. New elements of theirs with the id
of a new one of mine get another id. Inconsistencies, such as a transition to a state that the other side
deleted, are left to the checks.
"""

from __future__ import annotations

import re
from collections import deque
from collections.abc import Callable, Hashable, Iterable, Iterator, Sequence
from dataclasses import replace
from difflib import SequenceMatcher
from os.path import commonprefix
from typing import Any, Final, NamedTuple, TypeVar

from codegen.hfsm.document import Annotation, Automaton, Document, Node, State, Text, Transition
from codegen.messages import Message
from visualhfsm._document.diff import KEYS, compared_fields, keyed, part_of, shown
from visualhfsm._document.nodes import free_ids, label

_NodeT = TypeVar("_NodeT", bound=Node)
_T = TypeVar("_T", bound=Hashable)
_Numbered = Automaton | State | Transition | Annotation

_MOST_LINES: Final = 5000
"""Limit of the lines of a text that is compared line by line."""
_WORDS: Final = re.compile(r"\w+|\W")
_MOST_LETTERS: Final = 2000
"""Limit of the letters that are compared one by one; a longer change counts as one."""


class Merged(NamedTuple):
    """The result of a merge; `conflicts` names the elements of which both changed the same."""

    document: Document
    conflicts: tuple[Message, ...]


def merge_documents(base: Document, mine: Document, theirs: Document) -> Merged:
    """Return the merge of `mine` and `theirs` with their common ancestor `base`."""
    conflicts: list[Message] = []
    document = _merged_node(base, mine, _with_own_numbers(base, mine, theirs), conflicts)
    return Merged(document, tuple(conflicts))


def _merged_node(base: _NodeT, mine: _NodeT, theirs: _NodeT, conflicts: list[Message]) -> _NodeT:
    values: dict[str, Any] = {}
    parts: list[str] = []
    for name in compared_fields(mine):
        old, own, other = (getattr(each, name) for each in (base, mine, theirs))
        if other == own or other == old:  # noqa: PLR1714, SIM109 - not everything has a hash
            continue
        if own == old:
            values[name] = other
        elif name in KEYS:
            values[name] = _merged_list(name, old, own, other, conflicts)
        elif isinstance(own, tuple):
            values[name] = _merged_sequence(old, own, other)
        elif isinstance(own, Text) and (text := merge_lines(old.text, own.text, other.text)) is not None:
            values[name] = Text(text)
        elif name not in ("x", "y", "width", "height"):  # places on the canvas are no conflict
            parts.append(part_of(mine, name))
    if parts:
        conflicts.append(Message("{what} ({parts}): yours stays", what=_what(mine), parts=", ".join(parts)))
    merged: _NodeT = replace(mine, **values) if values else mine
    return merged


def _merged_list(
    name: str, base: Sequence[Node], mine: Sequence[Node], theirs: Sequence[Node], conflicts: list[Message]
) -> tuple[Node, ...]:
    old = keyed(name, base)
    here = keyed(name, mine)
    there = keyed(name, theirs)
    found: dict[Hashable, Node] = {}
    for key in {**here, **there}:
        former = old.get(key)
        own = here.get(key)
        other = there.get(key)
        if own is not None and other is not None:
            found[key] = own if former is None else _merged_node(former, own, other, conflicts)
            if former is None and own != other:
                conflicts.append(Message("{what} (new on both sides): yours stays", what=_what(own)))
        elif (kept := own or other) is not None and kept != former:
            found[key] = kept
            if former is not None:
                conflicts.append(Message("{what} (deleted on one side): it stays", what=_what(kept)))
    order = _merged_sequence(tuple(old), tuple(here), tuple(there), keep=set(found))
    return tuple(found[key] for key in order)


def _what(node: Node) -> Message:
    match node:
        case Document():
            return Message("the document")
        case Automaton():
            return Message("automaton {id}", id=node.id)
        case State():
            return Message("state {label}", label=label(node))
        case Transition():
            return Message("transition {label}", label=label(node))
        case Annotation(kind="frame"):
            return Message("frame {label}", label=label(node))
        case Annotation():
            return Message("note {label}", label=label(node))
    return Message.verbatim(f"{type(node).__name__.lower()} {shown(node)}")


def _merged_sequence(
    base: Sequence[_T], mine: Sequence[_T], theirs: Sequence[_T], keep: Iterable[_T] | None = None
) -> tuple[_T, ...]:
    """Return the items of two sequences in the order of the side that changed it, mine if both did.

    Those that one side removed are left out unless they are to be kept.
    """
    old = set(base)
    here = set(mine)
    there = set(theirs)
    kept = set(keep) if keep is not None else (here & there) | ((here | there) - old)
    common = here & there & old
    same_order = [item for item in mine if item in common] == [item for item in base if item in common]
    spine, other = (theirs, mine) if same_order else (mine, theirs)
    order, present = list(dict.fromkeys(spine)), set(spine)
    for before, item in zip((None, *other), other, strict=False):
        if item not in present:
            order.insert(0 if before is None else order.index(before) + 1, item)
    return tuple(item for item in dict.fromkeys(order) if item in kept)


def _with_own_numbers(base: Document, mine: Document, theirs: Document) -> Document:
    """Return their version with other ids for what is new in it and collides with what is new in mine."""
    old = {automaton.id: automaton for automaton in base.automata}
    here = {automaton.id: automaton for automaton in mine.automata}
    numbers = _new_numbers(base.automata, mine.automata, theirs.automata)
    automata = (
        _with_own_items(old[each.id], here[each.id], each) if each.id in old and each.id in here else each
        for each in theirs.automata
    )
    if numbers:
        automata = (
            replace(
                each,
                id=numbers.get(each.id, each.id),
                father=numbers.get(each.father, each.father),
                states=tuple(_with_children(state, numbers) for state in each.states),
            )
            for each in automata
        )
    return replace(theirs, automata=tuple(automata))


def _with_children(state: State, numbers: dict[int, int]) -> State:
    return replace(
        state,
        children=tuple(numbers.get(child, child) for child in state.children),
        arguments=tuple(replace(each, child=numbers.get(each.child, each.child)) for each in state.arguments),
        results=tuple(replace(each, child=numbers.get(each.child, each.child)) for each in state.results),
    )


def _with_own_items(base: Automaton, mine: Automaton, theirs: Automaton) -> Automaton:
    states = _new_numbers(base.states, mine.states, theirs.states)
    transitions = tuple(
        replace(
            each,
            origin=states.get(each.origin, each.origin),
            destination=states.get(each.destination, each.destination),
        )
        for each in theirs.transitions
    )
    numbers = _new_numbers(base.transitions, mine.transitions, transitions)
    notes = _new_numbers(base.annotations, mine.annotations, theirs.annotations)
    return replace(
        theirs,
        states=tuple(replace(each, id=states.get(each.id, each.id)) for each in theirs.states),
        transitions=tuple(replace(each, id=numbers.get(each.id, each.id)) for each in transitions),
        annotations=tuple(replace(each, id=notes.get(each.id, each.id)) for each in theirs.annotations),
    )


def _new_numbers(
    base: Sequence[_Numbered], mine: Sequence[_Numbered], theirs: Sequence[_Numbered]
) -> dict[int, int]:
    """Return other ids for what is new in theirs and has that of something else that is new in mine."""
    old = {each.id for each in base}
    here = {each.id: each for each in mine}
    free = free_ids((*old, *here, *(each.id for each in theirs)))
    return {
        each.id: next(free)
        for each in theirs
        if each.id not in old and each.id in here and here[each.id] != each
    }


class _Hunk(NamedTuple):
    """Lines (or letters) of the base, from `start` to before `end`, and their replacement."""

    start: int
    end: int
    lines: list[str]


def merge_lines(base: str, mine: str, theirs: str) -> str | None:
    """Return the merge of two texts with the ancestor `base`, or None when both changed the same lines.

    Changes of adjacent lines count as a conflict, too: together they might mean something that neither side
    has written.
    """
    return _merged_text(base, mine, theirs, lambda *_: None)


class Typed(NamedTuple):
    """The result of typing on two sides; `conflict`: both replaced the same letters by different ones."""

    text: str
    conflict: bool


def merge_typing(base: str, mine: str, theirs: str) -> Typed:
    """Return the merge of two texts that were typed at the same time, with all letters of both.

    Text that only one side deleted is removed. Where both wrote at the same place, mine comes first.
    """
    conflicts: list[bool] = []

    def letters(*texts: str) -> str:
        if (lines := _merged_lines(*texts)) is not None:
            return lines
        merged = _merged_letters(*texts)
        conflicts.append(merged.conflict)
        return merged.text

    text = _merged_text(base, mine, theirs, letters)
    return _merged_letters(base, mine, theirs) if text is None else Typed(text, any(conflicts))


def _merged_text(
    base: str, mine: str, theirs: str, resolve: Callable[[str, str, str], str | None]
) -> str | None:
    """Merge line by line; `resolve` merges lines that both changed, or returns None to give up."""
    lines, *others = (text.splitlines(keepends=True) for text in (_ended(base), _ended(mine), _ended(theirs)))
    if max(len(lines), *map(len, others)) > _MOST_LINES:
        return None
    here, there = (deque(_hunks(lines, other)) for other in others)
    merged: list[str] = []
    done = 0
    while here or there:
        start = min(side[0].start for side in (here, there) if side)
        own, other, end = _overlapping(here, there)
        merged += lines[done:start]
        if own and other and own != other:
            texts = ("".join(_applied(lines, start, end, hunks)) for hunks in ([], own, other))
            resolved = resolve(*texts)
            if resolved is None:
                return None
            merged.append(resolved)
        else:
            merged += _applied(lines, start, end, own or other)
        done = end
    text = "".join(merged + lines[done:])
    return text if _ends(base, mine, theirs) else text.removesuffix("\n")


def _merged_lines(base: str, mine: str, theirs: str) -> str | None:
    """Merge whole lines that were added and deleted side by side; None if a side replaced some by others.

    Letters would not do: where a line was added before one that begins like it, they match those of both.
    """
    lines, *others = (text.splitlines(keepends=True) for text in (base, mine, theirs))
    added: dict[int, list[str]] = {}
    deleted: set[int] = set()
    for other in others:
        for start, end, new in _hunks(lines, other):
            if start < end and new:
                return None
            added.setdefault(start, []).extend(new)
            deleted.update(range(start, end))
    kept = [[] if index in deleted else [line] for index, line in enumerate(lines)]
    return "".join(line for index, own in enumerate([*kept, []]) for line in (*added.get(index, ()), *own))


def _overlapping(here: deque[_Hunk], there: deque[_Hunk]) -> tuple[list[_Hunk], list[_Hunk], int]:
    """Take the first change, with all that touch it on either side; return them by side, and their end."""
    taken: tuple[list[_Hunk], list[_Hunk]] = ([], [])
    end = -1
    while True:
        sides = [(side[0].start, index) for index, side in enumerate((here, there)) if side]
        start, index = min(sides, default=(end + 1, 0))
        if end >= 0 and (start > end or not sides):
            return *taken, end
        hunk = (here, there)[index].popleft()
        taken[index].append(hunk)
        end = max(end, hunk.end)


def _applied(lines: Sequence[str], start: int, end: int, hunks: Iterable[_Hunk]) -> list[str]:
    """Return lines of the base with the changes of one side."""
    found: list[str] = []
    for hunk in hunks:
        found += [*lines[start : hunk.start], *hunk.lines]
        start = hunk.end
    return [*found, *lines[start:end]]


def _merged_letters(base: str, mine: str, theirs: str) -> Typed:
    changes = [list(_letters(base, text)) for text in (mine, theirs)]
    written: dict[int, str] = {}
    deleted = [False] * len(base)
    for hunks in changes:
        for start, end, letters in hunks:
            written[start] = written.get(start, "") + "".join(letters)
            deleted[start:end] = [True] * (end - start)
    kept = ("" if gone else letter for letter, gone in zip(base, deleted, strict=True))
    text = "".join(written.get(index, "") + letter for index, letter in enumerate((*kept, "")))
    own, other = ([hunk for hunk in hunks if hunk.end > hunk.start and any(hunk.lines)] for hunks in changes)
    return Typed(text, any(one.start < two.end and two.start < one.end for one in own for two in other))


def _letters(base: str, changed: str) -> Iterator[_Hunk]:
    """Yield in which letters two texts differ, in whole words where something was replaced."""
    whole = _trimmed(base, _Hunk(0, len(base), [changed]))
    old, new = base[whole.start : whole.end], "".join(whole.lines)
    if not old or not new or max(len(old), len(new)) > _MOST_LETTERS:
        if old or new:
            yield _at_words(base, whole)
        return
    found = _insertions(old, new)
    if found is None:
        words, ends = _WORDS.findall(old), [0]
        for word in words:
            ends.append(ends[-1] + len(word))
        found = [
            _trimmed(old, _Hunk(ends[each.start], ends[each.end], each.lines))
            for each in _hunks(words, _WORDS.findall(new))
        ]
    for hunk in found:
        yield _Hunk(whole.start + hunk.start, whole.start + hunk.end, hunk.lines)


def _at_words(base: str, hunk: _Hunk) -> _Hunk:
    """Return an insertion where whole words are inserted, if letters on both sides of it leave a choice.

    In `one three` a `two ` may as well be `wo t`, which others who change `three` would take apart.
    """
    start, text = hunk.start, "".join(hunk.lines)
    if hunk.end > start:
        return hunk
    while _splits_word(base, start, text) and start > 0 and base[start - 1] == text[-1]:
        start, text = start - 1, text[-1] + text[:-1]
    return hunk if _splits_word(base, start, text) else _Hunk(start, start, [text])


def _splits_word(base: str, at: int, text: str) -> bool:
    before, after = base[at - 1 : at] + text[0], text[-1] + base[at : at + 1]
    return any(len(pair) > 1 and all(letter.isalnum() for letter in pair) for pair in (before, after))


def _insertions(old: str, new: str) -> list[_Hunk] | None:
    """Return the insertions at several places, or None when something was also deleted."""
    found: list[_Hunk] = []
    at = 0
    for letter in new:
        if at < len(old) and letter == old[at]:
            at += 1
        elif found and found[-1].start == at:
            found[-1].lines.append(letter)
        else:
            found.append(_Hunk(at, at, [letter]))
    return found if at == len(old) else None


def _trimmed(base: str, hunk: _Hunk) -> _Hunk:
    """Return a change of letters without those at its ends that stay."""
    old, new = base[hunk.start : hunk.end], "".join(hunk.lines)
    first = len(commonprefix((old, new)))  # noqa: RUF071 - of letters
    last = len(commonprefix((old[first:][::-1], new[first:][::-1])))  # noqa: RUF071
    return _Hunk(hunk.start + first, hunk.end - last, [new[first : len(new) - last]])


def _hunks(base: Sequence[str], changed: Sequence[str]) -> Iterator[_Hunk]:
    matcher = SequenceMatcher(None, base, changed, autojunk=False)
    for what, start, end, first, last in matcher.get_opcodes():
        if what != "equal":
            yield _Hunk(start, end, list(changed[first:last]))


def _ended(text: str) -> str:
    """Return a text whose last line ends with a newline, so that it compares equal when another follows."""
    return text if text.endswith("\n") else f"{text}\n"


def _ends(base: str, mine: str, theirs: str) -> bool:
    """Return whether the merged text ends with a newline, as on the side that changed that."""
    own, other = mine.endswith("\n"), theirs.endswith("\n")
    return own if own != base.endswith("\n") else other
