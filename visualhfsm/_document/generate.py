"""Generate the component of a document and write its file."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from codegen.diagnostics import Diagnostics
from codegen.files import FilesNotWrittenError, apply, compare_with_disk, is_regular, read_regular
from codegen.hfsm import compile_document
from codegen.hfsm.document import Document
from visualhfsm._base.errors import VisualHfsmError


def generate_component(
    path: Path,
    output: Path | None,
    diagnostics: Diagnostics,
    include: Sequence[Path] = (),
    *,
    document: Document | None = None,
    written: dict[Path, bytes] | None = None,
) -> Path | None:
    """Write the component of a document; return its file, or None after errors, when nothing is written.

    `output` is the directory of the file, by default that of the document. `document` is the parsed content
    of the document if it has not been saved yet. Raises VisualHfsmError when the file cannot be written, or
    is not as it was `written` last.
    """
    files = compile_document(path, output, diagnostics, include, with_model=True, document=document)
    if files is None:
        return None
    ((path, text),) = ((each.path, each.text.encode()) for each in files)
    with VisualHfsmError.in_place_of(FilesNotWrittenError):
        now = read_regular(path) if is_regular(path) else text
        if written is not None and now not in (text, written.get(path, now)):
            raise VisualHfsmError.because(
                "{file} was changed since it was generated here, and that would be lost: move the change "
                "into the document, and delete the file",
                file=path.name,
            )
        apply(compare_with_disk(files))
    if written is not None:
        written[path] = text
    return path
