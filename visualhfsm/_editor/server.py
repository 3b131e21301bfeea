"""The server: its routes, its socket and address, its orderly end.

The newest image is sent whenever the page has drawn the last one: the server sends one binary frame and waits
for any message before it takes the next. A window that draws slowly skips frames instead of showing old ones.
"""

from __future__ import annotations

import asyncio
import contextlib
import errno
import logging
import os
import secrets
import socket
import stat
import threading
from collections.abc import AsyncGenerator, Awaitable, Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final, Literal

import uvicorn
from starlette.applications import Starlette
from starlette.routing import Route, WebSocketRoute
from starlette.types import ASGIApp
from starlette.websockets import WebSocket, WebSocketDisconnect
from uvicorn.protocols.websockets.websockets_sansio_impl import WebSocketsSansIOProtocol
from websockets.exceptions import InvalidState

from codegen.messages import Message
from codegen.reasons import reason
from visualhfsm._base.errors import TooManyError, VisualHfsmError
from visualhfsm._base.languages import encoder, known_language, said
from visualhfsm.project._editing.journal import journal_directory
from visualhfsm.project._project import Project
from visualhfsm.project._root import RECORDING_SUFFIX
from zenoh_ice.application.cli import stop_on_signals

from .assets import page_assets
from .connection import converse, until_one_ends
from .documents import open_file
from .launch import LaunchPage
from .limits import Limits
from .parts import MakeParts, Parts
from .protocol import Answer
from .refusal import RefusalLog
from .resumption import Resumption, kept_key
from .security import STOP, Boundary, Credentials, Guard
from .site import Site
from .viewers import VIEW
from .workspace import Workspace

LOOPBACK: Final = "127.0.0.1"

_READ_TOGETHER: Final = 1 << 14  # bytes of a websocket, or twice as many
_CLOSE_LIMIT: Final = 3  # s that answers under way may take at the end
_PING_INTERVAL: Final = 20.0  # s
_POLL_INTERVAL: Final = 0.1  # s, of looks whether a signal has come
_END_INTERVAL: Final = 0.005  # s, of looks whether what ends has ended
_TURNS: Final = 4  # of the event loop, in which an accepted connection is made
_TRY_LATER: Final = 1013  # registered with IANA
_NOT_AVAILABLE: Final = 4404  # an own code, RFC 6455, section 7.4.2
_LONGEST_REASON: Final = 60  # characters of up to 2 bytes; a reason has 123 bytes
_DRAW_LIMIT: Final = 60.0  # s that a window may take to draw a frame: hidden ones draw rarely

Occasion = Literal["started", "used"]
"""Why there is a new address: the page can be opened, or a browser has come in by the former address."""
Report = Callable[[Occasion, str], None]
"""Shows the user an address, which lets one browser in."""

_logger = logging.getLogger(__name__)


class PortInUseError(VisualHfsmError):
    """The port is not free."""

    def __init__(self, port: int, reason: str) -> None:
        super().__init__(
            Message(
                "cannot listen on port {port} of {loopback} ({reason}); choose another with --port, or none",
                port=port,
                loopback=LOOPBACK,
                reason=reason,
            )
        )


