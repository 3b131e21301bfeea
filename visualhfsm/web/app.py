"""What is served under which path."""

from __future__ import annotations

from collections.abc import Awaitable, Callable, Iterable
from typing import Final

from starlette.applications import Starlette
from starlette.routing import Route, WebSocketRoute
from starlette.types import ASGIApp
from starlette.websockets import WebSocket

from .assets import Assets
from .connection import converse
from .frames import send_frames
from .security import Credentials, Guard
from .workspace import Workspace

__all__ = ["make_app"]

_TRY_AGAIN_LATER: Final = 1013  # registered with IANA beside those of RFC 6455


def make_app(workspace: Workspace, credentials: Credentials, hosts: Iterable[str] = ()) -> ASGIApp:
    """Return the application of a workspace; everything in it stands behind the guard."""
    assets = Assets()
    live = workspace.services.live
    limited = _limited(workspace.limits.sockets)

    async def talk(websocket: WebSocket) -> None:
        await converse(websocket, workspace)

    async def camera(websocket: WebSocket) -> None:
        await send_frames(websocket, lambda: live.camera(websocket.path_params["name"]))

    async def scene(websocket: WebSocket) -> None:
        await send_frames(websocket, live.scene)

    app = Starlette(
        routes=[
            Route("/", assets.index),
            Route("/static/{version}/{path:path}", assets.file),
            WebSocketRoute("/ws", limited(talk)),
            WebSocketRoute("/camera/{name}", limited(camera)),
            WebSocketRoute("/scene", limited(scene)),
        ]
    )
    return Guard(app, credentials, hosts)


Handler = Callable[[WebSocket], Awaitable[None]]


def _limited(sockets: int) -> Callable[[Handler], Handler]:
    """Return a decorator that lets through so many websockets at a time, of all handlers together."""
    opened = 0

    def decorate(handle: Handler) -> Handler:
        async def handle_limited(websocket: WebSocket) -> None:
            nonlocal opened
            if opened >= sockets:
                # Accepted first: a browser does not tell its page why a handshake failed.
                await websocket.accept()
                await websocket.close(_TRY_AGAIN_LATER, "too many windows are open")
                return
            opened += 1
            try:
                await handle(websocket)
            finally:
                opened -= 1

        return handle_limited

    return decorate
