"""A folder with documents, and those of them that are open."""

from __future__ import annotations

import stat
import threading
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Final, Literal, Self

from codegen.hfsm.formats.others import Format, imported_format, imported_suffixes
from codegen.messages import Message
from visualhfsm._base.errors import EditError, MissingError, TooManyError, WouldOverwriteError
from visualhfsm._base.languages import ENGLISH, known_language
from visualhfsm._document.serialization import import_document, parse
from visualhfsm._processes.bodies import FOLDER
from visualhfsm.project._check_process import CheckProcess
from visualhfsm.project._code_help.service import CodeHelp
from visualhfsm.project._editing.edited_document import MERGE_WITHIN, EditedDocument
from visualhfsm.project._editing.files import make_folder, read_file
from visualhfsm.project._editing.journal import Abandoned, find_abandoned, journal_directory
from visualhfsm.project._editing.shelf import ReadyState, Shelves
from visualhfsm.project._editing.templates import EMPTY, make_template

from ._document import Listener, Listeners, OpenDocument, Opened
from ._root import (
    BODY_SUFFIX,
    DOCUMENT_SUFFIX,
    MODEL_SUFFIXES,
    RECORDING_SUFFIX,
    Root,
    looks_like_model,
)
from ._version import free_title, stem

if TYPE_CHECKING:
    from ._verdict import Judge

_MOST_ENTRIES: Final = 2000  # of a directory
_MOST_DIRECTORIES: Final = 200  # below it, whose entries are listed with its own
_MOST_REMARKS: Final = 100  # about one document


@dataclass(frozen=True, slots=True)
class Entry:
    """A directory, or a document, recording or robot in it; size in bytes, `changed_at` in s since 1970."""

    path: Path
    kind: Literal["directory", "document", "recording", "model"]
    size: int
    changed_at: float


