"""One websocket of a window: requests come in, answers and pushes go out.

Requests that change documents are done in the order in which they come; the others (`CONCURRENT`) hold up
nobody. Help with code (`CODE_HELP`) is counted by itself, so that it never keeps a run out, and so is the
operator's stop, which nothing may keep out. A window that reads too slowly gets fewer pushes, which the other
windows do not feel.
"""

from __future__ import annotations

import asyncio
import logging
from collections import defaultdict
from collections.abc import Coroutine
from typing import Final

import msgspec
from starlette.websockets import WebSocket, WebSocketDisconnect

from .errors import kind_of
from .operations import CODE_HELP, CONCURRENT, Operations, is_emergency_stop
from .protocol import Answer, ErrorAnswer, Request, decode_request, request_id
from .window import Window
from .workspace import Workspace

__all__ = ["converse", "until_one_ends"]

_UNSUPPORTED_DATA: Final = 1003  # RFC 6455, section 7.4.1

_logger = logging.getLogger(__name__)


async def converse(websocket: WebSocket, workspace: Workspace) -> None:
    """Serve one window until it goes away."""
    await websocket.accept()
    window = Window(workspace.limits.output_lines)
    connection = _Connection(websocket, window, Operations(workspace, window), workspace)
    try:
        await until_one_ends(connection.read(), connection.write())
    except WebSocketDisconnect:
        pass
    finally:
        await connection.close()
        await workspace.leave(window)


async def until_one_ends(*work: Coroutine[object, object, None]) -> None:
    """Run all until one ends, and cancel the others; raises what the first one to fail raised."""
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
    def __init__(
        self, websocket: WebSocket, window: Window, operations: Operations, workspace: Workspace
    ) -> None:
        self._websocket = websocket
        self._window = window
        self._operations = operations
        self._limits = workspace.limits
        self._under_way: dict[str, set[asyncio.Task[None]]] = defaultdict(set)

    async def close(self) -> None:
        """End everything under way."""
        tasks = [task for tasks in self._under_way.values() for task in tasks]
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)
        self._operations.close()

    async def write(self) -> None:
        while True:
            for message in await self._window.next():
                await self._websocket.send_text(message.decode())

    async def read(self) -> None:
        while True:
            message = await self._websocket.receive()
            if message["type"] == "websocket.disconnect":
                return
            text = message.get("text")
            if text is None:
                await self._websocket.close(_UNSUPPORTED_DATA, "messages are text")
                return
            try:
                request = decode_request(text)
            except (msgspec.DecodeError, RecursionError, UnicodeError) as error:
                why = "it is nested too deeply" if isinstance(error, RecursionError) else str(error)
                refusal = ErrorAnswer(re=request_id(text), error=f"no request: {why}", kind="malformed")
                self._window.answer(refusal)
                continue
            if isinstance(request, CODE_HELP):
                self._begin(request, "code help")
            elif is_emergency_stop(request):
                self._begin(request, "stop")
            elif isinstance(request, CONCURRENT):
                self._begin(request, "others")
            else:
                await self._answer(request)

    def _begin(self, request: Request, kind: str) -> None:
        """Answer a request beside those of its kind that are under way, unless they are too many."""
        tasks = self._under_way[kind]
        if len(tasks) >= self._limits.concurrent_operations:
            error = "too many requests are under way"
            self._window.answer(ErrorAnswer(re=request.id, error=error, kind="busy"))
            return
        task = asyncio.create_task(self._answer(request), name=type(request).__name__)
        tasks.add(task)
        task.add_done_callback(tasks.discard)

    async def _answer(self, request: Request) -> None:
        try:
            async with asyncio.timeout(self._limits.operation_seconds):
                value = await self._operations.do(request)
            self._window.answer(Answer(re=request.id, ok=value))
        except Exception as error:
            kind, text = kind_of(error)
            if kind == "internal":
                _logger.error("the request %s failed", type(request).__name__, exc_info=error)
            self._window.answer(ErrorAnswer(re=request.id, error=text, kind=kind))
