"""A reverse proxy that serves several editors below paths of one host, as a school's web server does."""

from __future__ import annotations

import asyncio
import contextlib
import threading
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from tests.support.limits import END_LIMIT, START_LIMIT

_HEAD_END = b"\r\n\r\n"
_MOST = 1 << 16


@dataclass(frozen=True, slots=True)
class Mount:
    """What is below a path: a server at a `port` or a `socket`.

    The proxy takes the path off, as most do, or passes it on, if `keeps_path`. With `own_host` it passes on the
    browser's `Host` as `X-Forwarded-Host` alone, and names the server itself, as Apache does.
    """

    port: int = 0
    socket: Path | None = None
    keeps_path: bool = False
    own_host: bool = False


class _Proxy:
    def __init__(self, mounts: dict[str, Mount]) -> None:
        self._mounts = mounts
        self._open: set[asyncio.Task[None]] = set()

    async def run(self, started: asyncio.Future[int], ended: asyncio.Event) -> None:
        server = await asyncio.start_server(self._accept, "127.0.0.1", 0, limit=_MOST)
        async with server:
            started.set_result(server.sockets[0].getsockname()[1])
            await ended.wait()
            for task in self._open:
                task.cancel()
            await asyncio.gather(*self._open, return_exceptions=True)

    async def _accept(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        task = asyncio.current_task()
        assert task is not None
        self._open.add(task)
        try:
            with contextlib.suppress(OSError, asyncio.IncompleteReadError, asyncio.CancelledError):
                await self._serve(reader, writer)
        finally:
            self._open.discard(task)
            writer.close()

    async def _serve(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        """Pass on one request and its answer, or a websocket; another request comes by another connection."""
        lines = (await reader.readuntil(_HEAD_END)).decode("latin-1").split("\r\n")
        method, target, version = lines[0].split(" ")
        found = [prefix for prefix in self._mounts if target.startswith(prefix)]
        if not found:
            writer.write(b"HTTP/1.1 404 Not Found\r\nContent-Length: 0\r\nConnection: close\r\n\r\n")
            return
        prefix = max(found, key=len)
        mount = self._mounts[prefix]
        if not mount.keeps_path:
            target = "/" + target.removeprefix(prefix)
        head = [f"{method} {target} {version}", *_headers(lines[1:-2], mount)]
        if mount.socket is not None:
            from_server, to_server = await asyncio.open_unix_connection(str(mount.socket))
        else:
            from_server, to_server = await asyncio.open_connection("127.0.0.1", mount.port)
        try:
            to_server.write("\r\n".join([*head, "", ""]).encode("latin-1"))
            directions = [
                asyncio.ensure_future(_copy(reader, to_server)),
                asyncio.ensure_future(_copy(from_server, writer)),
            ]
            await asyncio.wait(directions, return_when=asyncio.FIRST_COMPLETED)
            for each in directions:
                each.cancel()
            await asyncio.gather(*directions, return_exceptions=True)
        finally:
            to_server.close()


def _headers(lines: list[str], mount: Mount) -> list[str]:
    names = [line.partition(":")[0].lower() for line in lines]
    kept = [line for line, name in zip(lines, names, strict=True) if name != "connection"]
    connection = "Upgrade" if "upgrade" in names else "close"
    if mount.own_host:
        host = next(
            line.partition(":")[2].strip() for line, name in zip(lines, names, strict=True) if name == "host"
        )
        kept = [line for line in kept if not line.lower().startswith("host:")]
        kept += [f"Host: 127.0.0.1:{mount.port}", f"X-Forwarded-Host: {host}"]
    return [*kept, f"Connection: {connection}"]


async def _copy(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
    while data := await reader.read(_MOST):
        writer.write(data)
        await writer.drain()


@contextlib.contextmanager
def reverse_proxy(mounts: dict[str, Mount]) -> Iterator[str]:
    """Serve mounts, by their paths with a slash at both ends, and yield the host with its port."""
    loop = asyncio.new_event_loop()
    started: asyncio.Future[int] = loop.create_future()
    port_known = threading.Event()
    started.add_done_callback(lambda _: port_known.set())
    ended = asyncio.Event()
    thread = threading.Thread(
        target=loop.run_until_complete, args=(_Proxy(mounts).run(started, ended),), name="reverse proxy"
    )
    thread.start()
    try:
        assert port_known.wait(START_LIMIT)
        yield f"127.0.0.1:{started.result()}"
    finally:
        loop.call_soon_threadsafe(ended.set)
        thread.join(END_LIMIT)
        loop.close()
