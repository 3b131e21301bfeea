"""Compile a document to the class of its component, in memory."""

from __future__ import annotations

import builtins
import linecache
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from functools import lru_cache
from itertools import count
from pathlib import Path
from types import ModuleType
from typing import Any, Final

from codegen.diagnostics import Diagnostics
from codegen.hfsm import (
    compile_document,
    interface_directories,
    read_document,
    resolve,
    write_document,
)
from codegen.hfsm.document import Document
from hfsm_runtime import Component
from hfsm_runtime.debugger.reload import components_in
from hfsm_runtime.loading import naming_libraries
from hfsm_runtime.places import keep_in_memory, texts_of_documents
from hfsm_runtime.virtual.errors import ExecutionError, says_it_all

__tracebackhide__ = says_it_all

_MARK: Final = "_in_memory_"
COMPILED: Final = "<compiled>"
"""The folder in the names of components that have no file."""
_numbers = count(1)
_measuring: Final[list[None]] = []
"""An entry for each that measures. Not a context variable: a test that is a coroutine has its own context."""


class DocumentInvalid(ExecutionError, ValueError):
    """A document has errors and cannot be run; the text is that of the compiler."""


def read(path: Path) -> Document:
    """Read a document with all that it imports; raises DocumentInvalid."""
    diagnostics = Diagnostics()
    document = read_document(path, diagnostics)
    if document is not None:
        document = resolve(document, path, diagnostics)
    if document is None or diagnostics.has_errors:
        raise DocumentInvalid(f"{path} cannot be read:\n{diagnostics.render(outcome='')}")
    return document


def document_of(component: type[Component]) -> Path | None:
    """Return the document next to a generated component, or None."""
    path = Path(component.automaton.__code__.co_filename).resolve().with_name(component._hfsm_document or " ")
    return path if path.is_file() else None


@contextmanager
def measurable() -> Iterator[None]:
    """Give the components that are loaded meanwhile names by which coverage.py measures their lines.

    It takes what begins with `<` for code without a file, and what does not for a file that a report needs.
    """
    _measuring.append(None)
    try:
        yield
    finally:
        _measuring.pop()


def load_component(
    document: Path, include: Sequence[Path] = (), *, content: Document | None = None
) -> type[Component]:
    """Compile a document and return the class of its component; raises DocumentInvalid.

    `content` is the parsed content if it has not been saved yet. Nothing is written. Each call makes a new
    module, so that runs share no state; call `forget` when the component no longer runs.
    """
    path = document.resolve()
    if content is None:
        target, text = _compile(path, path.stat().st_mtime_ns, tuple(include))
    else:
        target, text = _compiled(path, tuple(include), content)
    measured = bool(_measuring)
    on_disk = not measured and target.is_file() and target.read_text(encoding="utf-8") == text
    # As long as the component on the disk is up to date, tracebacks and debuggers show its file.
    file = str(target) if on_disk else f"{COMPILED}/{target.name}"
    if measured:
        file = str(target.parent / file)
    if on_disk:
        linecache.checkcache(file)
    else:
        documents = texts_of_documents(text, path.parent)
        if content is not None:
            documents[path.name] = write_document(content)
        keep_in_memory(file, text, documents)
    module = ModuleType(f"{target.stem}{_MARK}{next(_numbers)}")
    module.__file__ = file
    vars(module)["__builtins__"] = dict(vars(builtins))  # with these, its imports can get a virtual `time`
    sys.modules[module.__name__] = module  # dataclasses and pickle look up the module of a class there
    try:
        with importable(target.parent, *include, *interface_directories(path)), naming_libraries(file):
            exec(_code(text, file), vars(module))  # noqa: S102 - it is to run
        (found,) = components_in(module)
    except BaseException:
        del sys.modules[module.__name__]
        raise
    return found


def forget(component: type[Component]) -> None:
    """Unload the module of a component, if `load_component` loaded it."""
    if _MARK in component.__module__:
        sys.modules.pop(component.__module__, None)


@lru_cache(maxsize=64)
def _compile(path: Path, changed: int, include: tuple[Path, ...]) -> tuple[Path, str]:  # noqa: ARG001
    return _compiled(path, include)


def _compiled(path: Path, include: tuple[Path, ...], content: Document | None = None) -> tuple[Path, str]:
    diagnostics = Diagnostics()
    files = compile_document(path, None, diagnostics, include, document=content)
    if files is None:
        raise DocumentInvalid(f"{path} cannot be run:\n{diagnostics.render(outcome='')}")
    (file,) = files
    return file.path, file.text


@lru_cache(maxsize=64)
def _code(text: str, file: str) -> Any:  # noqa: ANN401 - a code object
    return compile(text, file, "exec")


@contextmanager
def importable(*directories: Path) -> Iterator[None]:
    """Let a component import files beside its document, and the packages of stub interfaces."""
    added = [str(path) for path in directories]
    sys.path[:0] = added
    try:
        yield
    finally:
        for path in added:
            sys.path.remove(path)
