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
from .viewers import VIEW, Viewers

_POLICY_VIOLATION: Final = 1008  # RFC 6455, section 7.4.1
_LOCKED_OUT: Final = 4403  # own codes, which the page knows
_NOT_SHARED: Final = 4410

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
"""The path of the websocket that stops all that moves, also for pages that are locked out."""
_UNKNOWN: Final = Message("Open the address that the command printed in its terminal.")
_USED_BEFORE: Final = Message(
    "Open the new address that the command printed in its terminal. By this one another browser has come in "
    "before: if it is not yours, the terminal says how you lock it out."
)
_WITHDRAWN: Final = Message("Ask for another address: the one that you had for looking on was withdrawn.")
_OTHER_HOST: Final = Message(
    "Use the address that the command printed: the header Host names another machine."
)
_OTHER_SITE: Final = Message("Open the editor itself: the request comes from another site.")
_WHY_LOCKED_OUT: Final = "an address of the editor that locks out all others was used"
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

    A token is part of an address that is printed or opened. The browser sends it once and then has a cookie
    with another secret, which scripts cannot read and other sites do not send. `resumption` lets in pages of
    an earlier run.

    A token that two browsers use may have been seen by somebody else. The second one is refused, and
    `used_again` is called, once for each token. Only the user knows which of them is the thief, and may then
    `lock_out` all who are in. All that they can do from then on is to stop what moves.

    `viewers` have another address, which many may use, and no cookie of the editor.
    """

    def __init__(
        self, port: int, resumption: Resumption, used_again: Callable[[], None] = lambda: None
    ) -> None:
        self.resumption = resumption
        self.cookie_name = f"visualhfsm-{port}"  # cookies are the same for all ports
        self.viewers: Final = Viewers(port)
        self.lockout = asyncio.Event()
        """Set when all who are in now are locked out; then there is another event for the next ones."""
        self._used_again = used_again
        self.resumed = secrets.token_urlsafe(32)
        """The cookie for pages of an earlier run."""
        self._unused: dict[str, Callable[[], None]] = {}
        self._cookies: dict[str, str] = {}
        self._reported: set[str] = set()
        self._former: list[str] = []

    def new_token(self, used: Callable[[], None] = lambda: None) -> str:
        """Return a token for one browser; `used` is called before that is let in."""
        token = secrets.token_urlsafe(32)
        self._unused[token] = used
        return token

    def knows(self, token: str) -> bool:
        """Whether this is a token of ours, even one that was used."""
        return any(_same(token, each) for each in (*self._unused, *self._cookies))

    def redeem(self, token: str, cookies: str) -> str | None:
        """Return the cookie for a known token; None when another browser has used it before.

        `cookies` is the header of the request: a browser may open an address again.
        """
        if token in self._unused:
            self._unused.pop(token)()
            cookie = self._cookies[token] = secrets.token_urlsafe(32)
            return cookie
        if self._holds(cookies, self._cookies[token]):
            return self._cookies[token]
        if token not in self._reported:
            self._reported.add(token)
            self._used_again()
        return None

    def accepts_cookie(self, header: str, *, stops: bool = False) -> bool:
        """Whether a header `Cookie` holds one of our cookies; to stop, a former one will do."""
        cookies = (self.resumed, *self._cookies.values(), *(self._former if stops else ()))
        return any(self._holds(header, cookie) for cookie in cookies)

    def _holds(self, header: str, cookie: str) -> bool:
        # A strict parser would fail: other servers on loopback set cookies here, too, in any form.
        pairs = (each.strip().partition("=") for each in header.split(";"))
        return any(name == self.cookie_name and _same(value, cookie) for name, _, value in pairs)

    def lock_out(self) -> None:
        """Make void what lets anybody in, and close all connections."""
        self._former += [self.resumed, *self._cookies.values()]
        self._cookies, self._unused = {}, {}
        self.resumed = secrets.token_urlsafe(32)
        self.viewers.withdraw()
        former, self.lockout = self.lockout, asyncio.Event()
        former.set()


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
            return refused(headers, scope["path"], refusal)
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
                await self._serve(scope, receive, send)
                return
            self._log.add(_unknown(scope))
            await _closed(_unknown(scope))(scope, receive, send)
        else:
            await self._answer(scope, headers)(scope, receive, send)

    async def _serve(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Serve a websocket until it ends, or until all, or all viewers, are locked out."""
        is_viewer = _is_view(scope)
        ending = self._credentials.viewers.withdrawn if is_viewer else self._credentials.lockout
        serving = asyncio.ensure_future(self._app(scope, receive, send))
        lockout = asyncio.ensure_future(ending.wait())
        try:
            await asyncio.wait({serving, lockout}, return_when=asyncio.FIRST_COMPLETED)
        finally:
            is_locked_out = not serving.done()
            for task in (serving, lockout):
                task.cancel()
            await asyncio.gather(serving, lockout, return_exceptions=True)
        if is_locked_out:
            with suppress(RuntimeError):  # it is closed already
                code, reason = (_NOT_SHARED, _WITHDRAWN) if is_viewer else (_LOCKED_OUT, _WHY_LOCKED_OUT)
                await send({"type": "websocket.close", "code": code, "reason": reason})
        else:
            serving.result()

    def _answer(self, scope: Scope, headers: Headers) -> ASGIApp:
        """Return the application that answers a request over HTTP."""
        if scope["path"] == _RESUME and scope["method"] == "GET":
            return self._resumed(scope)
        if not self._knows(scope, headers):
            return self._refused(scope, headers, _unknown(scope))
        if scope["method"] not in {"GET", "HEAD"}:
            return PlainTextResponse("only GET and HEAD\n", 405, {"allow": "GET, HEAD"})
        if token := _query(scope).get("token"):
            return self._let_in(token, scope, headers)
        return self._app

    def _refused(self, scope: Scope, headers: Headers, reason: Message) -> Response:
        self._log.add(reason)
        return refused(headers, scope["path"], reason)

    def _let_in(self, token: str, scope: Scope, headers: Headers) -> Response:
        """Give the browser that opened an address its cookie, and lead it to the page."""
        if _is_view(scope) and (cookie := self._credentials.viewers.redeem(token)):
            return self._led(scope, headers, "./", cookie, is_viewer=True)
        cookie = self._credentials.redeem(token, headers.get("cookie", ""))
        if cookie is None:
            return self._refused(scope, headers, _USED_BEFORE)
        # Relative: to any other a proxy may add the path that it took off.
        page = "./" + "../" * (scope["path"].count("/") - 1)
        return self._led(scope, headers, page, cookie)

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

    def _resumed(self, scope: Scope) -> Response:
        """Answer a page that the editor served before it was restarted."""
        query = _query(scope)
        resumption = self._credentials.resumption
        if "proof" not in query:
            return JSONResponse(resumption.prove(query.get("nonce", "")))
        if not resumption.accepts(query.get("challenge", ""), query["proof"]):
            return PlainTextResponse(f"{_UNKNOWN}\n", 403)
        response = Response(status_code=204)
        self._set_cookie(response, self._credentials.resumed, scope)
        return response

    def _knows(self, scope: Scope, headers: Headers) -> bool:
        """Whether a request has a token, or otherwise a cookie, of ours."""
        credentials, cookies = self._credentials, headers.get("cookie", "")
        viewers = credentials.viewers if _is_view(scope) else None
        if token := _query(scope).get("token"):
            is_known = credentials.knows(token) or bool(viewers and viewers.redeem(token))
            return scope["type"] == "http" and is_known
        stops = scope["type"] == "websocket" and scope["path"] == STOP
        is_let_in = credentials.accepts_cookie(cookies, stops=stops)
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


def _same(given: str, expected: str) -> bool:
    return hmac.compare_digest(given.encode(), expected.encode())


def _with_headers(send: Send) -> Send:
    async def send_with_headers(message: Event) -> None:
        if message["type"] == "http.response.start":
            headers = MutableHeaders(scope=message)
            for name, value in _HEADERS.items():
                headers.setdefault(name, value)
        await send(message)

    return send_with_headers
