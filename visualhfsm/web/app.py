"""What is served under which path: the page, its websocket, and websockets that carry pictures.

Of pictures the newest one is sent whenever the page has drawn the last: the server sends one binary frame and
waits for a message, whatever it says, before it asks for the next. A window that draws slowly skips frames
instead of showing old ones.
"""

from __future__ import annotations

import asyncio
import contextlib
import logging
from collections.abc import AsyncGenerator, Callable, Iterable
from typing import Final

from starlette.applications import Starlette
from starlette.routing import Route, WebSocketRoute
from starlette.types import ASGIApp
from starlette.websockets import WebSocket, WebSocketDisconnect

from visualhfsm.services import ServiceError

from .assets import Assets
from .connection import converse, until_one_ends
from .security import Credentials, Guard
from .workspace import Workspace

__all__ = ["make_app"]

_NOT_AVAILABLE: Final = 4404  # an own code, RFC 6455, section 7.4.2
_LONGEST_REASON: Final = 60  # characters of up to 2 bytes; a reason has 123 bytes
_DRAW_LIMIT: Final = 60.0  # s that a window may take to draw a frame: hidden ones draw rarely

_logger = logging.getLogger(__name__)


def make_app(workspace: Workspace, credentials: Credentials, hosts: Iterable[str] = ()) -> ASGIApp:
    """Return the application of a workspace; everything in it stands behind the guard."""
    assets = Assets()
    live = workspace.services.live

    async def talk(websocket: WebSocket) -> None:
        await converse(websocket, workspace)

    async def camera(websocket: WebSocket) -> None:
        await _send_frames(websocket, lambda: live.camera(websocket.path_params["name"]))

    async def poses(websocket: WebSocket) -> None:
        await _send_frames(websocket, live.poses)

    app = Starlette(
        routes=[
            Route("/", assets.index),
            Route("/static/{version}/{path:path}", assets.file),
            WebSocketRoute("/ws", talk),
            WebSocketRoute("/camera/{name}", camera),
            WebSocketRoute("/poses", poses),
        ]
    )
    return Guard(app, credentials, hosts)


async def _send_frames(websocket: WebSocket, open_frames: Callable[[], AsyncGenerator[bytes, None]]) -> None:
    """Send frames until the window goes away or there are no more."""
    await websocket.accept()
    drawn = asyncio.Event()

    async def read() -> None:
        while (await websocket.receive())["type"] != "websocket.disconnect":
            drawn.set()

    async def send() -> None:
        async with contextlib.aclosing(open_frames()) as frames:
            async for frame in frames:
                drawn.clear()
                await websocket.send_bytes(frame)
                async with asyncio.timeout(_DRAW_LIMIT):
                    await drawn.wait()

    try:
        await until_one_ends(read(), send())
    except ServiceError as error:
        await _close(websocket, str(error)[:_LONGEST_REASON])
    except TimeoutError:
        _logger.debug("a window drew no picture for %g s", _DRAW_LIMIT)
        await _close(websocket, "no picture was drawn for too long")
    except WebSocketDisconnect:
        pass


async def _close(websocket: WebSocket, reason: str) -> None:
    with contextlib.suppress(RuntimeError):  # it is closed already
        await websocket.close(_NOT_AVAILABLE, reason)
