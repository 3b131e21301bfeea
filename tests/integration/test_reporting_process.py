"""Child processes that report in lines of JSON: whatever they write, and however it is cut."""

from __future__ import annotations

import asyncio
import io
import os
import sys
from dataclasses import dataclass, field
from pathlib import Path

import msgspec
import pytest

from tests.support.limits import RUN_LIMIT
from tests.support.waiting import until
from visualhfsm._base.reporting_process import ReportingProcess


@dataclass
class Said:
    """What a process has reported, and how it ended."""

    reports: list[dict[str, int]] = field(default_factory=list)
    errors: io.BytesIO = field(default_factory=io.BytesIO)
    words: str = ""
    invalid: str = ""
    code: int = 0


def run(code: str) -> Said:
    said = Said()

    async def go() -> None:
        end: asyncio.Future[int] = asyncio.get_running_loop().create_future()
        process = ReportingProcess(
            msgspec.json.Decoder(dict[str, int]).decode,
            said.reports.append,
            lambda code, _: end.set_result(code),
            100_000,
            said.errors,
        )
        await process.start(
            [sys.executable, "-c", f"import sys, time; say = sys.stdout.write; {code}"], os.environ
        )
        try:
            said.code = await asyncio.wait_for(end, RUN_LIMIT)
        finally:
            process.kill()
        said.words, said.invalid = process.words, str(process.invalid or "")

    asyncio.run(go())
    return said


def test_reports_come_one_by_one_however_they_are_written_and_what_goes_wrong_is_kept() -> None:
    long = "say('{\"long' + ' ' * 90_000 + '\": 3}\\n')"
    said = run(
        "say('{\"a\": 1}\\n{\"b\"'); sys.stdout.flush(); time.sleep(0.05); say(': 2}\\n'); "
        f"{long}; say('cut'); sys.stderr.write('  all is lost \\n'); sys.exit(3)"
    )
    assert [sum(each.values()) for each in said.reports] == [1, 2, 3]
    assert (said.code, said.words, said.invalid) == (3, "all is lost", "")
    assert said.errors.getvalue() == b"  all is lost \n"


@pytest.mark.parametrize(
    ("written", "why"),
    [
        ("'hello\\n'", "invalid"),
        ("'[' * 50_000 + '\\n'", ""),
        ('\'{"a": "text"}\\n\'', "Expected `int`"),
        ("' ' * 200_000", "too long"),
    ],
    ids=["no JSON", "deep", "another type", "too long"],
)
def test_a_process_that_writes_anything_else_is_killed_and_heard_no_more(written: str, why: str) -> None:
    said = run(f"say({written}); say('{{\"a\": 1}}\\n'); sys.stdout.flush(); time.sleep(1000)")
    assert said.reports == []
    assert said.code == -9
    assert said.invalid
    assert why in said.invalid


def test_one_that_writes_something_else_before_its_start_is_noticed_is_killed(tmp_path: Path) -> None:
    written = tmp_path / "written"

    async def go() -> int:
        end: asyncio.Future[int] = asyncio.get_running_loop().create_future()
        process = ReportingProcess(
            msgspec.json.Decoder(dict[str, int]).decode, print, lambda code, _: end.set_result(code), 100
        )
        command = ["sh", "-c", f"echo hello; touch {written}; exec sleep 1000"]
        start = asyncio.create_task(process.start(command, os.environ))
        await asyncio.sleep(0)
        until(written.exists)  # while nothing else happens on this loop
        await start
        try:
            return await asyncio.wait_for(end, RUN_LIMIT)
        finally:
            process.kill()

    assert asyncio.run(go()) == -9