class SocketError(VisualHfsmError):
    """The page cannot be served at a Unix socket."""

    def __init__(self, path: Path, reason: str) -> None:
        super().__init__(
            Message("cannot listen at the socket {path}: {reason}", path=str(path), reason=reason)
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class Options:
    """Options: the `files` to open, the `port` (0 lets the system pick) and the names of the machine.

    A recording among the `files` is shown by the first window.
    Opening, saving and listing are confined to `root`, apart from `files`. `hosts` are names, beside those of
    loopback, under which a reverse proxy serves the page, below `base_path`; with `trust_proxy`, the server
    believes its headers `X-Forwarded-Host` and `X-Forwarded-Proto`. With a `socket` instead of a port, in a
    folder of the user alone, nobody needs a token: a proxy of the same user has to check who comes, under
    whichever name. `journals` is where unsaved changes are kept, by
    default the user's directory of journals. `include` are directories with packages of interfaces. With
    `demo`, the first window runs a behavior on a simulated robot, unless a document or a robot is there.
    """

    make_parts: MakeParts
    files: Sequence[Path] = ()
    root: Path = field(default_factory=Path.cwd)
    port: int = 0
    hosts: Sequence[str] = ()
    base_path: str = "/"
    trust_proxy: bool = False
    socket: Path | None = None
    limits: Limits = field(default_factory=Limits)
    journals: Path | None = None
    include: Sequence[Path] = ()
    demo: bool = False


class Server:
    """A server of the editor, listening from the start; `serve` it in an event loop, then `close` it."""

    def __init__(
        self, options: Options, stopping: threading.Event | None = None, report: Report = lambda *_: None
    ) -> None:
        """Listen; the server ends when `stopping` is set.

        Raises PortInUseError, SocketError, BasePathError.
        """
        self._options = options
        hosts = options.hosts if options.socket is None else None
        self._site = Site(options.base_path, hosts, trusts_proxy=options.trust_proxy)
        self._listener = _listen(options.port) if options.socket is None else _listen_at(options.socket)
        self.port: int = 0 if options.socket else self._listener.getsockname()[1]
        self.credentials = Credentials(self.port, Resumption(self._key()))
        self._stopping = stopping or threading.Event()
        self._wake: Callable[[], None] = lambda: None
        self._report = report

    def _key(self) -> bytes:
        """Return the key by which pages are let in again after a restart on the same port."""
        if not self._options.port:
            return secrets.token_bytes(32)
        journals = self._options.journals or journal_directory()
        return kept_key(journals.with_name("keys"), self._options.root, self.port)

    def offer(self, occasion: Occasion) -> None:
        """Report an address, and another one when a browser has come in by it; of a socket, its path."""
        socket = self._options.socket
        self._report(occasion, str(socket) if socket else self.new_address(lambda: self.offer("used")))

    def new_address(self, used: Callable[[], None] = lambda: None) -> str:
        """Return an address of the page for one browser; `used` is called before that is let in."""
        return f"http://{LOOPBACK}:{self.port}{self._site.path}?token={self.credentials.new_token(used)}"

    def _share(self, shared: bool) -> str:
        """Return the address for viewers, relative to the page; or withdraw it, and return none."""
        viewers = self.credentials.viewers
        if not shared:
            viewers.withdraw()
            return ""
        return f"{VIEW[1:]}?token={viewers.share()}" if self._options.socket is None else VIEW[1:]

    async def serve(self, started: Callable[[], None]) -> None:
        """Serve until it is stopped; `started` is called once the page can be opened.

        Raises VisualHfsmError when a file cannot be opened.
        """
        options = self._options
        made = Workspace(
            options.limits, options.make_parts, self._make_project, demo=options.demo, share=self._share
        )
        async with made as workspace:
            for file in options.files:
                try:
                    if file.suffix.lower() == RECORDING_SUFFIX:
                        workspace.offer_recording(str(file.resolve()))
                    else:
                        await open_file(workspace, str(file.resolve()))
                except TooManyError as error:
                    _logger.warning("%s was not opened: %s", file.name, error)
            app = make_app(workspace, self._site, None if options.socket else self.credentials)
            server = _HttpServer(_config(app, options.limits), self._stopping)
            self._wake = server.wake
            started()  # connections wait in the queue of the socket, which listens
            await server.serve([self._listener])
            for name in workspace.unsaved():
                _logger.warning("%s has unsaved changes; they are offered when it is opened again", name)

    def _make_project(self, parts: Parts) -> Project:
        options = self._options
        return Project(
            options.root,
            options.include,
            granted=options.files,
            journals=options.journals,
            most=options.limits.tabs,
            merge_within=options.limits.merge_seconds,
            checks=parts.checks,
            code_help=parts.code_help,
        )

    def stop(self) -> None:
        """Make `serve` end in an orderly way; may be called from any thread."""
        self._stopping.set()
        self._wake()

    def close(self) -> None:
        """Release the port, or the socket with its name."""
        if self._options.socket is not None:
            self._options.socket.unlink(missing_ok=True)
        self._listener.close()


class _HttpServer(uvicorn.Server):
    """uvicorn, which ends when `stopping` is set, and at once if it is woken then; made in its event loop.

    By itself it looks every 0.1 s whether it, or something that it waits for, has ended.
    """

    def __init__(self, config: uvicorn.Config, stopping: threading.Event) -> None:
        super().__init__(config)
        self._stopping = stopping
        self._loop = asyncio.get_running_loop()
        self._woken = asyncio.Event()

    def wake(self) -> None:
        """Look at once whether to end; may be called from any thread."""
        with contextlib.suppress(RuntimeError):  # the loop has ended
            self._loop.call_soon_threadsafe(self._woken.set)

    async def main_loop(self) -> None:
        """Wait for the end."""
        ticks = 0
        while not (self._stopping.is_set() or await self.on_tick(ticks)):
            ticks += 1
            with contextlib.suppress(TimeoutError):
                async with asyncio.timeout(_POLL_INTERVAL):
                    await self._woken.wait()

    async def shutdown(self, sockets: list[socket.socket] | None = None) -> None:
        """Accept no more connections, and end the open ones, also those that were accepted right before."""
        # asyncio makes a connection some turns of its loop after it has accepted it. If the server was closed
        # by then, it would drop it, but leave it open: a browser would send its next request there.
        for listener in sockets or ():
            self._loop.remove_reader(listener)
        for _ in range(_TURNS):
            await asyncio.sleep(0)
        for server in self.servers:
            server.close()
        state = self.server_state
        ended: set[object] = set()
        try:
            async with asyncio.timeout(self.config.timeout_graceful_shutdown):
                while (state.connections or state.tasks) and not self.force_exit:
                    for connection in state.connections - ended:
                        connection.shutdown()
                    ended |= state.connections
                    await asyncio.sleep(_END_INTERVAL)
        except TimeoutError:
            for task in state.tasks:
                task.cancel()


class _WebSocket(WebSocketsSansIOProtocol):
    """uvicorn's websocket, which reads a flood in small pieces, and may be ended while the page closes it."""

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """Begin; all that arrived together is taken apart before anybody else has a turn."""
        connection = transport.get_extra_info("socket")
        connection.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, _READ_TOGETHER)
        super().connection_made(transport)

    def shutdown(self) -> None:
        """End the connection."""
        try:
            super().shutdown()
        except InvalidState:  # uvicorn begins to close even when the page has done so already
            self.transport.abort()


