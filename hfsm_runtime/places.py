"""Look up lines of the running component in its document.

Marks around the code in the component, which `codegen.code_marks` reads, say whose code it is. The document
beside the component says in which line that code is; a document that has changed since says it of the code
that it still has. Without it, a place is a line of the code.
"""

from __future__ import annotations

import ast
import dis
import linecache
import re
from bisect import bisect_right
from collections.abc import Callable, Iterable, Mapping
from contextlib import suppress
from functools import lru_cache
from operator import attrgetter
from pathlib import Path
from traceback import walk_stack, walk_tb
from types import CodeType, FrameType, FunctionType
from typing import Any, Final, NamedTuple
from xml.parsers import expat

from codegen.code_marks import MarkedCode, code_at, library, plain, read_marks

PLACE: Final = "_hfsm_place"
"""The attribute of an exception that has its place with it, as text."""
_SOURCE: Final = "_hfsm_source"
"""The name of the source of a component in its module."""
_DOCUMENT: Final = re.compile(r"^class .*\bComponent, document=(.+?), on_error=", re.MULTILINE)
_IMPORTED: Final = "source="
_PARTS: Final = {"trans": "trigger", "transcode": "fired"}
"""The kinds of code that a document calls otherwise."""


class Source(NamedTuple):
    """What a component says about its document: its file, all code, and the files of imported automata."""

    document: str
    codes: tuple[MarkedCode, ...]
    imported: dict[int, str]


class _Text(NamedTuple):
    """The text of an element of a document, as `plain` has it, and its first line.

    `owner` are the kind of code that it is, and the innermost ids around it.
    """

    owner: tuple[str, int, int]
    text: str
    line: int


class Line(NamedTuple):
    """A line of a component's file; as a text, as `locate` returns it."""

    file: str
    number: int
    source: Source

    @property
    def code(self) -> MarkedCode | None:
        """The code of the document that is in the line; None for a generated line."""
        return code_at(self.source.codes, self.number)

    def __str__(self) -> str:
        place, code = f"{Path(self.file).name}:{self.number}", self.code
        if code is None:
            return place
        return f"{place} ({self.in_document or f'line {self.number - code.first + 1} of {code.key}'})"

    @property
    def in_document(self) -> str:
        """Where it stands in the document, as `follow_ball.xml:31`.

        It is empty where the document is not beside the component, or has this code no longer, or several
        times in imported automata.
        """
        code, source = self.code, self.source
        if code is None:
            return ""
        names = [source.document, *source.imported.values()]  # of a library, or functions of no automaton
        if code.automaton:
            names = [source.imported.get(code.automaton, source.document)]
        for name in filter(None, names):
            document = str(Path(self.file).parent / name)
            linecache.checkcache(document)
            found = [each for each in _texts("".join(linecache.getlines(document))) if each.text == code.text]
            for index, own in enumerate((code.part, code.id, code.automaton)):
                found = [each for each in found if each.owner[index] == own] or found
            if len(found) == 1:
                return f"{name}:{found[0].line + self.number - code.first}"
        return ""


def read_source(component: str) -> Source:
    """Return what the text of a component says about its document."""
    named = _DOCUMENT.search(component)
    codes = read_marks(component)
    imported = {
        each.automaton: str(ast.literal_eval(each.text.removeprefix(_IMPORTED)))
        for each in codes
        if each.part == "automaton"
    }
    return Source(str(ast.literal_eval(named[1])) if named else "", codes, imported)


def keep_source(automaton: FunctionType) -> None:
    """Keep the source of a component with its module; `automaton` is the method of its class.

    The file is read now, so that what is kept is about the running code when the file changes.
    """
    file = automaton.__code__.co_filename
    linecache.checkcache(file)
    automaton.__globals__[_SOURCE] = read_source("".join(linecache.getlines(file)))


def kept_source(namespace: Mapping[str, Any], file: str) -> Source:
    """Return the source that is kept with a component's module; before it has a class, that of its file."""
    return namespace.get(_SOURCE) or read_source("".join(linecache.getlines(file)))


def texts_of_documents(component: str, folder: Path) -> dict[str, str]:
    """Return the documents in a folder from which the text of a component was generated, by name."""
    source, found = read_source(component), {}
    for name in (source.document, *source.imported.values()):
        with suppress(OSError, UnicodeDecodeError):
            found[name] = (folder / name).read_text(encoding="utf-8")
    return found


def keep_in_memory(file: str, text: str, documents: Mapping[str, str]) -> None:
    """Let tracebacks, and lookups of lines, read a component and its documents, which are in no file."""
    for name, content in {**documents, Path(file).name: text}.items():
        path = str(Path(file).parent / name)
        linecache.cache[path] = (len(content), None, content.splitlines(keepends=True), path)


