"""One websocket of a window: receive requests and execute them, send answers and pushes.

Requests that change documents are executed in order; the others (`CONCURRENT`) run beside them. Help with
code (`CODE_HELP`) has a separate limit, so that it never blocks a run; so have `stopRun`, and the operator's
stop, which nothing may block: it does not even wait until earlier requests were executed. A window that reads
too slowly gets fewer pushes; other windows are not affected.
"""

from __future__ import annotations

import asyncio
import logging
from collections import defaultdict
from collections.abc import Coroutine
from functools import partial
from itertools import islice
from typing import Any, Final

import msgspec
from starlette.websockets import WebSocket, WebSocketDisconnect

from codegen.hfsm.document import Document
from visualhfsm.editing.commands.paste import PasteStates
from visualhfsm.editing.diff import Difference, changed_lines, diff_documents
from visualhfsm.editing.places import search
from visualhfsm.editing.serialization import copy_states, parse_file
from visualhfsm.editing.views import view
from visualhfsm.errors import ErrorKind, MissingError, VisualHfsmError
from visualhfsm.robots import find_worlds
from visualhfsm.services import Simulation
from visualhfsm.sessions.files import read_file
from visualhfsm.sessions.imports import extract, inline
from visualhfsm.sessions.session import Change, Choice, DocumentSession
from visualhfsm.sessions.templates import find_templates

from . import documents
from . import protocol as p
from .window import Window
from .workspace import Workspace

_UNSUPPORTED_DATA: Final = 1003  # RFC 6455, section 7.4.1

CODE_HELP = p.CodeHelp | p.Interfaces
"""Requests that the page sends while code is typed."""

_Reading = p.Diff | p.Export | p.ExportRun | p.Imported | p.ListFiles | p.Locate | p.Search
_Robot = p.ConnectRobot | p.EndRobot | p.MoveBalls | p.Simulate
_Running = p.Attach | p.Control | p.Detach | p.Generate | p.Record | p.Recording | p.Run | p.StopRun

CONCURRENT = CODE_HELP | _Reading | _Robot | p.Control | p.Generate | p.Recording | p.Run | p.StopRun
"""Requests that change no document: the connection reads the next one meanwhile."""

_MOST_LINES: Final = 200  # lines of the difference of a text
_SAVED: Final = "saved"  # a document may be compared with this instead of a file

_logger = logging.getLogger(__name__)


async def converse(websocket: WebSocket, workspace: Workspace, key: bytes) -> None:
    """Serve one window until it is closed; `key` is that of its resumption."""
    await websocket.accept()
    window = Window(workspace.limits.room_for_output)
    connection = _Connection(websocket, window, workspace, key)
    try:
        await until_one_ends(connection.read(), connection.work(), window.write(websocket.send_text))
    except WebSocketDisconnect:
        pass
    finally:
        await connection.close()
        await workspace.leave(window)


async def until_one_ends(*work: Coroutine[object, object, None]) -> None:
    """Run all until one ends, then cancel the others; raises the first exception of any."""
    tasks = [asyncio.create_task(each) for each in work]
    try:
        await asyncio.wait(tasks, return_when=asyncio.FIRST_COMPLETED)
    finally:
        for task in tasks:
            task.cancel()
        results = await asyncio.gather(*tasks, return_exceptions=True)
    for result in results:
        if isinstance(result, Exception):
            raise result


