"""The tests of a document, in files that name it, beside it or in a folder `tests`, and what they report."""

from __future__ import annotations

import ast
import contextlib
import importlib.util
import sys
import zlib
from collections.abc import Iterable, Iterator
from itertools import islice
from pathlib import Path
from typing import Final, Literal

import msgspec

from codegen.messages import NO_MESSAGE, Message
from codegen.parsing import parse_python
from visualhfsm._document.places import Place

Files = dict[Path, tuple[int, int]]
"""Files with the time of their last change, in nanoseconds, and their size in bytes."""

FOLDER: Final = "tests"
PATTERN: Final = "test_*.py"
END_OF_RESULTS: Final = b"\n\n"
"""How the results of tests end once all have run: with a blank line."""
MOST_FILES: Final = 200
MOST_TESTS: Final = 300
CONFIGURATIONS: Final = ("pyproject.toml", "pytest.ini", "tox.ini", "setup.cfg")
_LARGEST_FILE: Final = 1 << 20  # bytes
_ONE_PROCESS: Final = ("-n0",) if importlib.util.find_spec("xdist") else ()
"""The option that runs all tests in one process, whatever a project prefers: it writes the results."""


def version_of(text: str) -> int:
    """Return a number by which the text of a piece of code is known again."""
    return zlib.crc32(text.encode())


class Hit(msgspec.Struct, frozen=True, array_like=True):
    """How often a state was `entered`, a transition `fired`, or its guard `true` or `false`, in a test."""

    document: str
    """The absolute path of the document."""
    automaton: int
    kind: str
    id: int
    count: int


class CodeRun(msgspec.Struct, frozen=True, array_like=True):
    """The lines of a piece of code that hold a statement, from 1, and which of them a test ran."""

    document: str
    """The absolute path of the document."""
    place: Place
    version: int
    """The version of the text of the code."""
    lines: tuple[int, ...]
    ran: tuple[int, ...]
    failed: tuple[int, ...] = ()
    """The lines through which the exception went by which the test failed."""


class TestResult(msgspec.Struct, frozen=True, kw_only=True):
    """How a test went: a line of the file that the plugin of pytest writes."""

    __test__ = False  # pytest would take it for tests

    name: str
    """Of its file and function, as pytest calls it."""
    outcome: Literal["passed", "failed", "skipped"]
    seconds: float = 0.0
    reason: str = ""
    timeline: str = ""
    hits: tuple[Hit, ...] = ()
    ended: tuple[Hit, ...] = ()
    """The states that were current when it failed."""
    code: tuple[CodeRun, ...] = ()
    """Code that ran nowhere is said by the first test that might have run it."""
    unmeasured: Message = NO_MESSAGE
    """Why it is not known which lines ran."""


def test_files(path: Path, root: Path) -> Files:
    """Return the files that may contain tests of a document."""
    top = top_of(path, root)
    folders = dict.fromkeys((path.parent, path.parent / FOLDER, path.parent.parent / FOLDER, top / FOLDER))
    inside = [folder for folder in folders if folder.is_relative_to(top)]
    files = (file for folder in inside for file in sorted(folder.glob(PATTERN)))
    states: Files = {}
    for file in islice(dict.fromkeys(files), MOST_FILES):
        with contextlib.suppress(OSError):  # it has just gone
            status = file.stat()
            states[file] = (status.st_mtime_ns, status.st_size)
    return states


def find_tests(files: Files, path: Path, root: Path) -> list[str]:
    """Return the names of the tests of a document: their file below the top of the project, and function."""
    top = top_of(path, root)
    found: list[str] = []
    for file in files:
        name = file.relative_to(top).as_posix()
        try:
            found += (f"{name}::{each}" for each in test_functions(file, path.name))
        except (SyntaxError, ValueError, RecursionError):
            found.append(name)  # pytest says what is wrong with it
    return found[:MOST_TESTS]


def test_functions(file: Path, document: str) -> Iterator[str]:
    """Yield the tests of a file that names a document; raise what Python raises if it cannot be read."""
    try:
        if not file.is_file() or file.stat().st_size > _LARGEST_FILE:
            return
        text = file.read_text("utf-8", "replace")
    except OSError:
        return
    for node in parse_python(text).body if document in text else ():
        if isinstance(node, ast.FunctionDef) and node.name.startswith("test"):
            yield node.name
        elif isinstance(node, ast.ClassDef) and node.name.startswith("Test"):
            methods = [each for each in node.body if isinstance(each, ast.FunctionDef)]
            yield from (f"{node.name}::{each.name}" for each in methods if each.name.startswith("test"))


def top_of(path: Path, root: Path) -> Path:
    """Return the folder of a project: the nearest one with a configuration of pytest, or the root."""
    for folder in path.parents:
        if not folder.is_relative_to(root):
            break
        if any((folder / name).is_file() for name in CONFIGURATIONS):
            return folder
    return root if path.is_relative_to(root) else path.parent


def tests_command(top: Path, places: Iterable[str], results: Path) -> list[str]:
    """Return the command that runs tests, by names below the top of a project; results go to a file."""
    return [
        *(sys.executable, "-P", "-m", "pytest", "-q", *_ONE_PROCESS),
        *(f"--rootdir={top}", f"--hfsm-results={results}", *(str(top / place) for place in places)),
    ]
