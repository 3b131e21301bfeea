"""Open, make, recover, save and close documents; find and list their files."""

from __future__ import annotations

import stat
from collections.abc import Callable
from pathlib import Path
from typing import Any, Final

from visualhfsm.editing.changes import Choice
from visualhfsm.editing.files import read_file
from visualhfsm.editing.fragments import parse
from visualhfsm.editing.scxml import holds_scxml, take_over
from visualhfsm.editing.session import DocumentSession
from visualhfsm.editing.templates import make_template

from .paths import DOCUMENT_SUFFIX, FOREIGN_SUFFIX, RECORDING_SUFFIX
from .refusals import MissingError, UnsavedError, WouldOverwriteError
from .workspace import Workspace

__all__ = ["Documents"]

_MOST_ENTRIES: Final = 2000  # of a directory
_MOST_REMARKS: Final = 100  # about one document


class Documents:
    """What happens to the documents of a workspace as a whole. Everything raises VisualHfsmError."""

    def __init__(self, workspace: Workspace) -> None:
        self._workspace = workspace

    async def open(self, text: str) -> dict[str, Any]:
        """Open a document, or find the tab where it is open. SCXML becomes a new document."""
        workspace = self._workspace
        path = workspace.root.source(text)
        async with workspace.opening:
            for tab in workspace.tabs:
                if tab.shown.path == path:
                    return {"tab": tab.id}
            if not path.is_file():
                raise MissingError(f"there is no file {text}")
            content, _ = await workspace.workers.do(lambda: read_file(path))
            if holds_scxml(path.name, content):
                return await self._take_over(path.name, content)
            return await self._add(lambda: DocumentSession.open(path, journals=workspace.journals))

    async def new(self, template: str) -> dict[str, int]:
        """Make a document of a template."""
        workspace = self._workspace

        def make() -> DocumentSession:
            name, document = make_template(template)
            return DocumentSession.new(document, name, journals=workspace.journals)

        async with workspace.opening:
            return await self._add(make)

    async def open_text(self, name: str, text: str) -> dict[str, Any]:
        """Open a text as a document that has no file yet."""
        workspace = self._workspace

        def make() -> DocumentSession:
            document = parse(text, f"Cannot open {name}")
            return DocumentSession.new(document, _stem(name), journals=workspace.journals)

        async with workspace.opening:
            if holds_scxml(name, content := text.encode()):
                return await self._take_over(name, content)
            return await self._add(make)

    async def _take_over(self, name: str, content: bytes) -> dict[str, Any]:
        """Open SCXML as a document that has no file yet, and tell what of it means nothing here."""
        workspace = self._workspace
        remarks: tuple[str, ...] = ()

        def make() -> DocumentSession:
            nonlocal remarks
            taken = take_over(content, name)
            remarks = taken.remarks
            return DocumentSession.new(taken.document, _stem(name), journals=workspace.journals)

        opened = await self._add(make)
        return {**opened, "remarks": remarks[:_MOST_REMARKS]}

    async def recover(self, journal: str) -> dict[str, int]:
        """Open a document whose session ended without closing, as it was then."""
        workspace = self._workspace
        file = workspace.abandoned(journal)
        async with workspace.opening:
            opened = await self._add(lambda: DocumentSession.recover(file), recovered=True)
            await workspace.look_for_abandoned()
        return opened

    async def discard(self, journal: str) -> None:
        """Give up the changes of such a document."""
        workspace = self._workspace
        file = workspace.abandoned(journal)

        def discard() -> None:
            DocumentSession.recover(file).close(discard=True)

        await workspace.workers.do(discard)
        await workspace.look_for_abandoned()

    async def close(self, number: int, *, discard: bool) -> None:
        """Close a document."""
        workspace = self._workspace
        tab = workspace.tab(number)
        if tab.is_unsaved and not discard:
            raise UnsavedError(f"{tab.shown.name} has changes that are not saved")
        await tab.close(discard=discard)
        workspace.remove(tab)
        await workspace.services.running.forget(number)

    async def save(self, number: int, *, overwrite: bool) -> dict[str, str]:
        """Save a document to its own file."""
        workspace = self._workspace
        path = await workspace.tab(number).save(overwrite=overwrite)
        return {"path": workspace.root.name(path)}

    async def save_as(self, number: int, text: str, *, overwrite: bool) -> dict[str, str]:
        """Save a document to another file."""
        workspace = self._workspace
        path = workspace.root.document(text)
        tab = workspace.tab(number)
        if any(other.shown.path == path for other in workspace.tabs if other is not tab):
            raise WouldOverwriteError(f"{text} is open in another tab; close that first")
        if path.exists() and path != tab.shown.path and not overwrite:
            raise WouldOverwriteError(f"{text} is there already")
        return {"path": workspace.root.name(await tab.save(path, overwrite=overwrite))}

    async def resolve(self, number: int, choice: str) -> dict[str, Any]:
        """Settle what another program did to the file."""
        resolution = await self._workspace.tab(number).resolve(Choice(choice))
        self._workspace.tell()
        return resolution

    async def _add(self, make: Callable[[], DocumentSession], *, recovered: bool = False) -> dict[str, int]:
        self._workspace.require_room()
        session = await self._workspace.workers.do(make)
        tab = await self._workspace.add(session, recovered=recovered)
        return {"tab": tab.id}

    async def list_files(self, text: str) -> dict[str, Any]:
        """List the documents, recordings and directories in a directory; hidden ones are left out."""
        root = self._workspace.root
        directory = root.directory_of(text)

        def entries() -> list[dict[str, Any]]:
            found = []
            for path in _content_of(directory):
                if path.name.startswith(".") or not root.contains(path):
                    continue
                try:
                    status = path.stat()
                except OSError:  # a link that leads nowhere, or what was deleted just now
                    continue
                kind = _kind_of(path, status.st_mode)
                if kind:
                    found.append(
                        {
                            "name": path.name,
                            "path": root.name(path),
                            "kind": kind,
                            "size": status.st_size,
                            "changedAt": status.st_mtime,
                        }
                    )
            found.sort(key=lambda entry: (entry["kind"] != "directory", entry["name"]))
            return found[:_MOST_ENTRIES]

        is_root = directory == root.directory
        return {
            "directory": "" if is_root else root.name(directory),
            "parent": None if is_root else root.name(directory.parent).removeprefix("."),
            "entries": await self._workspace.workers.do(entries),
        }


def _content_of(directory: Path) -> list[Path]:
    """Return what lies in a directory; raises MissingError when that cannot be read."""
    try:
        return list(directory.iterdir())
    except OSError as error:
        raise MissingError(f"{directory.name} cannot be listed: {error.strerror}") from error


def _stem(name: str) -> str:
    return Path(name).stem[:100] or "component"


def _kind_of(path: Path, mode: int) -> str:
    """Return what the page may open: `directory`, `document` or `recording`; empty for all else."""
    if stat.S_ISDIR(mode):
        return "directory"
    kinds = {DOCUMENT_SUFFIX: "document", FOREIGN_SUFFIX: "document", RECORDING_SUFFIX: "recording"}
    return kinds.get(path.suffix.lower(), "") if stat.S_ISREG(mode) else ""
