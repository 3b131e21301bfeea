"""Access to the server, only for the page that was opened with the printed address, and to files.

Another page in the same browser reaches loopback too, so binding to it does not suffice.
docs/explanation/editor-safety.md explains the purpose of each check.
"""

from __future__ import annotations

import hmac
import ipaddress
import logging
import re
import secrets
from collections.abc import Iterable
from contextlib import suppress
from pathlib import Path
from typing import Final
from urllib.parse import parse_qs

from starlette.datastructures import Headers, MutableHeaders
from starlette.responses import HTMLResponse, JSONResponse, PlainTextResponse, RedirectResponse, Response
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from visualhfsm.errors import ForbiddenPathError

from .resumption import Resumption

DOCUMENT_SUFFIX: Final = ".xml"
FOREIGN_SUFFIX: Final = ".scxml"
RECORDING_SUFFIX: Final = ".mcap"

_LONGEST: Final = 4096  # characters, as Linux has it

_POLICY_VIOLATION: Final = 1008  # RFC 6455, section 7.4.1

_HOST: Final = re.compile(r"(?P<name>[a-z0-9._-]{1,253}|\[[0-9a-f:.]{2,45}\])(?::[0-9]{1,5})?", re.IGNORECASE)
"""The only allowed content of `Host`, which is also part of the policy of the page."""

_HEADERS: Final = {
    "cache-control": "no-store",
    "cross-origin-opener-policy": "same-origin",
    "cross-origin-resource-policy": "same-origin",
    "permissions-policy": "camera=(), geolocation=(), microphone=()",
    "referrer-policy": "no-referrer",
    "x-content-type-options": "nosniff",
    "x-frame-options": "DENY",
}
"""The default headers of every answer."""

_RESUME: Final = "/resume"
_UNKNOWN: Final = "open the address that the command printed in its terminal"
_REFUSAL: Final = """<!doctype html>
<html lang="en">
<meta charset="utf-8">
<meta name="viewport" content="width=device-width">
<meta name="color-scheme" content="light dark">
<title>VisualHFSM</title>
<style nonce="{nonce}">
body {{ font: 16px/1.5 system-ui, sans-serif; max-width: 38rem; margin: 15vh auto; padding: 0 1rem; }}
</style>
<h1>The editor runs, but does not know this page</h1>
<p>Please {reason}.</p>
<p>The address contains a key that is new whenever the editor is started. Look for the line with
<code>?token=</code> in the terminal in which you started <code>visualhfsm</code>. Without that terminal,
end the editor and start it again.</p>
<p>Changes that were not saved are kept: the editor offers to recover them.</p>
</html>
"""
"""The page for people who are refused; `reason` never contains text of the request."""

_logger = logging.getLogger(__name__)


def content_security_policy(host: str, script_hash: str, style_nonce: str) -> str:
    """Return the policy of the page: everything from this server, and nothing inline but what is named here.

    `host` is the page's own, checked before: browsers differ in whether 'self' includes websockets. The code
    editor creates a style sheet with the nonce.
    """
    return "; ".join(
        [
            "default-src 'none'",
            f"script-src 'self' '{script_hash}'",
            f"style-src 'self' 'nonce-{style_nonce}'",
            "img-src 'self' blob: data:",
            f"connect-src 'self' ws://{host} wss://{host}",
            "base-uri 'none'",
            "form-action 'none'",
            "frame-ancestors 'none'",
        ]
    )


