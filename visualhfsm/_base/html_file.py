"""One HTML file that needs neither server nor network, with modules of the editor's page and data for them.

Each module is a `data:` URL in an import map, which browsers know without a build step; nothing relative can
be imported from there, so that modules import each other by name. The data are one block of compressed text
in base64: no name or code in them is ever read as HTML or script. The policy of the file allows only scripts
and styles with its nonce, and no connection.
"""

from __future__ import annotations

import base64
import gzip
import html
import json
import os
import posixpath
import re
import secrets
from collections.abc import Sequence
from pathlib import Path
from typing import Final

from codegen.files import read_regular
from visualhfsm._base.errors import VisualHfsmError

STATIC: Final = Path(__file__).parents[1] / "_editor" / "static"
LIBRARIES: Final = ("codemirror", "dagre", "lit", "three", "uplot")
"""Libraries that the page imports by name; each is a file in vendor/."""

_HEAD: Final = """<!doctype html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta http-equiv="Content-Security-Policy\""""
_PAGE: Final = "visualhfsm/"
_UNWRITABLE: Final = "{path}: the page cannot be written: {reason}"
_IMPORT: Final = re.compile(
    r"""^\s*(?:import|export)\s(?:[^"';]*?\sfrom\s)?\s*["'](?P<name>[^"']+)["']""", re.MULTILINE
)


def html_file(
    title: str, entry: str | Path, styles: Sequence[str | Path], data: bytes, *, connects: bool = False
) -> str:
    """Return a file that shows some data: `entry` is the module that finds them in the element `data`.

    `styles` are style sheets of the page, in their order. Those of a plug-in are given by their files. A page
    that `connects` may ask the server that it comes from.
    """
    nonce = secrets.token_urlsafe(16)
    policy = "; ".join(
        [
            "default-src 'none'",
            f"script-src 'nonce-{nonce}'",
            f"style-src 'nonce-{nonce}'",
            "img-src data: blob:",
            *(["connect-src 'self'"] if connects else []),
            "base-uri 'none'",
            "form-action 'none'",
        ]
    )
    modules = {name: _data_url(text) for name, text in imported_modules(entry).items()}
    files = (name if isinstance(name, Path) else STATIC / f"{name}.css" for name in styles)
    sheets = "\n".join(file.read_text("utf-8") for file in files)
    forced = (STATIC / "styles/forced-colors.css").read_text("utf-8")
    packed = base64.b64encode(gzip.compress(data, 6, mtime=0)).decode()
    languages = texts_by_language()
    texts = "\n".join(_texts_block(language, path) for language, path in languages.items())
    return f"""{_HEAD} content="{policy}">
<meta name="viewport" content="width=device-width, initial-scale=1">
<meta name="color-scheme" content="light dark">
<meta name="languages" content="{" ".join(languages)}">
<title>{html.escape(title)}</title>
<style nonce="{nonce}">{sheets}</style>
<style nonce="{nonce}" media="(forced-colors: active)">{forced}</style>
<script nonce="{nonce}" type="importmap">{json.dumps({"imports": modules})}</script>
</head>
<body>
<noscript>This page is shown by a script, but this browser does not allow scripts.</noscript>
{texts}
<script type="text/plain" id="data">{packed}</script>
<script nonce="{nonce}" type="module">import "{next(iter(modules))}";</script>
</body>
</html>
"""


def check_place(path: Path, *, force: bool = False) -> None:
    """Raise VisualHfsmError when nothing can be written there, before the run begins.

    A file that is there must be a page of ours, unless it is overwritten by `force`.
    """
    if not force and path.is_file() and not _is_ours(path):
        raise VisualHfsmError.because(
            "{path} is no page that VisualHFSM wrote: move it, or choose another name", path=str(path)
        )
    directory = path.resolve().parent
    with VisualHfsmError.in_place_of(OSError, _UNWRITABLE, path=str(path)):
        directory.mkdir(parents=True, exist_ok=True)
    if not os.access(directory, os.W_OK):
        raise VisualHfsmError.because(
            "{path}: the page cannot be written: {directory} is not writable",
            path=str(path),
            directory=str(directory),
        )


def _is_ours(path: Path) -> bool:
    """Return whether a file begins as the pages that we write."""
    with VisualHfsmError.in_place_of(OSError, _UNWRITABLE, path=str(path)):
        return read_regular(path, len(_HEAD)) == _HEAD.encode()


def write_html(path: Path, text: str) -> int:
    """Write a file, and return its size in bytes. Raises VisualHfsmError."""
    with VisualHfsmError.in_place_of(OSError, _UNWRITABLE, path=str(path)):
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8")
    return len(text.encode())


def imported_modules(entry: str | Path, directory: Path = STATIC) -> dict[str, str]:
    """Return a module of the page and all that it imports when it is loaded: their text by name.

    That of a plug-in, given by its file, imports those of the page as `visualhfsm/NAME`, and those beside it.

    The names are paths below `directory`, or those of files beside the module of a plug-in; libraries have
    the names by which they are imported. The imports in the texts are by these names, too.
    """
    found: dict[str, str] = {}
    waiting = [entry if isinstance(entry, str) else entry.name]
    while waiting:
        name = waiting.pop(0)
        path = directory / (f"vendor/{name}.js" if name in LIBRARIES else name)
        if isinstance(entry, Path) and "/" not in name and name not in LIBRARIES:
            path = entry.with_name(name)
        if name in found or not path.is_file():
            continue

        def named(match: re.Match[str], folder: str = posixpath.dirname(name)) -> str:
            target = match["name"].removeprefix(_PAGE)
            if target.startswith("."):
                target = posixpath.normpath(posixpath.join(folder, target))
                if target.startswith("../"):
                    return match[0]
            waiting.append(target)
            return match[0].replace(match["name"], target)

        text = path.read_text("utf-8")
        found[name] = text if name in LIBRARIES else _IMPORT.sub(named, text)
    return found


def texts_by_language(directory: Path = STATIC) -> dict[str, Path]:
    """Return the files with the texts of the page by language. English is in the code."""
    return {path.stem: path for path in sorted((directory / "languages").glob("*.json"))}


def _texts_block(language: str, path: Path) -> str:
    texts = path.read_text("utf-8").replace("<", "\\u003c").replace("\n", "")
    return f'<script type="application/json" id="texts-{language}">{texts}</script>'


def _data_url(text: str) -> str:
    return f"data:text/javascript;base64,{base64.b64encode(text.encode()).decode()}"
