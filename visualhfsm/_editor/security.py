"""Access to the server, only for the page that was opened with the printed address.

Another page in the same browser reaches loopback too, so binding to it does not suffice: `Boundary` keeps
other sites out, and `Guard` everybody without a cookie. docs/explanation/editor-safety.md explains the
purpose of each check.
"""

from __future__ import annotations

import asyncio
import hmac
import secrets
from collections.abc import Callable
from contextlib import suppress
from typing import Final
from urllib.parse import parse_qs

from starlette.datastructures import Headers, MutableHeaders
from starlette.responses import HTMLResponse, JSONResponse, PlainTextResponse, RedirectResponse, Response
from starlette.types import ASGIApp, Receive, Scope, Send
from starlette.types import Message as Event

from codegen.messages import NO_MESSAGE, Message

from .refusal import RefusalLog, refused
from .resumption import Resumption
from .site import Site
from .viewers import VIEW, Viewers, holds_cookie

_POLICY_VIOLATION: Final = 1008  # RFC 6455, section 7.4.1
_NOT_SHARED: Final = 4410  # an own code, which the page knows

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
STOP: Final = "/stop"
"""The path of the websocket that stops all that moves."""
_UNKNOWN: Final = Message(
    "Open the last address that the command printed in its terminal: each lets in one browser."
)
_WITHDRAWN: Final = Message("Ask for another address: the one that you had for looking on was withdrawn.")
_OTHER_HOST: Final = Message(
    "Use the address that the command printed: the header Host names another machine."
)
_OTHER_SITE: Final = Message("Open the editor itself: the request comes from another site.")
_NO_ORIGIN: Final = "use a browser: a websocket needs the header Origin"
_ELSEWHERE: Final = frozenset({"cross-site", "same-site"})
"""The words of a browser (`Sec-Fetch-Site`) for a request to which a page of another site has led it."""
_WELCOME: Final = """<!doctype html>
<html lang="en">
<meta charset="utf-8">
<meta http-equiv="refresh" content="0;url={page}">
<title>VisualHFSM</title>
</html>
"""
"""A page that leads to the editor, for a browser that comes from another site or from the page of the launch:
along a redirection, it would not send the cookie."""


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

    A token is part of an address that is printed or opened, and lets one browser in. That sends it once, and
    then has a cookie with another secret, which scripts cannot read and other sites do not send. `resumption`
    lets in pages of an earlier run.

    `viewers` have another address, which many may use, and no cookie of the editor.
    """

    def __init__(self, port: int, resumption: Resumption) -> None:
        self.resumption: Final = resumption
        self.cookie_name: Final = f"visualhfsm-{port}"  # cookies are the same for all ports
        self.cookie: Final = secrets.token_urlsafe(32)
        self.viewers: Final = Viewers(port)
        self._unused: dict[str, Callable[[], None]] = {}

    def new_token(self, used: Callable[[], None] = lambda: None) -> str:
        """Return a token for one browser; `used` is called before that is let in."""
        token = secrets.token_urlsafe(32)
        self._unused[token] = used
        return token

    def knows(self, token: str) -> bool:
        """Whether this is a token by which no browser has come in yet."""
        return any(hmac.compare_digest(token.encode(), each.encode()) for each in self._unused)

    def use_up(self, token: str) -> None:
        """Forget a token, which lets in nobody else."""
        if used := self._unused.pop(token, None):
            used()

    def accepts_cookie(self, header: str) -> bool:
        """Whether a header `Cookie` holds ours."""
        return holds_cookie(header, self.cookie_name, self.cookie)


class Boundary:
    """Pass to an application only requests for a site that its own page may have sent."""

    def __init__(self, app: ASGIApp, site: Site, log: RefusalLog) -> None:
        self._app = app
        self._site = site
        self._log = log

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer or refuse one request."""
        if scope["type"] == "lifespan":
            await self._app(scope, receive, send)
            return
        scope = self._site.as_asked(scope)
        headers = Headers(scope=scope)
        refusal = self._refusal(scope, headers)
        if refusal:
            self._log.add(refusal)
        if scope["type"] == "websocket":
            await (_closed(refusal) if refusal else self._app)(scope, receive, send)
        else:
            await self._answer(scope, headers, refusal)(scope, receive, _with_headers(send))

    def _answer(self, scope: Scope, headers: Headers, refusal: Message) -> ASGIApp:
        if refusal:
            return refused(headers, refusal)
        if not scope["path"]:  # what the page names relative to its address would be looked for beside it
            folder = self._site.path.rstrip("/").rpartition("/")[2]
            query = scope["query_string"].decode("latin-1")
            return RedirectResponse(f"./{folder}/{'?' if query else ''}{query}")
        return self._app

    def _refusal(self, scope: Scope, headers: Headers) -> Message:
        """Return why a request is refused, empty if it is not; it contains no text of the request."""
        host = headers.getlist("host")
        if len(host) != 1 or not self._site.is_ours(host[0]):
            return _OTHER_HOST
        origins = headers.getlist("origin")
        if any(origin.partition("://")[2].lower() != host[0].lower() for origin in origins):
            return _OTHER_SITE
        if scope["type"] == "websocket" and len(origins) != 1:
            return Message.verbatim(_NO_ORIGIN)
        return NO_MESSAGE