class Credentials:
    """The secrets of one run of the server.

    The `token` is part of the printed address. The browser sends it once and then has a cookie with another
    secret, which scripts cannot read and other sites do not send. `resumption` lets in pages of an earlier
    run.
    """

    def __init__(self, port: int, resumption: Resumption) -> None:
        self.resumption = resumption
        self.token = secrets.token_urlsafe(32)
        self.cookie_name = f"visualhfsm-{port}"  # cookies are the same for all ports
        self._cookie = secrets.token_urlsafe(32)
        self._launch_tokens: set[str] = set()

    def launch_token(self) -> str:
        """Return a token that is accepted once: it may be seen in the list of processes."""
        token = secrets.token_urlsafe(32)
        self._launch_tokens.add(token)
        return token

    def accepts_token(self, token: str) -> bool:
        """Whether this is the token, or one to launch a browser with, which is used up by it."""
        launching = [launch for launch in self._launch_tokens if _same(token, launch)]
        self._launch_tokens.difference_update(launching)
        return bool(launching) or _same(token, self.token)

    def accepts_cookie(self, header: str) -> bool:
        """Whether a header `Cookie` holds our cookie."""
        # A strict parser would fail: other servers on loopback set cookies here, too, in any form.
        pairs = (each.strip().partition("=") for each in header.split(";"))
        return any(name == self.cookie_name and _same(value, self._cookie) for name, _, value in pairs)

    def set_cookie(self, response: Response) -> None:
        """Set the cookie in a response."""
        response.set_cookie(self.cookie_name, self._cookie, httponly=True, samesite="strict", path="/")


class Guard:
    """Pass to an application only requests of the page."""

    def __init__(self, app: ASGIApp, credentials: Credentials, hosts: Iterable[str] = ()) -> None:
        self._app = app
        self._credentials = credentials
        self._hosts = frozenset(host.lower() for host in hosts)

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer or refuse one request."""
        if scope["type"] == "lifespan":
            await self._app(scope, receive, send)
            return
        headers = Headers(scope=scope)
        refusal = self._refusal(scope, headers)
        if scope["type"] == "websocket":
            if refusal:
                _logger.warning("refused a websocket: %s", refusal)
                await receive()
                await send({"type": "websocket.close", "code": _POLICY_VIOLATION, "reason": refusal})
            else:
                await self._app(scope, receive, send)
            return
        await self._answer(scope, headers, refusal)(scope, receive, _with_headers(send))

    def _answer(self, scope: Scope, headers: Headers, refusal: str) -> ASGIApp:
        """Return the application that answers a request over HTTP."""
        if scope["path"] == _RESUME and refusal in {"", _UNKNOWN} and scope["method"] == "GET":
            return self._resumed(_query(scope))
        if refusal:
            _logger.warning("refused a request: %s", refusal)
            if "text/html" in headers.get("accept", ""):
                nonce = secrets.token_urlsafe(16)
                policy = f"default-src 'none'; style-src 'nonce-{nonce}'; frame-ancestors 'none'"
                page = _REFUSAL.format(nonce=nonce, reason=refusal)
                return HTMLResponse(page, 403, {"content-security-policy": policy})
            return PlainTextResponse(f"{refusal}\n", 403)
        if scope["method"] not in {"GET", "HEAD"}:
            return PlainTextResponse("only GET and HEAD\n", 405, {"allow": "GET, HEAD"})
        if _query(scope).get("token"):
            response = RedirectResponse("/", 303)  # the token leaves the address bar and the history
            self._credentials.set_cookie(response)
            return response
        return self._app

    def _resumed(self, query: dict[str, str]) -> Response:
        """Answer a page that the editor served before it was restarted."""
        resumption = self._credentials.resumption
        if "proof" not in query:
            return JSONResponse(resumption.prove(query.get("nonce", "")))
        if not resumption.accepts(query.get("challenge", ""), query["proof"]):
            return PlainTextResponse(f"{_UNKNOWN}\n", 403)
        response = Response(status_code=204)
        self._credentials.set_cookie(response)
        return response

    def _refusal(self, scope: Scope, headers: Headers) -> str:
        """Return why a request is refused, empty if it is not; it contains no text of the request."""
        host = headers.getlist("host")
        if len(host) != 1 or not self._is_ours(host[0]):
            return "use the address that the command printed: the header Host names another machine"
        origins = headers.getlist("origin")
        if any(origin.partition("://")[2].lower() != host[0].lower() for origin in origins):
            return "open the editor itself: the request comes from another site"
        if scope["type"] == "websocket" and len(origins) != 1:
            return "use a browser: a websocket needs the header Origin"
        if token := _query(scope).get("token"):
            known = scope["type"] == "http" and self._credentials.accepts_token(token)
        else:
            known = self._credentials.accepts_cookie(headers.get("cookie", ""))
        return "" if known else _UNKNOWN

    def _is_ours(self, host: str) -> bool:
        match = _HOST.fullmatch(host)
        if match is None:
            return False
        name = match["name"].lower().strip("[]")
        if name == "localhost" or name in self._hosts:
            return True
        try:
            return ipaddress.ip_address(name).is_loopback
        except ValueError:
            return False


def _query(scope: Scope) -> dict[str, str]:
    """Return the fields of a request's query, the first of each name."""
    query = scope["query_string"].decode("latin-1")
    return {name: values[0] for name, values in parse_qs(query).items()} if len(query) < 1024 else {}


