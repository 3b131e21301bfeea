"""Load a document with its imports and its extension, to generate its component or to check it."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Final, NamedTuple

from ..code_marks import code_at, read_marks
from ..diagnostics import Diagnostics, Location, Severity
from ..files import GeneratedFile, read_regular
from ..logic import Row
from ..messages import NO_MESSAGE, Message
from ..python_layout import GENERATED_BY
from ..reasons import reason
from ._checks import check, check_effects
from ._effects import CodeEffects
from ._extension import component_path
from ._imports import resolve
from .analysis import Analysis, analyze
from .codes import Code
from .document import Document
from .formats.reader import read_document
from .generator import check_generated, generate
from .known_interfaces import KnownInterfaces, find_interfaces

if TYPE_CHECKING:
    from .model_checker import ModelReport  # slow to import, and not needed for generating

_HEAD: Final = 4000
"""Characters at the beginning of a component that contain the note from what it was generated."""
_ADDED: Final = re.compile(r"( {4})?(async )?(def (?!.*-> Automaton:$)|class (?!.*\bComponent, document=))")
"""The beginning of a function or a class in a component or its class, besides our own."""


class CheckedDocument(NamedTuple):
    """A document with its imports resolved and its code checked, piece by piece; sound if without errors."""

    analysis: Analysis
    interfaces: KnownInterfaces
    is_python: bool
    is_sound: bool


@dataclass(frozen=True, slots=True)
class LoadedDocument:
    """A document with its imports resolved and its code analyzed, and the text of its component.

    `checked` is the report of a quick check, if its proofs are kept in the component.
    """

    document: Document
    effects: CodeEffects
    interfaces: KnownInterfaces
    component: str
    checked: ModelReport | None = None


def compile_document(
    path: Path,
    output: Path | None,
    diagnostics: Diagnostics,
    include: Sequence[Path] = (),
    *,
    with_model: bool = False,
    document: Document | None = None,
    generated: Mapping[Path, str] | None = None,
) -> list[GeneratedFile] | None:
    """Return the component of a document as a file, or None after reporting errors.

    `output` is the directory of the file, by default that of the document. `include` are directories with
    further packages of proxies, and `generated` the texts of such packages that are about to be written, by
    their resolved path. `document` is the parsed content if it has not been saved yet. With `with_model`, a
    short run of the model checker reports what can never happen, and each violated property as an error.
    Errors and warnings are reported, notes are not. Nothing is written.
    """
    found = Diagnostics()
    loaded = load_document(
        path, output, found, include, document=document, generated=generated, keeps_proofs=True
    )
    if loaded is not None and with_model:
        from .model_checker import QUICK_LIMIT, check_model, report_model

        report = loaded.checked or check_model(
            loaded.document, path, limit=QUICK_LIMIT, effects=loaded.effects
        )
        report_model(report, found, quick=True)
    diagnostics.add_all(found, leave_out=[Severity.NOTE])
    if loaded is None or found.has_errors:
        return None
    target = component_path(path, output)
    try:
        if message := _by_hand(target):
            diagnostics.error(Code.FILE_NOT_GENERATED, message, Location(path))
            return None
    except OSError as error:
        message = Message("{file} cannot be read: {reason}", file=str(target), reason=reason(error))
        diagnostics.error(Code.UNREADABLE_FILE, message, Location(path))
        return None
    return [GeneratedFile(target, loaded.component)]


def check_document(
    path: Path,
    diagnostics: Diagnostics,
    include: Sequence[Path] = (),
    *,
    limit: int | None = None,
    document: Document | None = None,
) -> ModelReport | None:
    """Report errors and possible mistakes in a document, and return what its automata can do.

    The model checker explores at most `limit` configurations, by default its DEFAULT_LIMIT. It does not run
    with a limit of 0 or after errors; then the report is None. `include` and `document` are as for
    `load_document`.
    """
    loaded = load_document(path, None, diagnostics, include, document=document)
    return None if loaded is None else explore_document(loaded, path, diagnostics, limit=limit)


def explore_document(
    loaded: LoadedDocument, path: Path, diagnostics: Diagnostics, *, limit: int | None = None
) -> ModelReport | None:
    """Report what the model checker finds in a loaded document, and return it; see `check_document`."""
    if limit is not None and limit <= 0:
        return None

    from .model_checker import DEFAULT_LIMIT, check_model, read_operations, report_model

    limit = DEFAULT_LIMIT if limit is None else limit
    errors = len(diagnostics.errors)
    operations = read_operations(loaded.document, loaded.interfaces, diagnostics)
    if len(diagnostics.errors) > errors:
        return None
    report = check_model(loaded.document, path, operations=operations, limit=limit, effects=loaded.effects)
    report_model(report, diagnostics)
    return report


def load_document(
    path: Path,
    output: Path | None,
    diagnostics: Diagnostics,
    include: Sequence[Path] = (),
    *,
    document: Document | None = None,
    generated: Mapping[Path, str] | None = None,
    keeps_proofs: bool = False,
) -> LoadedDocument | None:
    """Return a loaded document, or None after reporting errors.

    `output` is the directory of its component, by default that of the document. `include` are directories
    with packages of proxies, and with files to import. `document` is the parsed content if it has not been
    saved yet; `generated` are packages of proxies that are about to be written. Its component has what proofs
    rely on if it `keeps_proofs`. States that are never entered or left are reported here where imports are
    missing, since the model checker does not run then.
    """
    checked = check_pieces(path, output, diagnostics, include, document=document, generated=generated)
    return None if checked is None else load_checked(checked, diagnostics, keeps_proofs=keeps_proofs)


def check_pieces(
    path: Path,
    output: Path | None,
    diagnostics: Diagnostics,
    include: Sequence[Path] = (),
    *,
    document: Document | None = None,
    generated: Mapping[Path, str] | None = None,
) -> CheckedDocument | None:
    """Report the errors and mistakes of a document that are found at once; see `load_document`."""
    errors = len(diagnostics.errors)
    if document is None:
        document = read_document(path, diagnostics)
    if document is None:
        return None
    document = resolve(document, path, diagnostics, include)
    interfaces = find_interfaces(path, include, generated)
    analysis = analyze(document, path, output)
    extension = analysis.extension
    if extension is not None and extension.problem:
        diagnostics.add_source(extension.path, extension.source)
        place = Location(extension.path, extension.line, extension.column)
        diagnostics.error(Code.EXTENSION_WITHOUT_CLASS, extension.problem, place)
    is_python = check(analysis, interfaces, diagnostics)
    return CheckedDocument(analysis, interfaces, is_python, len(diagnostics.errors) == errors)


def load_checked(
    checked: CheckedDocument, diagnostics: Diagnostics, *, keeps_proofs: bool = False
) -> LoadedDocument | None:
    """Follow what the code of a checked document does, and generate its component; see `load_document`."""
    errors = len(diagnostics.errors)
    analysis, document = checked.analysis, checked.analysis.document
    effects = CodeEffects(analysis)
    if checked.is_python:
        check_effects(effects, diagnostics)
    if not checked.is_sound:
        if any(each.imported for each in document.automata):
            from .model_checker import report_graph

            report_graph(effects, diagnostics)
        return None
    proofs: list[Row] = []
    report = None
    if keeps_proofs:
        from .model_checker import relied_on

        proofs, report = relied_on(effects)
    component = generate(analysis, checked.interfaces, proofs)
    check_generated(component, analysis, diagnostics)
    if len(diagnostics.errors) > errors:
        return None
    return LoadedDocument(document, effects, checked.interfaces, component.text, report)


def is_generated(file: Path) -> bool:
    """Return whether a file is a generated component, and not written by hand."""
    with file.open(encoding="utf-8", errors="replace") as text:
        return GENERATED_BY in text.read(_HEAD)


def _by_hand(target: Path) -> Message:
    """Return what a person has written at the place of a component, blank if nothing. Raises OSError."""
    if not target.is_file():
        return NO_MESSAGE
    if not is_generated(target):
        return Message(
            "{file} was not generated by codegen: move it, or rename the document", file=target.name
        )
    text = read_regular(target).decode(errors="replace")
    codes = read_marks(text)
    for line, content in enumerate(text.split("\n"), 1):
        if _ADDED.match(content) and code_at(codes, line) is None:
            return Message(
                "{file}:{line} was added by hand: move it into the document", file=target.name, line=line
            )
    return NO_MESSAGE
