"""Convert documents of any format to ours, or to one of another program."""

from __future__ import annotations

from pathlib import Path

from codegen.diagnostics import Diagnostics, Location, Note
from codegen.hfsm import parse_document, write_document
from codegen.hfsm.code.former import former_code
from codegen.hfsm.code.language import code_of, is_foreign
from codegen.hfsm.codes import Code
from codegen.hfsm.document import Document
from codegen.hfsm.formats.others import WritableFormat, imported_format
from codegen.hfsm.formats.xml_tree import read_bytes
from codegen.messages import Message
from visualhfsm._document.serialization import read_imported


def convert_document(
    source: Path, diagnostics: Diagnostics, *, to: WritableFormat | None = None, fixes_python2: bool = False
) -> str:
    """Return the text of the new document; it is meaningless after errors were reported.

    Raises ModuleNotFoundError when it `fixes_python2` and what that needs is missing.
    """
    document = read(source, diagnostics)
    if document is None:
        return ""
    if undeclared := former_code().language_of(document):
        place = next(code_of(document, source)).place
        message = Message(
            "most of the code looks like {language}: it is kept, but cannot run", language=undeclared
        )
        note = Note(Message("if it is, declare it: `<language>{language}</language>`", language=undeclared))
        diagnostics.note(Code.KEPT_LANGUAGE, message, place, [note])
    elif not is_foreign(document):
        document = former_code().modernize(document, source, diagnostics, fixes=fixes_python2)
    elif not any(each.code == Code.KEPT_LANGUAGE for each in diagnostics):  # the reader may have reported it
        language = document.language.text.strip()
        first = next(code_of(document, source), None)
        place = Location(source) if first is None else first.place
        message = Message("the code is {language}: it is kept, but cannot run", language=language)
        diagnostics.note(Code.KEPT_LANGUAGE, message, place)
    return write_document(document) if to is None else to.write(document, source, diagnostics)


def read(path: Path, diagnostics: Diagnostics) -> Document | None:
    """Return the document in a file of any format, or None after errors were reported."""
    content = read_bytes(path, diagnostics)
    if content is None:
        return None
    if (other := imported_format(path.name, content)) is not None:
        return read_imported(other, content, path, diagnostics)
    return parse_document(content, path, diagnostics, remarks=diagnostics)
