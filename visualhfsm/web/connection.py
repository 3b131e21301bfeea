"""One websocket of a window: requests come in, answers and pushes go out.

Requests that change documents are done in the order in which they come; the others (`CONCURRENT`) hold up
nobody. Help with code (`CODE_HELP`) is counted by itself, so that it never keeps a run out, and so is the
operator's stop, which nothing must keep out. A window that sends too much is read more slowly, and one that
reads too slowly gets fewer pushes: neither is felt by the other windows.
"""

from __future__ import annotations

import asyncio
import logging
from typing import Final

import msgspec
from starlette.websockets import WebSocket, WebSocketDisconnect

from .limits import Limits, TokenBucket
from .operations import CODE_HELP, CONCURRENT, Operations, is_emergency_stop
from .outbox import Outbox
from .protocol import Answer, ErrorAnswer, Request, decode_request, encode, request_id
from .refusals import kind_of
from .tasks import until_one_ends
from .window import Window
from .workspace import Workspace

__all__ = ["converse"]

_UNSUPPORTED_DATA: Final = 1003  # RFC 6455, section 7.4.1

_logger = logging.getLogger(__name__)


async def converse(websocket: WebSocket, workspace: Workspace) -> None:
    """Serve one window until it goes away."""
    await websocket.accept()
    limits = workspace.limits
    outbox = Outbox(limits.output_lines)
    window = Window(outbox)
    operations = Operations(workspace, window)
    conversation = _Conversation(websocket, outbox, operations, limits)
    try:
        await conversation.hold()
    finally:
        operations.close()
        await workspace.leave(window)


class _Conversation:
    def __init__(self, websocket: WebSocket, outbox: Outbox, operations: Operations, limits: Limits) -> None:
        self._websocket = websocket
        self._outbox = outbox
        self._operations = operations
        self._limits = limits
        self._under_way: set[asyncio.Task[None]] = set()
        self._helping: set[asyncio.Task[None]] = set()
        self._stopping: set[asyncio.Task[None]] = set()

    async def hold(self) -> None:
        """Read and write until one of both ends, then end everything under way."""
        try:
            await until_one_ends(self._read(), self._write())
        except WebSocketDisconnect:
            pass
        finally:
            under_way = self._under_way | self._helping | self._stopping
            for task in under_way:
                task.cancel()
            await asyncio.gather(*under_way, return_exceptions=True)

    async def _write(self) -> None:
        while True:
            for message in await self._outbox.next():
                await self._websocket.send_text(message.decode())

    async def _read(self) -> None:
        bucket = TokenBucket(self._limits.messages_per_second, self._limits.message_burst)
        while True:
            message = await self._websocket.receive()
            if message["type"] == "websocket.disconnect":
                return
            text = message.get("text")
            if text is None:
                await self._websocket.close(_UNSUPPORTED_DATA, "messages are text")
                return
            await self._handle(text)
            if (pause := bucket.take()) > 0:
                await asyncio.sleep(pause)

    async def _handle(self, text: str) -> None:
        try:
            request = decode_request(text)
        except (msgspec.DecodeError, RecursionError, UnicodeError) as error:
            reason = "it is nested too deeply" if isinstance(error, RecursionError) else str(error)
            refusal = ErrorAnswer(re=request_id(text), error=f"no request: {reason}", kind="malformed")
            self._outbox.answer(encode(refusal))
            return
        if isinstance(request, CODE_HELP):
            self._begin(request, self._helping)
        elif is_emergency_stop(request):
            self._begin(request, self._stopping)
        elif isinstance(request, CONCURRENT):
            self._begin(request, self._under_way)
        else:
            await self._answer(request)

    def _begin(self, request: Request, under_way: set[asyncio.Task[None]]) -> None:
        """Answer a request beside those that are under way, unless they are too many."""
        if len(under_way) >= self._limits.concurrent_operations:
            busy = ErrorAnswer(re=request.id, error="too many requests are under way", kind="busy")
            self._outbox.answer(encode(busy))
            return
        task = asyncio.create_task(self._answer(request), name=type(request).__name__)
        under_way.add(task)
        task.add_done_callback(under_way.discard)

    async def _answer(self, request: Request) -> None:
        try:
            async with asyncio.timeout(self._limits.operation_seconds):
                value = await self._operations.do(request)
            message = encode(Answer(re=request.id, ok=value))
        except Exception as error:
            kind, text = kind_of(error)
            if kind == "internal":
                _logger.error("the request %s failed", type(request).__name__, exc_info=error)
            message = encode(ErrorAnswer(re=request.id, error=text, kind=kind))
        self._outbox.answer(message)
