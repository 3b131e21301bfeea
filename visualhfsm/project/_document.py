"""An open document, which commands change, and the events that notify others of it."""

from __future__ import annotations

import logging
import threading
from collections.abc import Callable, Hashable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from itertools import count
from pathlib import Path
from typing import TYPE_CHECKING, Final, Literal

import msgspec

from codegen.hfsm.document import Automaton, Document, Text
from codegen.hfsm.document import Shelf as ShelfEntry
from codegen.messages import NO_MESSAGE, Message
from codegen.reasons import reason
from visualhfsm._base.errors import EditError, UnsavedError
from visualhfsm._base.languages import ENGLISH
from visualhfsm._document.commands import Command, decode_command
from visualhfsm._document.commands.base import AS_FILE
from visualhfsm._document.commands.paste import AddReadyState
from visualhfsm._document.commands.transitions import TransitionType
from visualhfsm._document.problems import Findings
from visualhfsm._document.serialization import copy_states, written
from visualhfsm.project._editing import imports
from visualhfsm.project._editing.edited_document import Change, Choice, EditedDocument, Resolution
from visualhfsm.project._editing.files import write_file
from visualhfsm.project._editing.shelf import FOLDER as SHELF
from visualhfsm.project._editing.shelving import shelf_document, shelf_file
from visualhfsm.project._editing.undo_stack import Own

from ._analyses import Analyses
from ._version import FileState, Version

if TYPE_CHECKING:
    from ._project import Project

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


