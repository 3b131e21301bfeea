"""The page's files, and how long the browser may cache them.

Paths begin with `static/<version>/`, those of views with `plugins/<view>/<version>/`, where the version is
a digest of all files: the browser may cache files forever and still never shows an old one. The page itself,
`index.html`, names the version. It names all files relative to its own address, and so does not know the path
below which it is served.

Modules are sent without the comments that fill whole lines, a fifth of their compressed
bytes, and style sheets without theirs.
"""

from __future__ import annotations

import base64
import functools
import gzip
import hashlib
import json
import mimetypes
import re
import secrets
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import Final

from starlette.exceptions import HTTPException
from starlette.requests import Request
from starlette.responses import Response

from visualhfsm._base.html_file import LIBRARIES, STATIC, imported_modules, texts_by_language

from .protocol import VIEWS
from .security import content_security_policy
from .views import ENTRY

_VERSION: Final = "%VERSION%"
_IMPORT_MAP: Final = "%IMPORT_MAP%"
_PRELOADS: Final = "%PRELOADS%"
_LANGUAGES: Final = "%LANGUAGES%"
_VIEWS: Final = "%VIEWS%"
_NONCE: Final = b"%NONCE%"
_ENTRY: Final = "shell/app.js"

_COMPRESSED: Final = frozenset({".css", ".html", ".js", ".json", ".svg", ".txt"})
_LIBRARIES: Final = "vendor/"
_COMMENTS: Final = re.compile(r"^[ \t]*(?://.*|/\*(?:(?!\*/)[\s\S])*\*/[ \t]*)$", re.MULTILINE)
_CSS_COMMENTS: Final = re.compile(r"/\*(?:(?!\*/)[\s\S])*\*/")
_TYPES: Final = {
    ".js": "text/javascript",
    ".svg": "image/svg+xml",
    ".txt": "text/plain",
    ".webp": "image/webp",
}


@dataclass(frozen=True, slots=True)
class Page:
    """The page and the hash of its one inline script, which is the import map.

    The nonce, a new one for each answer, is filled in later.
    """

    html: bytes
    script_hash: str


@dataclass(frozen=True, slots=True)
class _File:
    stamp: tuple[int, int]  # time of the last change in ns, size
    plain: bytes
    packed: bytes | None