class Guard:
    """Pass to an application only requests of browsers that were let in; it stands within a `Boundary`.

    The cookie is for the pages below `path` alone, that of viewers for those below `VIEW` there.
    """

    def __init__(self, app: ASGIApp, credentials: Credentials, log: RefusalLog, path: str = "/") -> None:
        self._app = app
        self._credentials = credentials
        self._log = log
        self._path = path

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer or refuse one request."""
        headers = Headers(scope=scope)
        if scope["type"] == "websocket":
            if self._knows(scope, headers):
                await (self._serve_viewer if _is_view(scope) else self._app)(scope, receive, send)
                return
            self._log.add(_unknown(scope))
            await _closed(_unknown(scope))(scope, receive, send)
        else:
            await self._answer(scope, headers)(scope, receive, send)

    async def _serve_viewer(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Serve a websocket until it ends, or until the address of viewers is withdrawn."""
        serving = asyncio.ensure_future(self._app(scope, receive, send))
        withdrawal = asyncio.ensure_future(self._credentials.viewers.withdrawn.wait())
        try:
            await asyncio.wait({serving, withdrawal}, return_when=asyncio.FIRST_COMPLETED)
        finally:
            is_withdrawn = not serving.done()
            for task in (serving, withdrawal):
                task.cancel()
            await asyncio.gather(serving, withdrawal, return_exceptions=True)
        if is_withdrawn:
            with suppress(RuntimeError):  # it is closed already
                await send({"type": "websocket.close", "code": _NOT_SHARED, "reason": _WITHDRAWN})
        else:
            serving.result()

    def _answer(self, scope: Scope, headers: Headers) -> ASGIApp:
        """Return the application that answers a request over HTTP."""
        if scope["path"] == _RESUME and scope["method"] == "GET":
            return self._resumed(scope, headers)
        if not self._knows(scope, headers):
            self._log.add(_unknown(scope))
            return refused(headers, _unknown(scope))
        if scope["method"] not in {"GET", "HEAD"}:
            return PlainTextResponse("only GET and HEAD\n", 405, {"allow": "GET, HEAD"})
        if token := _query(scope).get("token"):
            return self._let_in(token, scope, headers)
        return self._app

    def _let_in(self, token: str, scope: Scope, headers: Headers) -> Response:
        """Give the browser that opened an address its cookie, and lead it to the page."""
        if _is_view(scope) and (cookie := self._credentials.viewers.redeem(token)):
            return self._led(scope, headers, "./", cookie, is_viewer=True)
        self._credentials.use_up(token)
        # Relative: to any other a proxy may add the path that it took off.
        page = "./" + "../" * (scope["path"].count("/") - 1)
        return self._led(scope, headers, page, self._credentials.cookie)

    def _led(
        self, scope: Scope, headers: Headers, page: str, cookie: str, *, is_viewer: bool = False
    ) -> Response:
        # Either way the token leaves the address bar and the history.
        comes_from_elsewhere = headers.get("sec-fetch-site") in _ELSEWHERE
        response = (
            HTMLResponse(_WELCOME.format(page=page)) if comes_from_elsewhere else RedirectResponse(page, 303)
        )
        self._set_cookie(response, cookie, scope, is_viewer=is_viewer)
        return response

    def _set_cookie(self, response: Response, cookie: str, scope: Scope, *, is_viewer: bool = False) -> None:
        credentials = self._credentials
        response.set_cookie(
            credentials.viewers.cookie_name if is_viewer else credentials.cookie_name,
            cookie,
            httponly=True,
            samesite="strict",
            path=f"{self._path.rstrip('/')}{VIEW}" if is_viewer else self._path,
            secure=scope["scheme"] == "https",
        )

    def _resumed(self, scope: Scope, headers: Headers) -> Response:
        """Answer a page that the editor served before it was restarted."""
        query = _query(scope)
        resumption = self._credentials.resumption
        if "proof" not in query:
            return JSONResponse(resumption.prove(query.get("nonce", "")))
        if not resumption.accepts(query.get("challenge", ""), query["proof"]):
            return refused(headers, _UNKNOWN)
        response = Response(status_code=204)
        self._set_cookie(response, self._credentials.cookie, scope)
        return response

    def _knows(self, scope: Scope, headers: Headers) -> bool:
        """Whether a request has a token or a cookie of ours.

        A browser that was let in may open any address again; a viewer needs the one of viewers for that.
        """
        credentials, cookies = self._credentials, headers.get("cookie", "")
        viewers = credentials.viewers if _is_view(scope) else None
        is_let_in = credentials.accepts_cookie(cookies)
        if token := _query(scope).get("token"):
            is_known = credentials.knows(token) or bool(viewers and viewers.redeem(token))
            return scope["type"] == "http" and (is_let_in or is_known)
        return is_let_in or bool(viewers and viewers.accepts_cookie(cookies))


def _is_view(scope: Scope) -> bool:
    """Whether a request is for the page of viewers, which changes nothing, even for the editor itself."""
    path: str = scope["path"]
    return path.startswith(VIEW)


def _closed(refusal: str) -> ASGIApp:
    """Return the answer to a websocket that is refused."""

    async def close(_scope: Scope, receive: Receive, send: Send) -> None:
        await receive()
        await send({"type": "websocket.close", "code": _POLICY_VIOLATION, "reason": refusal})

    return close


def _unknown(scope: Scope) -> Message:
    """Return what somebody can do whose request has neither a token nor a cookie of ours."""
    return _WITHDRAWN if _is_view(scope) else _UNKNOWN


def _query(scope: Scope) -> dict[str, str]:
    """Return the fields of a request's query, the first of each name."""
    query = scope["query_string"].decode("latin-1")
    return {name: values[0] for name, values in parse_qs(query).items()} if len(query) < 1024 else {}


def _with_headers(send: Send) -> Send:
    async def send_with_headers(message: Event) -> None:
        if message["type"] == "http.response.start":
            headers = MutableHeaders(scope=message)
            for name, value in _HEADERS.items():
                headers.setdefault(name, value)
        await send(message)

    return send_with_headers
