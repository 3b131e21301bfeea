"""A drawing as one HTML file, to send it: all automata with their code, notes and frames, without a server.

The file contains the modules of the editor's page that `_editor/static/onefile/drawing-page.js` imports, and
the document. Nothing of the document is executed.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Final

import msgspec

from codegen.hfsm.document import Document
from visualhfsm._base.html_file import html_file
from visualhfsm._document.views import view

_ENTRY: Final = "onefile/drawing-page.js"
_STYLES: Final = tuple(
    f"styles/{name}" for name in ("theme", "shell", "canvas", "panels", "run-page", "drawing-page")
)


def drawing_page(name: str, document: Document, imported: Sequence[Mapping[str, Any]] = ()) -> str:
    """Return the page of a document as HTML; `name` is that of its component.

    `imported` are the views of automata that the document imports, unless it contains them already.
    """
    content = {
        "name": name,
        "document": {**view(document), "automata": [view(each) for each in document.automata]},
        "imported": imported,
    }
    return html_file(name, _ENTRY, _STYLES, msgspec.json.encode(content))
