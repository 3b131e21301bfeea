"""Requests that change a document; most answers say which step it was and what is new.

Everything raises VisualHfsmError.
"""

from __future__ import annotations

from functools import partial
from typing import Any

from codegen.messages import Message
from visualhfsm._base.errors import MissingError
from visualhfsm._document.commands import in_language
from visualhfsm._document.commands.base import DUPLICATED
from visualhfsm._document.commands.paste import PasteStates
from visualhfsm.project._document import OpenDocument
from visualhfsm.project._session.session import Change

from . import protocol as p
from .window import Window
from .workspace import Workspace


async def do(workspace: Workspace, window: Window, request: p.Do) -> dict[str, Any]:
    """Apply a command; names that it makes up are in the language of the page."""
    tab = workspace.tabs.editable(request.tab)
    command = in_language(request.command, window.language)
    return _outcome(await tab.edit(OpenDocument.apply, command, request.base, window))


async def undo(workspace: Workspace, _: Window, request: p.Undo) -> dict[str, Any]:
    """Undo the last step."""
    return _step(await workspace.tabs.editable(request.tab).edit(OpenDocument.undo))


async def redo(workspace: Workspace, _: Window, request: p.Redo) -> dict[str, Any]:
    """Redo the step that was undone last."""
    return _step(await workspace.tabs.editable(request.tab).edit(OpenDocument.redo))


async def go_to(workspace: Workspace, _: Window, request: p.GoTo) -> dict[str, Any]:
    """Undo or redo up to a step."""
    return _step(await workspace.tabs.editable(request.tab).edit(OpenDocument.go_to, request.revision))


async def copy(workspace: Workspace, window: Window, request: p.Copy) -> dict[str, str]:
    """Put states into the clipboard."""
    tab = workspace.tabs.get(request.tab)
    text = await tab.edit(OpenDocument.copy, request.automaton, request.states, request.annotations)
    workspace.clipboard = window.clipboard = text
    return {"text": text}


async def cut(workspace: Workspace, window: Window, request: p.Cut) -> dict[str, Any]:
    """Put states into the clipboard, and delete them."""
    tab = workspace.tabs.editable(request.tab)
    text, change = await tab.edit(OpenDocument.cut, request.automaton, request.states, request.annotations)
    workspace.clipboard = window.clipboard = text
    return {**_outcome(change), "text": text}


async def paste(workspace: Workspace, window: Window, request: p.Paste) -> dict[str, Any]:
    """Paste what the window has copied, or any window if it has copied nothing."""
    tab = workspace.tabs.editable(request.tab)
    content = window.clipboard or workspace.clipboard
    if not content:
        raise MissingError(Message("no states were copied here: Ctrl+V pastes those of another editor"))
    command = PasteStates(automaton=request.automaton, content=content, x=request.x, y=request.y)
    return _outcome(await tab.edit(OpenDocument.apply, command))


async def duplicate(workspace: Workspace, _: Window, request: p.Duplicate) -> dict[str, Any]:
    """Paste states beside themselves."""
    tab = workspace.tabs.editable(request.tab)
    content = await tab.edit(OpenDocument.copy, request.automaton, request.states, request.annotations)
    command = PasteStates(automaton=request.automaton, content=content, name=str(DUPLICATED))
    return _outcome(await tab.edit(OpenDocument.apply, command))


async def add_ready(workspace: Workspace, window: Window, request: p.AddReady) -> dict[str, Any]:
    """Draw a state of the shelf."""
    tab = workspace.tabs.editable(request.tab)
    add = partial(
        OpenDocument.add_ready_state,
        id=request.state,
        automaton=request.automaton,
        x=request.x,
        y=request.y,
        origin=request.origin,
        trigger=request.trigger,
        name=request.name,
        language=window.language,
    )
    return _outcome(await tab.edit(add))


async def put_on_shelf(workspace: Workspace, _: Window, request: p.PutOnShelf) -> dict[str, str]:
    """Write states as a ready state of the project, and return the name of its file."""
    tab = workspace.tabs.get(request.tab)
    put = partial(
        OpenDocument.put_on_shelf,
        automaton=request.automaton,
        states=request.states,
        title=request.title,
        category=request.category,
        words=request.words,
        description=request.description,
    )
    return {"path": workspace.project.root.name(await tab.edit(put))}


async def extract(workspace: Workspace, _: Window, request: p.Extract) -> dict[str, Any]:
    """Move an automaton to a new file."""
    tab = workspace.tabs.editable(request.tab)
    return _outcome(await tab.edit(OpenDocument.extract, request.automaton, request.path))


async def inline(workspace: Workspace, _: Window, request: p.Inline) -> dict[str, Any]:
    """Copy the content of an imported automaton into the document."""
    tab = workspace.tabs.editable(request.tab)
    return _outcome(await tab.edit(OpenDocument.inline, request.automaton))


def _outcome(change: Change) -> dict[str, Any]:
    outcome = {"name": change.name, "revision": change.revision, "added": list(change.added)}
    return {**outcome, "conflict": True} if change.conflict else outcome


def _step(change: Change) -> dict[str, Any]:
    """Return the outcome of undoing or redoing, with the changed place, which may be out of sight."""
    return {**_outcome(change), "place": change.place}
