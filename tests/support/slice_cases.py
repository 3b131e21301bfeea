"""Small Slice files for every rule, with the verdicts of the reference compiler.

A file of tests/data/slice_cases holds cases like

    -- [ok] a struct
    struct S { int a; };
    -- [main.ice:1] a name that is not defined
    struct S { Undefined a; };
    == [ok] an include
    #include "a.ice"
    module m { struct T { S s; }; };
    ++ a.ice
    module m { struct S { int a; }; };

`--` begins the content of a module `m`, `==` a whole file, `++` another file next to it. Brackets have the place of
the first error and, after a bar, the place of ours where it differs on purpose: `[ok | main.ice:1]`.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from .slice_reference import Verdict

DIRECTORY = Path(__file__).parents[1] / "data" / "slice_cases"
_HEADER = re.compile(r"(?P<kind>--|==) \[(?P<reference>[^|\]]*?)(?: \| (?P<ours>[^\]]*))?\] (?P<title>.*)")


@dataclass(frozen=True, slots=True)
class Case:
    """One case: the texts of its files by name, `main.ice` first, and the two verdicts."""

    title: str
    files: dict[str, str]
    reference: Verdict
    ours: Verdict

    def write(self, directory: Path) -> Path:
        """Write the files into a directory and return the path of the main one."""
        for name, text in self.files.items():
            path = directory / name
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(text)
        return directory / "main.ice"


def all_cases() -> list[Case]:
    """Return every case of the data directory."""
    return [case for path in sorted(DIRECTORY.glob("*.txt")) for case in _read(path)]


def _read(path: Path) -> Iterator[Case]:
    blocks = re.split(r"^(?=-- |== )", path.read_text(), flags=re.MULTILINE)
    for block in blocks[1:]:
        head, _, body = block.partition("\n")
        match = _HEADER.fullmatch(head)
        if match is None:
            raise ValueError(f"{path}: {head!r} is no head of a case")
        text, *others = re.split(r"^\+\+ ", body, flags=re.MULTILINE)
        files = {"main.ice": f"module m {{ {text}}};\n" if match["kind"] == "--" else text}
        for other in others:
            name, _, content = other.partition("\n")
            files[name] = content
        reference = _verdict(match["reference"])
        ours = _verdict(match["ours"]) if match["ours"] else reference
        yield Case(f"{path.stem}: {match['title']}", files, reference, ours)


def _verdict(text: str) -> Verdict:
    if text == "ok":
        return Verdict()
    name, _, line = text.rpartition(":")
    return Verdict((name, int(line)))
