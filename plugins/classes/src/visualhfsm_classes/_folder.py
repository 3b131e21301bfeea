"""The folder of marks: what a person changed in it since it was written last stays, and is named.

`.written.json` has what was written last: of each file its digest, of the table its rows.
"""

from __future__ import annotations

import csv
import hashlib
import io
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from threading import Lock
from typing import Final

import msgspec

from codegen.files import read_regular
from visualhfsm import VisualHfsmError
from visualhfsm.plugins import csv_text
from visualhfsm_classes._errors import GradingError
from visualhfsm_classes._marks import NAME, NOTE, POINTS, REASONS, Listed
from visualhfsm_classes._words import say
from zenoh_ice.data import typed

TABLE: Final = "marks.csv"
_WRITTEN: Final = ".written.json"

_Key = tuple[str, int]
"""The name in a row of the table, and how many rows before it have the same."""
_Row = list[str]


class _Written(msgspec.Struct):
    """What was written last."""

    digests: dict[str, list[str]] = {}
    """Of each file; two if the command was ended between noting a file and writing it."""
    rows: list[_Row] = []
    """The table, its head first."""
    pages: dict[str, str] = {}
    """The page of each name in the table."""


class MarksFolder:
    """A folder in which marks are written, from several threads, beside what a person changed there."""

    def __init__(self, path: Path, language: str) -> None:
        """Make the folder if there is none. Raises GradingError."""
        self.path: Final = path
        self.kept: Final[list[str]] = []
        """What was kept because somebody had changed it: files, and rows as `marks.csv: NAME`."""
        self._language = language
        self._replaced: set[str] = set()
        self._lock = Lock()
        with GradingError.in_place_of(OSError, "{folder} cannot be made: {reason}", folder=str(path)):
            path.mkdir(parents=True, exist_ok=True)
        try:
            self._written = typed.from_json(read_regular(path / _WRITTEN), _Written)
        except (OSError, msgspec.MsgspecError):  # then all that is there counts as a person's
            self._written = _Written()

    def changed(self, files: Iterable[str]) -> list[str]:
        """Return what somebody changed of the table and of some files, by its names in `kept`."""
        found = [name for name in files if not self._is_ours(name)]
        now = self._table_now()
        if now is None or self._is_ours(TABLE):
            return found
        if now[:1] != self._written.rows[:1]:
            return [TABLE, *found]
        return [*(_item(key) for key in self._edited(now)), *found]

    def replace(self, item: str) -> None:
        """Let something that somebody changed be replaced."""
        self._replaced.add(item)

    def write(self, name: str, content: bytes) -> None:
        """Write a file, unless somebody has changed it. Raises VisualHfsmError."""
        with self._lock:
            if name in self._replaced or self._is_ours(name, content):
                self._put(name, content)
            else:
                self.kept.append(name)

    def write_table(self, table: Sequence[Sequence[str]], pages: Mapping[str, str]) -> list[Listed]:
        """Write the table, its head first, and return its rows; `pages` has those of all names.

        A row that somebody changed stays, and so does one whose document has gone; each says so in its note.
        A table whose columns somebody changed stays whole. Raises VisualHfsmError.
        """
        head, *rows = _parsed(csv_text(table))
        pages = {**self._written.pages, **pages}
        now = self._table_now() or []
        ours = self._is_ours(TABLE)
        if not ours and TABLE not in self._replaced and not now[:1] == self._written.rows[:1] == [head]:
            self.kept.append(TABLE)
            return _listed(head, rows, pages)
        edited = set() if ours or TABLE in self._replaced else self._edited(now)
        edited = {key for key in edited if _item(key) not in self._replaced}
        before, last = _by_key(now, head), _by_key(self._written.rows, head)
        new = _by_key([head, *rows], head)
        merged: list[_Row] = []
        written: list[_Row] = []
        for key in [*new, *(key for key in before if key not in new)]:
            row = as_written = new.get(key) or before[key]
            if key in edited or key not in new:
                row, as_written = before[key], last.get(key, [])
                if as_written:
                    note = self._note(row, new.get(key))
                    row = [*row[:-1], note if row[-1] == as_written[-1] else row[-1]]
                    as_written = [*as_written[:-1], note]
                if key in edited:
                    self.kept.append(_item(key))
            merged.append(row)
            written += [as_written] * bool(as_written)
        self._written.rows, self._written.pages = [head, *written], pages
        self._put(TABLE, csv_text([head, *merged]).encode("utf-8-sig"), ours=merged == written)
        return _listed(head, merged, pages)

    def _note(self, row: _Row, new: _Row | None) -> str:
        """Return why a row is not that of a document of now."""
        if new is None:
            return say(self._language, "gone")
        if new[:-1] == row[:-1]:
            return ""
        return say(self._language, "by hand", points=new[POINTS], document=new[-3])

    def _edited(self, now: Sequence[_Row]) -> set[_Key]:
        head = now[0]
        last = _by_key(self._written.rows, head)
        return {key for key, row in _by_key(now, head).items() if row != last.get(key)}

    def _table_now(self) -> list[_Row] | None:
        """Return the table that is there, None if there is none; empty if it is none of ours."""
        try:
            return _parsed(read_regular(self.path / TABLE).decode("utf-8-sig"))
        except FileNotFoundError:
            return None
        except (OSError, UnicodeDecodeError, csv.Error):
            return []

    def _is_ours(self, name: str, content: bytes | None = None) -> bool:
        """Return whether there is no such file, or it is as it was written, or as it will be."""
        with VisualHfsmError.in_place_of(
            OSError, "{path}: the page cannot be written: {reason}", path=str(self.path / name)
        ):
            try:
                now = read_regular(self.path / name)
            except FileNotFoundError:
                return True
        return now == content or _digest(now) in self._written.digests.get(name, ())

    def _put(self, name: str, content: bytes, *, ours: bool = True) -> None:
        """Note a file, unless it has something of a person, and write it."""
        digests = self._written.digests
        digests[name] = [*digests.get(name, [])[-1:], _digest(content)] if ours else []
        self._replace(_WRITTEN, msgspec.json.encode(self._written))
        self._replace(name, content)
        digests[name] = digests[name][-1:]

    def _replace(self, name: str, content: bytes) -> None:
        path = self.path / name
        with VisualHfsmError.in_place_of(
            OSError, "{path}: the page cannot be written: {reason}", path=str(path)
        ):
            part = path.with_name(f".{name}.part")
            part.write_bytes(content)
            part.replace(path)


def _listed(head: _Row, rows: Iterable[_Row], pages: Mapping[str, str]) -> list[Listed]:
    reasons = head.index(REASONS)
    return [Listed(row[NAME], pages.get(row[NAME], ""), row[POINTS], row[reasons], row[NOTE]) for row in rows]


def _by_key(table: Sequence[_Row], head: _Row) -> dict[_Key, _Row]:
    """Return the rows of a table with the columns of a head, by their names."""
    if not table:
        return {}
    seen: Counter[str] = Counter()
    found: dict[_Key, _Row] = {}
    for cells in table[1:]:
        row = cells
        if table[0] != head:
            known = dict(zip(table[0], cells, strict=False))
            row = [known.get(column, "") for column in head]
        if not any(row):
            continue
        row = [*row, *[""] * (len(head) - len(row))]
        found[row[NAME], seen[row[NAME]]] = row
        seen[row[NAME]] += 1
    return found


def _parsed(text: str) -> list[_Row]:
    return [*csv.reader(io.StringIO(text, newline=""))]


def _item(key: _Key) -> str:
    return f"{TABLE}: {key[0]}"


def _digest(content: bytes) -> str:
    return hashlib.sha256(content).hexdigest()
