"""One open document: its present state, its steps, which can be undone, its file, and its journal."""

from __future__ import annotations

import time
from collections.abc import Callable, Hashable, Iterable, Iterator
from dataclasses import dataclass, replace
from enum import StrEnum
from pathlib import Path
from typing import Final

import msgspec

from codegen.hfsm.document import NATIVE, Automaton, Document
from codegen.messages import NO_MESSAGE, Message
from visualhfsm._base.errors import ChangedOutsideError, EditError, OldFormatError
from visualhfsm._document.commands import Command, decode_command
from visualhfsm._document.commands.base import AS_FILE, MERGED
from visualhfsm._document.commands.items import DeleteItems
from visualhfsm._document.commands.paste import ReplaceDocument
from visualhfsm._document.commands.text import SetText
from visualhfsm._document.diff import Difference, diff_documents
from visualhfsm._document.places import TEXTS, Place
from visualhfsm._document.serialization import MAX_SIZE, copy_states, parse_file, written

from .authors import sign, signed
from .files import FileVersion, read_file, write_file
from .journal import Done, Entry, Header, Journal, Redone, Saved, Undone, journal_directory
from .merge import merge_documents, merge_typing
from .undo_stack import Own, Step, UndoStack

_GROWTH: Final = 2048
"""Limit of the bytes by which a command may let a document grow, beyond its own size."""
_ESCAPED: Final = 6
"""Bytes that one byte of a command may take in a document."""
MERGE_WITHIN: Final = 2.0
"""Seconds without a change after which the same kind of change is a new step."""


@dataclass(frozen=True, slots=True)
class Added:
    """What is new in one automaton, by id; the automaton itself may be new."""

    automaton: int
    states: tuple[int, ...]
    transitions: tuple[int, ...]
    annotations: tuple[int, ...]


@dataclass(frozen=True, slots=True)
class Change:
    """A change of a document: `before` and `after` share everything that did not change."""

    name: Message
    revision: int
    before: Document
    after: Document
    conflict: bool = False
    """True if somebody else had replaced the same words; the text then contains both versions."""
    by: Hashable = None
    """Who had made the step that was undone or redone, None if that is not known."""
    is_own: bool = False
    """True if only what one had typed oneself was undone or redone."""

    @property
    def added(self) -> tuple[Added, ...]:
        """The new elements, for example to select them; empty when there are none."""
        former = {automaton.id: automaton for automaton in self.before.automata}
        found = []
        for automaton in self.after.automata:
            old = former.get(automaton.id)
            if old is automaton:
                continue
            known = old or Automaton(id=automaton.id)
            states = {state.id for state in known.states}
            transitions = {transition.id for transition in known.transitions}
            annotations = {annotation.id for annotation in known.annotations}
            added = Added(
                automaton.id,
                tuple(state.id for state in automaton.states if state.id not in states),
                tuple(each.id for each in automaton.transitions if each.id not in transitions),
                tuple(each.id for each in automaton.annotations if each.id not in annotations),
            )
            if old is None or added.states or added.transitions or added.annotations:
                found.append(added)
        return tuple(found)

    @property
    def place(self) -> Place | None:
        """The first place that differs and is still there, to show it; None when there is none."""
        for difference in diff_documents(self.before, self.after):
            place, part = difference.place, difference.part
            if difference.kind == "removed":
                place = Place(kind="automaton" if place.automaton else "document", automaton=place.automaton)
            elif place.part:
                place = msgspec.structs.replace(place, name=place.name or part)
            elif part in TEXTS:
                place = msgspec.structs.replace(place, part=part)
            if not place.automaton or self.after.automaton(place.automaton) is not None:
                return place
        return None


def _refusal(what: Message, why: Message) -> EditError:
    return EditError(what, why, "change something first")


def _bound(document: Document, before: int, size: int) -> int:
    """Return a bound of the size of a document after a command of `size` bytes; `before` is the former one.

    Raises EditError when the document is too large.
    """
    bound = before + _GROWTH + _ESCAPED * size
    return bound if bound <= MAX_SIZE else len(written(document).encode())


