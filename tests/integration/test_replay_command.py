"""`--record` of a component's process and `visualhfsm replay`, as users type them."""

from __future__ import annotations

import json
import os
import re
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import msgspec
import psutil
import pytest
from mcap.reader import make_reader
from mcap.writer import CompressionType, Writer

from hfsm_runtime.recording_file.messages import Failing, Message
from hfsm_runtime.recording_file.reader import RecordingFile
from naoserver.fake import FakeRobot
from tests.support.commands import run_here
from tests.support.documents import compile_to, document, state, sub, transition
from tests.support.limits import END_LIMIT, EVENT_LIMIT, RUN_LIMIT, START_LIMIT
from tests.support.processes import REPOSITORY, ComponentProcess, free_endpoint, module
from tests.support.robot_server import served
from tests.support.waiting import until
from visualhfsm._base.errors import VisualHfsmError
from visualhfsm._commands.app import app
from visualhfsm._monitor.recordings import open_recording

SECONDS = 1.2  # of the recording

HEAD = (
    "<iceinterface><nameinterface>head</nameinterface><nameproxy>Head</nameproxy>"
    "<interface>PoseHead</interface></iceinterface>"
)
RUN = "sys.argv = sys.argv[1:]; runpy.run_path(sys.argv[0], run_name='__main__')"
TURN = "pose = self.head.setSpeed(0.4, 0.0)\nlooks += 1\nself.mark('Camera', looks, 7, 'look')"
TURNING = document(
    sub(
        1,
        0,
        state(1, "left", TURN, initial=True),
        state(2, "right", "self.head.setSpeed(-0.4, 0.0)"),
        transition(1, 1, 2, "self.head.getPose().pan > 0.15", name="far"),
        transition(2, 2, 1, "400", type="time", name="back"),
        variables="looks = 0\npose = None",
        period="40",
    ),
    config=HEAD,
)


def replay(*arguments: str | Path) -> subprocess.CompletedProcess[str]:
    return run_here(app, "visualhfsm", "replay", *arguments, expected=(VisualHfsmError,))


def lines(done: subprocess.CompletedProcess[str]) -> list[dict[str, Any]]:
    return [json.loads(line) for line in done.stdout.splitlines()]


