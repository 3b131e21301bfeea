"""Each page gets the texts of the server in its language."""

from __future__ import annotations

from pathlib import Path

import pytest
from websockets.exceptions import ConnectionClosed

from tests.support.editor import DOCUMENT, Refused, Window, editor
from tests.support.limits import PAGE_LIMIT

WRONG = DOCUMENT.replace("<code>pass</code>", "<code>missing()</code>", 1)


def problem(window: Window) -> str:
    found = window.wait_for(lambda message: message.get("push") == "problems" and message["complete"])
    items = found["items"]
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


@pytest.mark.parametrize(
    ("path", "text"),
    [
        ("/", "Abre la última dirección que el comando ha escrito en su terminal: cada una deja entrar"),
        ("/view/?token=old", "Pide otra dirección: la que tenías para mirar se ha retirado"),
    ],
)
def test_people_are_refused_in_the_language_of_their_browser(tmp_path: Path, path: str, text: str) -> None:
    with editor(tmp_path) as running:
        headers = {"Accept": "text/html", "Accept-Language": "es-ES,es;q=0.9,en;q=0.8"}
        status, answer, content = running.get(path, headers)
        assert (status, answer["vary"]) == (403, "accept-language")
        assert content.decode().startswith(text)


def test_what_a_page_adds_has_names_of_its_language(tmp_path: Path) -> None:
    with editor(tmp_path) as running:
        for language, title, name in (("es", "sin título", "estado 1"), ("en", "untitled", "state 1")):
            with running.window(language) as window:
                tab = window.ask("new")["tab"]
                window.ask("do", tab=tab, command={"command": "addState", "automaton": 1, "x": 0, "y": 0})
                titles = [each["title"] for each in window.workspace["tabs"]]
                assert titles[-1] == title
                assert f"<name>{name}</name>" in window.ask("copy", tab=tab, automaton=1, states=[1])["text"]


def test_why_there_is_no_image_is_said_in_the_language_of_the_page(tmp_path: Path) -> None:
    with editor(tmp_path) as running:
        for language, text in (("es", "no hay ninguna cámara Top"), ("en", "there is no camera Top")):
            with running.socket(f"/camera/Top?language={language}") as camera:
                with pytest.raises(ConnectionClosed):
                    camera.recv(PAGE_LIMIT)
                assert camera.close_reason == text


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
