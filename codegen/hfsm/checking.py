"""Check a document without generating anything: all that generation says, and what its automata can do."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from ..diagnostics import Diagnostics
from .document import Document, State, Text, Transition
from .loading import LoadedDocument, load_document
from .model_checker import (
    DEFAULT_LIMIT,
    QUICK_LIMIT,
    ModelReport,
    WhyNever,
    check_model,
    read_operations,
    report_model,
    report_properties,
)
from .model_checker.reporting import STRUCTURAL

__all__ = ["check_document", "report_violations"]

_TOLD = STRUCTURAL | {WhyNever.CHILDREN}
"""What the checks of the structure tell wherever it is so."""


def check_document(
    path: Path,
    diagnostics: Diagnostics,
    include: Sequence[Path] = (),
    *,
    limit: int = DEFAULT_LIMIT,
    document: Document | None = None,
) -> ModelReport | None:
    """Report what is wrong or doubtful in a document, and return what its automata can do.

    The model checker looks at `limit` configurations at most, and not at all with a limit of 0 or after
    errors: then there is no such report. `include` is as for `compile_document`, `document` what the file is
    to hold, as it was read from its text, where it has not been saved yet.
    """
    loaded = load_document(path, None, diagnostics, include, document=document)
    if loaded is None or limit <= 0:
        return None
    schemas = {
        known.file.with_name("schema.json")
        for interface in loaded.document.interfaces
        for known in loaded.interfaces.find(interface.type)
    }
    errors = len(diagnostics.errors)
    operations = read_operations((each for each in sorted(schemas) if each.is_file()), diagnostics)
    if len(diagnostics.errors) > errors:
        return None
    report = check_model(loaded.document, path, operations=operations, limit=limit)
    report_model(_without_known(report, loaded, path, diagnostics), diagnostics, leave_out=_TOLD)
    return report


def report_violations(document: Document, path: Path, diagnostics: Diagnostics) -> None:
    """Report the properties of a document that are violated, or are none, as far as little work tells.

    What it leaves undecided is not told: `check_document` looks longer.
    """
    report_properties(check_model(document, path, limit=QUICK_LIMIT), diagnostics, with_undecided=False)


def _without_known(
    report: ModelReport, loaded: LoadedDocument, path: Path, diagnostics: Diagnostics
) -> ModelReport:
    """Return a report without what other checks have told: where they see a cause, they show it better."""
    told = {(found.location.path, found.location.line, found.location.column) for found in diagnostics}

    def is_told(item: State | Transition, *texts: Text) -> bool:
        return any((item.path or path, place.line, max(1, place.column)) in told for place in (item, *texts))

    automata = loaded.document.automata
    transitions = {
        (automaton.id, transition.id): transition
        for automaton in automata
        for transition in automaton.transitions
        if is_told(transition, transition.trigger, transition.guard)
    }
    states = {(automaton.id, state.id) for automaton, state in loaded.document.states() if is_told(state)}
    for (automaton_id, _), transition in transitions.items():
        states |= {(automaton_id, transition.origin), (automaton_id, transition.destination)}
    root = loaded.document.root
    return replace(
        report,
        transitions=tuple(
            found for found in report.transitions if (found.automaton, found.transition) not in transitions
        ),
        states=tuple(found for found in report.states if (found.automaton, found.state) not in states),
        deadlocks=tuple(
            found for found in report.deadlocks if not root or (root.id, found.state) not in states
        ),
    )
