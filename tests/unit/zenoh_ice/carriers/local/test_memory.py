"""Memory that a process lends: written once, read, given back, and used again."""

from __future__ import annotations

import errno
import fcntl
import mmap
import os
import subprocess
import sys
from contextlib import closing

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.support.limits import RUN_LIMIT
from tests.support.open_files import open_files
from zenoh_ice import MarshalException
from zenoh_ice.carriers._local import memory as _memory
from zenoh_ice.carriers._local.memory import Arena, ArenaView, Extent
from zenoh_ice.threads.limits import Limits

PAGE = mmap.PAGESIZE
SIZE = 1 << 20  # of the memory in these tests
SMALL = Limits(memory=SIZE)
READER, OTHER, NOBODY = object(), object(), object()
ENDED, LIVING = object(), object()

ADD_SEALS = 1033
SEAL_SHRINK = 0x2


@pytest.fixture
def limits() -> Limits:
    return SMALL


def lend(arena: Arena, size: int, *readers: object) -> Extent:
    extent = arena.lend([bytes(size)], readers or [READER])
    assert extent is not None
    return extent


def memory_file(size: int = PAGE, seals: int = SEAL_SHRINK) -> int:
    file = os.memfd_create("test", os.MFD_CLOEXEC | os.MFD_ALLOW_SEALING)
    os.ftruncate(file, size)
    fcntl.fcntl(file, ADD_SEALS, seals)
    return file