def _same(given: str, expected: str) -> bool:
    return hmac.compare_digest(given.encode(), expected.encode())


def _with_headers(send: Send) -> Send:
    async def send_with_headers(message: Message) -> None:
        if message["type"] == "http.response.start":
            headers = MutableHeaders(scope=message)
            for name, value in _HEADERS.items():
                headers.setdefault(name, value)
        await send(message)

    return send_with_headers


class Root:
    """The directory to which opening, saving and listing are confined.

    Symbolic links are resolved before a path is checked. `granted` are files that the operator named at the
    terminal; they may be elsewhere.
    """

    def __init__(self, directory: Path, granted: Iterable[Path] = ()) -> None:
        self.directory = directory.resolve(strict=True)
        self._granted = frozenset(path.resolve() for path in granted)

    def resolve(self, text: str) -> Path:
        """Return the path for a text from the page, absolute and without symbolic links.

        Raises ForbiddenPathError.
        """
        if not text or len(text) > _LONGEST or "\0" in text:
            raise ForbiddenPathError("the path is empty, too long, or contains a zero byte")
        try:
            path = (self.directory / text).resolve()
            with suppress(FileNotFoundError, NotADirectoryError):
                path.stat()
        except (OSError, RuntimeError) as error:  # a loop of links, or too long a name
            raise ForbiddenPathError(f"invalid path {text[:100]}") from error
        if not self.contains(path):
            raise ForbiddenPathError(
                f"{text} is outside {self.directory}; start the editor with --root DIR to reach others"
            )
        return path

    def contains(self, path: Path) -> bool:
        """Whether the page may reach a path, with symbolic links followed."""
        path = path.resolve()
        return path.is_relative_to(self.directory) or path in self._granted

    def document(self, text: str) -> Path:
        """Return the path of a document, which ends in `.xml`; raises ForbiddenPathError."""
        return self._file(text, DOCUMENT_SUFFIX)

    def source(self, text: str) -> Path:
        """Return the path of a file to open, a document or SCXML; raises ForbiddenPathError."""
        return self._file(text, DOCUMENT_SUFFIX, FOREIGN_SUFFIX)

    def recording(self, text: str) -> Path:
        """Return the path of a recording, which ends in `.mcap`; raises ForbiddenPathError."""
        return self._file(text, RECORDING_SUFFIX)

    def _file(self, text: str, *suffixes: str) -> Path:
        path = self.resolve(text)
        if path.suffix.lower() not in suffixes:
            raise ForbiddenPathError(f"{text}: the name of the file must end in {' or '.join(suffixes)}")
        if path.exists() and not path.is_file():  # reading a pipe might wait forever
            raise ForbiddenPathError(f"{text} is not a file")
        return path

    def directory_of(self, text: str) -> Path:
        """Return the path of a directory, the root for an empty text; raises ForbiddenPathError."""
        path = self.resolve(text) if text else self.directory
        if not path.is_relative_to(self.directory) or not path.is_dir():
            raise ForbiddenPathError(f"{text} is not a directory below {self.directory}")
        return path

    def name(self, path: Path) -> str:
        """Return the name of a path on the page: relative to the root where possible."""
        return str(path.relative_to(self.directory) if path.is_relative_to(self.directory) else path)
