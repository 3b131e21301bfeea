"""The files of shared memory: they are given back when their maker has ended, and not before."""

from __future__ import annotations

import fcntl
import os
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from uuid import uuid4

import pytest

from zenoh_ice.wire import shared_segments
from zenoh_ice.wire.shared_segments import claim, mapped_segments, sweep

SIZE = 1 << 20


@pytest.fixture
def segment() -> Iterator[Path]:
    """A file of shared memory, full."""
    path = Path("/dev/shm") / f"{uuid4().int >> 96}.zenoh"
    with path.open("wb") as file:
        fcntl.flock(file, fcntl.LOCK_SH)  # as Zenoh does, which removes at any time what nobody has locked
        file.write(b"x" * SIZE)
        file.flush()
        yield path
    path.unlink(missing_ok=True)


@pytest.fixture(autouse=True)
def no_other(monkeypatch: pytest.MonkeyPatch, segment: Path) -> None:
    class Folder:
        def __truediv__(self, name: str) -> Path:
            return segment.parent / name

        def glob(self, pattern: str) -> list[Path]:
            return [path for path in [segment] if path.exists() and path.match(pattern)]

    monkeypatch.setattr(shared_segments, "_FOLDER", Folder())


def test_what_somebody_else_made_stays(segment: Path) -> None:
    for _ in range(3):
        assert sweep(0.0) == 0
    assert segment.read_bytes() == b"x" * SIZE


def test_what_is_claimed_stays(segment: Path) -> None:
    held = claim(segment.name, SIZE)
    assert held is not None
    for _ in range(3):
        assert sweep(0.0) == 0
    assert segment.read_bytes() == b"x" * SIZE
    assert claim(segment.name, SIZE) is None
    os.close(held)


def test_what_is_no_pool_is_not_claimed(segment: Path) -> None:
    assert claim(segment.name, SIZE + 1) is None
    assert claim("0.zenoh", SIZE) is None


def test_what_is_claimed_no_longer_is_given_back(segment: Path) -> None:
    held = claim(segment.name, SIZE)
    assert held is not None
    os.close(held)
    with segment.open("rb", buffering=0) as mapped:
        assert sweep(0.0) == 0  # at first it is only noted
        assert sweep(60.0) == 0  # who reads has some time
        assert mapped.read(1) == b"x"
        assert sweep(0.0) == SIZE
        assert sweep(0.0) == 0
        assert os.fstat(mapped.fileno()).st_blocks == 0
        assert mapped.read() == bytes(SIZE - 1)


def test_claim_ends_with_its_process(segment: Path) -> None:
    code = (
        "import sys; from zenoh_ice.wire.shared_segments import claim; "
        "print(claim(sys.argv[1], int(sys.argv[2])), flush=True); input()"
    )
    command = [sys.executable, "-c", code, segment.name, str(SIZE)]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        assert process.stdout.readline() != "None\n"
        assert (sweep(0.0), sweep(0.0)) == (0, 0)
        process.kill()
        process.wait()
        assert (sweep(0.0), sweep(0.0)) == (0, SIZE)


def test_segments_that_are_mapped_are_known() -> None:
    assert all(name.endswith(".zenoh") for name in mapped_segments())
