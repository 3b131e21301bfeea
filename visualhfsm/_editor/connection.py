"""One websocket of a window: receive requests and execute them, send answers and pushes.

The table in `handlers` says which requests are executed in order, and which run beside them. The operator's
stop does not even wait until earlier requests were read. A window that reads too slowly gets fewer pushes;
other windows are not affected.
"""

from __future__ import annotations

import asyncio
import logging
import math
from collections import defaultdict
from collections.abc import Coroutine
from typing import Final

import msgspec
from starlette.websockets import WebSocket, WebSocketDisconnect

from codegen.messages import Message
from codegen.reasons import reason
from visualhfsm._base.errors import ErrorKind, VisualHfsmError

from . import protocol as p
from .handlers import HANDLERS, Lane
from .window import Window
from .workspace import Workspace

_UNSUPPORTED_DATA: Final = 1003  # RFC 6455, section 7.4.1
_SAVED: Final = 2.0  # s of requests that a viewer may save up
_REQUEST_SIZE: Final = 1000
"""Bytes that a request takes besides its text, more or less."""

_logger = logging.getLogger(__name__)


async def converse(
    websocket: WebSocket, workspace: Workspace, key: bytes = b"", *, is_viewer: bool = False
) -> None:
    """Serve one window until it is closed; `key` is that of its resumption.

    That of a viewer may ask only for what is `for_viewers`.
    """
    await websocket.accept()
    window = Window(workspace.limits.room_for_output, key, is_viewer=is_viewer)
    connection = _Connection(websocket, window, workspace)
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


class _Budget:
    """Let something happen at some rate, and after a pause what was saved up."""

    def __init__(self, rate: float) -> None:
        self._period = 1.0 / rate
        self._due = -math.inf

    async def spend(self) -> None:
        """Wait until it may happen once more; in any case, others have their turn."""
        now = asyncio.get_running_loop().time()
        self._due = max(self._due + self._period, now - _SAVED)
        await asyncio.sleep(max(0.0, self._due - now))


class _Connection:
    """Reads requests and executes them on the workspace; the answers go to the window."""

    def __init__(self, websocket: WebSocket, window: Window, workspace: Workspace) -> None:
        self._websocket = websocket
        self._window = window
        self._workspace = workspace
        self._limits = workspace.limits
        self._budget = _Budget(self._limits.viewer_requests) if window.is_viewer else None
        self._under_way: dict[Lane, set[asyncio.Task[None]]] = defaultdict(set)
        self._requests: asyncio.Queue[tuple[p.Request, int]] = asyncio.Queue()
        """Requests that wait for earlier ones, in their order, and the size of each."""
        self._waiting = 0
        """Their size together."""

    async def close(self) -> None:
        """Cancel all requests under way."""
        tasks = [task for tasks in self._under_way.values() for task in tasks]
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)

    async def read(self) -> None:
        """Read requests, until the window is closed."""
        while True:
            # A window that floods waits for itself alone: all others, and their stops, have their turn.
            await (asyncio.sleep(0) if self._budget is None else self._budget.spend())
            await self._window.room(self._limits.unsent_answers)
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
                self._refuse(p.request_id(text), Message.verbatim(f"not a request: {why}"), "malformed")
                continue
            if self._window.is_viewer and not HANDLERS[type(request)].for_viewers:
                self._refuse(request.id, Message("you look on, and cannot change anything here"), "forbidden")
                continue
            match HANDLERS[type(request)].lane:
                case Lane.AT_ONCE:
                    await self._answer(request)
                case Lane.STOP:
                    self._begin(request, Lane.STOP)
                case _ if self._waiting + (size := len(text) + _REQUEST_SIZE) > self._limits.waiting_bytes:
                    self._refuse(request.id, Message("too many requests are waiting"), "busy")
                case _:  # it waits for its turn; reading never waits, since a stop may come next
                    self._waiting += size
                    self._requests.put_nowait((request, size))

    async def work(self) -> None:
        """Execute the requests that were read, or begin to, in their order."""
        while True:
            request, size = await self._requests.get()
            self._waiting -= size
            lane = HANDLERS[type(request)].lane
            if lane is Lane.IN_ORDER:
                await self._answer(request)
            else:
                self._begin(request, lane)

    def _begin(self, request: p.Request, lane: Lane) -> None:
        """Answer a request concurrently, unless too many of its lane are under way."""
        tasks = self._under_way[lane]
        if len(tasks) >= self._limits.concurrent_operations:
            self._refuse(request.id, Message("too many requests are under way"), "busy")
            return
        task = asyncio.create_task(self._answer(request), name=type(request).__name__)
        tasks.add(task)
        task.add_done_callback(tasks.discard)

    async def _answer(self, request: p.Request) -> None:
        try:
            handler = HANDLERS[type(request)]
            async with asyncio.timeout(handler.limit or self._limits.operation_seconds):
                value = await handler.handle(self._workspace, self._window, request)
            self._window.answer(p.Answer(re=request.id, ok=value))
        except VisualHfsmError as error:
            self._refuse(request.id, reason(error), error.kind)
        except TimeoutError:
            self._refuse(request.id, Message("it took too long"), "timeout")
        except Exception:  # the page gets no details of an internal error
            _logger.exception("the request %s failed", type(request).__name__)
            message = Message("an internal error; the log of the editor has the details")
            self._refuse(request.id, message, "internal")

    def _refuse(self, request: int | None, error: Message, kind: ErrorKind) -> None:
        self._window.answer(p.ErrorAnswer(re=request, error=error, kind=kind))
