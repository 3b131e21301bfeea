"""The content of a recording, and how it is written."""

from __future__ import annotations

import importlib
import json
import math
import os
import threading
import time
from contextlib import suppress
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from mcap.reader import make_reader

from hfsm_runtime._automaton import Automaton, State
from hfsm_runtime._recording.recorder import CodeLock, VariableWatch
from hfsm_runtime._recording.run import RecordedRuntime, recording
from hfsm_runtime._recording.values import readable
from hfsm_runtime._replay.script import Recording
from hfsm_runtime.component import Component
from hfsm_runtime.recording_file.messages import MESSAGES, Action, Gap, Message, Reading, schema_of
from hfsm_runtime.recording_file.reader import LARGEST_MESSAGE, ReadLimits, RecordingError, RecordingFile
from hfsm_runtime.recording_file.writer import (
    WRITE_LIMITS,
    Entry,
    RecordingFailedError,
    RecordingWriter,
    WriteLimits,
)
from interfaces.jderobot import ImageDescription
from tests.support.any_text import any_text
from tests.support.automata import after, automaton, component, when
from tests.support.documents import compile_to, document, state, sub
from tests.support.examples import examples
from tests.support.limits import EVENT_LIMIT, FOREVER
from tests.support.stepped_clock import SteppedClock
from tests.support.waiting import until
from zenoh_ice.threads.clock import WallClock

STATE = {"name": "test", "start": "1000"}


def messages(path: Path) -> list[tuple[str, int, Any]]:
    with path.open("rb") as file:
        found = make_reader(file).iter_messages(log_time_order=False)
        return [(channel.topic, message.log_time, json.loads(message.data)) for _, channel, message in found]


# Values.


@pytest.mark.parametrize(
    ("value", "shown"),
    [
        (1.5, 1.5),
        (math.nan, "nan"),
        (-math.inf, "-inf"),
        (2**60, str(2**60)),
        (b"\x00" * 2000, "<2000 bytes>"),
        ((1, [2, {"a": None}]), [1, [2, {"a": None}]]),
        ({1: "x"}, {"1": "x"}),
        ({"b", "a"}, ["a", "b"]),
        ("\ud800", "\\ud800"),
        (ImageDescription(4, 3, 12, "RGB8"), {"width": 4, "height": 3, "size": 12, "format": "RGB8"}),
        (object, "<class 'object'>"),
    ],
)
def test_a_value_becomes_readable(value: object, shown: object) -> None:
    assert readable(value) == shown


def test_an_object_is_shown_without_its_address() -> None:
    assert readable(object()) == "<object object>"


def test_an_object_whose_repr_fails_is_shown_all_the_same() -> None:
    class Bad:
        def __repr__(self) -> str:
            raise RuntimeError("no")

    assert "Bad" in readable(Bad())


_plain = (
    st.floats() | st.integers() | any_text(max_size=5) | st.binary(max_size=5) | st.none() | st.booleans()
)
_nested = st.recursive(
    _plain,
    lambda inner: (
        st.lists(inner, max_size=3)
        | st.dictionaries(any_text(max_size=5), inner, max_size=2)
        | st.tuples(inner)
    ),
    max_leaves=8,
)


@settings(max_examples=examples(20), deadline=None)
@given(_nested)
def test_whatever_the_value_is_the_result_is_json(value: object) -> None:
    text = json.dumps(readable(value), allow_nan=False)
    assert len(text.encode()) < 2_000_000


def test_a_huge_value_that_holds_itself_is_cut() -> None:
    value: list[Any] = [0] * 5_000_000
    value.append(value)
    shown = readable(value)
    assert shown[-1] == "..."
    assert len(shown) < 300


# The file.


@pytest.mark.parametrize("message", MESSAGES.values(), ids=MESSAGES)
def test_a_schema_is_an_object_without_references(message: type[Message]) -> None:
    text = schema_of(message)
    assert json.loads(text)["type"] == "object"
    assert b"$ref" not in text


