"""What each request does."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Final

from codegen.hfsm.document import Document
from visualhfsm.editing.commands import decode_command
from visualhfsm.editing.diff import diff_documents
from visualhfsm.editing.files import read_file
from visualhfsm.editing.fragments import parse_file
from visualhfsm.editing.imported import imported_views
from visualhfsm.editing.search import search
from visualhfsm.editing.templates import find_templates
from visualhfsm.editing.views import automaton_view

from . import protocol as p
from .documents import Documents
from .refusals import MissingError
from .uploads import Upload
from .window import Window
from .workspace import Workspace

__all__ = ["CODE_HELP", "CONCURRENT", "Operations", "is_emergency_stop"]

CODE_HELP = p.Complete | p.Explain | p.Interfaces | p.Lint | p.Signature
"""Requests that come by themselves while somebody types."""

CONCURRENT: Final = (
    CODE_HELP
    | p.Control
    | p.Diff
    | p.Export
    | p.Generate
    | p.Imported
    | p.ListFiles
    | p.Locate
    | p.Recording
    | p.Run
    | p.Search
    | p.StopRun
)
"""Requests that change no document: the connection goes on to the next one meanwhile."""

_SAVED: Final = "saved"  # what a document may be compared with, beside files

_FileRequest = (
    p.Open
    | p.New
    | p.OpenText
    | p.Recover
    | p.Discard
    | p.Close
    | p.Save
    | p.SaveAs
    | p.ListFiles
    | p.Resolve
)
_EditRequest = p.Do | p.Undo | p.Redo | p.Seal | p.Copy | p.Cut | p.Paste | p.Extract | p.Inline
_ReadRequest = p.Search | p.Diff | p.Export | p.Imported | p.Locate | CODE_HELP


def is_emergency_stop(request: p.Request) -> bool:
    """Whether a request is the operator's red button."""
    return isinstance(request, p.Control) and request.action == "emergencyStop"


