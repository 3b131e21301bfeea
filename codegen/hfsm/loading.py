"""Load a document with all that it imports and extends: to make a component of it, or only to check it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Final

from ..diagnostics import Diagnostics, Location, Severity
from ..files import GeneratedFile
from .analysis import Analysis, analyze
from .checks import check
from .codes import Code
from .document import Document
from .extension import component_path
from .formats.reader import read_document
from .generator import GENERATED_BY, check_component, generate
from .imports import resolve
from .known_interfaces import KnownInterfaces, find_interfaces

if TYPE_CHECKING:
    from .model_checker import ModelReport  # it takes its time to load, and generating can do without

__all__ = ["LoadedDocument", "check_document", "compile_document", "load_document"]

_HEAD: Final = 4000
"""Characters of a file in which a component says what it was generated from."""


@dataclass(frozen=True, slots=True)
class LoadedDocument:
    """A document with its imports resolved and its code analyzed, and the text of its component."""

    document: Document
    analysis: Analysis
    interfaces: KnownInterfaces
    component: str


def compile_document(
    path: Path,
    output: Path | None,
    diagnostics: Diagnostics,
    include: Sequence[Path] = (),
    *,
    with_model: bool = False,
) -> list[GeneratedFile] | None:
    """Return the component of a document as a file, or None after errors were reported.

    `output` is the directory of the file, by default that of the document. `include` are directories with
    packages of proxies beside the package `interfaces`. `with_model` reports what is seen at once never to
    happen, and makes an error of each property that is seen at once to be violated. Errors and warnings are
    reported, without notes. Nothing is written.
    """
    found = Diagnostics()
    loaded = load_document(path, output, found, include)
    if loaded is not None and with_model:
        _report_violations(loaded, path, found)
    diagnostics.add_all(found, leave_out=[Severity.NOTE])
    if loaded is None or found.has_errors:
        return None
    target = component_path(path, output)
    try:
        if target.is_file() and not _is_generated(target):
            message = f"{target.name} was not made by codegen: move it away, or rename the document"
            diagnostics.error(Code.FILE_IN_THE_WAY, message, Location(path))
            return None
    except OSError as error:
        diagnostics.error(
            Code.UNREADABLE_FILE, f"{target} cannot be read: {error.strerror or error}", Location(path)
        )
        return None
    return [GeneratedFile(target, loaded.component)]


def _report_violations(loaded: LoadedDocument, path: Path, diagnostics: Diagnostics) -> None:
    """Report what can never happen, and properties that are violated or invalid, as far as little work tells.

    What it leaves undecided is not reported: `check_document` looks longer.
    """
    from .model_checker import QUICK_LIMIT, check_model, report_model

    report = check_model(loaded.document, path, limit=QUICK_LIMIT, analysis=loaded.analysis)
    report_model(report, diagnostics, quick=True)


def check_document(
    path: Path,
    diagnostics: Diagnostics,
    include: Sequence[Path] = (),
    *,
    limit: int | None = None,
    document: Document | None = None,
) -> ModelReport | None:
    """Report what is wrong or doubtful in a document, and return what its automata can do.

    The model checker looks at `limit` configurations at most, by default at its DEFAULT_LIMIT, and not at all
    with a limit of 0 or after errors: then there is no such report. `include` and `document` are as for
    `load_document`.
    """
    from .model_checker import DEFAULT_LIMIT, check_model, read_operations, report_model

    loaded = load_document(path, None, diagnostics, include, document=document)
    limit = DEFAULT_LIMIT if limit is None else limit
    if loaded is None or limit <= 0:
        return None
    errors = len(diagnostics.errors)
    operations = read_operations(loaded.document.interfaces, loaded.interfaces, diagnostics)
    if len(diagnostics.errors) > errors:
        return None
    report = check_model(loaded.document, path, operations=operations, limit=limit, analysis=loaded.analysis)
    report_model(report, diagnostics)
    return report


def load_document(
    path: Path,
    output: Path | None,
    diagnostics: Diagnostics,
    include: Sequence[Path] = (),
    *,
    document: Document | None = None,
) -> LoadedDocument | None:
    """Return what a document says, or None after errors were reported.

    `output` is the directory of its component, by default that of the document. `include` are directories
    with packages of proxies, and with files to import. `document` is what the file is to hold, as it was
    read from its text, where it has not been saved yet.
    """
    errors = len(diagnostics.errors)
    if document is None:
        document = read_document(path, diagnostics)
    if document is None:
        return None
    document = resolve(document, path, diagnostics, include)
    if len(diagnostics.errors) > errors:
        return None
    interfaces = find_interfaces(include)
    analysis = analyze(document, path, output)
    extension = analysis.extension
    if extension is not None and extension.problem:
        diagnostics.add_source(extension.path, extension.source)
        place = Location(extension.path, extension.line, extension.column)
        diagnostics.error(Code.EXTENSION_WITHOUT_CLASS, extension.problem, place)
    check(analysis, interfaces, diagnostics)
    if len(diagnostics.errors) > errors:
        return None
    component = generate(analysis, interfaces)
    check_component(component, path, diagnostics)
    if len(diagnostics.errors) > errors:
        return None
    return LoadedDocument(document, analysis, interfaces, component.text)


def _is_generated(file: Path) -> bool:
    with file.open(encoding="utf-8", errors="replace") as text:
        return GENERATED_BY in text.read(_HEAD)
