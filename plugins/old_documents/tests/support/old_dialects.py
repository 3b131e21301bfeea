"""Documents in the dialects of the original editors."""

from __future__ import annotations

from pathlib import Path
from typing import Final

from codegen.diagnostics import Diagnostics
from codegen.hfsm import parse_document
from codegen.hfsm.document import Document, Transition
from tests.support.places import DATA

__all__ = ["SPANISH", "VISUALSTATES", "in_spanish", "in_states", "read", "shape"]

SPANISH: Final = (DATA / "old_documents/spanish.xml").read_text("utf-8")
"""A document of 2013."""
VISUALSTATES: Final = (DATA / "old_documents/visualstates.xml").read_text("utf-8")
"""A document of VisualStates."""


def read(text: str) -> tuple[Document, list[str]]:
    """Return the document and what was found and remarked, each as code and message."""
    diagnostics = Diagnostics()
    document = parse_document(text, Path("old.xml"), diagnostics, remarks=diagnostics)
    assert document is not None, diagnostics.render()
    return document, [f"{found.code}: {found.message}" for found in diagnostics]


def in_spanish(inside: str) -> Document:
    """Return a document of 2013 with this in its automaton."""
    head = "<VisualHFSM><SubAutomata><idSub>1</idSub>"
    return read(f"{head}{inside}</SubAutomata></VisualHFSM>")[0]


def in_states(inside: str, before: str = "") -> Document:
    """Return a document of VisualStates with these states in its outermost."""
    return read(
        f'<VisualStates>{before}<state id="0" initial="True"><name>root</name>{inside}</state></VisualStates>'
    )[0]


def shape(transition: Transition) -> tuple[object, ...]:
    """Return what a transition is made of."""
    ends = (transition.origin, transition.destination)
    place = (transition.x, transition.y)
    return (transition.id, transition.name, *ends, transition.type, transition.trigger.text, *place)