class Operations:
    """The operations of one window on the workspace. Everything raises VisualHfsmError."""

    def __init__(self, workspace: Workspace, window: Window) -> None:
        self._workspace = workspace
        self._window = window
        self._documents = Documents(workspace)
        self._upload = Upload(workspace.workers)

    def close(self) -> None:
        """Give up what the window has begun to send."""
        self._upload.close()

    async def do(self, request: p.Request) -> object:
        """Do what a request asks for and return its answer."""
        if isinstance(request, p.Hello):
            return await self._greet()
        if isinstance(request, _FileRequest):
            return await self._files(request)
        if isinstance(request, _EditRequest):
            return await self._edit(request)
        if isinstance(request, _ReadRequest):
            return await self._read(request)
        return await self._run(request)

    async def _greet(self) -> dict[str, Any]:
        templates = await self._workspace.workers.do(find_templates)
        self._workspace.greet(self._window)
        return {
            "root": str(self._workspace.root.directory),
            "templates": [{"name": each.name, "description": each.description} for each in templates],
        }

    async def _files(self, request: _FileRequest) -> object:
        documents = self._documents
        match request:
            case p.Open(path=path):
                return await documents.open(path)
            case p.New(template=template):
                return await documents.new(template)
            case p.OpenText(name=name, text=text):
                return await documents.open_text(name, text)
            case p.Recover(journal=journal):
                return await documents.recover(journal)
            case p.Discard(journal=journal):
                await documents.discard(journal)
                return None
            case p.Close(tab=tab, discard=discard):
                await documents.close(tab, discard=discard)
                return None
            case p.Save(tab=tab, overwrite=overwrite):
                return await documents.save(tab, overwrite=overwrite)
            case p.SaveAs(tab=tab, path=path, overwrite=overwrite):
                return await documents.save_as(tab, path, overwrite=overwrite)
            case p.ListFiles(directory=directory):
                return await documents.list_files(directory)
            case p.Resolve(tab=tab, choice=choice):
                return await documents.resolve(tab, choice)

    async def _edit(self, request: _EditRequest) -> object:
        tab = self._workspace.tab(request.tab)
        match request:
            case p.Do(command=command):
                return await tab.do(decode_command(command))
            case p.Undo(steps=steps):
                return await tab.undo(steps)
            case p.Redo(steps=steps):
                return await tab.redo(steps)
            case p.Seal():
                await tab.seal()
                return None
            case p.Copy(automaton=automaton, states=states):
                self._keep(await tab.copy(automaton, states), states)
                return None
            case p.Cut(automaton=automaton, states=states):
                text, change = await tab.cut(automaton, states)
                self._keep(text, states)
                return change
            case p.Paste(automaton=automaton, x=x, y=y):
                if not self._workspace.clipboard:
                    raise MissingError("nothing was copied yet")
                return await tab.paste(self._workspace.clipboard, automaton, x, y)
            case p.Extract(automaton=automaton, path=path):
                return await tab.extract(automaton, self._workspace.root.document(path))
            case p.Inline(automaton=automaton):
                return await tab.inline(automaton)

    def _keep(self, text: str, states: list[int]) -> None:
        self._workspace.clipboard = text
        self._workspace.copied_states = len(states)
        self._workspace.tell()

    async def _read(self, request: _ReadRequest) -> object:
        code_help = self._workspace.services.code_help
        match request:
            case p.Search():
                return await self._search(request)
            case p.Diff(tab=tab, against=against):
                return await self._diff(tab, against)
            case p.Export(tab=tab):
                exported = self._workspace.tab(tab)
                return {"name": f"{exported.shown.name}.xml", "text": await exported.text()}
            case p.Imported(tab=tab):
                shown = self._workspace.tab(tab).shown
                if shown.path is None:
                    return []  # imports are relative to the file
                path = shown.path
                return await self._workspace.workers.do(lambda: imported_views(shown.document, path))
            case p.Locate(tab=tab, text=text, automaton=automaton, state=state):
                source = self._workspace.tab(tab).source
                return await self._workspace.services.running.locate(source, text, automaton, state)
            case p.Complete(tab=tab, place=place, code=code, line=line, column=column):
                source = self._workspace.tab(tab).source
                return await code_help.complete(source, place, code, line, column)
            case p.Explain(tab=tab, place=place, code=code, line=line, column=column):
                source = self._workspace.tab(tab).source
                return await code_help.explain(source, place, code, line, column)
            case p.Signature(tab=tab, place=place, code=code, line=line, column=column):
                source = self._workspace.tab(tab).source
                return await code_help.signature(source, place, code, line, column)
            case p.Lint(tab=tab, place=place, code=code):
                return await code_help.lint(self._workspace.tab(tab).source, place, code)
            case p.Interfaces():
                return await code_help.interfaces()

    async def _search(self, request: p.Search) -> list[dict[str, Any]]:
        workspace = self._workspace
        tabs = workspace.tabs if request.tab is None else [workspace.tab(request.tab)]
        documents = [(tab.id, tab.shown.document) for tab in tabs]

        def look() -> list[dict[str, Any]]:
            return [
                {
                    "tab": number,
                    "hits": search(
                        document,
                        request.text,
                        match_case=request.match_case,
                        whole_words=request.whole_words,
                    ),
                }
                for number, document in documents
            ]

        return await workspace.workers.do(look)

    async def _diff(self, number: int, against: str) -> object:
        workspace = self._workspace
        tab = workspace.tab(number)
        after = tab.shown.document
        if against == _SAVED:
            before = await tab.saved_document()
            if before is None:
                raise MissingError(f"{tab.shown.name} was never saved")
            return await workspace.workers.do(lambda: _compared(before, after))
        path = workspace.root.document(against)
        return await workspace.workers.do(lambda: _compared(_read(path), after))

    async def _run(
        self,
        request: p.Generate
        | p.Run
        | p.StopRun
        | p.Attach
        | p.Detach
        | p.Control
        | p.Recording
        | p.SendRecording,
    ) -> object:
        workspace = self._workspace
        running, live = workspace.services.running, workspace.services.live
        match request:
            case p.Generate(tab=tab):
                return await running.generate(workspace.tab(tab).source)
            case p.Run(tab=tab, arguments=arguments):
                return await running.run(workspace.tab(tab).source, arguments)
            case p.StopRun(tab=tab):
                return await running.stop(tab)
            case p.Attach(component=component):
                return await workspace.follow(self._window, component)
            case p.Detach(component=component):
                await workspace.unfollow(self._window, component)
                return None
            case p.Control(component=component, action=action, arguments=values):
                return await live.control(component, action, values)
            case p.Recording(path=path):
                return await workspace.look_at(self._window, workspace.root.recording(path))
            case p.SendRecording(name=name, data=data, begins=begins, ends=ends):
                await self._upload.add(name, data, begins=begins)
                if not ends:
                    return None
                with self._upload.whole() as sent:
                    return await workspace.look_at(self._window, sent)


def _compared(before: Document, after: Document) -> dict[str, Any]:
    """Return what differs, and the former automata of it, so that what is gone can be drawn."""
    differences = diff_documents(before, after)
    affected = {each.place.automaton for each in differences}
    return {
        "differences": differences,
        "before": [automaton_view(each) for each in before.automata if each.id in affected],
    }


def _read(path: Path) -> Document:
    return parse_file(read_file(path)[0], path)
