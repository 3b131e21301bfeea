"""Requests that change a document; most answers say which step it was and what is new.

Everything raises VisualHfsmError.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Concatenate, ParamSpec

from visualhfsm._base.errors import MissingError
from visualhfsm._document.commands import in_language
from visualhfsm._document.commands.base import DUPLICATED
from visualhfsm._document.commands.paste import PasteStates
from visualhfsm._document.places import Place
from visualhfsm.project._document import OpenDocument
from visualhfsm.project._editing.change import Change
from visualhfsm.project._editing.undo_stack import Own

from . import answers as a
from . import protocol as p
from .views import TabEdit
from .window import Window
from .workspace import Workspace

P = ParamSpec("P")


async def do(workspace: Workspace, window: Window, request: p.Do) -> a.Done:
    """Apply a command; names that it makes up are in the language of the page."""
    command = in_language(request.command, window.language)
    tab = workspace.tabs.editable(request.tab)
    return _done(await tab.edit(OpenDocument.apply, command, request.base, window.number))


async def copy(workspace: Workspace, window: Window, request: p.Copy) -> a.Copied:
    """Put states into the clipboard."""
    tab = workspace.tabs.get(request.tab)
    text = await tab.edit(OpenDocument.copy, request.automaton, request.states, request.annotations)
    workspace.clipboard = window.clipboard = text
    return {"text": text}


async def cut(workspace: Workspace, window: Window, request: p.Cut) -> a.CutOut:
    """Put states into the clipboard, and delete them."""
    tab = workspace.tabs.editable(request.tab)
    text, changed = await tab.edit(
        OpenDocument.cut, request.automaton, request.states, request.annotations, window.number
    )
    workspace.clipboard = window.clipboard = text
    return {**_done(changed), "text": text}


async def paste(workspace: Workspace, window: Window, request: p.Paste) -> a.Done:
    """Paste what the window has copied, or any window if it has copied nothing."""
    workspace.tabs.editable(request.tab)  # the first thing to say of a recording
    content = window.clipboard or workspace.clipboard
    if not content:
        raise MissingError.because("no states were copied here: Ctrl+V pastes those of another editor")
    command = PasteStates(automaton=request.automaton, content=content, x=request.x, y=request.y)
    return await change(workspace, request, OpenDocument.apply, command, by=window.number)


async def duplicate(workspace: Workspace, window: Window, request: p.Duplicate) -> a.Done:
    """Paste states beside themselves."""
    tab = workspace.tabs.editable(request.tab)
    content = await tab.edit(OpenDocument.copy, request.automaton, request.states, request.annotations)
    command = PasteStates(automaton=request.automaton, content=content, name=str(DUPLICATED))
    return await change(workspace, request, OpenDocument.apply, command, by=window.number)


async def add_ready(workspace: Workspace, window: Window, request: p.AddReady) -> a.Done:
    """Draw a state of the shelf."""
    return await change(
        workspace,
        request,
        OpenDocument.add_ready_state,
        id=request.state,
        automaton=request.automaton,
        x=request.x,
        y=request.y,
        origin=request.origin,
        trigger=request.trigger,
        name=request.name,
        language=window.language,
        by=window.number,
    )


async def put_on_shelf(workspace: Workspace, _: Window, request: p.PutOnShelf) -> a.Written:
    """Write states as a ready state of the project, and return the name of its file."""
    path = await workspace.tabs.get(request.tab).edit(
        OpenDocument.put_on_shelf,
        automaton=request.automaton,
        states=request.states,
        title=request.title,
        category=request.category,
        words=request.words,
        description=request.description,
    )
    return {"path": workspace.project.root.name(path)}


async def change(
    workspace: Workspace,
    request: TabEdit,
    work: Callable[Concatenate[OpenDocument, P], Change],
    *args: P.args,
    **kwargs: P.kwargs,
) -> a.Done:
    """Change a document, and return what is new."""
    return _done(await workspace.tabs.editable(request.tab).edit(work, *args, **kwargs))


async def undo(workspace: Workspace, window: Window, request: p.Undo) -> a.Undone:
    """Undo the last step, or what the window has typed at a place if others have changed something since."""
    own = _own(workspace, window, request.place)
    return await step(workspace, window, request, OpenDocument.undo, own)


async def redo(workspace: Workspace, window: Window, request: p.Redo) -> a.Undone:
    """Redo the step that was undone last."""
    own = _own(workspace, window, request.place)
    return await step(workspace, window, request, OpenDocument.redo, own)


def _own(workspace: Workspace, window: Window, place: Place | None) -> Own | None:
    return None if place is None else Own(window.number, place, workspace.windows.others(window))


async def step(
    workspace: Workspace,
    window: Window,
    request: TabEdit,
    work: Callable[Concatenate[OpenDocument, P], Change],
    *args: P.args,
    **kwargs: P.kwargs,
) -> a.Undone:
    """Undo or redo, and return what is new, with the changed place, which may be out of sight."""
    changed = await workspace.tabs.editable(request.tab).edit(work, *args, **kwargs)
    others = changed.by in workspace.windows.others(window)
    return {**_done(changed), "place": changed.place, "others": others, "own": changed.is_own}


def _done(change: Change) -> a.Done:
    done: a.Done = {"name": change.name, "revision": change.revision, "added": list(change.added)}
    return {**done, "conflict": True} if change.conflict else done
