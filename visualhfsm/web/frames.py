"""Websockets that carry pictures: the newest one whenever the page has drawn the last.

The server sends one binary frame and waits for a message, whatever it says, before it asks for the next. So a
window that draws slowly skips frames instead of seeing old ones.
"""

from __future__ import annotations

import asyncio
import contextlib
import logging
from collections.abc import AsyncGenerator, Callable
from typing import Final

from starlette.websockets import WebSocket, WebSocketDisconnect

from .services import ServiceError
from .tasks import until_one_ends

__all__ = ["send_frames"]

_NOT_AVAILABLE: Final = 4404  # an own code, RFC 6455, section 7.4.2
_LONGEST_REASON: Final = 60  # characters of up to 2 bytes; a reason has 123 bytes
_PATIENCE: Final = 60.0  # s that a window may take to draw a frame: hidden ones draw rarely

_logger = logging.getLogger(__name__)


async def send_frames(websocket: WebSocket, open_frames: Callable[[], AsyncGenerator[bytes, None]]) -> None:
    """Send frames until the window goes away or there are no more."""
    await websocket.accept()
    drawn = asyncio.Event()
    try:
        frames = open_frames()
        await until_one_ends(_read(websocket, drawn), _send(websocket, frames, drawn))
    except ServiceError as error:
        await _close(websocket, str(error)[:_LONGEST_REASON])
    except TimeoutError:
        _logger.debug("a window drew no picture for %g s", _PATIENCE)
        await _close(websocket, "no picture was drawn for too long")
    except WebSocketDisconnect:
        pass


async def _send(websocket: WebSocket, frames: AsyncGenerator[bytes, None], drawn: asyncio.Event) -> None:
    async with contextlib.aclosing(frames):
        async for frame in frames:
            drawn.clear()
            await websocket.send_bytes(frame)
            async with asyncio.timeout(_PATIENCE):
                await drawn.wait()


async def _read(websocket: WebSocket, drawn: asyncio.Event) -> None:
    while (await websocket.receive())["type"] != "websocket.disconnect":
        drawn.set()


async def _close(websocket: WebSocket, reason: str) -> None:
    with contextlib.suppress(RuntimeError):  # it is closed already
        await websocket.close(_NOT_AVAILABLE, reason)