def _merged_with_others(command: Command, base: str, document: Document) -> tuple[Command, bool]:
    """Return a command with its typed text merged with that of the document, and whether they conflict."""
    match diff_documents(command.with_text(base).apply(document), document):
        case [Difference(kind="changed", after=theirs)]:
            typed = merge_typing(base, command.text_typed, theirs)
            return command.with_text(typed.text), typed.conflict
    return command, False


class Choice(StrEnum):
    """The ways to resolve a change of a document's file by another program."""

    MINE = "mine"
    THEIRS = "theirs"
    MERGE = "merge"


@dataclass(frozen=True, slots=True)
class Resolution:
    """The change of a document whose file was changed, and the conflicts."""

    change: Change | None
    conflicts: tuple[str, ...] = ()


class EditedDocument:
    """An open document with undo, redo, file and journal. All calls come from one thread.

    `revision` counts changes. `dialect` is the format of the file that it was opened from: in one that is not
    the native one it is saved over that file only with `overwrite`.
    """

    def __init__(
        self,
        document: Document,
        journal: Journal,
        version: FileVersion | None,
        size: int,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        header = journal.header
        self.path = None if header.path is None else Path(header.path)
        self.name = header.name
        self.dialect = NATIVE if self.path is None else document.format
        self.revision = 0
        self.merge_within = MERGE_WITHIN
        self.author = ""
        """The name under which others see what is saved; blank for people."""
        self.steps = UndoStack(document, clock)
        self.saved = None if self.path is None else document
        """The document as it was read or saved last, None if it never was."""
        self._version = version
        self._journal = journal
        self._size_bound = size
        self._original: tuple[Document, bytes] | None = None
        self._saved_at = 0
        """The revision of the steps that was saved last."""
        self._kept: Header | None = header
        """The document as it was opened or saved last, with which a journal begins; None if nowhere."""

    @classmethod
    def open(
        cls, path: Path, *, journals: Path | None = None, clock: Callable[[], float] = time.monotonic
    ) -> EditedDocument:
        """Open a document in any dialect. `journals` is the directory of the autosave journals.

        Raises EditError.
        """
        path = path.absolute()
        content, version = read_file(path)
        document = parse_file(content, path)
        header = Header(str(path), path.stem, content, version.digest)
        journal = Journal(journals or journal_directory(), header)
        edited = cls(document, journal, version, len(content) * 2, clock)
        edited._keep_original(document, content)
        return edited

    @classmethod
    def new(
        cls, document: Document, name: str, *, journals: Path | None = None, kept: bool = False
    ) -> EditedDocument:
        """Begin with a document that has no file yet; `kept` says that it is kept elsewhere as it is."""
        content = written(document).encode()
        journal = Journal(journals or journal_directory(), Header(None, name, content, ""))
        edited = cls(document, journal, None, len(content))
        edited.saved = document if kept else None
        return edited

    @classmethod
    def recover(cls, file: Path, *, reads: bool = False) -> EditedDocument:
        """Open a document again that was open when its process ended, with all its steps.

        Its journal stays as it is for who only `reads`. Raises EditError when that cannot be read, or another
        process has it open.
        """
        journal, entries = Journal.take_over(file, reads=reads)
        header = journal.header
        path = None if header.path is None else Path(header.path)
        try:
            document = parse_file(header.content, path or Path(header.name))
        except EditError:
            journal.close(keep=True)
            raise
        version = None if path is None else FileVersion(0, len(header.content), header.digest)
        edited = cls(document, journal, version, MAX_SIZE)
        edited._keep_original(document, header.content)
        try:
            edited._replay(entries)
        except BaseException:
            journal.close(keep=True)
            raise
        edited.steps.seal()
        edited._notice_saved()
        return edited

    @classmethod
    def drop_saved(cls, file: Path) -> bool:
        """Remove the journal of a document that is as its file holds it, and return whether it was one."""
        try:
            edited = cls.recover(file, reads=True)
        except EditError:  # who recovers it is told
            return False
        is_saved = not edited.dirty and not edited.is_changed_outside()
        edited._journal.close(keep=not is_saved)
        return is_saved

    @property
    def document(self) -> Document:
        """The document as it is now."""
        return self.steps.document

    @property
    def dirty(self) -> bool:
        """Whether the document differs from what was saved; a new one does until it is saved."""
        return self.document is not self.saved

    @property
    def is_unsaved(self) -> bool:
        """Whether closing would lose changes; an unchanged new document has none."""
        return self.dirty and (self.path is not None or bool(self.steps.past or self.steps.future))

    @property
    def undo_steps(self) -> list[Step]:
        """The steps that can be undone, the latest first."""
        return [*reversed(self.steps.past)]

    @property
    def redo_steps(self) -> list[Step]:
        """The steps that can be done again, the next first."""
        return [*reversed(self.steps.future)]

    def do(
        self,
        command: Command,
        base: str | None = None,
        by: Hashable = None,
        *,
        reverts: int | None = None,
    ) -> Change:
        """Apply a command. Raises EditError and leaves the document as it was when that is not possible.

        `base` is the text in which the command's text was typed; if given, changes of others to it are
        merged. Typing is one step as long as nobody else than `by` changes anything. `reverts` is the
        revision of the step that it takes back.
        """
        before = self.document
        conflict = False
        if base is not None:
            command, conflict = _merged_with_others(command, base, before)
        key = (command.merge_key and (by, command.merge_key)) if reverts is None else None
        merged = self.steps.merges(key, self.merge_within)
        name = command.title(before)
        encoded = msgspec.json.encode(command)
        place = command.place if isinstance(command, SetText) else None
        step = Step(name, command.apply(before), self.revision + 1, by, place, reverts)
        self._keep(step, key, merge=merged, size=len(encoded))
        if self.document is not before:
            self._note(Done(msgspec.Raw(encoded), merged), name)
        return Change(name, self.revision, before, self.document, conflict)

    def require_all(self, commands: Iterable[Command]) -> None:
        """Raise EditError if commands cannot all be applied, one after the other."""
        document, bound = self.document, self._size_bound
        for command in commands:
            after = command.apply(document)
            if after != document:
                bound = _bound(after, bound, len(msgspec.json.encode(command)))
            document = after

    def undo(self, own: Own | None = None) -> Change:
        """Undo the last step, or if it is another's the last `own` one. Raises EditError without one."""
        if own is not None and self.steps.is_shared(own):
            why = Message("you have typed nothing here that is not undone yet, but others have")
            hint = Message("undo on the canvas, where all share the steps")
            return self._take_back(own, EditError("Cannot undo", why, hint))
        why = Message("there is nothing to undo")
        return self._move(self.steps.undo, Undone(), _refusal(Message("Cannot undo"), why))

    def redo(self, own: Own | None = None) -> Change:
        """Do the step again that was undone last, perhaps an `own` one. Raises EditError without one."""
        refusal = _refusal(Message("Cannot redo"), Message("there is nothing to redo"))
        if own is not None and not self.steps.future:
            return self._take_back(own, refusal, again=True)
        return self._move(self.steps.redo, Redone(), refusal)

    def _take_back(self, own: Own, refusal: EditError, *, again: bool = False) -> Change:
        found = self.steps.take_back(own, again=again)
        if found is None:
            raise refusal
        command = SetText(place=own.place, text=found.text)
        change = self.do(command, by=own.by, reverts=found.step.revision)
        return replace(change, conflict=found.conflict, by=own.by, is_own=True)

    def go_to(self, revision: int) -> Change:
        """Undo or redo until the document is the one that was made at a revision.

        Raises EditError when no step leads there any more.
        """
        if revision == self.steps.revision:
            return Change(NO_MESSAGE, self.revision, self.document, self.document)
        for steps, move in ((self.undo_steps, self.undo), (self.redo_steps, self.redo)):
            for count, step in enumerate(steps, 1):
                if step.revision == revision:
                    before = self.document
                    changes = [move() for _ in range(count)]
                    return replace(changes[-1], before=before)
        why = Message("the document was changed since the list was shown")
        raise EditError("Cannot go to this step", why, "choose it in the list as it is now")

    def cut(
        self, automaton: int, states: tuple[int, ...], annotations: tuple[int, ...] = (), by: Hashable = None
    ) -> tuple[str, Change]:
        """Return states as text for the clipboard, and delete them. Raises EditError."""
        text = copy_states(self.document, automaton, states, annotations)
        gone = DeleteItems(automaton=automaton, states=states, annotations=annotations, cut=True)
        return text, self.do(gone, by=by)

    def text(self) -> str:
        """Return the document as its file would hold it. Raises EditError."""
        return written(self.document)

    def save(self, path: Path | None = None, *, overwrite: bool = False) -> Path:
        """Save the document, by default to its own file, and return the path.

        Raises EditError when there is no name yet, when the file was in an older dialect, or when another
        file is there; ChangedOutsideError when another program has changed the file. `overwrite` ignores the
        last three.
        """
        target = self.path if path is None else path.absolute()
        if target is None:
            raise EditError("Cannot save", "the document has no file yet", "use `Save as`")
        if target == self.path:
            self._may_save_over(target, overwrite=overwrite)
        elif target.exists() and not overwrite:
            raise EditError(
                Message("Cannot save as {target}", target=target.name),
                "the file exists",
                "confirm to overwrite it",
            )
        if target.suffix.lower() != ".xml":
            raise EditError(
                Message("Cannot save as {target}", target=target.name),
                "documents end with .xml",
                "choose such a name",
            )
        content = self._content()
        if self.author:  # before, so that who sees the file sees the note
            names = [each.name for each in self.steps.past if each.revision >= self._saved_at]
            sign(target, content, self.author, ", ".join(dict.fromkeys(names)) or "Undo")
        self._version, self._saved_at = write_file(target, content), self.steps.revision
        self.saved = self.document
        self.path = target
        self.name = target.stem
        self.dialect = NATIVE
        self.steps.seal()
        self._kept = Header(str(target), self.name, content, self._version.digest)
        self._note(Saved(str(target), self._version.digest))
        return target

    def is_changed_outside(self) -> bool:
        """Return whether another program has changed or removed the file since it was read or saved."""
        return self.path is not None and self._version is not None and not self._version.is_current(self.path)

    def resolve(self, choice: Choice) -> Resolution:
        """Resolve a change of the file by another program: keep mine, take theirs, or merge both.

        Afterwards the document differs from the file by my changes. Raises EditError when the file cannot be
        read.
        """
        if self.path is None:
            raise EditError("Cannot compare with the file", "the document has no file yet", "save it first")
        if choice is Choice.MINE and not self.path.exists():
            self._version, self.saved, self._kept = None, None, None
            self._journal.begin()
            return Resolution(None)
        content, version = read_file(self.path)
        theirs = parse_file(content, self.path)
        change: Change | None = None
        conflicts: tuple[str, ...] = ()
        if choice is Choice.THEIRS:
            name = signed(self.path, version.digest) or str(AS_FILE)
            change = self.do(ReplaceDocument(content=written(theirs), name=name))
        elif choice is Choice.MERGE:
            merged = merge_documents(self.saved or theirs, self.document, theirs)
            conflicts = merged.conflicts
            change = self.do(ReplaceDocument(content=written(merged.document), name=str(MERGED)))
        self._version = version
        self.dialect = theirs.format
        self.saved = self.document if self.document == theirs else theirs
        self._keep_original(theirs, content)
        self._kept = Header(str(self.path), self.name, content, version.digest)
        self._note(Saved(str(self.path), version.digest, content))
        return Resolution(change, conflicts)

    def close(self, *, discard: bool = False) -> None:
        """Close the document and remove its journal. Raises EditError when changes would be lost.

        `discard` allows that.
        """
        if self.is_unsaved and not discard:
            raise EditError(
                Message("Cannot close {name}", name=self.name),
                "it has changes that are not saved",
                "save or discard them",
            )
        self._journal.close()

    def abandon(self) -> None:
        """Close the document and keep its journal, so that its changes can be recovered."""
        self._journal.close(keep=self.dirty)

    def _may_save_over(self, target: Path, *, overwrite: bool) -> None:
        if overwrite:
            return
        if self.dialect != NATIVE:
            raise OldFormatError(
                Message("Cannot save {target}", target=target.name),
                Message(
                    "it is in the format of {dialect}, and would be replaced by the current format",
                    dialect=self.dialect,
                ),
                "save it as another file, or replace it",
            )
        if self.is_changed_outside():
            what = Message("Cannot save {target}", target=target.name)
            if target.exists():
                why = Message("another program has changed it")
                raise ChangedOutsideError(what, why, "merge both, take theirs, or keep yours")
            why = Message("another program has deleted it")
            raise ChangedOutsideError(what, why, "write it again, or save it elsewhere")

    def _keep(self, step: Step, key: Hashable | None, *, merge: bool, size: int) -> None:
        """Keep the result of a command of `size` bytes; raises EditError when it is too large."""
        if step.document == self.document:  # cheap: what they share is identical
            return
        self._size_bound = _bound(step.document, self._size_bound, size)
        self.revision += 1
        self.steps.add(step, key, merge=merge)

    def _move(self, move: Callable[[], Step | None], entry: Entry, refusal: EditError) -> Change:
        before = self.document
        step = move()
        if step is None:
            raise refusal
        self.revision += 1
        self._note(entry, step.name)
        return Change(step.name, self.revision, before, self.document, by=step.by)

    def _note(self, entry: Entry, name: Message = NO_MESSAGE) -> None:
        """Write an entry into the journal; `name` is that of the step, if it is one."""

        def whole() -> Done:
            return Done(
                msgspec.Raw(msgspec.json.encode(ReplaceDocument(content=self.text(), name=str(name))))
            )

        self._journal.add(entry, whole, self._kept)

    def _keep_original(self, document: Document, content: bytes) -> None:
        """Keep the bytes of the file: an unchanged document is written back byte for byte."""
        self._original = (document, content) if document.format == NATIVE else None

    def _content(self) -> bytes:
        """Return the new content of the file. Raises EditError."""
        if self._original is not None and self._original[0] == self.document:
            return self._original[1]
        return self.text().encode()

    def _notice_saved(self) -> None:
        """Detect that the file holds the document, though its journal lacks the entry, or steps led back."""
        if self.path is None or not (self.dirty or self.is_changed_outside()):
            return
        try:
            content, version = read_file(self.path)
            held = parse_file(content, self.path)
        except EditError:  # it is reported when it is saved
            return
        if held == self.document:
            self.saved, self._version = self.document, version
            self.dialect = held.format
            self._keep_original(held, content)

    def _replay(self, entries: Iterator[tuple[Entry, int]]) -> None:
        for entry, place in entries:
            try:
                match entry:
                    case Done(command=raw, merged=merged):
                        command = decode_command(bytes(raw))
                        name = command.title(self.document)
                        document = command.apply(self.document)
                        step = Step(name, document, self.revision + 1)
                        self._keep(step, None, merge=merged, size=len(bytes(raw)))
                    case Undone():
                        self.steps.undo()
                    case Redone():
                        self.steps.redo()
                    case Saved(path=path, digest=digest, content=content):
                        self.path, self.name = Path(path), Path(path).stem
                        self._version = FileVersion(0, -1, digest)
                        theirs = self.document if content is None else parse_file(content, self.path)
                        self.dialect = NATIVE if content is None else theirs.format
                        self.saved = self.document if self.document == theirs else theirs
                        if content is not None:
                            self._keep_original(theirs, content)
                        self._kept = Header(path, self.name, content or self._content(), digest)
            except EditError as error:
                self._journal.cut(place, error)
                return
