from __future__ import annotations

from pathlib import Path

from codegen.diagnostics import Diagnostics, Location, Note, did_you_mean

PATH = Path("robot.idl")


def collected(text: str = "module m {\n\tstrng name;\n};\n") -> Diagnostics:
    diagnostics = Diagnostics()
    diagnostics.add_source(PATH, text)
    return diagnostics


def test_an_error_shows_its_line_a_caret_and_its_notes() -> None:
    diagnostics = collected()
    notes = [Note("did you mean `string`?"), Note("first defined here", Location(PATH, 1, 8, 1))]
    diagnostics.error("E012", "`strng` is not defined", Location(PATH, 2, 2, 5), notes)
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
        diagnostics.error("E001", "wrong", Location(PATH, line))
    diagnostics.error("E001", "wrong", Location(Path("a.idl"), 9))
    assert [str(found.location) for found in diagnostics] == ["a.idl:9:1", "robot.idl:1:1", "robot.idl:3:1"]


def test_a_warning_is_not_an_error() -> None:
    diagnostics = collected()
    diagnostics.warning("W001", "doubtful", Location(PATH, 1))
    assert len(diagnostics) == 1
    assert not diagnostics.has_errors
    assert "warning[W001]" in diagnostics.render()
    assert "written" not in diagnostics.render()


def test_a_long_line_is_cut_around_the_place() -> None:
    diagnostics = collected("x" * 5000 + "!" + "y" * 5000)
    diagnostics.error("E002", "unexpected", Location(PATH, 1, 5001))
    _, excerpt, caret, _ = diagnostics.render().splitlines()
    assert len(excerpt) < 200
    assert excerpt[caret.index("^")] == "!"


def test_a_place_outside_the_source_is_shown_without_an_excerpt() -> None:
    diagnostics = collected()
    diagnostics.error("E001", "cannot be read", Location(Path("absent.idl")))
    assert diagnostics.render().splitlines()[0] == "absent.idl: error[E001]: cannot be read"


def test_control_characters_of_a_source_do_not_reach_the_terminal() -> None:
    diagnostics = collected("\x1b[31mred")
    diagnostics.error("E002", "unexpected", Location(PATH, 1))
    assert "\x1b" not in diagnostics.render()
    assert "\x1b" in diagnostics.render(color=True)


def test_a_near_name_is_proposed_and_a_far_one_is_not() -> None:
    assert did_you_mean("flot", ["int", "float"])[0].message == "did you mean `float`?"
    assert did_you_mean("TIME", ["Time"])[0].message == "did you mean `Time`?"
    assert did_you_mean("robot", ["int", "float"]) == ()
