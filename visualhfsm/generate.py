"""Generate the component of a document and write its file."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from codegen.diagnostics import Diagnostics
from codegen.files import FilesNotWrittenError, apply, compare_with_disk
from codegen.hfsm import compile_document
from visualhfsm.errors import VisualHfsmError


def generate_component(
    document: Path, output: Path | None, diagnostics: Diagnostics, include: Sequence[Path] = ()
) -> Path | None:
    """Write the component of a document; return its file, or None after errors, when nothing is written.

    `output` is the directory of the file, by default that of the document. Raises VisualHfsmError when the
    file cannot be written.
    """
    files = compile_document(document, output, diagnostics, include, with_model=True)
    if files is None:
        return None
    try:
        apply(compare_with_disk(files))
    except FilesNotWrittenError as error:
        raise VisualHfsmError(str(error)) from error
    return files[0].path
