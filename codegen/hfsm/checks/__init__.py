"""Check a document before it runs: its structure and its code, as far as that can be told without running it.

Each module finds one kind of fault; `docs/reference/document-errors.md` lists them by their codes. What the
origin's generated code gave a meaning is a warning and not an error, so that its documents still run.
"""

from __future__ import annotations

from pathlib import Path

from ...diagnostics import Diagnostics
from ..analysis import Analysis, analyze
from ..code.names import RESERVED
from ..code.pieces import is_foreign
from ..document import Document
from ..known_interfaces import KnownInterfaces
from .attributes import check_attributes
from .blocking import check_blocking
from .component import COMPONENT_ATTRIBUTES, ON_ERROR, ON_REFUSED, check_component, check_file_name
from .constants import delay, milliseconds, truth
from .events import check_events
from .flow import assignments_of, check_flow
from .names import check_names, check_start, check_variables
from .report import Report
from .structure import check_arguments, check_automaton, check_tree

__all__ = ["COMPONENT_ATTRIBUTES", "ON_ERROR", "ON_REFUSED", "check", "delay", "milliseconds", "truth"]

_STAR = "*"


def check(
    document: Document,
    path: Path,
    interfaces: KnownInterfaces,
    diagnostics: Diagnostics,
    analysis: Analysis | None = None,
) -> None:
    """Report everything that is wrong or doubtful in a document; what it imports has been resolved.

    Code that is no Python is reported when the component is generated; here it is left out, with all that
    could only be said if it were known. What can never happen the model checker reports. `analysis` is that
    of the document, where it has been made.
    """
    analysis = analysis or analyze(document, path)
    report = Report(path, diagnostics)
    check_file_name(path, analysis.libraries.values(), report)
    check_component(document, interfaces, report)
    check_tree(document, report)
    for automaton in document.automata:
        check_automaton(automaton, report)
    check_arguments(document, report)
    if not is_foreign(document):
        _check_code(analysis, interfaces, report)


def _check_code(analysis: Analysis, interfaces: KnownInterfaces, report: Report) -> None:
    _check_names(analysis, report)
    for code in analysis.automata:
        check_flow(code, report)
        check_variables(code, report)
    if analysis.is_complete:
        check_attributes(analysis, interfaces, report)
        if not analysis.extension.exists:
            for code in analysis.automata:
                check_start(code, analysis.defined, report)
    check_events(analysis, report)
    check_blocking(analysis, report)


def _check_names(analysis: Analysis, report: Report) -> None:
    if _STAR in analysis.libraries:
        return
    interfaces = analysis.document.interfaces
    proxies = {interface.type.strip().rsplit("::", 1)[-1] + "Prx" for interface in interfaces}
    known = {*RESERVED, *analysis.libraries, *proxies, "Event", "Input", "Parameter"}
    for piece in analysis.functions:
        check_names(piece, known, report)
    for code in analysis.automata:
        if not code.broken:
            bound = (assignments_of(piece.tree.body).assigned for piece in code.sharing())
            shared = known.union((item.name for item in code.automaton.inputs), *bound)
            for piece in code.sharing():
                check_names(piece, shared, report)
