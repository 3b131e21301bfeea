"""Check the structure and the code of a document without running it.

Each module finds one kind of problem; `docs/reference/document-errors.md` lists them by code. What worked
with the original generators is a warning and not an error, so that old documents still run.
"""

from __future__ import annotations

from ...diagnostics import Diagnostics, Location, Note
from ...messages import Message
from .._effects import CodeEffects
from ..analysis import Analysis
from ..code.former import former_code
from ..code.language import first_foreign, report_foreign
from ..code.names import COMPONENT_ATTRIBUTES, RESERVED, reserved_names
from ..codes import Code
from ..document import TF
from ..known_interfaces import KnownInterfaces
from ..report import Report
from .attributes import check_attributes, check_old_names
from .blocking import check_blocking
from .component import (
    check_component,
    check_file_name,
    check_functions,
    check_hidden_interfaces,
    check_libraries,
    check_neighbors,
    check_parameters,
)
from .events import check_events
from .flow import check_flow
from .idle import check_idle
from .inputs import check_arguments, check_inputs
from .libraries import KnownLibraries
from .names import check_names, check_reserved, check_start, check_variables
from .outputs import check_outputs, check_results, check_taken
from .scope import Above
from .structure import check_automaton, check_tree
from .survives import check_survives

_STAR = "*"


def check(analysis: Analysis, interfaces: KnownInterfaces, diagnostics: Diagnostics) -> bool:
    """Report errors and possible mistakes in a document whose imports have been resolved, as far as possible.

    Checks that need the whole code are left out if a part of it is not Python. Returns whether its code is
    meant to be: then `check_effects` finds more. The model checker reports what can never happen.
    """
    document = analysis.document
    path = analysis.path
    extension = analysis.extension
    report = Report(path, diagnostics, document.automata)
    report.unseen()
    check_file_name(analysis, report)
    check_neighbors(path, report)
    check_hidden_interfaces(analysis, report)
    check_component(document, interfaces, report)
    check_survives(document, report)
    interfaces.kind.check(document, report)
    check_tree(document, report)
    for automaton in document.automata:
        check_automaton(automaton, report)
    if (foreign := first_foreign(document, path)) is not None:
        report_foreign(foreign, document.language.text.strip()[:20], diagnostics)
        return False
    if len(analysis.problems) > 1 and (undeclared := former_code().language_of(document)):
        _report_language(undeclared, analysis, report)
        return False
    for text, file, error in analysis.problems:
        place = Location(file, error.line, max(1, error.column))
        report.error(Code.BAD_CODE, error.message, place, former_code().notes_about(text.text))
    reserved = reserved_names(document)
    if extension is not None:
        reserved |= {"load_extension", extension.class_name}
    check_libraries(analysis, reserved, report)
    check_parameters(document, check_functions(analysis, report), report)
    automata = {automaton.id: automaton for automaton in reversed(document.automata)}
    for _, state in document.states():
        check_arguments(state, automata, report)
    for code in analysis.automata:
        check_inputs(document, code, reserved, report)
        check_outputs(code, reserved, report)
        check_results(code, automata, report)
        check_reserved(code, reserved, report)
    _check_code(analysis, interfaces, report)
    return True


def check_effects(effects: CodeEffects, diagnostics: Diagnostics) -> None:
    """Report possible mistakes that follow from what the code of a document does."""
    analysis = effects.analysis
    check_events(effects, Report(analysis.path, diagnostics, analysis.document.automata))


def _report_language(language: str, analysis: Analysis, report: Report) -> None:
    """Report once that the code is in another language, instead of each place where it is not Python."""
    first = analysis.problems[0]
    place = Location(first.path, first.error.line, max(1, first.error.column))
    notes = [
        Note(Message("as Python it is wrong here: {error}", error=first.error.message)),
        *former_code().notes_about(first.text.text),
    ]
    message = Message(
        "most of the code looks like {language}: it is kept, but only Python can run", language=language
    )
    report.error(Code.FOREIGN_LANGUAGE, message, place, notes)


def _check_code(analysis: Analysis, interfaces: KnownInterfaces, report: Report) -> None:
    _check_names(analysis, interfaces, report)
    for code in analysis.automata:
        check_flow(code, report, Above(analysis, code))
        check_variables(code, Above(analysis, code), report)
        check_taken(code, report)
    if analysis.is_complete:
        check_attributes(analysis, interfaces, report)
        interfaces.kind.check_uses(analysis, report)
        check_old_names(analysis, report)
        if analysis.extension is None:
            for code in analysis.automata:
                check_start(code, analysis.defined, report)
    check_blocking(analysis, report)
    check_idle(analysis, report)


def _check_names(analysis: Analysis, interfaces: KnownInterfaces, report: Report) -> None:
    if _STAR in analysis.libraries:
        return
    document = analysis.document
    proxies = {each.type.strip().rsplit("::", 1)[-1] + "Prx" for each in document.interfaces}
    known = {*RESERVED, *analysis.libraries, *proxies, "Event", "Input", "Output", "Parameter"}
    if document.ros_messages:
        known |= {*document.ros_messages, TF}
    libraries = KnownLibraries(analysis, interfaces)
    attributes = {
        *COMPONENT_ATTRIBUTES,
        *analysis.defined,
        *(each.name for each in (*document.all_interfaces, *document.parameters)),
    }
    for piece in analysis.functions:
        check_names(piece, known, report, libraries, attributes)
    for code in analysis.automata:
        if not code.broken:
            bound = (piece.bound for piece in code.sharing())
            shared = known.union(code.automaton.declared, code.results, *bound)
            above = Above(analysis, code)
            for piece in code.sharing():
                check_names(piece, shared, report, libraries, attributes, above=above)
