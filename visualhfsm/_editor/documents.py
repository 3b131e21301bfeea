"""Requests that open, create, recover, save and close documents, and list their files.

Everything raises VisualHfsmError.
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Final

from visualhfsm._base.errors import EditError
from visualhfsm._base.languages import known_language
from visualhfsm._base.work import complete
from visualhfsm._processes.bodies import find_bodies
from visualhfsm._processes.robots import find_worlds
from visualhfsm.project._document import OpenDocument
from visualhfsm.project._editing.templates import find_templates

from . import answers as a
from . import protocol as p
from .tab import Tab
from .window import Window
from .workspace import Workspace

_DEPTH: Final = 3
"""How far below a directory files are listed with its own."""


async def hello(workspace: Workspace, window: Window, request: p.Hello) -> a.Greeting:
    """Send a window the whole state."""
    templates = await workspace.threads.do(find_templates)
    root = workspace.project.root.directory
    workspace.greet(window, known_language(request.language))
    return {
        "root": str(root),
        "templates": [{"name": each.name, "description": each.description} for each in templates],
        "worlds": await workspace.threads.do(find_worlds),
        "bodies": await workspace.threads.do(partial(find_bodies, root)),
        "demo": not window.is_viewer and workspace.begin_demo(),
        "recording": "" if window.is_viewer else workspace.begin_recording(),
        "viewer": window.is_viewer,
        "instance": workspace.instance,
        "key": window.key.hex(),
    }


async def share(workspace: Workspace, _: Window, request: p.Share) -> a.Address:
    """Return the read-only address of the page; blank once it is withdrawn."""
    return {"address": workspace.share(request.shared)}


async def open_file(workspace: Workspace, path: str) -> a.Opened:
    """Open a document, or find the tab where it is open. SCXML becomes a new document."""
    return await shown(workspace, partial(workspace.project.open, path))


async def recover(workspace: Workspace, _: Window, request: p.Recover) -> a.Opened:
    """Open a document that was still open when its editor ended, as it was then."""
    opened = await shown(workspace, partial(workspace.project.recover, request.journal))
    await workspace.look_for_recoverable()
    return opened


async def discard(workspace: Workspace, _: Window, request: p.Discard) -> None:
    """Discard the changes of such a document."""
    await workspace.threads.do(partial(workspace.project.discard, request.journal))
    await workspace.look_for_recoverable()


async def open_recording(workspace: Workspace, window: Window, request: p.Recording) -> a.ShownRecording:
    """Open a recording; `tab` of the answer shows the document that it contains, 0 without one."""
    project = workspace.project
    path = project.root.recording(request.path)
    known = next((tab.id for tab in workspace.tabs if tab.recording == path), 0)
    if not known:
        project.require_room()
    found = await workspace.components.open_recording(window, path)
    if known:
        return {**found, "tab": known}
    open_it = partial(project.open_text, path.name, found["document"], kept=True)
    try:
        return {**found, "tab": (await shown(workspace, open_it, recording=path))["tab"]}
    except EditError:
        return {**found, "tab": 0}


async def close(workspace: Workspace, _: Window, request: p.Close) -> None:
    """Close a document, with unsaved changes only to `discard` them."""
    tab = workspace.tabs.get(request.tab)

    async def closed() -> None:
        await tab.edit(OpenDocument.close, discard=request.discard)
        workspace.remove(tab)
        parts = workspace.parts
        runners = (parts.started, *parts.views.values(), parts.tests)
        await asyncio.gather(*(each.forget(tab.id) for each in runners))

    await complete(closed())


async def save(workspace: Workspace, _: Window, request: p.Save) -> a.Written:
    """Save a document to its own file."""
    tab = workspace.tabs.get(request.tab)
    return {"path": _name(workspace, await tab.edit(OpenDocument.save, overwrite=request.overwrite))}


async def save_as(workspace: Workspace, _: Window, request: p.SaveAs) -> a.SavedAs:
    """Save a document to another file; one of a recording is saved as a copy, which is opened."""
    tab = workspace.tabs.get(request.tab)
    if tab.recording is None:
        saved = await tab.edit(OpenDocument.save, request.path, overwrite=request.overwrite)
        return {"path": _name(workspace, saved)}
    copy = await tab.edit(OpenDocument.save_copy, request.path, overwrite=request.overwrite)
    return {"path": _name(workspace, copy), **await open_file(workspace, str(copy))}


async def resolve(workspace: Workspace, _: Window, request: p.Resolve) -> a.Resolved:
    """Resolve a change of the file by another program."""
    tab = workspace.tabs.get(request.tab)
    resolution = await tab.edit(OpenDocument.resolve, request.choice)
    return {"revision": tab.shown.revision, "conflicts": list(resolution.conflicts)}


async def list_files(workspace: Workspace, _: Window, request: p.ListFiles) -> a.Listing:
    """List the documents, recordings and directories in a directory, or also what is below it."""
    root = workspace.project.root
    directory = root.directory_of(request.directory)
    entries = await workspace.threads.do(
        partial(workspace.project.entries, request.directory, depth=_DEPTH if request.below else 0)
    )
    is_root = directory == root.directory
    return {
        "directory": "" if is_root else root.name(directory),
        "parent": None if is_root else root.name(directory.parent).removeprefix("."),
        "entries": [
            {
                "name": each.path.relative_to(directory).as_posix(),
                "path": root.name(each.path),
                "kind": each.kind,
                "size": each.size,
                "changedAt": each.changed_at,
            }
            for each in entries
        ],
    }


async def shown(
    workspace: Workspace, make: Callable[[], OpenDocument], *, recording: Path | None = None
) -> a.Opened:
    """Open a document, and show it in a tab; the answer has the remarks about a foreign file."""

    async def show() -> Tab:
        return workspace.show(await workspace.threads.do(make), recording=recording)

    tab = await complete(show())
    document = tab.document
    if document.remarks is None:
        return {"tab": tab.id}
    return {"tab": tab.id, "remarks": document.remarks}


def _name(workspace: Workspace, path: Path) -> str:
    return workspace.project.root.name(path)
