"""An open document, which commands change, and the events that notify others of it."""

from __future__ import annotations

import logging
import threading
from collections.abc import Callable, Hashable, Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass, replace
from itertools import count
from pathlib import Path
from typing import Final, Literal

import msgspec

from codegen.hfsm.document import Automaton, Document, Text
from codegen.hfsm.document import Shelf as ShelfEntry
from codegen.messages import NO_MESSAGE, Message
from codegen.reasons import reason
from visualhfsm._base.errors import EditError, UnsavedError
from visualhfsm._base.languages import ENGLISH
from visualhfsm._document.commands import Command, decode_command
from visualhfsm._document.commands.base import AS_FILE, MERGED
from visualhfsm._document.commands.items import DeleteItems
from visualhfsm._document.commands.paste import AddReadyState, ReplaceDocument
from visualhfsm._document.commands.text import SetText
from visualhfsm._document.commands.transitions import TransitionType
from visualhfsm._document.problems import Findings
from visualhfsm._document.serialization import copy_states, parse_file, written
from visualhfsm.project._editing import imports
from visualhfsm.project._editing.authors import sign, signed
from visualhfsm.project._editing.change import Change, Choice, Resolution, merged_with_others
from visualhfsm.project._editing.document_file import FileState
from visualhfsm.project._editing.document_state import DocumentState
from visualhfsm.project._editing.files import read_file, write_file
from visualhfsm.project._editing.journal import Done, Entry, Redone, Undone
from visualhfsm.project._editing.merge import merge_documents
from visualhfsm.project._editing.shelf import FOLDER as SHELF
from visualhfsm.project._editing.shelving import shelf_document, shelf_file
from visualhfsm.project._editing.undo_stack import Own, Step

from ._analyses import Analyses
from ._folder import ProjectFolder
from ._version import Version

_logger = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True)
class Opened:
    """A document was opened."""

    document: OpenDocument


@dataclass(frozen=True, slots=True)
class Changed:
    """A document has another version: it was changed, saved, or its file was."""

    document: OpenDocument
    version: Version


@dataclass(frozen=True, slots=True)
class FileChanged:
    """Another program has changed the file of a document.

    `reloaded`: the document had no unsaved changes, and is now as the file, which can be undone. `changed`
    and `deleted`: somebody has to choose how to `resolve` it; `message` says why the file cannot be read, or
    who has changed what, if that program has a name.
    `same`: the file is again as it was.
    """

    document: OpenDocument
    state: Literal["reloaded", "changed", "deleted", "same"]
    message: Message = NO_MESSAGE


@dataclass(frozen=True, slots=True)
class Checked:
    """A version of a document was checked; the findings may not be `complete` yet."""

    document: OpenDocument
    version: Version
    findings: Findings


@dataclass(frozen=True, slots=True)
class Closed:
    """A document was closed."""

    document: OpenDocument


Event = Opened | Changed | FileChanged | Checked | Closed

Listener = Callable[[Event], None]
"""Called in the thread that made the change, one event of a document at a time and in their order.

The document is locked meanwhile: a listener returns soon, changes no document, and waits for no other thread
that uses one. What it raises is logged.
"""


