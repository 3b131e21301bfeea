"""Report what the reader of SCXML cannot carry, and what it carries in another shape."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from codegen.diagnostics import Diagnostics, Location, Note

from ..formats.xml_tree import XmlElement

__all__ = ["Problems"]


class Problems:
    """What is told of one file; `failed` says that it is no valid SCXML."""

    def __init__(self, path: Path, diagnostics: Diagnostics) -> None:
        self._path = path
        self._diagnostics = diagnostics
        self.failed = False

    def invalid(self, element: XmlElement, message: str, notes: Iterable[Note] = ()) -> None:
        """Report what makes the file no SCXML."""
        self.failed = True
        self._diagnostics.error("E561", message, self._place(element), notes)

    def lost(self, element: XmlElement, message: str) -> None:
        """Tell what is not carried."""
        self._diagnostics.warning("W561", message, self._place(element))

    def approximate(self, element: XmlElement, message: str) -> None:
        """Tell what is carried, but means something else in some cases."""
        self._diagnostics.warning("W562", message, self._place(element))

    def foreign_code(self, element: XmlElement, message: str) -> None:
        """Tell of code that does not run here."""
        self._diagnostics.note("N502", message, self._place(element))

    def reshaped(self, element: XmlElement, message: str) -> None:
        """Tell what is carried in another shape."""
        self._diagnostics.note("N561", message, self._place(element))

    def of_others(self, element: XmlElement, message: str) -> None:
        """Tell what belongs to another program."""
        self._diagnostics.note("N562", message, self._place(element))

    def _place(self, element: XmlElement) -> Location:
        return Location(self._path, element.line, element.column, len(element.tag) + 1)