@pytest.fixture(scope="module")
def recorded(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The recording of a component that turned a fake robot's head for a while."""
    folder = tmp_path_factory.mktemp("recorded")
    endpoint = free_endpoint()
    file = compile_to(folder, TURNING, "turner")
    path = folder / "run.mcap"
    with (
        served(FakeRobot(), realm="nao", endpoint=endpoint),
        run(file, endpoint, "--record", str(path), "--seconds", str(SECONDS)) as component,
    ):
        assert component.wait(RUN_LIMIT) == 0, component.output
    return path


def run(file: Path, endpoint: str, *options: str) -> ComponentProcess:
    command = [sys.executable, str(file), "--connect", endpoint, *options]
    return ComponentProcess(command, {"PYTHONPATH": str(REPOSITORY)})


@contextmanager
def recording(path: Path, endpoint: str) -> Iterator[ComponentProcess]:
    """Run a component that has begun to record."""
    file = compile_to(path.parent, TURNING, "turner")
    with (
        served(FakeRobot(), realm="nao", endpoint=endpoint),
        run(file, endpoint, "--record", str(path)) as component,
    ):
        until(lambda: path.exists() and path.stat().st_size >= 12_000, START_LIMIT)
        yield component


def edited(folder: Path, old: str, new: str) -> Path:
    assert old in TURNING
    path = folder / "turner.xml"
    path.write_text(TURNING.replace(old, new))
    return path


def test_its_document_replays_identically_without_the_code_in_the_recording(recorded: Path) -> None:
    done = replay(recorded, recorded.parent / "turner.xml")
    assert done.returncode == 0, done.stderr
    assert "cycles, identical" in done.stdout
    assert done.stderr == ""


def test_a_run_whose_recording_a_full_disk_cut_short_fails(tmp_path: Path) -> None:
    endpoint = free_endpoint()
    file = compile_to(tmp_path, TURNING, "turner")
    path = tmp_path / "run.mcap"
    limited = (
        f"import resource, runpy, sys; resource.setrlimit(resource.RLIMIT_FSIZE, (16_384, 16_384)); {RUN}"
    )
    command = [sys.executable, "-c", limited, str(file), "--connect", endpoint, "--record", str(path)]
    with (
        served(FakeRobot(), realm="nao", endpoint=endpoint),
        ComponentProcess([*command, "--seconds", str(SECONDS)], {"PYTHONPATH": str(REPOSITORY)}) as component,
    ):
        assert component.wait(RUN_LIMIT) == 1, component.output
    assert f"error: the recording {path} is incomplete: File too large" in component.output
    done = replay(path)
    assert "the recording was cut off: it is replayed as far as it goes" in done.stdout


def test_what_was_made_to_fail_is_named_and_the_replay_repeats_the_run(tmp_path: Path, endpoint: str) -> None:
    path, robot = tmp_path / "run.mcap", FakeRobot()
    file = compile_to(tmp_path, TURNING, "turner")
    with (
        served(robot, realm="nao", endpoint=endpoint),
        run(file, endpoint, "--record", str(path)) as component,
    ):
        until(lambda: abs(robot.read().positions[0]) > 0.05, START_LIMIT)
        robot.faults.inject("Battery", "low", 0.25)
        until(lambda: count_of(Failing, path) == 1, EVENT_LIMIT)
        robot.faults.inject("HeadYaw", "stuck", seconds=0.5)
        until(lambda: count_of(Failing, path) == 3, EVENT_LIMIT)
        component.process.send_signal(signal.SIGINT)
        component.wait(END_LIMIT)
    done = replay(path)
    assert done.returncode == 0, done.stderr
    assert "cycles, identical" in done.stdout
    named = re.findall(r"made to fail: (.+) from ([\d.]+) s to ([\d.]+) s", done.stdout)
    low, both, again = named
    assert (low[0], both[0]) == ("Battery low 0.25", "Battery low 0.25, HeadYaw stuck")
    assert (low[2], both[2], again[0]) == (both[1], again[1], low[0])
    begin = lines(replay(path, "--json"))[0]
    assert begin["failures"][0]["faults"] == [{"part": "Battery", "kind": "low", "amount": 0.25}]
    report = run_here(app, "visualhfsm", "report", path).stdout
    assert [line for line in report.splitlines() if "made to fail: " in line][1].startswith(
        "made to fail: Battery low 0.25, HeadYaw stuck from"
    )


def count_of(kind: type[Message], path: Path) -> int:
    """Return how many messages of a kind the file of a run has, which may go on."""
    return sum(message.kind is kind for message in RecordingFile(path).messages())


def test_an_edited_document_is_reported_with_the_first_difference_and_both_timelines(
    recorded: Path, tmp_path: Path
) -> None:
    done = replay(recorded, edited(tmp_path, "&gt; 0.15", "&gt; 0.05"))
    assert done.returncode == 3, done.stderr
    assert "1 automaton behaves otherwise" in done.stdout
    assert "turner in the state left" in done.stdout
    first, shown = done.stdout.partition("first at ")[2].split(" s: ", 1)
    assert float(first) > 0.0
    rows = [line.split() for line in shown.splitlines()[1:5]]
    assert rows == [["recorded", "replayed"], ["guard", "far", "false", "true"], ["fired", "-", "far"],
                    ["then", "in", "left", "right"]]  # fmt: skip


def test_json_has_every_change_of_both(recorded: Path, tmp_path: Path) -> None:
    never = round((SECONDS + EVENT_LIMIT) * 1000)  # not a shorter time: cycles may have been skipped
    done = replay(recorded, edited(tmp_path, ">400<", f">{never}<"), "--json")
    begin, *_, end = lines(done)
    assert begin["event"] == "begin"
    assert begin["recording_seconds"] > SECONDS - 0.3
    assert end["event"] == "end"
    assert [step["state"] for step in end["recorded"]][:3] == ["left", "right", "left"]
    assert end["divergences"][0]["name"] == "turner"
    assert [step["state"] for step in end["replayed"]] == ["left", "right"]


def test_a_part_can_be_replayed_and_the_edited_document_take_over_within(
    recorded: Path, tmp_path: Path
) -> None:
    part = lines(replay(recorded, "--json", "--until", "0.5"))[-1]
    assert part["identical"]
    assert part["seconds"] <= 0.5
    later = lines(replay(recorded, edited(tmp_path, ">400<", ">100<"), "--from", "1", "--json"))[-1]
    changes = [(step["time"], step["state"]) for step in later["replayed"]]
    same = [(step["time"], step["state"]) for step in later["recorded"] if step["time"] < 1.0]
    assert changes[: len(same)] == same
    assert any("took over at 1." in note for note in later["notes"])


def test_a_document_with_errors_is_reported_and_nothing_runs(recorded: Path, tmp_path: Path) -> None:
    done = replay(recorded, edited(tmp_path, "looks += 1", "looks +="))
    assert done.returncode == 1
    assert "turner.xml:" in done.stderr
    assert "nothing was replayed" in done.stderr


def test_what_user_code_prints_does_not_disturb_the_report(recorded: Path, tmp_path: Path) -> None:
    talking = edited(tmp_path, "looks += 1", "looks += 1; print('{}', flush=True)")
    done = replay(recorded, talking, "--json")
    assert {line["event"] for line in lines(done)} == {"begin", "end"}
    assert "{}" not in done.stderr
    assert "{}" in replay(recorded, talking, "--output").stderr


def test_from_without_a_document_is_wrong_usage(recorded: Path) -> None:
    done = replay(recorded, "--from", "1")
    assert done.returncode == 2
    assert "--from needs the DOCUMENT" in done.stderr


def test_a_killed_component_leaves_a_recording_that_is_replayed_as_far_as_it_goes(
    tmp_path: Path, endpoint: str
) -> None:
    path = tmp_path / "run.mcap"
    with recording(path, endpoint) as component:
        component.process.kill()
        component.process.wait(END_LIMIT)
    done = replay(path)
    assert done.returncode == 0, done.stderr
    assert "the recording was cut off" in done.stdout
    assert "identical" in done.stdout
    assert open_recording(path).log.newest is not None


def test_one_shows_what_its_monitor_showed(recorded: Path) -> None:
    run = open_recording(recorded)
    changes = [change[1:4] for change in run.log.timeline().changes]
    assert changes[:2] == [(1, 1, 2), (1, 2, 1)]
    newest = run.log.newest
    assert newest is not None
    (turner,) = newest.component.automata
    assert newest.component.time > SECONDS - 0.3
    assert int(turner.variables["looks"]) > 0
    assert turner.cycles > 0


def test_ctrl_c_leaves_a_whole_recording(tmp_path: Path, endpoint: str) -> None:
    path = tmp_path / "run.mcap"
    with recording(path, endpoint) as component:
        component.process.send_signal(signal.SIGINT)
        assert component.wait(END_LIMIT) == 130
    with path.open("rb") as read:
        summary = make_reader(read).get_summary()
        assert summary is not None
        topics = {channel.topic for channel in summary.channels.values()}
    assert {"/automata/turner", "/guards/turner", "/variables/turner", "/proxy/head/setSpeed"} <= topics


HASTY = """\
import sys
from pathlib import Path
from hfsm_runtime._replay.__main__ import replay
replay(*map(Path, sys.argv[1:]), hang_limit=1.0)
"""
"""The process of a replay that soon loses its patience."""


def test_code_that_neither_ends_nor_asks_for_anything_ends_the_replay(recorded: Path, tmp_path: Path) -> None:
    hanging = edited(tmp_path, "looks += 1", "looks += 1\nwhile looks == 3:\n    pass")
    component = compile_to(tmp_path, hanging.read_text("utf-8"), "turner")
    command = [sys.executable, "-c", HASTY, str(recorded), str(component)]
    done = subprocess.run(
        command, cwd=REPOSITORY, capture_output=True, text=True, timeout=RUN_LIMIT, check=False
    )
    *_, end = lines(done)
    assert end["error"] == ("the code of automaton 1 neither ends nor reads anything recorded within 1 s"), (
        done.stderr
    )
    assert end["cycles"] == 3
    assert not end["divergences"]


def test_ctrl_c_ends_the_process_that_replays(recorded: Path, tmp_path: Path) -> None:
    hanging = edited(tmp_path, "looks += 1", "looks += 1\nwhile True: print('endless', flush=True)")
    with ComponentProcess(module("visualhfsm", "replay", str(recorded), str(hanging), "--output")) as process:
        process.wait_for("endless")
        children = psutil.Process(process.process.pid).children(recursive=True)
        assert children
        process.process.send_signal(signal.SIGINT)
        assert process.wait(END_LIMIT) == 130
    assert not any(child.is_running() and child.status() != psutil.STATUS_ZOMBIE for child in children)


# Files that are none, or want to do harm.


def harmful(
    path: Path,
    *,
    attachments: dict[str, str],
    messages: list[bytes],
    start: str = "1000",
    kind: str = "Reading",
    topic: str = "/readings",
    **metadata: str,
) -> Path:
    with path.open("wb") as file:
        writer = Writer(file, compression=CompressionType.ZSTD)
        writer.start()
        writer.add_metadata("visualhfsm.component", {"name": "evil\x1b[31m", "start": start, **metadata})
        for name, text in attachments.items():
            writer.add_attachment(0, 0, name, "text/plain", text.encode())
        schema = writer.register_schema(f"visualhfsm.{kind}", "jsonschema", b"{}")
        channel = writer.register_channel(topic, "json", schema)
        for data in messages:
            writer.add_message(channel, 2000, data, 2000)
        writer.finish()
    return path


def test_a_file_that_is_no_recording_is_reported_in_one_line(tmp_path: Path) -> None:
    path = tmp_path / "run.mcap"
    path.write_bytes(b"")
    done = replay(path)
    assert done.returncode == 1
    assert "not an MCAP file" in done.stderr
    assert done.stderr.count("\n") == 1
    assert "Traceback" not in done.stderr


def test_attachments_do_not_leave_their_folder_and_names_do_not_reach_the_terminal(tmp_path: Path) -> None:
    target = tmp_path / "stolen.py"
    path = harmful(
        tmp_path / "run.mcap",
        attachments={f"component/../../../../..{target}": "print('run')", "component//etc/x.py": "x"},
        messages=[],
    )
    done = replay(path)
    assert done.returncode == 1
    assert "does not contain its component" in done.stderr
    assert "\x1b" not in done.stdout + done.stderr
    assert not target.exists()


@pytest.mark.parametrize(
    ("metadata", "periods", "reported"),
    [
        ({"random": "[" * 100_000}, "1", "the recorded state of the random numbers is malformed"),
        ({}, "9" * 5000, ""),
    ],
)
def test_settings_that_nobody_recorded_end_no_replay_unseen(
    tmp_path: Path, metadata: dict[str, str], periods: str, reported: str
) -> None:
    component = compile_to(tmp_path, document(sub(1, 0, state(1, "a", initial=True))), "idle").read_text()
    made = {"kind": "made", "arguments": {"periods": {periods: 1}}}
    path = harmful(
        tmp_path / "run.mcap",
        attachments={"component/idle.py": component},
        messages=[json.dumps(made).encode()],
        kind="Action",
        topic="/actions",
        **metadata,
    )
    done = replay(path)
    assert "Traceback" not in done.stdout + done.stderr
    assert reported in done.stderr
    assert done.returncode == (1 if reported else 0)


def test_a_malformed_message_is_reported(tmp_path: Path) -> None:
    component = compile_to(tmp_path, document(sub(1, 0, state(1, "a", initial=True))), "idle").read_text()
    path = harmful(
        tmp_path / "run.mcap", attachments={"component/idle.py": component}, messages=[b'{"context": 5}']
    )
    done = replay(path)
    assert done.returncode == 1
    assert "message 1 of /readings is malformed" in done.stderr
    assert "Traceback" not in done.stderr


def test_the_metadata_report_versions_hashes_and_the_random_state(recorded: Path) -> None:
    with recorded.open("rb") as file:
        (metadata,) = make_reader(file).iter_metadata()
    found = metadata.metadata
    assert found["name"] == "turner"
    assert found["document"] == "turner.xml"
    assert msgspec.json.decode(found["proxies"]) == {"head": "Head"}
    assert {
        "visualhfsm",
        "mcap",
        "python",
        "random",
    } <= set(found)
    assert os.fspath(recorded.parent) not in str(found)