class Project:
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
        self.root: Final = Root(Path(root), granted)
        self.include: Final[Sequence[Path]] = tuple(Path(each).resolve() for each in include)
        self.journals: Final = journals or journal_directory()
        folder = self.root.directory
        self.checks: Final = checks or CheckProcess(folder=folder)
        self.code_help: Final = code_help or CodeHelp(include=self.include, folder=folder)
        self._shelves = Shelves(folder)
        self._most = most
        self._merge_within = merge_within
        self._author = author
        self.listeners: Final = Listeners()
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

    def end_processes(self) -> None:
        """End the processes that check and read code; questions that wait for them fail."""
        self.checks.close()
        self.code_help.close()
        if "judge" in vars(self):
            self.judge.close()

    @cached_property
    def judge(self) -> Judge:
        """What verdicts are made by, with its processes."""
        from ._verdict import Judge  # only who judges waits for trials

        return Judge(self.include)

    def subscribe(self, listener: Listener) -> Callable[[], None]:
        """Notify a listener of what happens to all documents; return the function that ends this."""
        return self.listeners.subscribe(listener)

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
            return self._add(lambda: EditedDocument.open(file, journals=self.journals))

    def open_text(self, name: str, text: str, *, kept: bool = False) -> OpenDocument:
        """Open a text in any format as a document that has no file yet, `name` is that of the text.

        `kept` says that it is kept elsewhere as it is, so that closing it loses nothing.
        """

        def make() -> EditedDocument:
            document = parse(text, Message("Cannot open {name}", name=name))
            title = name if kept else self._free_title(stem(name))
            return EditedDocument.new(document, title, journals=self.journals, kept=kept)

        with self._opening:
            if (other := imported_format(name, content := text.encode())) is not None:
                return self._import(other, name, content)
            return self._add(make)

    def new(self, template: str = EMPTY, language: str = ENGLISH) -> OpenDocument:
        """Make a document from a template: an empty one, or one of the behaviors that are installed.

        An empty one is called `untitled`, in a language such as `es`.
        """

        def make() -> EditedDocument:
            name, document = make_template(template, known_language(language))
            return EditedDocument.new(document, self._free_title(name), journals=self.journals)

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
            if each.path is None
            or (self.root.contains(each.path) and not EditedDocument.drop_saved(each.file))
        ]
        self._abandoned = {each.file.name: each for each in found}
        return found

    def recover(self, journal: str) -> OpenDocument:
        """Open one of `recoverable` as it was, by the name of its journal."""
        file = self._journal(journal)
        with self._opening:
            opened = self._add(lambda: EditedDocument.recover(file))
        self._abandoned.pop(journal, None)
        return opened

    def discard(self, journal: str) -> None:
        """Discard the changes of one of `recoverable`."""
        EditedDocument.recover(self._journal(journal)).close(discard=True)
        self._abandoned.pop(journal, None)

    # -- files ---------------------------------------------------------------------------------------------

    def entries(self, directory: str | Path = "", *, depth: int = 0) -> list[Entry]:
        """Return the directories, documents, recordings and models in a directory, without hidden ones.

        With a `depth` those files follow that are in directories so far below it, the nearest first. Links
        to directories, and those of packages, are left out there.
        """
        place = self.root.directory_of(str(directory))
        with MissingError.in_place_of(OSError, "{place} cannot be listed: {reason}", place=place.name):
            shown = level = self._entries_in(place)
        left = _MOST_DIRECTORIES
        for _ in range(depth):
            below = [each.path for each in level if each.kind == "directory" and _leads_on(each.path)][:left]
            left -= len(below)
            level = []
            for folder in below:
                if len(level) < _MOST_ENTRIES:
                    with suppress(OSError):  # closed, or deleted just now
                        level += self._entries_in(folder)
            shown = [*shown, *(each for each in level if each.kind != "directory")]
        return shown[:_MOST_ENTRIES]

    def _entries_in(self, directory: Path) -> list[Entry]:
        found = [each for path in directory.iterdir() if (each := self._entry(path)) is not None]
        return sorted(found, key=lambda each: (each.kind != "directory", each.path.name))

    def _entry(self, path: Path) -> Entry | None:
        if path.name.startswith(".") or not self.root.contains(path):
            return None
        try:
            status = path.stat()
        except OSError:  # a broken link, or a file that was deleted just now
            return None
        if stat.S_ISDIR(status.st_mode):
            return Entry(path, "directory", status.st_size, status.st_mtime)
        suffix = path.suffix.lower()
        kind = "document" if suffix in imported_suffixes() else _KINDS.get(suffix)
        if not stat.S_ISREG(status.st_mode) or kind is None:
            return None
        if suffix == BODY_SUFFIX and path.parent != self.root.directory / FOLDER:
            return None
        if suffix == DOCUMENT_SUFFIX and looks_like_model(path):
            kind = "model"
        return Entry(path, kind, status.st_size, status.st_mtime)

    # -- the shelf -----------------------------------------------------------------------------------------

    def shelf(self) -> list[ReadyState]:
        """Return the ready states that can be drawn: ours, then those of the folder `shelf`."""
        return self._shelves.states()

    def ready_state(self, id: str) -> tuple[str, str]:
        """Return the title and the text of the document of a ready state."""
        return self._shelves.content(id)

    # -- for open documents --------------------------------------------------------------------------------

    def file(self, path: str | Path) -> Path:
        """Return the path of a document below the root."""
        return self.root.document(str(path))

    @contextmanager
    def saving(self, document: OpenDocument, path: str | Path, *, overwrite: bool) -> Iterator[Path]:
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

    def forget(self, document: OpenDocument) -> None:
        """Forget a document that is closed."""
        self._documents.remove(document)

    # -- parts ---------------------------------------------------------------------------------------------

    def _add(
        self, make: Callable[[], EditedDocument], remarks: Sequence[Message] | None = None
    ) -> OpenDocument:
        if self._closed:
            raise EditError("Cannot open a document", "the project is closed", "make another Project")
        self.require_room()
        edited = make()
        edited.merge_within, edited.author = self._merge_within, self._author
        opened = OpenDocument(edited, self, remarks)
        self._documents.append(opened)
        self.listeners.notify(Opened(opened))
        return opened

    def _import(self, other: Format, name: str, content: bytes) -> OpenDocument:
        """Open a file of another program as a document that has no file yet."""
        document, remarks = import_document(other, content, name)
        title = self._free_title(stem(name))
        return self._add(
            lambda: EditedDocument.new(document, title, journals=self.journals), remarks[:_MOST_REMARKS]
        )

    def _free_title(self, wanted: str) -> str:
        """Return a title for a document without a file, whose component no other one has."""
        return free_title(wanted, {each.version.component for each in self.documents})

    def _journal(self, name: str) -> Path:
        if name not in self._abandoned:
            self.recoverable()
        if name not in self._abandoned:
            raise MissingError.because("{name} cannot be recovered any more", name=name)
        return self._abandoned[name].file


def _leads_on(directory: Path) -> bool:
    """Return whether the files of a directory may be listed with those of one above it."""
    is_of_packages = directory.name in {"node_modules", "__pycache__"} or (directory / "pyvenv.cfg").exists()
    return not is_of_packages and not directory.is_symlink()


_KINDS: Final[dict[str, Literal["document", "recording", "model"]]] = {
    DOCUMENT_SUFFIX: "document",
    RECORDING_SUFFIX: "recording",
    BODY_SUFFIX: "model",
    **dict.fromkeys(MODEL_SUFFIXES, "model"),
}
