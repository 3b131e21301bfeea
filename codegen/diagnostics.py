"""Collect the diagnostics of one run, and write them for people, programs and GitHub."""

from __future__ import annotations

import difflib
from collections.abc import Collection, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from enum import StrEnum
from pathlib import Path
from typing import Any

from ._text_layout import Place, TextLayout
from .messages import NO_MESSAGE, Message

_LONGEST_EXCERPT = 160
_COLORS = {"error": "31;1", "warning": "33;1", "note": "36;1", "caret": "32;1", "bold": "1"}


class Severity(StrEnum):
    """The severity of a diagnostic; after an error no file of the run is written."""

    ERROR = "error"
    WARNING = "warning"
    NOTE = "note"


@dataclass(frozen=True, slots=True, order=True)
class Location:
    """A place in a source file.

    `line` and `column` count from 1; line 0 means the whole file. `length` is the number of characters to
    underline.
    """

    path: Path
    line: int = 0
    column: int = 1
    length: int = 1

    def __str__(self) -> str:
        """Return `file:line:column`, or only the file for line 0."""
        path = shown_path(self.path)
        return f"{path}:{self.line}:{self.column}" if self.line else path


def shown_path(path: Path) -> str:
    """Return a path as text, with escapes for characters that control a terminal or are not seen."""
    return "".join(c if c.isprintable() else c.encode("unicode_escape").decode() for c in str(path))


@dataclass(frozen=True, slots=True)
class Misspelt:
    """A name that is written at the place of a diagnostic, and the one that is probably meant.

    At the place of an element it is the value of one of its fields.
    """

    name: str
    meant: str
    field: str = ""


@dataclass(frozen=True, slots=True)
class Note:
    """An explanation of a diagnostic, perhaps with another place in a file, or with what would correct it.

    That is another name, or a `library` that a document lacks.
    """

    message: Message
    location: Location | None = None
    misspelt: Misspelt | None = None
    library: str = ""


@dataclass(frozen=True, slots=True)
class Diagnostic:
    """An error, a warning or a note, with its place and notes that help to fix it.

    `assumes` says what it holds under, if it is not true in any case.
    """

    severity: Severity
    code: str
    message: Message
    location: Location
    notes: tuple[Note, ...] = ()
    assumes: Message = NO_MESSAGE