def last_line(error: BaseException, file: str) -> Line | None:
    """Return the innermost line of a component's file in a traceback, None when the file is not involved."""
    return _first_line(reversed([*walk_tb(error.__traceback__)]), file)


def line_of_frame(frame: FrameType, file: str) -> Line | None:
    """Return which line of a component's file a thread executes; `frame` is its innermost one."""
    return _first_line(walk_stack(frame), file)


def _first_line(lines: Iterable[tuple[FrameType, int]], file: str) -> Line | None:
    for frame, number in lines:
        if frame.f_code.co_filename == file:
            return Line(file, number, kept_source(frame.f_globals, file))
    return None


def locate(error: BaseException, file: str) -> str:
    """Return where an exception was raised in a component, as `follow_ball.py:57 (follow_ball.xml:31)`.

    The innermost line of the component's `file` counts. A generated line has only its place in that file; the
    text is empty when the file is not involved. An exception from another process has its place with it.
    """
    place: object = getattr(error, PLACE, None)
    return place if isinstance(place, str) else str(last_line(error, file) or "")


def locate_frame(frame: FrameType, file: str) -> str:
    """Return which line of a component a thread executes, in the same form; `frame` is its innermost one."""
    return str(line_of_frame(frame, file) or "")


def tell_place(error: Exception, place: str) -> None:
    """Give an exception its place, if that is known, where `locate` would find none in the document."""
    if place:
        with suppress(Exception):  # it may be of a class of the document
            setattr(error, PLACE, place)


def place_of_result(function: Callable[..., object]) -> tuple[str, str]:
    """Return where a function of a component returns its value, in the form of `locate`, and its file.

    Of several places it is the first; the texts are empty for what is no function of a component.
    """
    code = getattr(function, "__code__", None)
    if not isinstance(code, CodeType):
        return "", ""
    lines = [
        each.positions.lineno
        for each in dis.get_instructions(code)
        if each.opname.startswith("RETURN_") and each.positions is not None and each.positions.lineno
    ]
    file = code.co_filename
    source = kept_source(getattr(function, "__globals__", {}), file)
    places = (Line(file, number, source) for number in lines)
    return next((str(each) for each in places if each.code is not None), ""), file


def place_of_assignment(functions: Iterable[Callable[..., object]], name: str) -> str:
    """Return where the first function that assigns an outer variable does so last, in the form of `locate`.

    To delete it counts, too. The text is empty if none of them does.
    """
    for function in functions:
        code = getattr(function, "__code__", None)
        if not isinstance(code, CodeType):
            continue
        stores = [
            each.positions.lineno
            for each in dis.get_instructions(code)
            if each.opname in ("STORE_DEREF", "DELETE_DEREF")
            and each.argval == name
            and each.positions is not None
        ]
        if stores and (number := stores[-1]):
            source = kept_source(getattr(function, "__globals__", {}), code.co_filename)
            return str(Line(code.co_filename, number, source))
    return ""


def text_of_guard(guard: Callable[..., object]) -> str:
    """Return the condition of a guard on one line; empty for one outside a generated component."""
    code = getattr(guard, "__code__", None)
    source = getattr(guard, "__globals__", {}).get(_SOURCE)
    if code is None or source is None:
        return ""
    index = bisect_right(source.codes, code.co_firstlineno, key=attrgetter("first"))
    text = "".join(each.text for each in source.codes[index : index + 1])  # what follows the `def`
    return " ".join(text.split()).removeprefix("return ")


@lru_cache(maxsize=8)
def _texts(document: str) -> tuple[_Text, ...]:
    """Return the texts in a document; none if it is not XML."""
    found: list[_Text] = []
    ids: list[int] = []
    pieces: list[str] = []
    line = 0
    parser = expat.ParserCreate()

    def start(_: str, attributes: dict[str, str]) -> None:
        ids.append(int(number) if (number := attributes.get("id", "")).isdecimal() else 0)
        pieces.clear()

    def read(text: str) -> None:
        nonlocal line
        line = line if pieces else parser.CurrentLineNumber
        pieces.append(text)

    def end(tag: str) -> None:
        text = "".join(pieces)
        if text.strip():
            automaton, element, *_ = *filter(None, ids), 0, 0
            blank = len(text) - len(text.lstrip())
            owner = _PARTS.get(tag, tag), element, automaton
            code = library(text) if tag == "lib" else text
            found.append(_Text(owner, plain(code), line + text.count("\n", 0, blank)))
        ids.pop()
        pieces.clear()

    parser.StartElementHandler, parser.EndElementHandler = start, end
    parser.CharacterDataHandler = read
    with suppress(expat.ExpatError):
        parser.Parse(document, True)
    return tuple(found)