class _Connection:
    """Reads requests and executes them on the workspace; the answers go to the window."""

    def __init__(self, websocket: WebSocket, window: Window, workspace: Workspace, key: bytes) -> None:
        self._websocket = websocket
        self._key = key
        self._window = window
        self._workspace = workspace
        self._limits = workspace.limits
        self._under_way: dict[str, set[asyncio.Task[None]]] = defaultdict(set)
        self._requests: asyncio.Queue[p.Request] = asyncio.Queue(self._limits.concurrent_operations)
        """Requests that were read, in their order; when it is full, no more are read."""

    async def close(self) -> None:
        """Cancel all requests under way."""
        tasks = [task for tasks in self._under_way.values() for task in tasks]
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)

    async def read(self) -> None:
        """Read requests, until the window is closed."""
        while True:
            message = await self._websocket.receive()
            if message["type"] == "websocket.disconnect":
                return
            text = message.get("text")
            if text is None:
                await self._websocket.close(_UNSUPPORTED_DATA, "messages must be text")
                return
            try:
                request = p.decode_request(text)
            except (msgspec.DecodeError, RecursionError, UnicodeError) as error:
                why = "it is nested too deeply" if isinstance(error, RecursionError) else str(error)
                self._refuse(p.request_id(text), f"not a request: {why}", "malformed")
                continue
            if isinstance(request, p.OutputShown):
                self._window.output_shown()
                self._window.answer(p.Answer(re=request.id))
            elif isinstance(request, p.Control) and request.action == "emergencyStop":
                self._begin(request, "stop")
            else:
                await self._requests.put(request)

    async def work(self) -> None:
        """Execute the requests that were read, or begin to, in their order."""
        while True:
            request = await self._requests.get()
            if isinstance(request, CODE_HELP):
                self._begin(request, "code help")
            elif isinstance(request, p.StopRun):
                self._begin(request, "stop of a run")
            elif isinstance(request, CONCURRENT):
                self._begin(request, "others")
            else:
                await self._answer(request)

    def _begin(self, request: p.Request, kind: str) -> None:
        """Answer a request concurrently, unless too many of its kind are under way."""
        tasks = self._under_way[kind]
        if len(tasks) >= self._limits.concurrent_operations:
            self._refuse(request.id, "too many requests are under way", "busy")
            return
        task = asyncio.create_task(self._answer(request), name=type(request).__name__)
        tasks.add(task)
        task.add_done_callback(tasks.discard)

    async def _answer(self, request: p.Request) -> None:
        try:
            async with asyncio.timeout(self._limits.operation_seconds):
                value = await self._do(request)
            self._window.answer(p.Answer(re=request.id, ok=value))
        except VisualHfsmError as error:
            self._refuse(request.id, str(error), error.kind)
        except TimeoutError:
            self._refuse(request.id, "it took too long", "timeout")
        except Exception:  # the page gets no details of an internal error
            _logger.exception("the request %s failed", type(request).__name__)
            self._refuse(request.id, "an internal error; the log of the editor has the details", "internal")

    def _refuse(self, request: int | None, error: str, kind: ErrorKind) -> None:
        self._window.answer(p.ErrorAnswer(re=request, error=error, kind=kind))

    async def _do(self, request: p.Request) -> object:
        """Execute a request and return its answer. Raises VisualHfsmError."""
        match request:
            case p.Do(tab=tab, command=command, base=base):
                return _outcome(await self._workspace.editable(tab).edit(DocumentSession.do, command, base))
            case p.TabEdit():
                return await self._edit(request)
            case p.CodeHelp(tab=tab, wanted=wanted, place=place, code=code, line=line, column=column):
                source = self._workspace.tab(tab).shown
                return await self._workspace.services.code_help.ask(
                    wanted, source, place, code, line=line, column=column
                )
            case p.Interfaces():
                return await self._workspace.services.code_help.interfaces(self._workspace.root.directory)
            case _ if isinstance(request, _Reading):
                return await self._read(request)
            case _ if isinstance(request, _Running):
                return await self._run(request)
            case _ if isinstance(request, _Robot):
                await self._change_robot(request)
                return None
        return await self._manage(request)

    async def _edit(self, request: p.TabEdit) -> object:
        """Change a document; most answers say which step it was and what is new."""
        workspace = self._workspace
        find = workspace.tab if isinstance(request, p.Copy) else workspace.editable
        tab = find(request.tab)
        match request:
            case p.Undo():
                return await tab.edit(lambda session: _step(session.undo()))
            case p.Redo():
                return await tab.edit(lambda session: _step(session.redo()))
            case p.GoTo(revision=revision):
                return await tab.edit(lambda session: _step(session.go_to(revision)))
            case p.Copy(automaton=automaton, states=states):
                text = await tab.edit(lambda session: copy_states(session.document, automaton, states))
                workspace.clipboard = text
                return {"text": text}
            case p.Cut(automaton=automaton, states=states):
                text, change = await tab.edit(DocumentSession.cut, automaton, tuple(states))
                workspace.clipboard = text
                return {**_outcome(change), "text": text}
            case p.Paste(automaton=automaton, x=x, y=y):
                if not workspace.clipboard:
                    raise MissingError("no states were copied here: Ctrl+V pastes those of another editor")
                paste = PasteStates(automaton=automaton, content=workspace.clipboard, x=x, y=y)
                return _outcome(await tab.edit(DocumentSession.do, paste))
            case p.Extract(automaton=automaton, path=path):
                file = workspace.root.document(path)
                change = await tab.edit(lambda it: it.do(extract(it.document, automaton, it.path, file)))
                return _outcome(change)
            case p.Inline(automaton=automaton):
                return _outcome(await tab.edit(lambda it: it.do(inline(it.document, automaton, it.path))))
        raise NotImplementedError(type(request).__name__)

    async def _read(self, request: _Reading) -> object:
        """Answer a question about documents and files."""
        workspace = self._workspace
        match request:
            case p.Search():
                return await self._search(request)
            case p.Diff(tab=number, against=against):
                return await self._diff(number, against)
            case p.Export(tab=number):
                tab = workspace.tab(number)
                text = await tab.edit(DocumentSession.text)
                return {"name": f"{tab.shown.title}.xml", "text": text}
            case p.ExportRun(component=component, tab=number):
                return await documents.export_run(workspace, component, number)
            case p.Imported(tab=number):
                return await documents.imported(workspace, number)
            case p.ListFiles(directory=directory):
                return await documents.list_files(workspace, directory)
            case p.Locate(tab=number, text=text, automaton=automaton, state=state):
                source = workspace.tab(number).shown
                return await workspace.services.running.locate(source, text, automaton, state)

    async def _run(self, request: _Running) -> object:
        """Generate, run, follow and steer components."""
        workspace, window = self._workspace, self._window
        running = workspace.services.running
        match request:
            case p.Generate(tab=tab):
                return await workspace.generate(workspace.tab(tab))
            case p.Run(tab=tab, arguments=arguments, record=record, trial=trial):
                return await workspace.run(workspace.tab(tab), arguments, record=record, trial=trial)
            case p.StopRun(tab=tab):
                return await running.stop(tab)
            case p.Attach(component=component):
                return await workspace.follow(window, component)
            case p.Detach(component=component):
                await workspace.unfollow(window, component)
                return None
            case p.Control(action="emergencyStop"):
                return await workspace.emergency_stop()
            case p.Control(component=component, action=action, arguments=values):
                return await workspace.control(component, action, values)
            case p.Record(component=component, pictures=pictures):
                return await workspace.record(component, pictures)
            case p.Recording(path=path):
                return await documents.open_recording(workspace, window, workspace.root.recording(path))

    async def _change_robot(self, request: _Robot) -> None:
        """Start and end the robot."""
        robots = self._workspace.services.robots
        match request:
            case p.Simulate(world=world, speed=speed, balls=balls, body=body):
                await robots.simulate(Simulation(world=world, speed=speed, balls=balls, body=body))
            case p.ConnectRobot(address=address, start=start):
                self._workspace.require_rest()
                await robots.connect(address, start)
            case p.MoveBalls(moving=moving):
                await robots.move_balls(moving=moving)
            case p.EndRobot():
                await robots.end()

    async def _manage(self, request: p.Request) -> object:
        """Open, save and close documents."""
        workspace = self._workspace
        match request:
            case p.Hello():
                templates = await workspace.threads.do(find_templates)
                workspace.greet(self._window)
                return {
                    "root": str(workspace.root.directory),
                    "templates": [{"name": each.name, "description": each.description} for each in templates],
                    "worlds": await workspace.threads.do(find_worlds),
                    "demo": workspace.begin_demo(),
                    "run": workspace.run_id,
                    "key": self._key.hex(),
                }
            case p.Open(path=path):
                return await documents.open_file(workspace, path)
            case p.New(template=template):
                return await documents.new(workspace, template)
            case p.OpenText(name=name, text=text):
                return await documents.open_text(workspace, name, text)
            case p.Recover(journal=journal):
                return await documents.recover(workspace, journal)
            case p.Discard(journal=journal):
                await documents.discard(workspace, journal)
                return None
            case p.Close(tab=tab, discard=discard):
                await documents.close(workspace, tab, discard=discard)
                return None
            case p.Save(tab=tab, overwrite=overwrite):
                return await documents.save(workspace, tab, overwrite=overwrite)
            case p.SaveAs(tab=tab, path=path, overwrite=overwrite):
                return await documents.save(workspace, tab, path, overwrite=overwrite)
            case p.Resolve(tab=tab, choice=choice):
                return await documents.resolve(workspace, tab, Choice(choice))
        raise NotImplementedError(type(request).__name__)

    async def _search(self, request: p.Search) -> list[dict[str, Any]]:
        workspace = self._workspace
        tabs = workspace.tabs if request.tab is None else [workspace.tab(request.tab)]
        shown = [(tab.id, tab.shown.document) for tab in tabs]
        text, whole = request.text, request.whole
        return await workspace.threads.do(
            lambda: [{"tab": number, "hits": search(each, text, whole=whole)} for number, each in shown]
        )

    async def _diff(self, number: int, against: str) -> object:
        workspace = self._workspace
        tab = workspace.tab(number)
        if against == _SAVED:
            before = await tab.edit(lambda session: session.saved_document)
            if before is None:
                raise MissingError(f"{tab.shown.title} was never saved")
        else:
            path = workspace.root.document(against)
            other = workspace.tab_of(path)
            if other is None or other is tab:
                before = await workspace.threads.do(lambda: parse_file(read_file(path)[0], path))
            else:
                before = other.shown.document
        return await workspace.threads.do(partial(_compared, before, tab.shown.document))


def _outcome(change: Change) -> dict[str, Any]:
    outcome = {"name": change.name, "revision": change.revision, "added": list(change.added)}
    return {**outcome, "conflict": True} if change.conflict else outcome


def _step(change: Change) -> dict[str, Any]:
    """Return the outcome of undoing or redoing, with the changed place, which may be out of sight."""
    return {**_outcome(change), "place": change.place}


def _compared(before: Document, after: Document) -> dict[str, Any]:
    """Return the differences, with the former automata, so that removed elements can be drawn."""
    differences = diff_documents(before, after)
    affected = {each.place.automaton for each in differences}
    return {
        "differences": [_with_lines(each) for each in differences],
        "before": [view(each) for each in before.automata if each.id in affected],
    }


def _with_lines(difference: Difference) -> dict[str, Any]:
    """Return a difference with the lines that differ in it."""
    shown: dict[str, Any] = msgspec.to_builtins(difference)
    if lines := [*islice(changed_lines(difference), _MOST_LINES)]:
        shown["lines"] = lines
    return shown