def serve(options: Options, report: Report, *, launch: Callable[[LaunchPage], None] | None = None) -> None:
    """Serve the editor until a signal comes, then exit.

    `report` gets the first address as soon as the page can be opened. `launch`, such as `open_browser`, gets
    a page that leads to the editor. Raises VisualHfsmError when a file cannot be opened or the port is not
    free.
    """
    with (
        stop_on_signals() as stop,
        contextlib.closing(Server(options, stop, report)) as server,
        contextlib.ExitStack() as pages,
    ):

        def started() -> None:
            server.offer("started")
            if launch is None:
                return
            try:
                page = pages.enter_context(contextlib.closing(LaunchPage(server.new_address(pages.close))))
            except OSError as error:
                _logger.warning("open the printed address: %s cannot be written", error.filename)
            else:
                launch(page)

        asyncio.run(server.serve(started))


def _config(app: ASGIApp, limits: Limits) -> uvicorn.Config:
    return uvicorn.Config(
        app,
        access_log=False,
        h11_max_incomplete_event_size=16 * 1024,
        http="h11",
        lifespan="off",
        limit_concurrency=limits.connections,
        log_config=None,
        log_level="warning",  # less severe messages would contain the token and the cookie
        loop="asyncio",
        proxy_headers=False,
        server_header=False,
        timeout_graceful_shutdown=_CLOSE_LIMIT,
        ws=_WebSocket,
        ws_max_size=limits.message_bytes,
        ws_per_message_deflate=False,  # on loopback it costs more than it saves
        ws_ping_interval=_PING_INTERVAL,
        ws_ping_timeout=_PING_INTERVAL,
    )


def _listen(port: int) -> socket.socket:
    # asyncio switches Nagle's delay of 40 ms off only where the protocol is named.
    listener = socket.socket(socket.AF_INET, socket.SOCK_STREAM, socket.IPPROTO_TCP)
    try:
        listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        listener.bind((LOOPBACK, port))
        listener.listen()
    except OSError as error:
        listener.close()
        raise PortInUseError(port, error.strerror or "unknown reason") from error
    return listener


def _listen_at(path: Path) -> socket.socket:
    """Listen at a Unix socket, in place of one that a killed editor has left behind."""
    listener = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
    try:
        folder = path.parent.stat()
        if folder.st_uid != os.getuid() or stat.S_IMODE(folder.st_mode) & 0o077:
            raise SocketError(path, f"others may enter its folder: chmod 700 {path.parent}")
        if path.is_socket() and not _is_served(path):
            path.unlink()
        listener.bind(str(path))
        path.chmod(0o600)
        listener.listen()
    except OSError as error:
        listener.close()
        raise SocketError(path, error.strerror or str(error)) from error
    except BaseException:
        listener.close()
        raise
    return listener


