"""Generate the component of a document and write its file."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from codegen.diagnostics import Diagnostics
from codegen.files import FilesNotWrittenError, apply, compare_with_disk
from codegen.hfsm import compile_document
from codegen.hfsm.document import Document
from visualhfsm._errors import VisualHfsmError


def generate_component(
    path: Path,
    output: Path | None,
    diagnostics: Diagnostics,
    include: Sequence[Path] = (),
    *,
    document: Document | None = None,
) -> Path | None:
    """Write the component of a document; return its file, or None after errors, when nothing is written.

    `output` is the directory of the file, by default that of the document. `document` is the parsed content
    of the document if it has not been saved yet. Raises VisualHfsmError when the file cannot be written.
    """
    files = compile_document(path, output, diagnostics, include, with_model=True, document=document)
    if files is None:
        return None
    try:
        apply(compare_with_disk(files))
    except FilesNotWrittenError as error:
        raise VisualHfsmError(str(error)) from error
    return files[0].path


def summary(diagnostics: Diagnostics) -> str:
    """Return why nothing was generated: the first error, and the number of the others."""
    errors = diagnostics.errors
    more = f" (and {len(errors) - 1} more)" if len(errors) > 1 else ""
    return f"nothing was generated: {errors[0].message}{more}"
