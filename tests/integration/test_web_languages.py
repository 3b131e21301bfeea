"""Each page gets the texts of the server in its language."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.support.editor import DOCUMENT, Refused, Window, editor

WRONG = DOCUMENT.replace("<code>pass</code>", "<code>missing()</code>", 1)


def problem(window: Window) -> str:
    items = window.wait_for(lambda message: message.get("push") == "problems")["items"]
    return next(str(each["message"]) for each in items if each["code"] == "W520")


def test_two_pages_see_the_same_problem_each_in_its_language(tmp_path: Path) -> None:
    (tmp_path / "robot.xml").write_text(WRONG)
    with (
        editor(tmp_path) as running,
        running.window("es-ES") as spanish,
        running.window() as english,
    ):
        spanish.send("open", path="robot.xml")
        assert problem(english) == "`missing` is not defined"
        assert problem(spanish) == "`missing` no está definido"


def test_a_refusal_is_said_in_the_language_of_the_page_that_asked(tmp_path: Path) -> None:
    with editor(tmp_path) as running, running.window("es") as spanish, running.window("xx") as other:
        for window, text in (
            (spanish, "no hay ningún archivo missing.xml"),
            (other, "there is no file missing.xml"),
        ):
            with pytest.raises(Refused, match=text):
                window.ask("open", path="missing.xml")


def test_a_page_that_changes_its_language_gets_everything_again(tmp_path: Path) -> None:
    (tmp_path / "robot.xml").write_text(WRONG)
    with editor(tmp_path) as running, running.window() as window:
        window.send("open", path="robot.xml")
        assert problem(window) == "`missing` is not defined"
        window.send("hello", language="es")
        assert problem(window) == "`missing` no está definido"


def test_steps_are_named_in_the_language_of_the_page(tmp_path: Path) -> None:
    (tmp_path / "robot.xml").write_text(DOCUMENT)
    with editor(tmp_path) as running, running.window("es") as spanish, running.window() as english:
        spanish.ask("open", path="robot.xml")
        spanish.ask(
            "do", tab=1, command={"command": "renameState", "automaton": 1, "state": 2, "name": "walk"}
        )
        assert spanish.wait_for_push("document", revision=1)["undo"][0]["name"] == "Cambiar el nombre de “go”"
        assert english.wait_for_push("document", revision=1)["undo"][0]["name"] == "Rename “go”"
