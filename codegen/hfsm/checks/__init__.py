"""Check a document before it runs: its structure and its code, as far as that can be told without running it.

Each module finds one kind of fault; `docs/document-errors.md` lists them by their codes. What the origin's
generated code gave a meaning is a warning and not an error, so that its documents still run.
"""

from __future__ import annotations

import ast
from functools import cache
from pathlib import Path

from ...diagnostics import Diagnostics
from ..code.answers import Answers
from ..code.names import OLD_MODULES, RESERVED
from ..code.pieces import is_foreign
from ..code.python import analyze_library
from ..code.sends import unclear_sends
from ..code.text import CodeError
from ..code.trees import parse_python
from ..document import Document
from ..known_interfaces import KnownInterfaces
from .accesses import accesses, defined_names
from .arguments import check_arguments
from .attributes import check_attributes
from .automata import check_automaton
from .blocking import check_blocking, imported_names
from .component import COMPONENT_ATTRIBUTES, ON_ERROR, ON_REFUSED, check_component, check_file_name
from .constants import delay, milliseconds, truth
from .events import check_events
from .extension import extension_of
from .flow import check_flow
from .graph import Graph, check_graph
from .names import check_names
from .pieces import AutomatonCode, Piece, automaton_code, document_functions
from .report import Report
from .shadows import check_shadows
from .timers import check_timers
from .tree import check_tree
from .variables import check_start, check_variables

__all__ = ["COMPONENT_ATTRIBUTES", "ON_ERROR", "ON_REFUSED", "check", "delay", "milliseconds", "truth"]

_STAR = "*"


def check(document: Document, path: Path, interfaces: KnownInterfaces, diagnostics: Diagnostics) -> None:
    """Report everything that is wrong or doubtful in a document; what it imports has been resolved.

    Code that is no Python is told when the component is generated; here it is left out, with all that could
    only be said if it were known.
    """
    report = Report(path, diagnostics)
    check_file_name(path, _libraries(document).values(), report)
    check_component(document, interfaces, report)
    check_tree(document, report)
    for automaton in document.automata:
        check_automaton(automaton, report)
    check_arguments(document, report)
    if not is_foreign(document):
        _check_behavior(document, path, interfaces, report)


def _check_behavior(document: Document, path: Path, interfaces: KnownInterfaces, report: Report) -> None:
    answers = cache(lambda: Answers(document, has_extension=extension_of(path).exists))
    codes = [automaton_code(automaton, report) for automaton in document.automata]
    graphs = [Graph(automaton) for automaton in document.automata]
    for graph, code in zip(graphs, codes, strict=True):
        check_graph(graph, report)
        check_shadows(document, graph, code, answers, report)
    by_id = {graph.automaton.id: graph for graph in graphs}
    if len(by_id) == len(graphs):
        check_timers(document, by_id, {code.automaton.id: code for code in codes}, report)
    _check_code(document, path, interfaces, graphs, codes=codes, report=report)


def _check_code(
    document: Document,
    path: Path,
    interfaces: KnownInterfaces,
    graphs: list[Graph],
    *,
    codes: list[AutomatonCode],
    report: Report,
) -> None:
    loose, is_complete = document_functions(document, report)
    functions = [*(code.functions for code in codes if code.functions is not None), *loose]
    is_complete = is_complete and not any(code.broken for code in codes)
    modules = _libraries(document)
    _check_names(document, codes, functions, modules, report)
    for graph, code in zip(graphs, codes, strict=True):
        check_flow(graph, code, report)
        check_variables(code, report)
    pieces = [*functions, *(piece for code in codes for piece in code.sharing())]
    found = [access for piece in pieces for access in accesses(piece)]
    extension = extension_of(path)
    if is_complete:
        check_attributes(document, interfaces, extension, pieces=pieces, found=found, report=report)
    own = frozenset().union(*(defined_names(piece) for piece in functions))
    if is_complete and not extension.exists:
        for code in codes:
            check_start(code, own, report)
    if "send" in own:  # what it sends is its own affair
        found, is_complete = [access for access in found if access.name != "send"], False
    is_complete = is_complete and not any(unclear_sends(document, path))
    check_events(document, codes, pieces, found, report, is_complete=is_complete)
    check_blocking(codes, functions, found, modules, report)


def _check_names(
    document: Document,
    codes: list[AutomatonCode],
    functions: list[Piece],
    modules: dict[str, str],
    report: Report,
) -> None:
    if _STAR in modules:
        return
    proxies = {interface.type.strip().rsplit("::", 1)[-1] + "Prx" for interface in document.interfaces}
    known = {*RESERVED, *modules, *proxies, "Event", "Input", "Parameter"}
    for piece in functions:
        check_names(piece, known, report)
    for code in codes:
        if not code.broken:
            shared = known | code.names
            for piece in code.sharing():
                check_names(piece, shared, report)


def _libraries(document: Document) -> dict[str, str]:
    """Return the names that the libraries bind, with what each stands for."""
    found = {module: module for module in (OLD_MODULES if document.is_old else ())}
    for library in document.libraries:
        if library.name.is_blank or not library.is_module:
            continue
        try:
            statement, _ = analyze_library(library.name)
        except CodeError:  # told when the component is generated
            continue
        for node in parse_python(statement).body:
            if isinstance(node, ast.Import | ast.ImportFrom):
                found.update(imported_names(node))
    return found
