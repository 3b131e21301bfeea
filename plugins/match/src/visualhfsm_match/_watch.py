"""Serve a match on loopback while it is played: a page, and the film as it grows.

The child process that plays writes the film as lines of JSON to a file: first what is seen, then a frame with
the events that are new, each 0.1 s of the match; this process adds the outcome. The page asks for what
follows what it has. Without the token nobody gets anything, and only the names of loopback are answered.
"""

from __future__ import annotations

import hmac
import re
import secrets
import threading
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import Any, Final

import msgspec

_HOST: Final = "127.0.0.1"
_LARGEST_PART: Final = 1 << 20
"""Bytes of a film that are sent at a time."""
_PATIENCE: Final = 2.0
"""s for which a connection that says nothing is waited for."""
_LAST: Final = 5.0
"""s that a page that watches has at the end to get the rest."""
_FRESH: Final = 2.0
"""s since the last question of a page that watches."""
_PATH: Final = re.compile(r"/(?P<token>[\w-]{1,100})/(?:film\?from=(?P<start>\d{1,15}))?", re.ASCII)
_HEADERS: Final = {
    "Cache-Control": "no-store",
    "Referrer-Policy": "no-referrer",
    "X-Content-Type-Options": "nosniff",
    "X-Frame-Options": "DENY",
}


class Watched:
    """A match that can be watched at an `address`, whose film grows in a file."""

    def __init__(self, page: str, film: Path) -> None:
        self._page: Final = page.encode()
        self._film: Final = film
        self._token: Final = secrets.token_urlsafe(32)
        self._seen: tuple[float, int] | None = None
        """When a page asked last, and how many bytes it has by now."""
        self._server: Final = ThreadingHTTPServer((_HOST, 0), self._handler())
        self._server.daemon_threads = False  # what is being answered is answered before the end
        self.address: Final = f"http://{_HOST}:{self._server.server_port}/{self._token}/"

    @contextmanager
    def served(self) -> Iterator[None]:
        """Serve it in a `with` block, and close everything at its end."""
        thread = threading.Thread(target=self._server.serve_forever, name="watched match", daemon=True)
        thread.start()
        try:
            yield
        finally:
            self._server.shutdown()
            thread.join()
            self._server.server_close()

    def end(self, outcome: Mapping[str, Any]) -> None:
        """Add what the match came to, and let a page that watches get it."""
        with self._film.open("ab") as file:
            file.write(b"\n" + msgspec.json.encode(outcome) + b"\n")
        size, deadline = self._film.stat().st_size, time.monotonic() + _LAST
        while (seen := self._seen) is not None and time.monotonic() < deadline:
            at, known = seen
            if known >= size or time.monotonic() - at > _FRESH:
                return
            time.sleep(0.05)

    def _answer(self, path: str, host: str) -> tuple[HTTPStatus, str, bytes]:
        match = _PATH.fullmatch(path)
        known = {f"{name}:{self._server.server_port}" for name in (_HOST, "localhost")}
        if match is None or host not in known or not hmac.compare_digest(match["token"], self._token):
            return (
                HTTPStatus.FORBIDDEN,
                "text/plain",
                b"The address of a match has a token, which this lacks.\n",
            )
        if match["start"] is None:
            return HTTPStatus.OK, "text/html; charset=utf-8", self._page
        start = int(match["start"])
        with self._film.open("rb") as file:
            file.seek(start)
            part = file.read(_LARGEST_PART)
        self._seen = time.monotonic(), start + len(part)
        return HTTPStatus.OK, "application/x-ndjson", part

    def _handler(self) -> type[BaseHTTPRequestHandler]:
        watched = self

        class Handler(BaseHTTPRequestHandler):
            timeout = _PATIENCE

            def do_GET(self) -> None:
                status, kind, body = watched._answer(self.path, self.headers.get("Host", ""))
                self.send_response(status)
                for name, value in {**_HEADERS, "Content-Type": kind, "Content-Length": len(body)}.items():
                    self.send_header(name, str(value))
                self.end_headers()
                self.wfile.write(body)

            def version_string(self) -> str:
                return "visualhfsm"

            def log_message(self, *_: object) -> None:
                """Say nothing: the terminal shows the match."""

        return Handler
