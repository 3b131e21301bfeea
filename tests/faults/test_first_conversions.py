"""Threads that convert a type for the first time at once: msgspec by itself would end the process."""

from __future__ import annotations

import random
import subprocess
import sys

import pytest

from tests.support.soak import repeated


@pytest.mark.timeout(1800)
def test_threads_that_convert_any_type_first_at_once_keep_the_process() -> None:
    seeds = [random.randrange(1 << 30) for _ in range(repeated(1, 200))]
    done = subprocess.run(
        [sys.executable, "-m", "tests.support.first_conversions", *map(str, [repeated(100, 10_000), *seeds])],
        capture_output=True,
        text=True,
    )
    types, died = done.stdout.splitlines()
    assert int(types) > 400
    assert (done.returncode, died) == (0, "[]"), done.stderr
