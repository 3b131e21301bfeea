"""A small file that decompresses to a huge one takes neither memory nor disk, and is refused."""

from __future__ import annotations

import tempfile
import tracemalloc
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from random import Random
from struct import pack

import pytest
import zstandard
from mcap.data_stream import RecordBuilder
from mcap.records import Channel, Chunk, DataEnd, Footer, Header, Metadata, Schema
from mcap.writer import Writer

from hfsm_runtime._replay.script import Recording
from hfsm_runtime.recording_file.messages import Image, Reading, Stamp
from hfsm_runtime.recording_file.reader import READ_LIMITS, ReadLimits, RecordingError, RecordingFile
from hfsm_runtime.recording_file.writer import Entry, RecordingWriter
from visualhfsm._base.errors import VisualHfsmError
from visualhfsm._monitor.recordings import open_recording

MAGIC = b"\x89MCAP0\r\n"


def message(data: bytes) -> bytes:
    return pack("<BQHIQQ", 5, 22 + len(data), 1, 0, 5, 5) + data


def image(size: int) -> bytes:
    return message(
        b'{"timestamp":{"sec":0,"nsec":0},"frame_id":"","width":1,"height":1,"encoding":"","step":1,'
        b'"hash":"aa","data":"' + b"A" * size + b'"}'
    )


def bomb(path: Path, schema: str, data: bytes, chunks: int, *, said: int | None = None) -> Path:
    """Write a recording whose chunks all unpack to the same messages, and may say that these are smaller."""
    builder = RecordBuilder()
    Header("", "").write(builder)
    Metadata("visualhfsm.component", {"name": "bomb", "start": "0"}).write(builder)
    Schema(id=1, name=schema, encoding="jsonschema", data=b"{}").write(builder)
    Channel(id=1, topic="/x", message_encoding="json", schema_id=1, metadata={}).write(builder)
    chunk = Chunk("zstd", zstandard.compress(data), 0, 0, 0, len(data) if said is None else said)
    for _ in range(chunks):
        chunk.write(builder)
    DataEnd(0).write(builder)
    Footer(0, 0, 0).write(builder)
    path.write_bytes(MAGIC + builder.end() + MAGIC)
    return path


@contextmanager
def within(megabytes: int) -> Iterator[None]:
    tracemalloc.start()
    try:
        yield
        assert tracemalloc.get_traced_memory()[1] < megabytes << 20
    finally:
        tracemalloc.stop()


