"""Check a document without generating anything: all that generation says, and what its automata can do."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from ..diagnostics import Diagnostics
from .document import Document
from .loading import LoadedDocument, load_document
from .model_checker import (
    DEFAULT_LIMIT,
    QUICK_LIMIT,
    ModelReport,
    check_model,
    read_operations,
    report_impossible,
    report_model,
    report_properties,
)

__all__ = ["check_document", "report_violations"]


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
    report = check_model(loaded.document, path, operations=operations, limit=limit, analysis=loaded.analysis)
    report_model(report, diagnostics)
    return report


def report_violations(loaded: LoadedDocument, path: Path, diagnostics: Diagnostics) -> None:
    """Report what can never happen, and properties that are violated or invalid, as far as little work tells.

    What it leaves undecided is not reported: `check_document` looks longer.
    """
    report = check_model(loaded.document, path, limit=QUICK_LIMIT, analysis=loaded.analysis)
    report_impossible(report, diagnostics)
    report_properties(report, diagnostics, with_undecided=False)
