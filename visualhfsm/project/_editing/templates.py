"""Templates of new documents: an empty one, and the installed behaviors."""

from __future__ import annotations

import importlib.util
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from codegen.diagnostics import Diagnostics
from codegen.hfsm import parse_document, read_document, resolve, write_document
from codegen.hfsm.document import Automaton, Document
from codegen.messages import Message
from visualhfsm._base.errors import EditError
from visualhfsm._base.languages import ENGLISH, said

EMPTY: Final = "empty"
"""The name of the template that is always there."""

_BEHAVIORS: Final = "behaviors"
_UNTITLED: Final = Message("untitled")


@dataclass(frozen=True, slots=True)
class Template:
    """A template; `path` is the document that is copied, None for the empty one."""

    name: str
    description: str
    path: Path | None


def find_templates() -> list[Template]:
    """Return the templates: the empty one, then the installed behaviors, of each name the first."""
    found = {EMPTY: Template(EMPTY, "An empty component.", None)}
    for directory in _directories():
        for path in sorted(directory.glob("*.xml")):
            document = None if path.stem in found else read_document(path, Diagnostics())
            if document is not None:
                found[path.stem] = Template(path.stem, " ".join(document.description.text.split()), path)
    return list(found.values())


def make_template(name: str, language: str = ENGLISH) -> tuple[str, Document]:
    """Return the name and the content of a document from a template; a blank name is the empty one.

    The document of that is called in a language, one of LANGUAGES.

    The imports of the template are inlined, since the new document may be saved anywhere. Raises EditError
    when there is none of that name.
    """
    if name in ("", EMPTY):
        return said(_UNTITLED, language), Document(automata=(Automaton(id=1),))
    path = next((each.path for each in find_templates() if each.name == name), None)
    document = None if path is None else read_document(path, Diagnostics())
    if path is None or document is None:
        raise EditError(
            "Cannot create a document",
            Message("there is no template {name}", name=name[:40]),
            Message("use {empty}", empty=EMPTY),
        )
    whole = parse_document(write_document(resolve(document, path, Diagnostics())), path, Diagnostics())
    return name, whole or document


def _directories() -> list[Path]:
    """Return where behaviors are installed; their package is not imported."""
    spec = importlib.util.find_spec(_BEHAVIORS)
    return [] if spec is None else [Path(place) for place in spec.submodule_search_locations or ()]
