"""What is kept of the cycles of a component, for the case that its process is killed."""

from __future__ import annotations

from pathlib import Path

from hfsm_runtime import State, Transition, VirtualRun
from hfsm_runtime.ending import CycleNotes
from tests.support.automata import automaton, component
from zenoh_ice.application.last_cycle import CycleFile, LastCycle, create, read


def test_each_piece_of_code_finds_itself_in_the_file(tmp_path: Path) -> None:
    path, found = tmp_path / "last_cycle", dict[str, LastCycle | None]()
    create(path)

    def keep(piece: str) -> bool:
        found.setdefault(piece, read(path))
        return "code" in found

    states = [
        State(id=1, name="a", code=lambda: keep("code"), exit=lambda: keep("exit")),
        State(id=2, name="b", entry=lambda: keep("entry"), code=lambda: keep("second")),
    ]
    fires = Transition("", 1, 2, id=7, guard=lambda: keep("guard"), code=lambda: keep("fired"))
    run = VirtualRun(component(automaton(3, "root", states, [fires])))
    run.tree.observers.append(CycleNotes(CycleFile(path)))
    run.advance(1.0)
    assert found == {
        "guard": LastCycle(3, 1, 0, running=True),
        "code": LastCycle(3, 1, 0, running=True),
        "exit": LastCycle(3, 1, 7, running=True),
        "fired": LastCycle(3, 1, 7, running=True),
        "entry": LastCycle(3, 1, 7, running=True),
        "second": LastCycle(3, 2, 0, running=True),
    }
    assert read(path) == LastCycle(3, 2, 0, running=False)