def _is_served(path: Path) -> bool:
    with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as probe:
        probe.setblocking(False)
        return probe.connect_ex(str(path)) != errno.ECONNREFUSED


class _AtMost:
    """Answer websockets, so many of them at a time; further ones are closed."""

    def __init__(self, limit: int) -> None:
        self._limit = limit
        self._open: set[WebSocket] = set()

    def __call__(
        self, answer: Callable[[WebSocket], Awaitable[None]]
    ) -> Callable[[WebSocket], Awaitable[None]]:
        async def answer_some(websocket: WebSocket) -> None:
            if len(self._open) >= self._limit:
                await websocket.close(_TRY_LATER, "too many windows are open")
                return
            self._open.add(websocket)
            try:
                await answer(websocket)
            finally:
                self._open.discard(websocket)

        return answer_some


def make_app(workspace: Workspace, site: Site, credentials: Credentials | None) -> ASGIApp:
    """Return the application of a workspace, for pages of the site that the credentials let in.

    Without credentials everybody who reaches the server is let in.
    """
    assets = page_assets()
    followers = workspace.parts.followers

    async def talk(websocket: WebSocket) -> None:
        await converse(websocket, workspace, credentials.resumption.key if credentials else b"")

    async def look_on(websocket: WebSocket) -> None:
        await converse(websocket, workspace, is_viewer=True)

    async def stop(websocket: WebSocket) -> None:
        await websocket.accept()
        answer = Answer(re=0, ok=await workspace.components.emergency_stop("window"))
        await websocket.send_text(encoder(_language(websocket)).encode(answer).decode())
        await websocket.close()

    async def camera(websocket: WebSocket) -> None:
        await _send_frames(websocket, lambda: followers.camera(websocket.path_params["name"]))

    async def poses(websocket: WebSocket) -> None:
        await _send_frames(websocket, lambda: followers.poses(_language(websocket)))

    routes = [
        route
        for path, (ask, see, feel) in (
            # uvicorn counts connections only until they become websockets.
            ("/", map(_AtMost(workspace.limits.connections), (talk, camera, poses))),
            (VIEW, map(_AtMost(workspace.limits.viewers), (look_on, camera, poses))),
        )
        for route in (
            Route(path, assets.index),
            Route(f"{path}static/{{version}}/{{path:path}}", assets.file),
            Route(f"{path}plugins/{{view}}/{{version}}/{{path:path}}", assets.file),
            WebSocketRoute(f"{path}ws", ask),
            WebSocketRoute(f"{path}camera/{{name}}", see),
            WebSocketRoute(f"{path}poses", feel),
        )
    ]
    routes.append(WebSocketRoute(STOP, _AtMost(workspace.limits.concurrent_operations)(stop)))
    app, log = Starlette(routes=routes), RefusalLog()
    return Boundary(Guard(app, credentials, log, site.path) if credentials else app, site, log)


async def _send_frames(
    websocket: WebSocket, open_frames: Callable[[], AsyncGenerator[bytes | str, None]]
) -> None:
    """Send frames until the window is closed or there are no more."""
    await websocket.accept()
    drawn = asyncio.Event()

    async def read() -> None:
        while (await websocket.receive())["type"] != "websocket.disconnect":
            drawn.set()

    async def send() -> None:
        async with contextlib.aclosing(open_frames()) as frames:
            async for frame in frames:
                drawn.clear()
                await (websocket.send_text(frame) if isinstance(frame, str) else websocket.send_bytes(frame))
                async with asyncio.timeout(_DRAW_LIMIT):
                    await drawn.wait()

    try:
        await until_one_ends(read(), send())
    except VisualHfsmError as error:
        await _close(websocket, reason(error))
    except TimeoutError:
        _logger.debug("a window drew no image for %g s", _DRAW_LIMIT)
        await _close(websocket, Message("no image was drawn for too long"))
    except WebSocketDisconnect:
        pass


def _language(websocket: WebSocket) -> str:
    """Return the language of the page that asks for frames."""
    return known_language(websocket.query_params.get("language", ""))


async def _close(websocket: WebSocket, why: Message) -> None:
    with contextlib.suppress(RuntimeError):  # it is closed already
        await websocket.close(_NOT_AVAILABLE, said(why, _language(websocket))[:_LONGEST_REASON])
