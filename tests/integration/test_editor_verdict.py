"""The editor answers what `visualhfsm verdict` answers, from the same code, in the language of the page."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.support.documents import document, state, sub
from tests.support.editor import Refused, editor
from visualhfsm import Project
from visualhfsm._document.reasons import summary

pytestmark = pytest.mark.slow

JOINTS = (
    "<iceinterface><nameinterface>Body</nameinterface><nameproxy>Body</nameproxy>"
    "<interface>Joints</interface></iceinterface>\n"
)
GO = {"kind": "state", "automaton": 1, "id": 1, "part": "code"}


def test_the_first_reason_is_that_of_the_project_and_what_is_not_saved_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "moves.xml"
    path.write_text(document(sub(1, 0, state(1, "go", "1 / 0", initial=True))))
    with Project(tmp_path, journals=tmp_path / ".journals") as project:
        (reason,) = project.open(path).verdict().reasons
    with editor(tmp_path, path) as running, running.window("es") as spanish, running.window() as english:
        found = english.ask("judge", tab=1)
        assert (found["ready"], found["found"], found["message"]) == (
            False,
            "run",
            summary([reason], terminal=False),
        )
        assert "visualhfsm edit" not in found["message"]
        assert found["place"] == GO
        said = spanish.ask("judge", tab=1)["message"]
        assert said == (
            "go (moves.xml:3): una ejecución en tiempo virtual ha fallado: "
            "el código de moves lanzó ZeroDivisionError: división entre cero"
        )
        english.ask("do", tab=1, command={"command": "setText", "place": GO, "text": ""})
        with pytest.raises(Refused, match="it has changes that are not saved; save it first"):
            english.ask("judge", tab=1)
        with pytest.raises(Refused, match="tiene cambios sin guardar; guárdalo antes"):
            spanish.ask("judge", tab=1)
        english.ask("save", tab=1)
        found = english.ask("judge", tab=1)
        assert (found["ready"], found["message"], found["place"], found["seconds"]) == (True, "", None, 10.0)


def test_it_runs_on_the_chosen_robot_and_names_it(tmp_path: Path) -> None:
    path = tmp_path / "moves.xml"
    code = 'if "HeadYaw" in self.Body.getJointNames():\n    raise ValueError("a Nao")'
    path.write_text(document(sub(1, 0, state(1, "go", code, initial=True)), config=JOINTS))
    with editor(tmp_path, path) as running, running.window() as window:
        found = window.ask("judge", tab=1)
        assert (found["ready"], found["robot"]) == (False, "Nao H25")
        assert "a Nao" in found["message"]
        found = window.ask("judge", tab=1, body="T1")
        assert (found["ready"], found["robot"]) == (True, "Booster T1")
        with pytest.raises(Refused, match="there is no robot X1"):
            window.ask("judge", tab=1, body="X1")