@pytest.fixture(autouse=True)
def nothing_is_spooled(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    spool = tmp_path / "spool"
    spool.mkdir()
    monkeypatch.setattr(tempfile, "tempdir", str(spool))
    yield
    assert not list(spool.iterdir())


def test_images_that_unpack_to_gigabytes_are_refused_and_not_spooled(tmp_path: Path) -> None:
    assert READ_LIMITS.most_unpacked == 1 << 30
    limits = ReadLimits(most_unpacked=1 << 27)  # an eighth, of images of an eighth
    path = bomb(tmp_path / "run.mcap", "foxglove.RawImage", image(15 << 19), 20)
    assert path.stat().st_size < 100_000
    with within(38), pytest.raises(RecordingError, match=f"unpacks to more than {1 << 27} bytes"):
        Recording(path, limits)


def test_images_stay_in_the_file_until_they_are_asked_for(tmp_path: Path) -> None:
    path = bomb(tmp_path / "run.mcap", "foxglove.RawImage", image(4 << 20), 10)
    with within(39):
        assert Recording(path).image("aa") == bytes(3 << 20)


def test_a_message_of_megabytes_is_refused(tmp_path: Path) -> None:
    path = bomb(tmp_path / "run.mcap", "visualhfsm.Gap", message(b'{"lost":1}' + b" " * (6 << 20)), 20)
    with within(36), pytest.raises(RecordingError, match=r"a message of /x has \d+ bytes: at most 4194304"):
        Recording(path)


def test_more_messages_than_any_run_makes_are_refused(tmp_path: Path) -> None:
    limits = ReadLimits(most_messages=10_000)
    data = message(b'{"context":"","kind":"now"}') * 6_000
    Recording(bomb(tmp_path / "fine.mcap", "visualhfsm.Reading", data, 1), limits)
    path = bomb(tmp_path / "run.mcap", "visualhfsm.Reading", data, 2)
    with within(10), pytest.raises(RecordingError, match="has more than 10000 messages"):
        Recording(path, limits)


def test_more_messages_than_a_small_file_can_have_are_refused(tmp_path: Path) -> None:
    data = message(b'{"context":"","kind":"now"}') * 6_000
    path = bomb(tmp_path / "run.mcap", "visualhfsm.Reading", data, 2)
    assert path.stat().st_size < 10_000
    with pytest.raises(RecordingError, match="has more than 10000 messages"):
        Recording(path, ReadLimits(few_messages=10_000))


def test_a_chunk_that_says_that_it_unpacks_to_too_much_is_not_unpacked(tmp_path: Path) -> None:
    path = bomb(tmp_path / "run.mcap", "visualhfsm.Gap", bytes(65 << 20), 1)
    with (
        within(10),
        pytest.raises(RecordingError, match="a chunk unpacks to 68157440 bytes: at most 67108864"),
    ):
        Recording(path)


def test_a_chunk_that_unpacks_to_more_than_it_says_is_not_unpacked(tmp_path: Path) -> None:
    path = bomb(tmp_path / "run.mcap", "visualhfsm.Gap", bytes(40 << 20), 1, said=100)
    with within(20):
        recorded = Recording(path)
        assert recorded.truncated
        assert list(recorded) == []


@pytest.mark.parametrize(
    "content",
    [
        b"",
        b"PK\x03\x04 something else",
        b"no recording at all",
        MAGIC,
        MAGIC + b"\x01" + b"\xff" * 8,
        MAGIC + b"\x06" + (1 << 62).to_bytes(8, "little") + b"x",
        Random(1).randbytes(2000),
    ],
)
def test_a_file_that_is_no_recording_is_refused(tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "run.mcap"
    path.write_bytes(content)
    with pytest.raises(RecordingError, match="is not a recording of a component: not an MCAP file"):
        Recording(path)


def test_an_mcap_file_of_something_else_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "run.mcap"
    with path.open("wb") as file:
        writer = Writer(file)
        writer.start()
        writer.finish()
    with pytest.raises(RecordingError, match="is not a recording of a component"):
        Recording(path)


def test_the_editor_refuses_the_same(tmp_path: Path) -> None:
    path = bomb(tmp_path / "run.mcap", "visualhfsm.Gap", message(b'{"lost":1}' + b" " * (6 << 20)), 1)
    with pytest.raises(VisualHfsmError, match=r"a message of /x has \d+ bytes: at most 4194304"):
        open_recording(path)


def test_an_hour_of_images_is_read(tmp_path: Path) -> None:
    """36,000 images of the fake robot, which are flat, unpack to 11 GB: the ratio allows for it."""
    path = tmp_path / "run.mcap"
    writer = RecordingWriter(path, {"name": "a", "start": "0"}, {}, 0)
    for number in range(30):
        pixels = bytes([number, 128, 128]) * 76_800
        writer.put(
            Entry(
                "/images/camera",
                number,
                Image(Stamp(0, 0), "", 320, 240, "rgb8", 960, pixels, f"{number:024}"),
            )
        )
        for reading in range(23):
            writer.put(Entry("/readings", number, Reading("automaton 1", "now", number + reading / 23)))
    writer.close()
    found = RecordingFile(path)
    unpacked = sum(len(raw.data) for raw in found.messages())
    hours = 36_000 / 30
    assert unpacked * hours > 10e9
    assert unpacked < READ_LIMITS.highest_ratio * path.stat().st_size
    assert Recording(path).image(f"{7:024}") == bytes([7, 128, 128]) * 76_800
