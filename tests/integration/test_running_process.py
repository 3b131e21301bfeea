"""Child processes: their output, how they are stopped, and that nothing of them remains."""

from __future__ import annotations

import asyncio
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import psutil
import pytest

from tests.support.limits import END_LIMIT, RUN_LIMIT
from tests.support.processes import REPOSITORY
from tests.support.waiting import until
from visualhfsm._base.output_lines import LineReports, Lines
from zenoh_ice.application.child import ChildProcess


class Output:
    """Keeps what a child wrote, and waits for it."""

    def __init__(self) -> None:
        self.lines: list[tuple[str, str]] = []
        self.dropped = 0
        self.changed = asyncio.Event()

    def __call__(self, lines: Lines) -> None:
        self.lines += lines.lines
        self.dropped += lines.dropped
        self.changed.set()

    async def wait_for(self, text: str) -> None:
        async with asyncio.timeout(RUN_LIMIT):
            while not any(text in line for _, line in self.lines):
                self.changed.clear()
                await self.changed.wait()


async def started(code: str, output: Output) -> ChildProcess:
    child = ChildProcess(LineReports(output))
    await child.start([sys.executable, "-c", code], os.environ)
    return child


def test_both_streams_are_reported_line_by_line_with_the_exit_code() -> None:
    async def go() -> None:
        output = Output()
        code = "import sys; print('one'); print('two'); sys.stderr.write('bad\\nrest'); sys.exit(3)"
        child = await started(code, output)
        assert await asyncio.wait_for(child.wait(), RUN_LIMIT) == 3
        assert [line for line in output.lines if line[0] == "out"] == [("out", "one"), ("out", "two")]
        assert [line for line in output.lines if line[0] == "err"] == [("err", "bad"), ("err", "rest")]

    asyncio.run(go())


def test_of_two_that_start_a_process_at_once_one_is_refused_until_it_has_ended() -> None:
    async def go() -> None:
        ends: asyncio.Queue[tuple[int, bool]] = asyncio.Queue()
        process = ChildProcess(lambda *_: None, lambda *end: ends.put_nowait(end))
        command = [sys.executable, "-c", "import time; time.sleep(1000)"]
        try:
            started = await asyncio.gather(
                *(process.start(command, os.environ) for _ in range(2)), return_exceptions=True
            )
            assert [type(each) for each in started] == [type(None), OSError]
            await process.stop((END_LIMIT, END_LIMIT))
            assert (ends.get_nowait()[1], process.is_running) == (True, False)
            await process.start([sys.executable, "-c", ""], os.environ)
            assert await asyncio.wait_for(ends.get(), RUN_LIMIT) == (0, False)
        finally:
            process.kill()

    asyncio.run(go())


def test_a_flood_is_bounded_and_counted() -> None:
    async def go() -> None:
        output = Output()
        child = await started("for number in range(100_000): print(number)", output)
        assert await asyncio.wait_for(child.wait(), RUN_LIMIT) == 0
        assert len(output.lines) + output.dropped == 100_000
        assert output.dropped > 0
        assert output.lines[-1] == ("out", "99999")

    asyncio.run(go())


def test_a_flood_is_bounded_in_a_second_and_its_last_lines_are_kept() -> None:
    """A flood takes longer than the shortest time between two reports, so that the rate counts."""

    async def go() -> None:
        output = Output()
        code = (
            "import sys, time\n"
            "end = time.monotonic() + 1\n"
            "while time.monotonic() < end: sys.stdout.write('x' * 99 + chr(10))\n"
            "sys.stdout.flush()\n"
            "raise ValueError('at last')"
        )
        began = time.monotonic()
        child = await started(code, output)
        assert await asyncio.wait_for(child.wait(), RUN_LIMIT) == 1
        seconds = time.monotonic() - began
        assert len(output.lines) <= 2000 * (seconds + 1.2)
        assert output.dropped > len(output.lines)
        assert output.lines[-1] == ("err", "ValueError: at last")

    asyncio.run(go())


