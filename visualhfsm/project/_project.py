"""A folder with documents, and those of them that are open."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Final, Self

from codegen.hfsm.formats.others import Format, imported_format
from codegen.messages import Message
from visualhfsm._base.errors import EditError, MissingError, TooManyError, WouldOverwriteError
from visualhfsm._base.languages import ENGLISH, known_language
from visualhfsm._document.serialization import import_document, parse
from visualhfsm.project._check_process import CheckProcess
from visualhfsm.project._code_help.service import CodeHelp
from visualhfsm.project._editing.document_state import (
    DocumentState,
    begin_from_file,
    begin_new,
    drop_saved,
    recover,
)
from visualhfsm.project._editing.files import make_folder, read_file
from visualhfsm.project._editing.journal import Abandoned, find_abandoned, journal_directory
from visualhfsm.project._editing.templates import EMPTY, make_template
from visualhfsm.project._editing.undo_stack import MERGE_WITHIN

from ._document import Closed, Event, Listener, Listeners, OpenDocument, Opened
from ._folder import ProjectFolder
from ._root import Root
from ._version import free_title, stem

_MOST_REMARKS: Final = 100  # about one document


class Project(ProjectFolder):
    """A folder with documents, without page and network. Errors are VisualHfsmError.

    `root` is the folder: files outside of it are refused, apart from those `granted`. `include` are
    directories with further packages of interfaces. Unsaved changes are kept in `journals`, by default the
    user's directory of journals, and outlive a crash; only one process at a time has them. At most `most`
    documents are open at a time. A change belongs to the step of a like one that is at most `merge_within` s
    older. Others who have a document open see what is saved here as steps of the `author`, if there is one.

    All methods may be called from any thread. Leaving it as a context closes what is open, and keeps unsaved
    changes for `recover`.
    """

    def __init__(
        self,
        root: str | Path = ".",
        include: Iterable[str | Path] = (),
        *,
        granted: Iterable[Path] = (),
        journals: Path | None = None,
        most: int | None = None,
        merge_within: float = MERGE_WITHIN,
        author: str = "",
        checks: CheckProcess | None = None,
        code_help: CodeHelp | None = None,
    ) -> None:
        super().__init__(Root(Path(root), granted), include, checks, code_help)
        self.journals: Final = journals or journal_directory()
        self._most = most
        self._merge_within = merge_within
        self._author = author
        self._listeners = Listeners()
        self._opening = threading.RLock()
        """Held while a document is opened or gets a file, so that no two documents have the same one.

        It may be taken while a document is locked; nobody locks a document while holding it.
        """
        self._documents: list[OpenDocument] = []
        self._closed = False
        self._abandoned: dict[str, Abandoned] = {}

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Close all documents, keeping unsaved changes for recovery, and end the processes."""
        self.end_processes()
        with self._opening:
            self._closed = True
        for document in self.documents:
            document.abandon()

    def subscribe(self, listener: Listener) -> Callable[[], None]:
        """Notify a listener of what happens to all documents; return the function that ends this."""
        return self._listeners.subscribe(listener)

    # -- open documents ------------------------------------------------------------------------------------

    @property
    def documents(self) -> list[OpenDocument]:
        """The open documents in the order in which they were opened."""
        return [*self._documents]

    def find(self, path: Path) -> OpenDocument | None:
        """Return the open document of a file."""
        return next((each for each in self.documents if each.has(path)), None)

    def require_room(self) -> None:
        """Raise TooManyError when no more documents can be opened."""
        if self._most is not None and len(self._documents) >= self._most:
            raise TooManyError.because(
                "at most {count} documents can be open: close one first", count=self._most
            )

    def open(self, path: str | Path) -> OpenDocument:
        """Open a document in any format, relative to the root; one that is open already is returned.

        A file of another program becomes a new document, whose `remarks` say what is missing or not the same
        there.
        """
        file = self.root.source(str(path))
        with self._opening:
            if (known := self.find(file)) is not None:
                return known
            if not file.is_file():
                raise MissingError.because("there is no file {path}", path=str(path))
            content, _ = read_file(file)
            if (other := imported_format(file.name, content)) is not None:
                return self._import(other, file.name, content)
            return self._add(lambda: begin_from_file(file, self.journals))

    def open_text(self, name: str, text: str, *, kept: bool = False) -> OpenDocument:
        """Open a text in any format as a document that has no file yet, `name` is that of the text.

        `kept` says that it is kept elsewhere as it is, so that closing it loses nothing.
        """

        def make() -> DocumentState:
            document = parse(text, Message("Cannot open {name}", name=name))
            title = name if kept else self._free_title(stem(name))
            return begin_new(document, title, self.journals, kept=kept)

        with self._opening:
            if (other := imported_format(name, content := text.encode())) is not None:
                return self._import(other, name, content)
            return self._add(make)

    def new(self, template: str = EMPTY, language: str = ENGLISH) -> OpenDocument:
        """Make a document from a template: an empty one, or one of the behaviors that are installed.

        An empty one is called `untitled`, in a language such as `es`.
        """

        def make() -> DocumentState:
            name, document = make_template(template, known_language(language))
            return begin_new(document, self._free_title(name), self.journals)

        with self._opening:
            return self._add(make)

    def refresh(self) -> None:
        """See what other programs did to the files of the open documents, and notify the listeners."""
        for document in self.documents:
            document.refresh()

    # -- recovery ------------------------------------------------------------------------------------------

    def recoverable(self) -> list[Abandoned]:
        """Return the documents that can be recovered: those below the root, and those without a file.

        The process that had them open ended without closing them, and they differ from their files.
        """
        found = [
            each
            for each in find_abandoned(self.journals)
            if each.path is None or (self.root.contains(each.path) and not drop_saved(each.file))
        ]
        self._abandoned = {each.file.name: each for each in found}
        return found

    def recover(self, journal: str) -> OpenDocument:
        """Open one of `recoverable` as it was, by the name of its journal."""
        file = self._journal(journal)
        with self._opening:
            opened = self._add(lambda: recover(file))
        self._abandoned.pop(journal, None)
        return opened

    def discard(self, journal: str) -> None:
        """Discard the changes of one of `recoverable`."""
        recover(self._journal(journal)).journal.close()
        self._abandoned.pop(journal, None)

    # -- parts ---------------------------------------------------------------------------------------------

    def _add(
        self, make: Callable[[], DocumentState], remarks: Sequence[Message] | None = None
    ) -> OpenDocument:
        if self._closed:
            raise EditError("Cannot open a document", "the project is closed", "make another Project")
        self.require_room()
        opened = OpenDocument(
            make(), self, self._saving, self._merge_within, author=self._author, remarks=remarks
        )
        opened.subscribe(self._hear)
        self._documents.append(opened)
        self._listeners.notify(Opened(opened))
        return opened

    def _hear(self, event: Event) -> None:
        if isinstance(event, Closed):
            self._documents.remove(event.document)
        self._listeners.notify(event)

    def _import(self, other: Format, name: str, content: bytes) -> OpenDocument:
        """Open a file of another program as a document that has no file yet."""
        document, remarks = import_document(other, content, name)
        title = self._free_title(stem(name))
        return self._add(lambda: begin_new(document, title, self.journals), remarks[:_MOST_REMARKS])

    @contextmanager
    def _saving(self, document: OpenDocument, path: str | Path, overwrite: bool) -> Iterator[Path]:
        """Return the file to which a document is saved; its folder is made, and nobody opens it meanwhile."""
        file = self.file(path)
        with self._opening:
            if self.find(file) not in {None, document}:
                raise WouldOverwriteError.because(
                    "{path} is open, too; close that document first", path=str(path)
                )
            if file.exists() and file != document.path and not overwrite:
                raise WouldOverwriteError.because("{path} already exists", path=str(path))
            make_folder(file.parent)
            yield file

    def _free_title(self, wanted: str) -> str:
        """Return a title for a document without a file, whose component no other one has."""
        return free_title(wanted, {each.version.component for each in self.documents})

    def _journal(self, name: str) -> Path:
        if name not in self._abandoned:
            self.recoverable()
        if name not in self._abandoned:
            raise MissingError.because("{name} cannot be recovered any more", name=name)
        return self._abandoned[name].file