class Diagnostics:
    """The diagnostics of one run, by file and line, without duplicates.

    Their places are those of the files. With `decoded`, places in texts count decoded characters instead, for
    an editor that shows the texts.
    """

    def __init__(self, *, decoded: bool = False) -> None:
        self._found: dict[tuple[Location, str, str], Diagnostic] = {}
        self._lines: dict[Path, Sequence[str]] = {}
        self._layouts: dict[Path, TextLayout] = {}
        self._decoded = decoded

    def add_source(self, path: Path, text: str) -> None:
        """Remember the text of a file, so that diagnostics can quote its lines."""
        if path not in self._lines:
            self._lines[path] = text.split("\n")

    def add_layout(self, path: Path, layout: TextLayout) -> None:
        """Remember how the texts of a file are written: what is reported from now on may be inside them."""
        if not self._decoded:
            self._layouts.setdefault(path, layout)

    @property
    def sources(self) -> list[Path]:
        """The files that were read."""
        return list(self._lines)

    def error(self, code: str, message: Message, location: Location, notes: Iterable[Note] = ()) -> None:
        """Report a problem that makes the sources unusable, with a code such as `E012`."""
        self._report(Diagnostic(Severity.ERROR, code, message, location, tuple(notes)))

    def warning(
        self,
        code: str,
        message: Message,
        location: Location,
        notes: Iterable[Note] = (),
        *,
        assumes: Message = NO_MESSAGE,
    ) -> None:
        """Report a possible mistake, with a code such as `W003`; the files are written anyway."""
        self._report(Diagnostic(Severity.WARNING, code, message, location, tuple(notes), assumes))

    def note(self, code: str, message: Message, location: Location, notes: Iterable[Note] = ()) -> None:
        """Report a fact that needs no change, with a code such as `N001`."""
        self._report(Diagnostic(Severity.NOTE, code, message, location, tuple(notes)))

    def add_all(self, others: Diagnostics, leave_out: Collection[Severity] = ()) -> None:
        """Add other diagnostics, except the severities in `leave_out`, and the sources that they quote."""
        for path, lines in others._lines.items():
            self._lines.setdefault(path, lines)
        for diagnostic in others._found.values():
            if diagnostic.severity not in leave_out:
                self._add(diagnostic)

    def _report(self, found: Diagnostic) -> None:
        notes = tuple(
            note if note.location is None else replace(note, location=self._in_file(note.location))
            for note in found.notes
        )
        self._add(replace(found, location=self._in_file(found.location), notes=notes))

    def _in_file(self, location: Location) -> Location:
        layout = self._layouts.get(location.path)
        if layout is None:
            return location
        line, column = layout.in_file(Place(location.line, location.column))
        last = layout.in_file(Place(location.line, location.column + location.length - 1))
        length = last.column + 1 - column if last.line == line else location.length
        return Location(location.path, line, column, length)

    def _add(self, diagnostic: Diagnostic) -> None:
        key = (diagnostic.location, diagnostic.code, diagnostic.message)
        self._found.setdefault(key, diagnostic)

    @property
    def has_errors(self) -> bool:
        """Whether there is an error."""
        return any(found.severity is Severity.ERROR for found in self._found.values())

    @property
    def assumptions(self) -> list[Message]:
        """What diagnostics hold under, each once."""
        return [*dict.fromkeys(found.assumes for found in self if found.assumes)]

    @property
    def errors(self) -> list[Diagnostic]:
        """The errors, by file and line."""
        return [found for found in self if found.severity is Severity.ERROR]

    def __iter__(self) -> Iterator[Diagnostic]:
        return iter(
            sorted(self._found.values(), key=lambda found: (found.location, found.code, found.message))
        )

    def __len__(self) -> int:
        return len(self._found)

    def render(self, *, color: bool = False, outcome: str | None = "nothing was written") -> str:
        """Return all diagnostics as text, one block each, then what they assume and the number of errors.

        The number has its `outcome`, and is omitted if that is None.
        """
        blocks = ["\n".join(self._render(found, color)) for found in self]
        blocks += self.assumptions
        errors = sum(found.severity is Severity.ERROR for found in self)
        if errors and outcome is not None:
            count = f"{errors} error{'s' if errors > 1 else ''}"
            blocks.append(f"{count}; {outcome}")
        return "\n".join(blocks)

    def _render(self, found: Diagnostic, color: bool) -> list[str]:
        severity = _paint(f"{found.severity}[{found.code}]", found.severity, color)
        lines = [f"{found.location}: {severity}: {_paint(found.message, 'bold', color)}"]
        lines += self._excerpt(found.location, color)
        for note in found.notes:
            label = _paint("note", "note", color)
            if note.location is None:
                lines.append(f"  {label}: {note.message}")
            else:
                lines.append(f"{note.location}: {label}: {note.message}")
                lines += self._excerpt(note.location, color)
        return lines

    def _excerpt(self, location: Location, color: bool) -> list[str]:
        """Return the source line and a caret line below it, or nothing if there is no source."""
        lines = self._lines.get(location.path, ())
        if not 0 < location.line <= len(lines):
            return []
        text = lines[location.line - 1].rstrip()
        if not text:
            return []
        start = min(location.column - 1, len(text))
        first = max(0, start - _LONGEST_EXCERPT // 2) if len(text) > _LONGEST_EXCERPT else 0
        text = text[first : first + _LONGEST_EXCERPT]
        start -= first
        indent = "".join("\t" if character == "\t" else " " for character in text[:start])
        width = max(1, min(location.length, len(text) - start))
        caret = _paint("^" + "~" * (width - 1), "caret", color)
        return [f"    {_printable(text)}", f"    {indent}{caret}"]


def did_you_mean(
    name: str, known: Iterable[str], field: str | None = None, likeness: float = 0.65
) -> tuple[Note, ...]:
    """Return a note that suggests the known name closest to `name`, or no note if none is similar.

    `likeness` is the least ratio of what they share, as of `difflib`. With a `field` as in `Misspelt` it
    also says what would correct the name, unless another known name is as close.
    """
    candidates = sorted(set(known))
    near = difflib.get_close_matches(name, candidates, n=2, cutoff=likeness)
    if not near:
        near = [candidate for candidate in candidates if candidate.lower() == name.lower()]
    if not near:
        return ()
    ratios = [difflib.SequenceMatcher(None, each, name).ratio() for each in near[:2]]
    is_clear = len(near) == 1 or ratios[0] > ratios[1]
    misspelt = Misspelt(name, near[0], field) if is_clear and field is not None else None
    return (Note(Message("did you mean `{name}`?", name=near[0]), misspelt=misspelt),)


def _printable(text: str) -> str:
    return "".join(
        character if character == "\t" or character.isprintable() else "\N{REPLACEMENT CHARACTER}"
        for character in text
    )


def _paint(text: str, style: str, color: bool) -> str:
    return f"\x1b[{_COLORS[style]}m{text}\x1b[0m" if color else text


# For programs

_GITHUB_LEVELS = {Severity.ERROR: "error", Severity.WARNING: "warning", Severity.NOTE: "notice"}


def as_json(diagnostics: Diagnostics) -> str:
    """Return all diagnostics as a JSON array with one object per line, or `[]`.

    Lines and columns count from 1; a diagnostic about a whole file has neither.
    """
    import json  # imported here, as only a command that has failed needs it

    if not len(diagnostics):
        return "[]"
    return "[\n" + ",\n".join(json.dumps(_object(found)) for found in diagnostics) + "\n]"


def _object(found: Diagnostic) -> dict[str, Any]:
    return {
        "severity": str(found.severity),
        "code": str(found.code),
        "message": found.message,
        **_place(found.location),
        "notes": [
            {"message": note.message, **(_place(note.location) if note.location else {})}
            for note in found.notes
        ],
        **({"assumes": found.assumes} if found.assumes else {}),
    }


def _place(location: Location) -> dict[str, Any]:
    if not location.line:
        return {"path": str(location.path)}
    return {
        "path": str(location.path),
        "line": location.line,
        "column": location.column,
        "length": location.length,
    }


def as_github(diagnostics: Diagnostics) -> str:
    """Return all diagnostics as workflow commands of GitHub, one per line."""
    return "\n".join(_command(found) for found in diagnostics)


def _command(found: Diagnostic) -> str:
    place = found.location
    properties = {"file": str(place.path)}
    if place.line:
        properties["line"] = str(place.line)
        properties["col"] = str(place.column)
        properties["endColumn"] = str(place.column + place.length)
    properties["title"] = f"codegen {found.code}"
    listed = ",".join(f"{name}={_escaped(value, ',:')}" for name, value in properties.items())
    notes = [
        f"note: {note.message}" + (f" ({note.location})" if note.location else "") for note in found.notes
    ]
    if found.assumes:
        notes.append(found.assumes)
    text = "\n".join([found.message, *notes])
    return f"::{_GITHUB_LEVELS[found.severity]} {listed}::{_escaped(text)}"


def _escaped(text: str, special: str = "") -> str:
    """Return text with the characters escaped that would end a workflow command or one of its properties."""
    return "".join(
        f"%{ord(character):02X}" if character in "%\r\n" or character in special else character
        for character in text
    )
