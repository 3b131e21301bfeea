"""Open, create, recover, save and close documents; list their files.

Everything raises VisualHfsmError.
"""

from __future__ import annotations

import stat
from collections.abc import Callable
from pathlib import Path
from typing import Any, Final

from codegen.hfsm.scxml import is_scxml
from visualhfsm.editing.serialization import import_scxml, parse
from visualhfsm.errors import EditError, MissingError, UnsavedError, WouldOverwriteError
from visualhfsm.sessions.files import read_file, write_file
from visualhfsm.sessions.imports import imported_views
from visualhfsm.sessions.session import Choice, DocumentSession
from visualhfsm.sessions.templates import make_template

from .security import DOCUMENT_SUFFIX, FOREIGN_SUFFIX, RECORDING_SUFFIX
from .window import Window
from .workspace import Workspace

_MOST_ENTRIES: Final = 2000  # of a directory
_MOST_REMARKS: Final = 100  # about one document


async def open_file(workspace: Workspace, text: str) -> dict[str, Any]:
    """Open a document, or find the tab where it is open. SCXML becomes a new document."""
    path = workspace.root.source(text)
    async with workspace.opening:
        if (tab := workspace.tab_of(path)) is not None:
            return {"tab": tab.id}
        if not path.is_file():
            raise MissingError(f"there is no file {text}")
        content, _ = await workspace.threads.do(lambda: read_file(path))
        if is_scxml(path.name, content):
            return await _import_scxml(workspace, path.name, content)
        return await _add(workspace, lambda: DocumentSession.open(path, journals=workspace.journals))


async def open_text(workspace: Workspace, name: str, text: str) -> dict[str, Any]:
    """Open a text as a document that has no file yet."""

    def make() -> DocumentSession:
        document = parse(text, f"Cannot open {name}")
        return DocumentSession.new(document, workspace.free_title(_stem(name)), journals=workspace.journals)

    async with workspace.opening:
        if is_scxml(name, content := text.encode()):
            return await _import_scxml(workspace, name, content)
        return await _add(workspace, make)


async def open_recording(workspace: Workspace, window: Window, path: Path) -> dict[str, Any]:
    """Open a recording; `tab` of the answer shows the document that it contains, 0 without one."""

    def make() -> DocumentSession:
        document = parse(found["document"], "The recorded document cannot be read")
        return DocumentSession.new(document, path.name, journals=workspace.journals, kept=True)

    known = next((tab.id for tab in workspace.tabs if tab.recording == path), 0)
    if not known:
        workspace.require_room()
    found = await workspace.open_recording(window, path)
    try:
        return {**found, **({"tab": known} if known else await _add(workspace, make, recording=path))}
    except EditError:
        return {**found, "tab": 0}


async def export_run(workspace: Workspace, component: str, number: int) -> dict[str, str]:
    """Return the page of a run with the document of a tab, if there is one, and a name for the file."""
    document = workspace.tab(number).shown.document if number else None
    content = await imported(workspace, number) if number else []
    text = await workspace.services.live.exported(component, document, content)
    return {"name": f"{_stem(component.rpartition(':')[2])}.html", "text": text}


async def imported(workspace: Workspace, number: int) -> list[dict[str, Any]]:
    """Return the content of the automata that a document imports."""
    shown = workspace.tab(number).shown
    if (path := shown.path) is None:
        return []  # imports are relative to the file
    return await workspace.threads.do(lambda: imported_views(shown.document, path))


async def new(workspace: Workspace, template: str) -> dict[str, Any]:
    """Create a document from a template."""

    def make() -> DocumentSession:
        name, document = make_template(template)
        return DocumentSession.new(document, workspace.free_title(name), journals=workspace.journals)

    async with workspace.opening:
        return await _add(workspace, make)


async def recover(workspace: Workspace, journal: str) -> dict[str, Any]:
    """Open a document whose session ended without closing, as it was then."""
    file = workspace.abandoned(journal)
    async with workspace.opening:
        opened = await _add(workspace, lambda: DocumentSession.recover(file))
        await workspace.look_for_abandoned()
    return opened