def test_a_reader_of_mcap_lists_channels_schemas_and_sources(tmp_path: Path) -> None:
    path = tmp_path / "run.mcap"
    writer = RecordingWriter(path, STATE, {"document/a.xml": "<a/>"}, 1000)
    writer.put(Entry("/readings", 1001, Reading("automaton 1", "now", 1.5)))
    writer.close()
    with path.open("rb") as file:
        reader = make_reader(file)
        summary = reader.get_summary()
        assert summary is not None
        assert [(c.topic, c.message_encoding) for c in summary.channels.values()] == [("/readings", "json")]
        (schema,) = summary.schemas.values()
        assert (schema.name, schema.encoding) == ("visualhfsm.Reading", "jsonschema")
        assert [(a.name, a.data) for a in reader.iter_attachments()] == [("document/a.xml", b"<a/>")]
        (metadata,) = reader.iter_metadata()
        assert metadata.name == "visualhfsm.component"
        assert metadata.metadata == {"format": "1", **STATE}
    assert messages(path) == [("/readings", 1001, {"context": "automaton 1", "kind": "now", "value": 1.5})]


def test_a_recording_of_a_moment_opens_before_it_is_closed(tmp_path: Path) -> None:
    """A component may be killed in its first second."""
    path, found = tmp_path / "run.mcap", list[int]()
    writer = RecordingWriter(path, STATE, {"document/a.xml": "<a/>"}, 0)

    def look() -> Message:
        """See what was written before this check."""
        found.append(len([*RecordingFile(path).messages()]))
        if len(found) < 5:
            writer.put(Entry("/readings", len(found), look))
        return Reading("automaton 1", "now", 1.5)

    assert RecordingFile(path).files["document"] == ("a.xml", b"<a/>")
    writer.put(Entry("/readings", 0, look))
    until(lambda: len(found) == 5, EVENT_LIMIT)
    writer.close()
    assert found == [0, 1, 2, 3, 4]


def test_what_is_too_large_to_be_read_is_left_out_of_what_is_looked_at(tmp_path: Path) -> None:
    path = tmp_path / "run.mcap"
    writer = RecordingWriter.watching(path, "walker", "<a/>")
    writer.show("/actions", Action("structure", {"name": "x" * LARGEST_MESSAGE}), 2.5)
    writer.show("/actions", Action("structure", {"name": "walker"}), 2.5)
    writer.close()
    recorded = RecordingFile(path)
    assert [(each.topic, each.time) for each in recorded.messages()] == [("/actions", 2_500_000_000)]
    assert (recorded.name, recorded.files["document"]) == ("walker", ("walker.xml", b"<a/>"))


def test_a_file_that_exists_is_not_overwritten(tmp_path: Path) -> None:
    path = tmp_path / "run.mcap"
    path.write_text("the only record")
    with pytest.raises(
        RecordingFailedError, match=r"run\.mcap exists, and is not overwritten: choose another"
    ):
        RecordingWriter(path, STATE, {}, 0)
    assert path.read_text() == "the only record"


def test_a_file_that_cannot_be_written_is_reported(tmp_path: Path) -> None:
    with pytest.raises(RecordingFailedError, match="No such file"):
        RecordingWriter(tmp_path / "no" / "run.mcap", STATE, {}, 0)


def test_a_disk_that_is_full_from_the_start_is_reported() -> None:
    with pytest.raises(RecordingFailedError, match="/dev/full cannot be written: No space left"):
        RecordingWriter(Path("/dev/full"), STATE, {"document/a.xml": "<a/>"}, 0)