@pytest.mark.parametrize(
    "written",
    [
        "b'x' * 100_000_000",
        "b'x' * 20_000_000 + bytes([10])",
        "os.urandom(5_000_000)",
        "bytes([10]) * 5_000_000",
    ],
)
def test_whatever_is_written_is_bounded(written: str) -> None:
    async def go() -> None:
        output = Output()
        child = await started(
            f"import os, sys; sys.stdout.buffer.write({written}); sys.stdout.flush(); print('\\ndone')",
            output,
        )
        assert await asyncio.wait_for(child.wait(), RUN_LIMIT) == 0
        assert output.lines[-1] == ("out", "done")
        assert max(len(line) for _, line in output.lines) <= 4000
        assert output.dropped > 0
        assert sum(len(line) for _, line in output.lines) < 10_000_000

    asyncio.run(go())


def test_a_line_without_end_is_cut_into_pieces() -> None:
    async def go() -> None:
        output = Output()
        child = await started("import sys; sys.stdout.write('x' * 10_000)", output)
        await asyncio.wait_for(child.wait(), RUN_LIMIT)
        assert [len(line) for _, line in output.lines] == [4000, 4000, 2000]

    asyncio.run(go())


IGNORES = (
    "import signal, time; [signal.signal(n, signal.SIG_IGN) for n in ({})]; print('up'); time.sleep(600)"
)


@pytest.mark.parametrize(
    ("ignored", "expected"),
    [
        ("", -signal.SIGINT),
        ("signal.SIGINT,", -signal.SIGTERM),
        ("signal.SIGINT, signal.SIGTERM", -signal.SIGKILL),
    ],
)
def test_stopping_rises_in_force(ignored: str, expected: int) -> None:
    async def go() -> None:
        output = Output()
        child = await started(IGNORES.format(ignored), output)
        await output.wait_for("up")
        await child.stop((0.3, 0.3) if ignored else (END_LIMIT, END_LIMIT))
        assert await child.wait() == expected

    asyncio.run(go())


def test_what_a_child_leaves_behind_ends_with_it() -> None:
    async def go() -> int:
        output = Output()
        code = (
            "import subprocess, sys\n"
            "other = subprocess.Popen([sys.executable, '-c', 'import time; time.sleep(600)'])\n"
            "print('pid', other.pid)"
        )
        child = await started(code, output)
        assert await asyncio.wait_for(child.wait(), RUN_LIMIT) == 0
        return int(output.lines[0][1].split()[1])

    pid = asyncio.run(go())
    until(lambda: not psutil.pid_exists(pid) or psutil.Process(pid).status() == psutil.STATUS_ZOMBIE)


SERVER = """
import asyncio, os, sys
from zenoh_ice.application.child import ChildProcess

async def go():
    child = ChildProcess(lambda descriptor, data: None)
    await child.start([sys.executable, "-c", "import time; time.sleep(600)"], os.environ)
    print(child.pid, flush=True)
    await child.wait()

asyncio.run(go())
"""


def test_an_error_does_not_drown_in_what_is_printed() -> None:
    async def go() -> None:
        output = Output()
        code = (
            "import sys\n"
            "for number in range(100_000):\n"
            "    print(number, 'x' * 100)\n"
            "    if number == 50_000: print('bad', file=sys.stderr, flush=True)"
        )
        child = await started(code, output)
        assert await asyncio.wait_for(child.wait(), RUN_LIMIT) == 0
        assert ("err", "bad") in output.lines
        assert output.dropped > 10_000
        numbers = [int(line.split()[0]) for stream, line in output.lines if stream == "out"]
        assert numbers == sorted(numbers)

    asyncio.run(go())


@pytest.mark.skipif(sys.platform != "linux", reason="the parent-death signal is Linux's")
def test_a_child_ends_with_a_server_that_is_killed() -> None:
    server = subprocess.Popen(
        [sys.executable, "-c", SERVER], cwd=REPOSITORY, stdout=subprocess.PIPE, text=True
    )
    assert server.stdout is not None
    with server.stdout:
        pid = int(server.stdout.readline())
        child = psutil.Process(pid)
        server.kill()
        server.wait(END_LIMIT)
        until(lambda: not child.is_running() or child.status() == psutil.STATUS_ZOMBIE)


def test_a_command_that_does_not_exist_is_reported(tmp_path: Path) -> None:
    async def go() -> None:
        output = Output()
        child = ChildProcess(LineReports(output))
        await child.start([str(tmp_path / "missing")], os.environ)
        assert await asyncio.wait_for(child.wait(), RUN_LIMIT) == 127
        assert "cannot run" in output.lines[0][1]

    asyncio.run(go())
