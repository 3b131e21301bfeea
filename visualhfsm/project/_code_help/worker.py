"""The process that reads code: questions in, answers out, a line of JSON each."""

from __future__ import annotations

import ast
import time
from collections.abc import Iterator, Sequence
from functools import lru_cache
from pathlib import Path
from typing import Any, Final

import msgspec

from codegen.diagnostics import Diagnostics
from codegen.hfsm import parse_document, resolve
from codegen.hfsm.code.text import parse_piece
from codegen.hfsm.document import Document
from codegen.hfsm.known_interfaces import KnownInterface, KnownInterfaces, find_interfaces
from visualhfsm._base.line_process import answer_lines
from visualhfsm._document.places import Place
from zenoh_ice.data import typed

from .completion import complete, explain, signature
from .component import TypedComponent, generate_around
from .parsed_files import keep_parsed_files, with_readable_files
from .protocol import InterfaceDescription, OperationDescription, Question

_INTERFACES_AGE: Final = 30.0
"""Seconds after which generated interfaces are searched again."""
_FINDERS: Final = {"complete": complete, "explain": explain, "signature": signature}


def answer(line: bytes) -> bytes:
    """Answer a question."""
    return msgspec.json.encode(_answer(typed.from_json(line, Question)))


def _answer(question: Question) -> Any:  # noqa: ANN401 - one of several
    path, include = Path(question.path), tuple(Path(each) for each in question.include)
    if question.wanted == "interfaces":
        return describe_interfaces(path, include)
    if question.place is None:
        return None
    period = int(time.monotonic() / _INTERFACES_AGE)
    module = _around(question.document, question.place, path, include, period).with_code(question.code)
    find = _FINDERS[question.wanted]
    return with_readable_files(lambda: find(module, path, question.line, question.column))


def describe_interfaces(path: Path, include: Sequence[Path] = ()) -> list[InterfaceDescription]:
    """Return the interfaces that a document at `path` finds, by name."""
    interfaces = find_interfaces(path, include)
    known = [each for several in interfaces.by_name.values() for each in several]
    return [
        InterfaceDescription(
            each.scoped_name.rsplit("::", 1)[-1], each.scoped_name, list(_operations(each, interfaces))
        )
        for each in sorted(known, key=lambda each: each.scoped_name)
    ]


def _operations(known: KnownInterface, interfaces: KnownInterfaces) -> Iterator[OperationDescription]:
    """Yield the operations that a proxy class declares, then those of the classes that it extends."""
    tree = _tree(known.file)
    for node in tree.body if tree else ():
        if not isinstance(node, ast.ClassDef) or node.name != known.proxy:
            continue
        for method in node.body:
            if isinstance(method, ast.FunctionDef):
                yield OperationDescription(
                    method.name,
                    f"({ast.unparse(method.args)})",
                    ast.unparse(method.returns) if method.returns else "None",
                    ast.get_docstring(method) or "",
                    any(".stream(" in ast.unparse(each) for each in method.decorator_list),
                )
        for base in node.bases:
            for extended in interfaces.find(ast.unparse(base).removesuffix("Prx"))[:1]:
                yield from _operations(extended, interfaces)


@lru_cache(maxsize=64)
def _tree(file: Path) -> ast.Module | None:
    return parse_piece(file.read_text(encoding="utf-8", errors="replace"))


@lru_cache(maxsize=4)
def _document(text: str, path: Path) -> Document:
    """Return the document in a text, with what it imports."""
    document = parse_document(text, path, Diagnostics())
    return Document() if document is None else resolve(document, path, Diagnostics())


@lru_cache(maxsize=16)
def _around(text: str, place: Place, path: Path, include: tuple[Path, ...], _period: int) -> TypedComponent:
    """Return the component around a piece of code; it is the same while the piece is typed."""
    return generate_around(_document(text, path), place, path, find_interfaces(path, include))


if __name__ == "__main__":
    keep_parsed_files()
    answer_lines(answer)
