"""`visualhfsm report`: the page of a recording."""

from __future__ import annotations

from functools import partial
from pathlib import Path

import pytest
from typer.testing import CliRunner

from hfsm_runtime.recording_file.messages import Snapshot
from hfsm_runtime.recording_file.writer import Entry, RecordingWriter
from tests.support.component import short_snapshot
from tests.support.watching import content
from visualhfsm._commands.app import app
from visualhfsm._monitor.recordings import open_recording

START = 1_700_000_000_000_000_000
SECOND = 1_000_000_000


def report(*arguments: object) -> tuple[int, str]:
    done = CliRunner().invoke(app, ["report", *map(str, arguments)], terminal_width=200)
    return done.exit_code, done.output


def recording(path: Path, seconds: int = 0) -> Path:
    """Record an automaton that enters its state at once, and its snapshots each second."""
    writer = RecordingWriter(path, {"name": "walker", "start": str(START)}, {}, START)
    for at in range(0, (seconds + 1) * SECOND, SECOND):
        writer.put(Entry("/snapshots", START + at, Snapshot.of(short_snapshot(at / SECOND))))
    writer.close()
    return path


def test_the_page_lies_beside_the_recording_and_is_not_overwritten(tmp_path: Path) -> None:
    file = recording(tmp_path / "walk.mcap")
    code, output = report(file)
    page = tmp_path / "walk.html"
    assert code == 0, output
    assert "<title>walker</title>" in page.read_text("utf-8")
    assert f"{page.stat().st_size / 1e6:.1f} MB" in output

    page.write_text("mine")
    code, output = report(file)
    assert code == 2
    assert "--force" in output
    assert page.read_text("utf-8") == "mine"
    assert report("--force", file)[0] == 0
    assert report(file, tmp_path / "other.html")[0] == 0


@pytest.mark.parametrize(
    ("cut", "text"),
    [
        (False, "The recording is long: only its first 1 min 40 s of 3 min 20 s were read."),
        (True, "The recording is long: only its first 1 min 40 s were read."),
    ],
    ids=["whole", "cut off"],
)
def test_a_long_recording_is_read_until_a_moment_that_is_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, cut: bool, text: str
) -> None:
    file = recording(tmp_path / "walk.mcap", seconds=200)
    if cut:
        file.write_bytes(file.read_bytes()[:-1])
    monkeypatch.setattr(
        "visualhfsm._monitor.recordings.open_recording", partial(open_recording, most_steps=201)
    )  # a change and a moment each second
    code, output = report(file)
    assert code == 0, output
    assert text in output
    page, _ = content((tmp_path / "walk.html").read_text("utf-8"))
    assert page["shortened"]["said"]["en"] == text
    assert page["timeline"]["end"] == pytest.approx(100.0)
    assert str(open_recording(file).shortened) == ""


def test_what_is_no_recording_is_refused(tmp_path: Path) -> None:
    (tmp_path / "walk.mcap").write_text("no")
    done = CliRunner().invoke(app, ["report", str(tmp_path / "walk.mcap")])
    assert "is not a recording of a component" in str(done.exception)
    assert not (tmp_path / "walk.html").exists()