class TestLending:
    def test_what_is_written_once_is_read_by_all(self, arena: Arena, view: ArenaView) -> None:
        parts = [b"a" * 3, b"", b"b" * PAGE]
        extent = arena.lend(parts, [READER, OTHER])
        assert extent is not None
        assert extent.sizes == (3, 0, PAGE)
        for _ in range(2):
            assert view.read(extent, SIZE, "it") == parts

    def test_the_lowest_place_that_is_large_enough_is_used_again(self, arena: Arena) -> None:
        first, second, third = (lend(arena, 2 * PAGE) for _ in range(3))
        arena.give_back(first.start, READER)
        arena.give_back(second.start, READER)
        assert lend(arena, 5 * PAGE).start > third.start
        assert lend(arena, 3 * PAGE).start == first.start

    def test_memory_is_lent_until_its_last_reader_has_given_it_back(self, arena: Arena) -> None:
        readers = [READER, OTHER, object()]
        extent = lend(arena, PAGE, *readers)
        for reader in readers:
            assert lend(arena, PAGE, NOBODY).start != extent.start
            arena.give_back(extent.start, reader)
        assert lend(arena, PAGE).start == extent.start

    def test_who_was_lent_nothing_gives_nothing_back(self, arena: Arena) -> None:
        extent = lend(arena, PAGE)
        arena.give_back(extent.start, OTHER)
        arena.give_back(extent.start + 1, READER)
        arena.give_back(SIZE, READER)
        assert lend(arena, PAGE).start != extent.start

    def test_the_loans_of_a_reader_are_counted(self, arena: Arena) -> None:
        first, _ = lend(arena, PAGE), lend(arena, PAGE, READER, OTHER)
        assert (arena.lent_to(READER), arena.lent_to(OTHER), arena.lent_to(NOBODY)) == (2, 1, 0)
        arena.give_back(first.start, READER)
        assert arena.lent_to(READER) == 1

    def test_memory_is_kept_for_a_while_for_a_reader_whose_link_ended(
        self, arena: Arena, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        now = 100.0
        monkeypatch.setattr("zenoh_ice.carriers._local.memory.time.monotonic", lambda: now)
        mine, others = lend(arena, PAGE), lend(arena, PAGE, OTHER)
        arena.forget(READER)
        now += 0.9 * SMALL.last_reads
        assert lend(arena, PAGE, OTHER).start > others.start
        now += 0.2 * SMALL.last_reads
        assert lend(arena, PAGE, OTHER).start == mine.start
        assert lend(arena, PAGE, OTHER).start > others.start

    def test_without_room_nothing_is_lent(self, arena: Arena) -> None:
        assert arena.lend([bytes(SIZE + 1)], [READER]) is None
        whole = lend(arena, SIZE)
        assert arena.lend([b"x"], [READER]) is None
        arena.give_back(whole.start, READER)
        lend(arena, SIZE)

    def test_who_is_closed_lends_nothing(self, arena: Arena, view: ArenaView) -> None:
        extent = arena.lend([b"kept"], [READER])
        assert extent is not None
        for _ in range(2):
            arena.close()
        assert arena.lend([b"x"], [READER]) is None
        assert view.read(extent, SIZE, "it") == [b"kept"]


Steps = list[tuple[str, int, int]]


@given(
    st.lists(
        st.tuples(
            st.sampled_from(["lend", "lend", "give back", "forget", "wait"]),
            st.integers(1, SIZE // 4),
            st.integers(0, 2),
        ),
        max_size=60,
    )
)
def test_what_is_lent_is_never_written_again(steps: Steps) -> None:
    with pytest.MonkeyPatch.context() as patch, closing(Arena(SMALL)) as arena:
        now = 0.0
        patch.setattr("zenoh_ice.carriers._local.memory.time.monotonic", lambda: now)
        with closing(ArenaView(os.dup(arena.file))) as view:
            links = [object() for _ in range(3)]
            lent: list[tuple[Extent, bytes, int, float]] = []  # with their links, and when they end
            for number, (step, size, chosen) in enumerate(steps):
                match step:
                    case "lend":
                        content = bytes([number]) * size
                        if (extent := arena.lend([content], [links[chosen]])) is not None:
                            lent.append((extent, content, chosen, float("inf")))
                    case "give back" if lent:
                        extent, _, owner, _ = lent.pop(size % len(lent))
                        arena.give_back(extent.start, (links[owner], 1))
                    case "forget":
                        arena.forget(links[chosen])
                        end = now + SMALL.last_reads
                        lent = [
                            (extent, content, owner, min(until, end) if owner == chosen else until)
                            for extent, content, owner, until in lent
                        ]
                    case "wait":
                        now += 2.0
                lent = [each for each in lent if each[3] > now]
                for extent, content, _, _ in lent:
                    assert view.read(extent, SIZE, "it") == [content]


class TestLimitsOfTheSystem:
    def test_memory_that_cannot_be_had_is_reported_once(
        self, arena: Arena, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
    ) -> None:
        def refuse(*_: object) -> None:
            raise OSError(errno.ENOSPC, "no room")

        lend(arena, PAGE)
        with monkeypatch.context() as patch:
            patch.setattr(os, "posix_fallocate", refuse)
            assert [arena.lend([bytes(PAGE)], [READER]) for _ in range(3)] == [None] * 3
            assert caplog.text.count("no memory to share") == 1
        assert lend(arena, PAGE).start == PAGE

    @pytest.mark.parametrize("without", ["memfd_create", "ftruncate"])
    def test_without_memory_files_none_is_made(self, without: str, monkeypatch: pytest.MonkeyPatch) -> None:
        def refuse(*_: object) -> int:
            raise OSError(errno.ENOSYS, "not here")

        monkeypatch.setattr(os, without, refuse)
        before = open_files()
        with pytest.raises(OSError, match="not here"):
            Arena()
        assert open_files() == before

    def test_a_python_without_memory_files_makes_none(self, monkeypatch: pytest.MonkeyPatch) -> None:
        monkeypatch.delattr(os, "memfd_create")
        with pytest.raises(OSError, match="makes no memory files"):
            Arena()

    @pytest.mark.slow
    def test_a_limit_of_the_size_of_files_is_one_of_memory(self) -> None:
        program = """
import resource
from zenoh_ice.carriers._local.memory import Arena
arena = Arena()
resource.setrlimit(resource.RLIMIT_FSIZE, (1 << 20, 1 << 20))
print(arena.lend([bytes(2 << 20)], [arena]) is not None)
try:
    Arena()
except OSError:
    print("refused")
"""
        done = subprocess.run(
            [sys.executable, "-c", program], capture_output=True, text=True, timeout=RUN_LIMIT, check=True
        )
        assert done.stdout.split() == ["True", "refused"]


class TestReading:
    def test_a_reader_can_neither_write_nor_shrink_or_grow_it(self, arena: Arena) -> None:
        with pytest.raises(PermissionError):
            mmap.mmap(arena.file, SIZE)
        with pytest.raises(PermissionError):
            os.pwrite(arena.file, b"x", 0)
        for size in (0, SIZE - PAGE, SIZE + PAGE):
            with pytest.raises(PermissionError):
                os.ftruncate(arena.file, size)

    @pytest.mark.parametrize("kind", ["not sealed", "empty", "pipe", "file", "closed"])
    def test_a_file_that_is_no_sealed_memory_is_refused_and_closed(self, kind: str) -> None:
        before = open_files()
        receiving = -1
        match kind:
            case "not sealed":
                file = memory_file(seals=0)
            case "empty":
                file = memory_file(size=0)
            case "pipe":
                receiving, file = os.pipe()
            case "file":
                file = os.open(__file__, os.O_RDONLY)
            case _:
                file = memory_file()
                os.close(file)
        with pytest.raises(OSError, match=r"Invalid argument|shrink|empty|Bad file"):
            ArenaView(file)
        if receiving >= 0:
            os.close(receiving)
        assert open_files() == before

    def test_the_file_is_closed_once_it_is_mapped(self, arena: Arena) -> None:
        before = open_files()
        view = ArenaView(os.dup(arena.file))
        view.close()
        assert open_files() == before

    @pytest.mark.parametrize(
        ("extent", "limit"),
        [
            (Extent(SIZE - 1, (2,)), SIZE),
            (Extent(SIZE, (1,)), SIZE),
            (Extent(0, (SIZE, 1)), 2 * SIZE),
            (Extent(0, (SIZE,) * 256), 1 << 40),
            (Extent(0, (11,)), 10),
            (Extent(0, (5, 6)), 10),
        ],
    )
    def test_a_reference_beyond_the_end_or_the_limit_is_refused(
        self, view: ArenaView, extent: Extent, limit: int
    ) -> None:
        with pytest.raises(MarshalException, match="shared memory"):
            view.read(extent, limit, "it")


class Clock:
    now = 100.0

    def monotonic(self) -> float:
        return self.now


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> Clock:
    clock = Clock()
    monkeypatch.setattr(_memory, "time", clock)
    return clock


def test_the_end_of_one_reader_takes_nothing_from_another(arena: Arena, clock: Clock) -> None:
    shared = lend(arena, 100, ENDED, LIVING)
    arena.forget(ENDED)
    clock.now += 1000.0
    assert lend(arena, 100, LIVING).start != shared.start
    arena.give_back(shared.start, LIVING)
    assert lend(arena, 100, LIVING).start == shared.start


def test_memory_is_used_again_when_its_last_reader_ended(arena: Arena, clock: Clock) -> None:
    shared = lend(arena, 100, ENDED, LIVING)
    arena.give_back(shared.start, LIVING)
    arena.forget(ENDED)
    assert lend(arena, 100, LIVING).start != shared.start  # it may still be reading
    clock.now += 1000.0
    assert lend(arena, 100, LIVING).start == shared.start