class Listeners:
    """The listeners of a document or a project; thread-safe."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._listeners: dict[int, Listener] = {}
        self._numbers = count()

    def subscribe(self, listener: Listener) -> Callable[[], None]:
        """Notify a listener of every event from now on; return the function that ends this."""
        with self._lock:
            number = next(self._numbers)
            self._listeners[number] = listener

        def unsubscribe() -> None:
            with self._lock:
                self._listeners.pop(number, None)

        return unsubscribe

    def notify(self, event: Event) -> None:
        """Notify all listeners of an event."""
        with self._lock:
            listeners = [*self._listeners.values()]
        for listener in listeners:
            try:
                listener(event)
            except Exception:  # what a listener does wrong must not undo the change
                _logger.exception("a listener failed with the event %s", type(event).__name__)


Saving = Callable[["OpenDocument", str | Path, bool], AbstractContextManager[Path]]
"""Yields the file to which a document is saved, perhaps over another; nobody opens that meanwhile."""


class OpenDocument(Analyses):
    """An open document of a project, which opens and makes them. Errors are VisualHfsmError.

    Any thread may call any method: changes happen one after the other, and `version` is the state between
    two of them. Checks, completion, generation and simulation work on the version that was
    there when they were called, and keep nobody from changing the document.
    """

    def __init__(
        self,
        state: DocumentState,
        folder: ProjectFolder,
        saving: Saving,
        merge_within: float,
        *,
        author: str = "",
        remarks: Sequence[Message] | None = None,
    ) -> None:
        super().__init__(folder)
        self.remarks: Final = remarks
        """The parts of a foreign file that are missing or not the same; None for a file of ours."""
        self._state = state
        self._steps, self._file, self._journal = state.steps, state.file, state.journal
        self._saving = saving
        self._merge_within = merge_within
        self._author = author
        self._saved_at = 0
        """The revision of the steps that was saved last."""
        self._listeners = Listeners()
        self._lock = threading.RLock()
        self._depth = 0
        self._notifying = False
        self._closed = False
        self.version = Version.of(state)

    # -- state ---------------------------------------------------------------------------------------------

    @property
    def automata(self) -> tuple[Automaton, ...]:
        """The automata at this moment, as values."""
        return self.version.document.automata

    @property
    def path(self) -> Path | None:
        """The file, None as long as there is none."""
        return self.version.path

    def has(self, file: Path) -> bool:
        """Return whether this is the document of a file, also one to which it is just being saved."""
        return self._file.path == file

    @property
    def saved(self) -> Document | None:
        """The document as it was read or saved last, None if it never was."""
        with self._lock:
            return self._file.saved

    def text(self) -> str:
        """Return the document as its file would hold it."""
        with self._lock:
            return written(self._steps.document)

    def subscribe(self, listener: Listener) -> Callable[[], None]:
        """Notify a listener of what happens to this document; return the function that ends this."""
        return self._listeners.subscribe(listener)

    # -- changes -------------------------------------------------------------------------------------------

    @contextmanager
    def together(self) -> Iterator[None]:
        """Make several changes in a `with` block: no other thread changes the document meanwhile.

        Listeners are notified at the end, once.
        """
        with self._lock:
            what = Message("Cannot use {version}", version=self.version.title)
            if self._closed:
                raise EditError(what, "it is closed", "open it again")
            if self._notifying:
                raise EditError(what, "its listeners are being notified", "change it after that")
            self._depth += 1
            try:
                yield
            finally:
                self._depth -= 1
                if not self._depth:
                    self._settle()

    def apply(
        self, commands: Command | Sequence[Command], base: str | None = None, by: Hashable = None
    ) -> Change:
        """Apply a command, or several: all of them or none. Each is a step that can be undone.

        `base` is the text in which the command's text was typed: changes of others to it are kept. What is
        typed is one step as long as it is typed `by` the same one.
        """
        one = isinstance(commands, Command)
        several = [_validated(each) for each in ((commands,) if isinstance(commands, Command) else commands)]
        if not several or (base is not None and not one):
            why = (
                Message("there is no command")
                if not several
                else Message("only one command at a time has a base")
            )
            raise EditError("Cannot change the document", why, "pass one command")
        with self.together():
            before = self._steps.document
            if not one:
                self._steps.require(several)
            changes = [self._do(each, base, by) for each in several]
            return replace(changes[-1], before=before)

    def undo(self, own: Own | None = None) -> Change:
        """Undo the last step; with `own`, what one has typed there oneself if the last step is another's."""
        with self.together():
            if own is not None and self._steps.is_shared(own):
                why = Message("you have typed nothing here that is not undone yet, but others have")
                hint = Message("undo on the canvas, where all share the steps")
                return self._take_back(own, EditError("Cannot undo", why, hint))
            refusal = EditError("Cannot undo", "there is nothing to undo", "change something first")
            return self._move(self._steps.undo, Undone(), refusal)

    def redo(self, own: Own | None = None) -> Change:
        """Do the step again that was undone last, also where only one's `own` was."""
        with self.together():
            refusal = EditError("Cannot redo", "there is nothing to redo", "change something first")
            if own is not None and not self._steps.future:
                return self._take_back(own, refusal, again=True)
            return self._move(self._steps.redo, Redone(), refusal)

    def go_to(self, revision: int) -> Change:
        """Undo or redo until the document is the one that was made at a revision."""
        with self.together():
            now = self._steps
            if revision == now.revision:
                return Change(NO_MESSAGE, now.changes, now.document, now.document)
            for steps, move in ((now.past, self.undo), (now.future, self.redo)):
                for number, step in enumerate(reversed(steps), 1):
                    if step.revision == revision:
                        before = now.document
                        changes = [move() for _ in range(number)]
                        return replace(changes[-1], before=before)
            why = Message("the document was changed since the list was shown")
            raise EditError("Cannot go to this step", why, "choose it in the list as it is now")

    def copy(self, automaton: int, states: Sequence[int], annotations: Sequence[int] = ()) -> str:
        """Return states, with the transitions among them and all below, as text for `PasteStates`."""
        return copy_states(self.version.document, automaton, states, annotations)

    def cut(
        self, automaton: int, states: Sequence[int], annotations: Sequence[int] = (), by: Hashable = None
    ) -> tuple[str, Change]:
        """Copy states and annotations, and delete them."""
        gone = DeleteItems(
            automaton=automaton, states=tuple(states), annotations=tuple(annotations), cut=True
        )
        with self.together():
            text = copy_states(self._steps.document, automaton, states, annotations)
            return text, self.apply(gone, by=by)

    def extract(self, automaton: int, path: str | Path, by: Hashable = None) -> Change:
        """Move an automaton with all below it to a new file beside this one, and import it from there."""
        file = self._folder.file(path)
        with self.together():
            command = imports.extract(self._steps.document, automaton, self._file.path, file)
            return self._do(command, by=by)

    def inline(self, automaton: int, by: Hashable = None) -> Change:
        """Copy the content of an imported automaton into the document."""
        with self.together():
            command = imports.inline(self._steps.document, automaton, self._file.path)
            return self._do(command, by=by)

    def add_ready_state(
        self,
        id: str,
        automaton: int,
        x: float,
        y: float,
        *,
        origin: int | None = None,
        trigger: TransitionType = "condition",
        name: str = "",
        language: str = ENGLISH,
        by: Hashable = None,
    ) -> Change:
        """Draw one of the project's ready states at a place, as a copy.

        It is called `name`, by default as it is on the shelf. With `origin`, a transition of the type
        `trigger` leads to it from there, with a name in a language such as `es`.
        """
        title, content = self._folder.ready_state(id)
        wanted = name or title
        command = AddReadyState(
            automaton=automaton,
            content=content,
            name=wanted[:1].lower() + wanted[1:],
            x=x,
            y=y,
            origin=origin,
            trigger=trigger,
            language=language,
        )
        return self.apply(command, by=by)

    def put_on_shelf(
        self,
        automaton: int,
        states: Sequence[int],
        title: str,
        *,
        category: str = "",
        words: str = "",
        description: str = "",
    ) -> Path:
        """Write states, with all below them, as a ready state of the project; return the path of its file.

        A single state without code is there as its automaton. The file, in the folder `shelf`,
        is named by the title; WouldOverwriteError is raised if there is one already. The document stays as
        it is.
        """
        entry = ShelfEntry(
            title=Text(title.strip()), category=Text(category.strip()), words=Text(words.strip())
        )
        name = shelf_file(title)
        made = shelf_document(
            self.version.document, self.path, automaton, states, entry=entry, description=description
        )
        with self._saving(self, f"{SHELF}/{name}", False) as target:
            write_file(target, written(made).encode())
            return target

    # -- files ---------------------------------------------------------------------------------------------

    def save(self, path: str | Path | None = None, *, overwrite: bool = False) -> Path:
        """Save to the document's file, or to another one, which is its file from then on; return its path.

        `overwrite` saves over another file, over one in an older format, and over what another program wrote
        there meanwhile. Without it, these raise WouldOverwriteError, OldFormatError and ChangedOutsideError.
        """
        with self.together():
            if path is not None:
                with self._saving(self, path, overwrite) as target:
                    return self._save(target, overwrite=overwrite)
            own = self._file.path
            if own is None:
                raise EditError("Cannot save", "the document has no file yet", "use `Save as`")
            self._folder.file(own)  # by now it may be a link that leads out
            return self._save(own, overwrite=overwrite)

    def save_copy(self, path: str | Path, *, overwrite: bool = False) -> Path:
        """Write the document to another file, which does not become its own; return its path."""
        with self._saving(self, path, overwrite) as target:
            write_file(target, self.text().encode())
            return target

    def refresh(self) -> FileState:
        """See what other programs did to the file, and return it; listeners are notified of what is new.

        A document without unsaved changes becomes as its file is now, which can be undone.
        """
        with self._lock:
            with self.together():
                before = self._file.state
                news = self._compare_with_file()
                state = self._file.state = "same" if news.state == "reloaded" else news.state
            if news.state != before:
                self._listeners.notify(news)
            return state

    def resolve(self, choice: Choice | str) -> Resolution:
        """Resolve a change of the file by another program: keep `mine`, take `theirs`, or `merge` both."""
        if choice not in {*Choice}:
            raise EditError(
                "Cannot resolve the change",
                Message("{choice} is none of {choice2}", choice=choice, choice2=", ".join(Choice)),
            )
        with self.together():
            file, document, path = self._file, self._steps.document, self._file.path
            if path is None:
                raise EditError(
                    "Cannot compare with the file", "the document has no file yet", "save it first"
                )
            if choice == Choice.MINE and not path.exists():
                file.lose()
                self._journal.begin()
                return Resolution(None)
            content, version = read_file(path)
            theirs = parse_file(content, path)
            change: Change | None = None
            conflicts: tuple[str, ...] = ()
            if choice == Choice.THEIRS:
                name = signed(path, version.digest) or str(AS_FILE)
                change = self._do(ReplaceDocument(content=written(theirs), name=name))
            elif choice == Choice.MERGE:
                merged = merge_documents(file.saved or theirs, document, theirs)
                conflicts = merged.conflicts
                change = self._do(ReplaceDocument(content=written(merged.document), name=str(MERGED)))
            self._note(file.take(theirs, content, version, self._steps.document))
            return Resolution(change, conflicts)

    def close(self, *, discard: bool = False) -> None:
        """Close the document, with unsaved changes only to `discard` them; else it raises UnsavedError."""
        with self._lock:
            if not self._closed:
                if Version.of(self._state).is_unsaved and not discard:
                    raise UnsavedError.because(
                        "{version} has changes that are not saved", version=self.version.title
                    )
                self._end(keep=False)

    def abandon(self) -> None:
        """Close the document, and keep its unsaved changes, so that they can be recovered."""
        with self._lock:
            if not self._closed:
                self._end(keep=self._state.dirty)

    # -- parts ---------------------------------------------------------------------------------------------

    def _do(
        self, command: Command, base: str | None = None, by: Hashable = None, *, reverts: int | None = None
    ) -> Change:
        """Apply a command; `reverts` is the revision of the step that it takes back."""
        steps, before, conflict = self._steps, self._steps.document, False
        if base is not None:
            command, conflict = merged_with_others(command, base, before)
        key = (command.merge_key and (by, command.merge_key)) if reverts is None else None
        merged = steps.merges(key, self._merge_within)
        name = steps.do(command, key, by, merge=merged, reverts=reverts)
        if steps.document is not before:
            self._note(Done(msgspec.Raw(msgspec.json.encode(command)), merged), name)
        return Change(name, steps.changes, before, steps.document, conflict)

    def _take_back(self, own: Own, refusal: EditError, *, again: bool = False) -> Change:
        found = self._steps.take_back(own, again=again)
        if found is None:
            raise refusal
        command = SetText(place=own.place, text=found.text)
        change = self._do(command, by=own.by, reverts=found.step.revision)
        return replace(change, conflict=found.conflict, by=own.by, is_own=True)

    def _move(self, move: Callable[[], Step | None], entry: Entry, refusal: EditError) -> Change:
        before = self._steps.document
        step = move()
        if step is None:
            raise refusal
        self._note(entry, step.name)
        return Change(step.name, self._steps.changes, before, self._steps.document, by=step.by)

    def _note(self, entry: Entry, name: Message = NO_MESSAGE) -> None:
        """Write an entry into the journal; `name` is that of the step, if it is one."""

        def whole() -> Done:
            replaced = ReplaceDocument(content=written(self._steps.document), name=str(name))
            return Done(msgspec.Raw(msgspec.json.encode(replaced)))

        self._journal.add(entry, whole, self._file.header)

    def _save(self, target: Path, *, overwrite: bool) -> Path:
        file, steps = self._file, self._steps
        if target == file.path and not overwrite:
            file.require_ours()
        content = file.content(steps.document)
        if self._author:  # before, so that who sees the file sees the note
            names = [each.name for each in steps.past if each.revision >= self._saved_at]
            sign(target, content, self._author, ", ".join(dict.fromkeys(names)) or "Undo")
        saved = file.save(target, steps.document, content)
        self._saved_at = steps.revision
        steps.seal()
        self._note(saved)
        return target

    def _compare_with_file(self) -> FileChanged:
        file = self._file
        if file.path is None or not file.is_changed_outside():
            return FileChanged(self, "same")
        if not file.path.exists():
            return FileChanged(self, "deleted")
        if self._state.dirty:
            return FileChanged(self, "changed")
        try:
            change = self.resolve(Choice.THEIRS).change
        except EditError as error:  # it is not a document, or incomplete: try again
            return FileChanged(self, "changed", error.message)
        said = NO_MESSAGE if change is None or change.name == AS_FILE else change.name
        return FileChanged(self, "reloaded", said)

    def _settle(self) -> None:
        """Make the new version, and notify the listeners of it."""
        version = Version.of(self._state)
        if version != self.version:
            self.version = version
            self._notifying = True  # otherwise a listener could change it, and others hear of that first
            try:
                self._listeners.notify(Changed(self, version))
            finally:
                self._notifying = False

    def _checked(self, version: Version, findings: Findings) -> None:
        # Who has the document locked may wait for the rest of this check.
        if not self._lock.acquire(blocking=not findings.pending):
            return
        try:
            if not self._closed:
                self._listeners.notify(Checked(self, version, findings))
        finally:
            self._lock.release()

    def _end(self, *, keep: bool) -> None:
        self._journal.close(keep=keep)
        self._settle()
        self._closed = True
        self._listeners.notify(Closed(self))


def _validated(command: Command) -> Command:
    """Return a command whose fields have the types that it declares: it will be read from the journal."""
    try:
        return decode_command(msgspec.json.encode(command))
    except (TypeError, UnicodeEncodeError) as error:
        raise EditError("Cannot understand the command", reason(error)) from error
