"""An open document's steps, file and journal, and how they begin: with a file, new, or from a journal."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from codegen.hfsm.document import Document
from visualhfsm._base.errors import EditError
from visualhfsm._document.commands import decode_command
from visualhfsm._document.serialization import parse_file, written

from .document_file import DocumentFile
from .files import FileVersion, read_file
from .journal import Done, Entry, Header, Journal, Redone, Saved, Undone
from .undo_stack import UndoStack


@dataclass(frozen=True, slots=True)
class DocumentState:
    """An open document: its steps, its file and its journal."""

    steps: UndoStack
    file: DocumentFile
    journal: Journal

    @property
    def dirty(self) -> bool:
        """Whether the document differs from what was saved; a new one does until it is saved."""
        return self.steps.document is not self.file.saved


def begin_from_file(path: Path, journals: Path) -> DocumentState:
    """Begin with a file in any dialect. Raises EditError."""
    content, version = read_file(path)
    document = parse_file(content, path)
    header = Header(str(path), path.stem, content, version.digest)
    file = DocumentFile(header, document, version)
    return DocumentState(UndoStack(document, len(content) * 2), file, Journal(journals, header))


def begin_new(document: Document, title: str, journals: Path, *, kept: bool = False) -> DocumentState:
    """Begin with a document that has no file yet; `kept` says that it is kept elsewhere as it is."""
    content = written(document).encode()
    header = Header(None, title, content, "")
    file = DocumentFile(header, document)
    file.saved = document if kept else None
    return DocumentState(UndoStack(document, len(content)), file, Journal(journals, header))


def recover(journal_file: Path, *, reads: bool = False) -> DocumentState:
    """Begin with a document that was open when its process ended, with all its steps.

    Its journal stays as it is for who only `reads`. Raises EditError when that cannot be read, or another
    process has it open.
    """
    journal, entries = Journal.take_over(journal_file, reads=reads)
    header = journal.header
    path = None if header.path is None else Path(header.path)
    try:
        document = parse_file(header.content, path or Path(header.name))
        version = None if path is None else FileVersion(0, len(header.content), header.digest)
        state = DocumentState(UndoStack(document), DocumentFile(header, document, version), journal)
        _replay(entries, state)
    except BaseException:
        journal.close(keep=True)
        raise
    state.steps.seal()
    state.file.take_if_same(state.steps.document)
    return state


def drop_saved(journal_file: Path) -> bool:
    """Remove the journal of a document that is as its file holds it, and return whether it was one."""
    try:
        state = recover(journal_file, reads=True)
    except EditError:  # who recovers it is told
        return False
    is_saved = not state.dirty and not state.file.is_changed_outside()
    state.journal.close(keep=not is_saved)
    return is_saved


def _replay(entries: Iterator[tuple[Entry, int]], state: DocumentState) -> None:
    steps = state.steps
    for entry, place in entries:
        try:
            match entry:
                case Done(command=raw, merged=merged):
                    steps.do(decode_command(bytes(raw)), merge=merged)
                case Undone():
                    steps.undo()
                case Redone():
                    steps.redo()
                case Saved():
                    state.file.replay(entry, steps.document)
        except EditError as error:
            state.journal.cut(place, error)
            return
