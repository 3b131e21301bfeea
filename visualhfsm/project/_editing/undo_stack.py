"""The steps of a document that can be undone and redone, by whom they were made, and which of them are mine.

All share one list, which is undone from its end. Who types in a place where others type as well undoes only
what is typed there by the same one: a new step takes that back, and keeps what others typed meanwhile.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Collection, Hashable, Iterable, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from time import monotonic
from typing import Final

import msgspec

from codegen.hfsm.document import Document
from codegen.messages import Message
from visualhfsm._document.commands import Command
from visualhfsm._document.commands.text import SetText
from visualhfsm._document.places import Place, texts_at
from visualhfsm._document.serialization import MAX_SIZE, written

from .merge import merge_typing

MERGE_WITHIN: Final = 2.0
"""Seconds without a change after which the same kind of change is a new step."""
_MOST_STEPS: Final = 5000
_GROWTH: Final = 2048
"""Limit of the bytes by which a command may let a document grow, beyond its own size."""
_ESCAPED: Final = 6
"""Bytes that one byte of a command may take in a document."""


@dataclass(frozen=True, slots=True)
class Step:
    """The target of undoing or redoing: a document, and the revision at which it was made.

    What leads from it to the next one was done `by` somebody, None if that is not known, perhaps by typing at
    a place; it may take back another step, that from the revision `reverts`.
    """

    name: Message
    document: Document
    revision: int
    by: Hashable = None
    place: Place | None = None
    reverts: int | None = None


@dataclass(frozen=True, slots=True)
class Own:
    """Who undoes what is typed at a place, and the `others` who may type there now."""

    by: Hashable
    place: Place
    others: Collection[Hashable]


@dataclass(frozen=True, slots=True)
class TakenBack:
    """The text without a step of one's own, with what others have typed since, and that step."""

    step: Step
    text: str
    conflict: bool


class UndoStack:
    """The present document, with the former ones and those that were undone.

    Documents share unchanged parts, so that a step takes little memory; of more than 5000 the oldest is
    dropped.
    """

    def __init__(self, document: Document, size: int = MAX_SIZE) -> None:
        self.document = document
        self.revision = 0
        """The revision at which the present document was made: going back to it keeps that number."""
        self.changes = 0
        """The number of changes so far, back and forth, which is the latest revision."""
        self.past: deque[Step] = deque(maxlen=_MOST_STEPS)
        self.future: deque[Step] = deque()
        self._size_bound = size
        self._key: Hashable | None = None
        self._changed_at = 0.0

    def merges(self, key: Hashable | None, within: float) -> bool:
        """Return whether a change with this key continues the last step, which is at most `within` s old."""
        recent = monotonic() - self._changed_at <= within
        return key is not None and key == self._key and recent and bool(self.past)

    def do(
        self,
        command: Command,
        key: Hashable | None = None,
        by: Hashable = None,
        *,
        merge: bool,
        reverts: int | None = None,
    ) -> Message:
        """Apply a command, as a separate step or as part of the last one, and return the step's name.

        Raises EditError, and leaves everything as it was, when that is not possible, or the document would be
        too large. What changes nothing is no step.
        """
        name, document = command.title(self.document), command.apply(self.document)
        if document == self.document:  # cheap: what they share is identical
            return name
        self._size_bound = _bound(document, self._size_bound, command)
        self.changes += 1
        if not merge:
            place = command.place if isinstance(command, SetText) else None
            self.past.append(Step(name, self.document, self.revision, by, place, reverts))
        self.future.clear()
        self.document, self.revision = document, self.changes
        self._key = key
        self._changed_at = monotonic()
        return name

    def require(self, commands: Iterable[Command]) -> None:
        """Raise EditError if commands cannot all be applied, one after the other."""
        document, bound = self.document, self._size_bound
        for command in commands:
            after = command.apply(document)
            if after != document:
                bound = _bound(after, bound, command)
            document = after

    def seal(self) -> None:
        """Make the next change a separate step, as it is after undoing and redoing."""
        self._key = None

    def undo(self) -> Step | None:
        """Go back one step and return it, or None when there is none."""
        return self._move(self.past, self.future)

    def redo(self) -> Step | None:
        """Do the step again that was undone last, and return it, or None when there is none."""
        return self._move(self.future, self.past)

    def _move(self, source: deque[Step], target: deque[Step]) -> Step | None:
        if not source:
            return None
        step = source.pop()
        target.append(replace(step, document=self.document, revision=self.revision))
        self.document, self.revision = step.document, step.revision
        self.changes += 1
        self.seal()
        return step

    def is_shared(self, own: Own) -> bool:
        """Return whether the last step is not to be undone as it is: it is another's, or takes back one."""
        last = self.past[-1] if self.past else None
        if last is None:
            return False
        return last.by in own.others or (last.reverts is not None and _is_own(last, own))

    def take_back(self, own: Own, *, again: bool = False) -> TakenBack | None:
        """Return what takes the last own step back, or `again` what takes that back; None without one."""
        gone: set[int] = set()
        since = [self.document]
        originals = {step.revision for step in self.past if step.reverts is None}
        for step in reversed(self.past):
            if step.revision not in gone:
                if step.reverts is not None:
                    gone.add(step.reverts)
                if _is_own(step, own) and again == (step.reverts in originals):
                    return _without(step, since, own.place)
                if again and step.reverts is None and _is_own(step, own):
                    return None  # what was typed since cannot be redone
            since.append(step.document)
        return None


def _bound(document: Document, before: int, command: Command) -> int:
    """Return a bound of the size of a document after a command; `before` is the former one.

    Raises EditError when the document is too large.
    """
    bound = before + _GROWTH + _ESCAPED * len(msgspec.json.encode(command))
    return bound if bound <= MAX_SIZE else len(written(document).encode())


def _without(step: Step, since: Sequence[Document], place: Place) -> TakenBack | None:
    """Return the text without a step, after which there were these documents, the latest first.

    One is merged after the other: what they differ in is little, so that letters are not mistaken for others.
    """
    before, *texts = (texts_at(document, place) for document in (step.document, *reversed(since)))
    if not before or not all(texts):
        return None  # the place, or this text, is gone, or was
    text, conflict = before[0], False
    for (former,), (later,) in pairwise(texts):
        if former != later:
            text, is_conflict = merge_typing(former, text, later)
            conflict |= is_conflict
    return TakenBack(step, text, conflict)


def _is_own(step: Step, own: Own) -> bool:
    return step.by == own.by and step.place == own.place