class OpenDocument(Analyses):
    """An open document of a project, which opens and makes them. Errors are VisualHfsmError.

    Any thread may call any method: changes happen one after the other, and `version` is the state between
    two of them. Checks, completion, generation and simulation work on the version that was
    there when they were called, and keep nobody from changing the document.
    """

    def __init__(
        self, edited: EditedDocument, project: Project, remarks: Sequence[Message] | None = None
    ) -> None:
        super().__init__(project)
        self.remarks: Final = remarks
        """The parts of a foreign file that are missing or not the same; None for a file of ours."""
        self._edited = edited
        self._listeners = Listeners()
        self._lock = threading.RLock()
        self._depth = 0
        self._notifying = False
        self._file: FileState = "same"
        self._closed = False
        self.version = Version.of(edited, self._file)

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
        return self._edited.path == file

    @property
    def saved(self) -> Document | None:
        """The document as it was read or saved last, None if it never was."""
        with self._lock:
            return self._edited.saved

    def text(self) -> str:
        """Return the document as its file would hold it."""
        with self._lock:
            return self._edited.text()

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
        if isinstance(commands, Command):
            command = _validated(commands)
            with self.together():
                return self._edited.do(command, base, by)
        several = [_validated(each) for each in commands]
        if not several or base is not None:
            why = (
                Message("there is no command")
                if not several
                else Message("only one command at a time has a base")
            )
            raise EditError("Cannot change the document", why, "pass one command")
        with self.together():
            before = self._edited.document
            self._edited.require_all(several)
            changes = [self._edited.do(command, by=by) for command in several]
            return replace(changes[-1], before=before)

    def undo(self, own: Own | None = None) -> Change:
        """Undo the last step; with `own`, what one has typed there oneself if the last step is another's."""
        with self.together():
            return self._edited.undo(own)

    def redo(self, own: Own | None = None) -> Change:
        """Do the step again that was undone last, also where only one's `own` was."""
        with self.together():
            return self._edited.redo(own)

    def go_to(self, revision: int) -> Change:
        """Undo or redo until the document is the one that was made at a revision."""
        with self.together():
            return self._edited.go_to(revision)

    def copy(self, automaton: int, states: Sequence[int], annotations: Sequence[int] = ()) -> str:
        """Return states, with the transitions among them and all below, as text for `PasteStates`."""
        return copy_states(self.version.document, automaton, states, annotations)

    def cut(
        self, automaton: int, states: Sequence[int], annotations: Sequence[int] = (), by: Hashable = None
    ) -> tuple[str, Change]:
        """Copy states and annotations, and delete them."""
        with self.together():
            return self._edited.cut(automaton, tuple(states), tuple(annotations), by)

    def extract(self, automaton: int, path: str | Path, by: Hashable = None) -> Change:
        """Move an automaton with all below it to a new file beside this one, and import it from there."""
        file = self._project.file(path)
        with self.together():
            edited = self._edited
            return edited.do(imports.extract(edited.document, automaton, edited.path, file), by=by)

    def inline(self, automaton: int, by: Hashable = None) -> Change:
        """Copy the content of an imported automaton into the document."""
        with self.together():
            edited = self._edited
            return edited.do(imports.inline(edited.document, automaton, edited.path), by=by)

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
        title, content = self._project.ready_state(id)
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
        with self._project.saving(self, f"{SHELF}/{name}", overwrite=False) as target:
            write_file(target, written(made).encode())
            return target

    # -- files ---------------------------------------------------------------------------------------------

    def save(self, path: str | Path | None = None, *, overwrite: bool = False) -> Path:
        """Save to the document's file, or to another one, which is its file from then on; return its path.

        `overwrite` saves over another file, over one in an older format, and over what another program wrote
        there meanwhile. Without it, these raise WouldOverwriteError, OldFormatError and ChangedOutsideError.
        """
        with self.together():
            if path is None:
                if self._edited.path is not None:
                    self._project.file(self._edited.path)  # by now it may be a link that leads out
                saved = self._edited.save(overwrite=overwrite)
            else:
                with self._project.saving(self, path, overwrite=overwrite) as target:
                    saved = self._edited.save(target, overwrite=overwrite)
            self._file = "same"
            return saved

    def save_copy(self, path: str | Path, *, overwrite: bool = False) -> Path:
        """Write the document to another file, which does not become its own; return its path."""
        with self._project.saving(self, path, overwrite=overwrite) as target:
            write_file(target, self.text().encode())
            return target

    def refresh(self) -> FileState:
        """See what other programs did to the file, and return it; listeners are notified of what is new.

        A document without unsaved changes becomes as its file is now, which can be undone.
        """
        with self._lock:
            with self.together():
                before = self._file
                news = self._compare_with_file()
                self._file = "same" if news.state == "reloaded" else news.state
            if news.state != before:
                self._notify(news)
            return self._file

    def resolve(self, choice: Choice | str) -> Resolution:
        """Resolve a change of the file by another program: keep `mine`, take `theirs`, or `merge` both."""
        if choice not in {*Choice}:
            raise EditError(
                "Cannot resolve the change",
                Message("{choice} is none of {choice2}", choice=choice, choice2=", ".join(Choice)),
            )
        with self.together():
            resolution = self._edited.resolve(Choice(choice))
            self._file = "same"
            return resolution

    def close(self, *, discard: bool = False) -> None:
        """Close the document, with unsaved changes only to `discard` them; else it raises UnsavedError."""
        with self._lock:
            if self._closed:
                return
            if self._edited.is_unsaved and not discard:
                raise UnsavedError.because(
                    "{version} has changes that are not saved", version=self.version.title
                )
            self._edited.close(discard=discard)
            self._end()

    def abandon(self) -> None:
        """Close the document, and keep its unsaved changes, so that they can be recovered."""
        with self._lock:
            if not self._closed:
                self._edited.abandon()
                self._end()

    # -- parts ---------------------------------------------------------------------------------------------

    def _compare_with_file(self) -> FileChanged:
        edited = self._edited
        if edited.path is None or not edited.is_changed_outside():
            return FileChanged(self, "same")
        if not edited.path.exists():
            return FileChanged(self, "deleted")
        if edited.dirty:
            return FileChanged(self, "changed")
        try:
            change = edited.resolve(Choice.THEIRS).change
        except EditError as error:  # it is not a document, or incomplete: try again
            return FileChanged(self, "changed", error.message)
        said = NO_MESSAGE if change is None or change.name == AS_FILE else change.name
        return FileChanged(self, "reloaded", said)

    def _settle(self) -> None:
        """Make the new version, and notify the listeners of it."""
        version = Version.of(self._edited, self._file)
        if version != self.version:
            self.version = version
            self._notifying = True  # otherwise a listener could change it, and others hear of that first
            try:
                self._notify(Changed(self, version))
            finally:
                self._notifying = False

    def _checked(self, version: Version, findings: Findings) -> None:
        # Who has the document locked may wait for the rest of this check.
        if not self._lock.acquire(blocking=not findings.pending):
            return
        try:
            if not self._closed:
                self._notify(Checked(self, version, findings))
        finally:
            self._lock.release()

    def _end(self) -> None:
        self._settle()
        self._closed = True
        self._project.forget(self)
        self._notify(Closed(self))

    def _notify(self, event: Event) -> None:
        self._listeners.notify(event)
        self._project.listeners.notify(event)


def _validated(command: Command) -> Command:
    """Return a command whose fields have the types that it declares: it will be read from the journal."""
    try:
        return decode_command(msgspec.json.encode(command))
    except (TypeError, UnicodeEncodeError) as error:
        raise EditError("Cannot understand the command", reason(error)) from error
