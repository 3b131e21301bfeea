"""What is replayed, and how its end is reported to people."""

from __future__ import annotations

from pathlib import Path

import pytest
from msgspec.structs import replace

from hfsm_runtime.recording_file.outcome import Divergence, Outcome, Side, Step
from hfsm_runtime.recording_file.reader import RecordingFile
from hfsm_runtime.recording_file.writer import RecordingWriter
from visualhfsm._base.errors import VisualHfsmError
from visualhfsm._commands.replay import replay
from visualhfsm._monitor.replay import outcome_lines
from zenoh_ice.data.status import own_version


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


def test_a_replay_that_stops_short_is_not_called_the_same() -> None:
    outcome = Outcome(
        error="the call head.getPose was not recorded",
        seconds=1.6,
        cycles=1,
        identical=False,
        missing_cycles=20,
        divergences=[],
        differences=[],
        recorded=[],
        replayed=[],
        guesses={},
        notes=[],
    )
    assert list(outcome_lines(outcome)) == [
        "stopped short after 1.6 s, 1 cycles: the call head.getPose was not recorded",
        "20 cycles of the recording were not run",
    ]


def test_a_recording_of_a_newer_format_is_refused_with_its_version(tmp_path: Path) -> None:
    path = tmp_path / "run.mcap"
    metadata = {"name": "walker", "start": "1000", "format": "2", "visualhfsm": "9.0"}
    RecordingWriter(path, metadata, {}, 1000).close()
    with pytest.raises(VisualHfsmError, match=r"read it with the version that recorded it, VisualHFSM 9\.0"):
        replay(path)


def test_a_recording_says_which_version_has_recorded(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    for name, metadata in (
        ("ours.mcap", {"visualhfsm": own_version()}),
        ("old.mcap", {"visualhfsm": "0.2.0"}),
    ):
        RecordingWriter(tmp_path / name, {"name": "walker", "start": "1000", **metadata}, {}, 1000).close()
        with pytest.raises(VisualHfsmError, match="does not contain its component"):
            replay(tmp_path / name)
    ours, old = capsys.readouterr().out.splitlines()
    assert "VisualHFSM" not in ours
    assert old.endswith(f" by VisualHFSM 0.2.0, this is {own_version()}")


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
