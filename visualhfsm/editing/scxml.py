"""SCXML of other programs, taken over as a new document."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Final

from codegen.diagnostics import Diagnostics
from codegen.hfsm.document import Document
from codegen.hfsm.scxml import is_scxml, parse_scxml

from .errors import EditError

__all__ = ["TakenOver", "holds_scxml", "take_over"]

_SUFFIX: Final = ".scxml"
_HEAD: Final = 4096  # bytes in which the root of a file begins


@dataclass(frozen=True, slots=True)
class TakenOver:
    """A document that was made of SCXML; `remarks` tell what of that means nothing here."""

    document: Document
    remarks: tuple[str, ...]


def holds_scxml(name: str, content: bytes) -> bool:
    """Return whether a file is SCXML: by the end of its name, or by its root."""
    return name.lower().endswith(_SUFFIX) or is_scxml(content[:_HEAD])


def take_over(content: bytes, name: str) -> TakenOver:
    """Make a document of SCXML. Raises EditError."""
    diagnostics, remarks = Diagnostics(), Diagnostics()
    document = parse_scxml(content, Path(name), diagnostics, remarks)
    if document is None:
        first = diagnostics.errors[0]
        why = f"line {first.location.line}: {first.message}" if first.location.line else first.message
        raise EditError(f"Cannot open {name}", why, "see docs/scxml.md for what is understood")
    told = [*diagnostics, *remarks]
    lines = (
        f"line {each.location.line}: {each.message}" if each.location.line else each.message for each in told
    )
    return TakenOver(document, tuple(lines))
