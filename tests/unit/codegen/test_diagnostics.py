from __future__ import annotations

import json
from pathlib import Path

from codegen.diagnostics import Diagnostics, Location, Note, as_github, as_json, did_you_mean
from codegen.messages import Message

PATH = Path("robot.idl")


def collected(text: str = "module m {\n\tstrng name;\n};\n") -> Diagnostics:
    diagnostics = Diagnostics()
    diagnostics.add_source(PATH, text)
    return diagnostics


def test_an_error_shows_its_line_a_caret_and_its_notes() -> None:
    diagnostics = collected()
    notes = [
        Note(Message("did you mean `string`?")),
        Note(Message("first defined here"), Location(PATH, 1, 8, 1)),
    ]
    diagnostics.error("E012", Message("`strng` is not defined"), Location(PATH, 2, 2, 5), notes)
    assert diagnostics.render().splitlines() == [
        "robot.idl:2:2: error[E012]: `strng` is not defined",
        "    \tstrng name;",
        "    \t^~~~~",
        "  note: did you mean `string`?",
        "robot.idl:1:8: note: first defined here",
        "    module m {",
        "           ^",
        "1 error; nothing was written",
    ]


def test_findings_come_in_the_order_of_files_and_lines_and_each_once() -> None:
    diagnostics = collected()
    for line in (3, 1, 3):
        diagnostics.error("E001", Message("wrong"), Location(PATH, line))
    diagnostics.error("E001", Message("wrong"), Location(Path("a.idl"), 9))
    assert [str(found.location) for found in diagnostics] == ["a.idl:9:1", "robot.idl:1:1", "robot.idl:3:1"]


def test_a_warning_is_not_an_error() -> None:
    diagnostics = collected()
    diagnostics.warning("W001", Message("doubtful"), Location(PATH, 1))
    assert len(diagnostics) == 1
    assert not diagnostics.has_errors
    assert "warning[W001]" in diagnostics.render()
    assert "written" not in diagnostics.render()


def test_a_long_line_is_cut_around_the_place() -> None:
    diagnostics = collected("x" * 5000 + "!" + "y" * 5000)
    diagnostics.error("E002", Message("unexpected"), Location(PATH, 1, 5001))
    _, excerpt, caret, _ = diagnostics.render().splitlines()
    assert len(excerpt) < 200
    assert excerpt[caret.index("^")] == "!"


def test_a_place_outside_the_source_is_shown_without_an_excerpt() -> None:
    diagnostics = collected()
    diagnostics.error("E001", Message("cannot be read"), Location(Path("absent.idl")))
    assert diagnostics.render().splitlines()[0] == "absent.idl: error[E001]: cannot be read"


def test_control_characters_of_a_source_do_not_reach_the_terminal() -> None:
    diagnostics = collected("\x1b[31mred")
    diagnostics.error("E002", Message("unexpected"), Location(PATH, 1))
    assert "\x1b" not in diagnostics.render()
    assert "\x1b" in diagnostics.render(color=True)


def test_a_near_name_is_proposed_and_a_far_one_is_not() -> None:
    assert did_you_mean("flot", ["int", "float"])[0].message == "did you mean `float`?"
    assert did_you_mean("TIME", ["Time"])[0].message == "did you mean `Time`?"
    assert did_you_mean("robot", ["int", "float"]) == ()


def example() -> Diagnostics:
    diagnostics = Diagnostics()
    first = Note(Message("first, here"), Location(Path("a,b.idl"), 1, 2))
    diagnostics.error("E013", Message("100 % wrong\nreally"), Location(Path("a,b.idl"), 3, 4, 5), [first])
    diagnostics.warning("W003", Message("odd"), Location(Path("c:d.idl")), [Note(Message("save it again"))])
    diagnostics.note("N001", Message("left out"), Location(Path("e.idl"), 7, 1))
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
            "notes": [{"message": "save it again"}],
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
        "::warning file=c%3Ad.idl,title=codegen W003::odd%0Anote: save it again",
        "::notice file=e.idl,line=7,col=1,endColumn=2,title=codegen N001::left out",
    ]
    assert as_github(Diagnostics()) == ""