def test_a_disk_that_fills_up_is_reported_in_one_line(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    path = tmp_path / "run.mcap"
    path.symlink_to("/dev/null")
    writer = RecordingWriter(path, STATE, {}, 1000)
    full = os.open("/dev/full", os.O_WRONLY)
    try:
        os.dup2(full, writer._file.fileno())
    finally:
        os.close(full)
    writer.put(Entry("/log", 2000, Gap(1)))
    writer.close()
    (record,) = caplog.records
    assert record.getMessage() == f"the recording {path} is incomplete: No space left on device"
    assert record.exc_info is None


def test_messages_that_come_too_fast_leave_a_gap_that_is_reported(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    path = tmp_path / "run.mcap"
    writer = RecordingWriter(path, STATE, {}, 1000, WriteLimits(most_waiting=10))
    for number in range(25):
        writer.put(Entry("/readings", 1000 + number, Reading("", "now", number)))
    writer.close()
    kept = [message["value"] for topic, _, message in messages(path) if topic == "/readings"]
    lost = sum(message["lost"] for topic, _, message in messages(path) if topic == "/gaps")
    assert lost == 25 - len(kept) > 0
    assert f"{lost} messages came too fast" in caplog.text
    gaps = [record.message for record in Recording(path) if isinstance(record.message, Gap)]
    assert sum(gap.lost for gap in gaps) == lost


def test_a_message_that_cannot_be_made_costs_only_itself(tmp_path: Path) -> None:
    path = tmp_path / "run.mcap"
    writer = RecordingWriter(path, STATE, {}, 1000)

    def fail() -> Message:
        raise RuntimeError("no")

    writer.put(Entry("/readings", 1001, fail))
    writer.put(Entry("/readings", 1002, Reading("", "now", 1)))
    writer.close()
    assert [topic for topic, _, _ in messages(path)] == ["/gaps", "/readings"]


def test_a_chunk_ends_after_ten_looks(tmp_path: Path) -> None:
    """What was recorded can be read while the file is still being written, as after a kill."""
    path = tmp_path / "run.mcap"
    assert WRITE_LIMITS.check_period <= 0.1, "a second at most"
    writer = RecordingWriter(path, STATE, {}, 1000, WriteLimits(check_period=0.01))
    try:
        writer.put(Entry("/readings", 1001, Reading("", "now", 1)))
        until(lambda: bool(list(Recording(path))), EVENT_LIMIT)
        recorded = Recording(path)
        (record,) = recorded
        assert recorded.truncated
        assert isinstance(record.message, Reading)
    finally:
        writer.close()


@pytest.mark.parametrize("kept", [0.2, 0.5, 0.9, 0.999])
def test_a_file_that_was_cut_off_is_read_as_far_as_it_goes(tmp_path: Path, kept: float) -> None:
    path = tmp_path / "run.mcap"
    writer = RecordingWriter(path, STATE, {}, 1000)
    for number in range(5000):
        writer.put(Entry("/readings", 1000 + number, Reading("x" * 500, "now", number)))
    writer.close()
    data = path.read_bytes()
    path.write_bytes(data[: int(len(data) * kept)])
    recorded = Recording(path)
    assert recorded.truncated
    times = [record.time for record in recorded]
    assert times == list(range(len(times)))


@pytest.mark.slow
@given(place=st.integers(0, 10_000), byte=st.integers(0, 255))
@settings(max_examples=examples(300))
def test_a_byte_that_was_altered_is_no_error_of_ours(recorded_bytes: bytes, place: int, byte: int) -> None:
    data = bytearray(recorded_bytes)
    data[place % len(data)] = byte
    with TemporaryDirectory() as folder:
        path = Path(folder, "run.mcap")
        path.write_bytes(data)
        with suppress(RecordingError):
            for _ in RecordingFile(path).messages():
                pass


@pytest.fixture(scope="module")
def recorded_bytes(tmp_path_factory: pytest.TempPathFactory) -> bytes:
    path = tmp_path_factory.mktemp("altered") / "run.mcap"
    writer = RecordingWriter(path, STATE, {"component/a.py": "pass"}, 1000)
    for number in range(20):
        writer.put(Entry("/readings", 1000 + number, Reading("x" * 20, "now", number)))
    writer.close()
    return path.read_bytes()


def test_messages_that_unpack_to_more_than_memory_has_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "run.mcap"
    writer = RecordingWriter(path, STATE, {}, 1000)
    for number in range(5000):  # which are few in the file
        writer.put(Entry("/readings", 1000 + number, Reading("x" * 500, "now", number)))
    writer.close()
    assert 3 * path.stat().st_size < 1_000_000
    with pytest.raises(RecordingError, match="unpacks to more than 1000000 bytes"):
        Recording(path, ReadLimits(most_unpacked=1_000_000, highest_ratio=3))


# The lock.


def test_the_lock_keeps_two_threads_apart() -> None:
    overlaps: list[tuple[str, str]] = []
    lock = CodeLock(lambda *who: overlaps.append(who), patience=FOREVER)
    inside: list[str] = []
    most: list[int] = []

    def work(name: str) -> None:
        for _ in range(50):
            with lock.held(name):
                inside.append(name)
                most.append(len(inside))
                assert lock.context == name
                time.sleep(0.0002)
                inside.remove(name)

    threads = [threading.Thread(target=work, args=(name,)) for name in "abc"]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(EVENT_LIMIT)
    assert max(most) == 1
    assert overlaps == []


def test_others_get_the_lock_while_its_holder_waits() -> None:
    lock = CodeLock(lambda *_: pytest.fail("nobody took it away"), patience=FOREVER)
    with lock.held("a"):
        with lock.released():
            assert lock.context is None
            other = threading.Thread(target=acquire_and_release, args=(lock, "b"))
            other.start()
            other.join(EVENT_LIMIT)
            assert not other.is_alive()
        assert lock.context == "a"


def test_a_thread_that_blocks_loses_the_lock_and_that_is_reported() -> None:
    overlaps: list[tuple[str, str]] = []
    lock = CodeLock(lambda *who: overlaps.append(who), patience=0.05)
    with lock.held("a"):
        other = threading.Thread(target=acquire_and_release, args=(lock, "b"))
        other.start()
        other.join(EVENT_LIMIT)
    assert overlaps == [("b", "a")]


def acquire_and_release(lock: CodeLock, context: str) -> None:
    lock.acquire(context)
    lock.release()


# Variables.


def test_only_variables_that_changed_are_reported() -> None:
    count, same, unset = 0, [1.0, math.nan], None
    del unset

    def code() -> None:
        nonlocal count, unset
        count += 1
        _ = same
        unset = 1 if count > 1 else None
        if count > 2:
            del unset

    watch = VariableWatch()
    found = component_automaton(code)
    code()
    assert watch.changes(found) == ({"count": 1, "same": [1.0, "nan"], "unset": None}, [])
    assert watch.changes(found) == ({}, [])
    code()
    assert watch.changes(found) == ({"count": 2, "unset": 1}, [])
    code()
    assert watch.changes(found) == ({"count": 3}, ["unset"])


def component_automaton(code: Any) -> Automaton:
    return automaton(1, "a", [State(id=1, name="s", code=code)])


# A run.


@pytest.fixture
def blinker() -> Component:
    states = [State(id=1, name="on"), State(id=2, name="off")]
    root = automaton(1, "blinker", states, [after(0.3, 1, 2), after(0.2, 2, 1)])
    return component(root)


def test_a_run_is_recorded_by_the_time_of_the_component(tmp_path: Path, blinker: Component) -> None:
    path = tmp_path / "run.mcap"
    clock = SteppedClock(100.0)
    with recording(blinker, path) as recorder:
        runtime = RecordedRuntime(blinker, clock, recorder)
        runtime.start()
        clock.wait_for_waiters(1)
        clock.advance(1.0)
        runtime.stop()
    recorded = Recording(path)
    assert recorded.metadata["name"] == "written"
    start = recorded.start
    changes = [
        (time - start, m["state_name"]) for topic, time, m in messages(path) if topic == "/automata/blinker"
    ]
    assert changes == [
        (0, "on"), (300_000_000, "off"), (500_000_000, "on"), (800_000_000, "off"), (1_000_000_000, "on"),
    ]  # fmt: skip
    assert not [topic for topic, _, _ in messages(path) if topic == "/gaps"]


def test_a_step_of_all_leaves_nothing_to_do_for_those_that_it_makes_ghosts(tmp_path: Path) -> None:
    below = automaton(2, "below", [State(id=1, name="x")], period=0.02)
    states = [State(id=1, name="a", children=(below,)), State(id=2, name="b")]
    root = automaton(1, "root", states, [when(lambda: False, 1, 2)], period=0.02)
    written = component(root)
    with recording(written, tmp_path / "run.mcap") as recorder:
        runtime = RecordedRuntime(written, WallClock(), recorder)
        runtime.start()
        try:
            until(lambda: runtime.actor(2).cycle.count > 0)
            runtime.pause()
            until(lambda: not runtime.in_cycle)
            runtime.force(1, root.transitions[0].id)
            runtime.step(0)
            assert next(runtime.tree.root.paths()) == "b"
            until(lambda: not runtime.actor(2).stepping)
        finally:
            runtime.stop()


def test_a_recording_holds_every_file_that_makes_its_component(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "library").mkdir()
    library = document(sub(1, 0, state(1, "resting", initial=True)))
    (tmp_path / "library" / "rest.xml").write_text(library)
    stand_in = '<SubAutomata id="2" idFather="1"><import>library/rest.xml</import></SubAutomata>'
    main = document(sub(1, 0, state(1, "a", initial=True, child=2)), stand_in)
    compile_to(tmp_path, main, "rester")
    monkeypatch.syspath_prepend(tmp_path)
    made = importlib.import_module("rester").Rester()
    with recording(made, tmp_path / "run.mcap"):
        pass
    recorded = Recording(tmp_path / "run.mcap")
    assert sorted(recorded.sources) == [
        "component/rester.py",
        "document/rester.xml",
        "import/library/rest.xml",
    ]
    assert recorded.sources["import/library/rest.xml"].decode() == library


def test_the_gap_is_a_message_of_its_own() -> None:
    assert MESSAGES["visualhfsm.Gap"] is Gap