class Assets:
    """The files below a directory, and those of views by name, held in memory until they change."""

    def __init__(self, directory: Path = STATIC, views: Mapping[str, Path] = MappingProxyType({})) -> None:
        self._directory = directory.resolve(strict=True)
        self._views = {name: folder.resolve(strict=True) for name, folder in views.items()}
        self._files: dict[str, _File] = {}
        self._stamps: dict[str, tuple[int, int]] = {}
        self._version = ""
        self._page = Page(b"", "")

    def page(self) -> Page:
        """Return the current page."""
        paths = {
            _name(view, path.relative_to(folder)): path
            for view, folder in {"": self._directory, **self._views}.items()
            for path in folder.rglob("*")
            if path.is_file()
        }
        stamps = {name: _stamp(path) for name, path in paths.items()}
        if stamps != self._stamps:
            self._files = {name: file for name, file in self._files.items() if stamps.get(name) == file.stamp}
            self._version = _digest(paths)
            self._page = self._make_page()
            self._stamps = stamps
        return self._page

    async def index(self, request: Request) -> Response:
        """Answer the request for the page."""
        page = self.page()
        nonce = secrets.token_urlsafe(16)
        policy = content_security_policy(request.headers["host"], page.script_hash, nonce)
        headers = {"cache-control": "no-store", "content-security-policy": policy}
        html = page.html.replace(_NONCE, nonce.encode())
        return _answer(request, html, gzip.compress(html, 6, mtime=0), "text/html", headers)

    async def file(self, request: Request) -> Response:
        """Answer the request for a file of the page."""
        name, view = request.path_params["path"], request.path_params.get("view", "")
        file = self._file(name, view)
        if file is None:
            raise HTTPException(404)
        current = request.path_params["version"] == self._version
        suffix = Path(name).suffix
        kind = _TYPES.get(suffix) or mimetypes.guess_type(name)[0] or "application/octet-stream"
        headers = {
            "cache-control": "private, max-age=31536000, immutable" if current else "no-cache",
            # In case a file of ours, such as an SVG, is opened as a page.
            "content-security-policy": "default-src 'none'; frame-ancestors 'none'",
        }
        return _answer(request, file.plain, file.packed, kind, headers)

    def _file(self, name: str, view: str) -> _File | None:
        folder = self._views.get(view) if view else self._directory
        if folder is None:
            return None
        try:
            path = (folder / name).resolve(strict=True)
            stamp = _stamp(path)
            if not path.is_relative_to(folder) or not path.is_file():
                return None
        except (OSError, ValueError):  # ValueError: a zero byte
            return None
        name = _name(view, path.relative_to(folder))  # one for each file, however it was requested
        known = self._files.get(name)
        if known is None or known.stamp != stamp:
            plain = path.read_bytes()
            if not name.startswith(_LIBRARIES) and (strip := _STRIPPED.get(path.suffix)) is not None:
                plain = strip(plain.decode()).encode()
            # As small as it gets: it is packed once.
            packed = gzip.compress(plain, mtime=0) if path.suffix in _COMPRESSED else None
            known = self._files[name] = _File(stamp, plain, packed)
        return known

    def _make_page(self) -> Page:
        base = f"./static/{self._version}"  # an import map needs the dot
        views = [f"./plugins/{name}/{self._version}/{ENTRY}" for name in self._views]
        imports = {name: f"{base}/vendor/{name}.js" for name in LIBRARIES} | {"visualhfsm/": f"{base}/"}
        import_map = json.dumps({"imports": imports}, separators=(",", ":"))
        # The browser requests all modules at once instead of one after the other.
        modules = (imports.get(name, f"{base}/{name}") for name in imported_modules(_ENTRY, self._directory))
        preloads = "\n".join(f'<link rel="modulepreload" href="{each}">' for each in (*modules, *views))
        html = (
            (self._directory / "index.html")
            .read_text("utf-8")
            .replace(_IMPORT_MAP, import_map)
            .replace(_PRELOADS, preloads)
            .replace(_LANGUAGES, " ".join(texts_by_language(self._directory)))
            .replace(_VIEWS, "\n".join(f'<script type="module" src="{each}"></script>' for each in views))
            .replace(_VERSION, self._version)
        )
        digest = base64.b64encode(hashlib.sha256(import_map.encode()).digest()).decode()
        return Page(html.encode(), f"sha256-{digest}")


def without_comments(module: str) -> str:
    """Return a module with spaces in place of the comments that fill whole lines.

    All else keeps its line and its column, which errors and debuggers name. ESLint refuses a template in
    which a line looks like a comment.
    """
    return _COMMENTS.sub(lambda comment: re.sub(r"[^\n]", " ", comment[0]), module)


def _without_css_comments(style: str) -> str:
    """Return a style sheet without its comments; all else keeps its line."""
    return _CSS_COMMENTS.sub(lambda comment: "\n" * comment[0].count("\n"), style)


_STRIPPED: Final = {".js": without_comments, ".css": _without_css_comments}
"""The functions that take the comments out of files, by the suffixes of these."""


@functools.cache
def page_assets() -> Assets:
    """Return the editor's own files and those of views, which all servers of a process share."""
    return Assets(views={name: view.static for name, view in VIEWS.items()})


def _name(view: str, path: Path) -> str:
    """Return the name of a file of the page, or of a view."""
    return f"{view}:{path.as_posix()}" if view else path.as_posix()


def _digest(paths: Mapping[str, Path]) -> str:
    digest = hashlib.sha256()
    for name in sorted(paths):
        digest.update(name.encode() + b"\0")
        digest.update(hashlib.sha256(paths[name].read_bytes()).digest())
    return digest.hexdigest()[:12]


def _stamp(path: Path) -> tuple[int, int]:
    status = path.stat()
    return status.st_mtime_ns, status.st_size


def _answer(
    request: Request, plain: bytes, packed: bytes | None, kind: str, headers: dict[str, str]
) -> Response:
    headers |= {"vary": "accept-encoding"}
    if packed is not None and "gzip" in request.headers.get("accept-encoding", ""):
        return Response(packed, media_type=kind, headers=headers | {"content-encoding": "gzip"})
    return Response(plain, media_type=kind, headers=headers)