async def discard(workspace: Workspace, journal: str) -> None:
    """Discard the changes of such a document."""
    file = workspace.abandoned(journal)
    await workspace.threads.do(lambda: DocumentSession.recover(file).close(discard=True))
    await workspace.look_for_abandoned()


async def close(workspace: Workspace, number: int, *, discard: bool) -> None:
    """Close a document, with unsaved changes only to `discard` them."""
    tab = workspace.tab(number)
    if tab.shown.is_unsaved and not discard:
        raise UnsavedError(f"{tab.shown.title} has changes that are not saved")
    await tab.edit(DocumentSession.close, discard=discard)
    workspace.remove(tab)
    await workspace.services.running.forget(number)


async def save(
    workspace: Workspace, number: int, text: str | None = None, *, overwrite: bool
) -> dict[str, Any]:
    """Save a document, by default to its own file; one of a recording is saved as a copy, which is opened."""
    tab = workspace.tab(number)
    path = None if text is None else workspace.root.document(text)
    if path is not None:
        if workspace.tab_of(path) not in {None, tab}:
            raise WouldOverwriteError(f"{text} is open in another tab; close that first")
        if path.exists() and path != tab.shown.path and not overwrite:
            raise WouldOverwriteError(f"{text} already exists")
        await workspace.threads.do(lambda: _make_folder(path.parent))
        if tab.recording is not None:
            content = (await tab.edit(DocumentSession.text)).encode()
            await workspace.threads.do(lambda: write_file(path, content))
            return {"path": workspace.root.name(path), **await open_file(workspace, str(path))}
    saved = await tab.edit(DocumentSession.save, path, overwrite=overwrite)
    tab.outside = None
    workspace.publish_state()
    return {"path": workspace.root.name(saved)}


def _make_folder(folder: Path) -> None:
    """Create the folder that a file name contains. Raises EditError."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise EditError(
            f"Cannot create the folder {folder.name}", error.strerror or str(error), "choose another name"
        ) from error


async def resolve(workspace: Workspace, number: int, choice: Choice) -> dict[str, Any]:
    """Resolve a change of the file by another program."""
    tab = workspace.tab(number)
    resolution = await tab.edit(DocumentSession.resolve, choice)
    tab.outside = None
    workspace.publish_state()
    return {"revision": tab.shown.revision, "conflicts": list(resolution.conflicts)}


async def list_files(workspace: Workspace, text: str) -> dict[str, Any]:
    """List the documents, recordings and directories in a directory; hidden ones are left out."""
    root = workspace.root
    directory = root.directory_of(text)

    def entries() -> list[dict[str, Any]]:
        found = []
        for path in _content_of(directory):
            if path.name.startswith(".") or not root.contains(path):
                continue
            try:
                status = path.stat()
            except OSError:  # a broken link, or a file that was deleted just now
                continue
            kind = _kind_of(path, status.st_mode)
            if kind:
                entry = {"name": path.name, "path": root.name(path), "kind": kind}
                found.append({**entry, "size": status.st_size, "changedAt": status.st_mtime})
        found.sort(key=lambda entry: (entry["kind"] != "directory", entry["name"]))
        return found[:_MOST_ENTRIES]

    is_root = directory == root.directory
    return {
        "directory": "" if is_root else root.name(directory),
        "parent": None if is_root else root.name(directory.parent).removeprefix("."),
        "entries": await workspace.threads.do(entries),
    }


async def _import_scxml(workspace: Workspace, name: str, content: bytes) -> dict[str, Any]:
    """Open SCXML as a document that has no file yet, and report what has no equivalent here."""
    document, remarks = await workspace.threads.do(lambda: import_scxml(content, name))
    title = workspace.free_title(_stem(name))
    opened = await _add(workspace, lambda: DocumentSession.new(document, title, journals=workspace.journals))
    return {**opened, "remarks": remarks[:_MOST_REMARKS]}


async def _add(
    workspace: Workspace, make: Callable[[], DocumentSession], *, recording: Path | None = None
) -> dict[str, Any]:
    workspace.require_room()
    tab = await workspace.add(await workspace.threads.do(make), recording=recording)
    return {"tab": tab.id}


def _content_of(directory: Path) -> list[Path]:
    """Return the entries of a directory; raises MissingError when it cannot be read."""
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
