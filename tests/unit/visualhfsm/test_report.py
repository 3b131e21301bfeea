"""`visualhfsm report`: the page of a recording."""

from __future__ import annotations

from pathlib import Path

from typer.testing import CliRunner

from hfsm_runtime.recording_file.messages import Change
from hfsm_runtime.recording_file.writer import Entry, RecordingWriter
from visualhfsm._command import app

START = 1_700_000_000_000_000_000


def report(*arguments: object) -> tuple[int, str]:
    done = CliRunner().invoke(app, ["report", *map(str, arguments)], terminal_width=200)
    return done.exit_code, done.output


def recording(path: Path) -> Path:
    writer = RecordingWriter(path, {"name": "walker", "start": str(START)}, {}, START)
    writer.put(Entry("/automata/walker", START, Change(1, "walker", 1, "stand", "entered", 0)))
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


def test_what_is_no_recording_is_refused(tmp_path: Path) -> None:
    (tmp_path / "walk.mcap").write_text("no")
    done = CliRunner().invoke(app, ["report", str(tmp_path / "walk.mcap")])
    assert "is not a recording of a component" in str(done.exception)
    assert not (tmp_path / "walk.html").exists()
