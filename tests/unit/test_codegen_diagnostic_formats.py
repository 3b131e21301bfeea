from __future__ import annotations

import json
from pathlib import Path

from codegen.diagnostic_formats import as_github, as_json
from codegen.diagnostics import Diagnostics, Location, Note


def example() -> Diagnostics:
    diagnostics = Diagnostics()
    first = Note("first, here", Location(Path("a,b.idl"), 1, 2))
    diagnostics.error("E013", "100 % wrong\nreally", Location(Path("a,b.idl"), 3, 4, 5), [first])
    diagnostics.warning("W003", "odd", Location(Path("c:d.idl")), [Note("save it anew")])
    diagnostics.note("N001", "left out", Location(Path("e.idl"), 7, 1))
    return diagnostics


def test_json_says_everything() -> None:
    assert json.loads(as_json(example())) == [
        {
            "severity": "error",
            "code": "E013",
            "message": "100 % wrong\nreally",
            "path": "a,b.idl",
            "line": 3,
            "column": 4,
            "length": 5,
            "notes": [{"message": "first, here", "path": "a,b.idl", "line": 1, "column": 2, "length": 1}],
        },
        {
            "severity": "warning",
            "code": "W003",
            "message": "odd",
            "path": "c:d.idl",
            "notes": [{"message": "save it anew"}],
        },
        {
            "severity": "note",
            "code": "N001",
            "message": "left out",
            "path": "e.idl",
            "line": 7,
            "column": 1,
            "length": 1,
            "notes": [],
        },
    ]
    assert as_json(Diagnostics()) == "[]"


def test_github_gets_annotations_that_nothing_in_them_can_end() -> None:
    assert as_github(example()).splitlines() == [
        (
            "::error file=a%2Cb.idl,line=3,col=4,endColumn=9,title=codegen E013"
            "::100 %25 wrong%0Areally%0Anote: first, here (a,b.idl:1:2)"
        ),
        "::warning file=c%3Ad.idl,title=codegen W003::odd%0Anote: save it anew",
        "::notice file=e.idl,line=7,col=1,endColumn=2,title=codegen N001::left out",
    ]
    assert as_github(Diagnostics()) == ""
