"""What is replayed, and how its end is reported to people."""

from __future__ import annotations

from pathlib import Path

import pytest
from msgspec.structs import replace

from hfsm_runtime.recording_file.outcome import Divergence, Outcome, Side, Step
from hfsm_runtime.recording_file.reader import RecordingFile
from hfsm_runtime.recording_file.writer import RecordingWriter
from visualhfsm._errors import VisualHfsmError
from visualhfsm._replay import replay
from visualhfsm._replaying import outcome_lines


def side(state: str) -> Side:
    return Side(state=state, guards={}, fired=[], errors=[], state_after=state, ran=True)


def test_automata_of_one_name_are_distinguished() -> None:
    steps = [
        Step(0.0, automaton, name, "a", "entered") for automaton, name in enumerate(("root", "x", "x"), 1)
    ]
    parted = [Divergence(1.0, automaton, "x", side("a"), side("b")) for automaton in (2, 3)]
    parted.append(Divergence(1.5, 0, "automaton 2", side(""), side("")))
    outcome = Outcome(
        error="",
        seconds=1.0,
        cycles=3,
        identical=False,
        missing_cycles=0,
        divergences=parted,
        differences=[],
        recorded=steps,
        replayed=steps,
        guesses={},
        notes=[],
    )
    text = "\n".join(outcome_lines(outcome))
    assert "2 automata behave otherwise" in text
    assert "first at 1.000 s: x (2) in the state a" in text
    assert " x (3) " in text
    assert " root  " in text


def test_errors_of_a_cycle_that_are_not_shown_are_counted() -> None:
    recorded = replace(side("a"), errors=[f"error {number}" for number in range(100)])
    outcome = Outcome(
        error="",
        seconds=1.0,
        cycles=3,
        identical=False,
        missing_cycles=0,
        divergences=[Divergence(1.0, 1, "root", recorded, side("b"))],
        differences=[],
        recorded=[],
        replayed=[],
        guesses={},
        notes=[],
    )
    lines = list(outcome_lines(outcome))
    shown = sum(line.startswith("error") for line in map(str.lstrip, lines))
    assert f"... and {100 - shown} more errors: --json has all" in lines


def test_what_was_recorded_to_be_looked_at_is_not_replayed(tmp_path: Path) -> None:
    path = tmp_path / "run.mcap"
    RecordingWriter.watching(path, "walker", "<VisualHFSM/>").close()
    with pytest.raises(VisualHfsmError, match=r"run\.mcap was recorded to be looked at"):
        replay(path)


@pytest.mark.parametrize("kind", ["component", "document", "extension"])
def test_a_recording_whose_code_was_altered_is_damaged(tmp_path: Path, kind: str) -> None:
    path = tmp_path / "run.mcap"
    name = f"{kind}/walker.py"
    RecordingWriter(path, {"name": "walker", "start": "1000"}, {name: "seconds=0.09"}, 1000).close()
    assert RecordingFile(path).sources == {name: b"seconds=0.09"}
    path.write_bytes(path.read_bytes().replace(b"seconds=0.09", b"seconds=0.08"))
    with pytest.raises(VisualHfsmError, match=rf"run\.mcap is damaged: its {name} is not what was recorded"):
        replay(path)
    assert RecordingFile(path).sources == {}
