"""Which processes declare that they can read each other's memory: only those that the system allows to."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys

import pytest

from tests.support.limits import RUN_LIMIT
from zenoh_ice._zenoh.shared_memory import memory_space

MAKER = """
import os
import sys
from zenoh_ice._zenoh.shared_memory import MemoryFile, memory_space
print(os.getpid(), MemoryFile(1 << 16).file, memory_space(), flush=True)
sys.stdin.read()
"""
READER = """
import os
import sys
from zenoh_ice._zenoh.shared_memory import memory_space
process, file = sys.argv[1:]
try:
    os.close(os.open(f"/proc/{process}/fd/{file}", os.O_RDWR))
except PermissionError:
    print("refused", memory_space())
else:
    print("opened", memory_space())
"""
LESS = ("setpriv", "--bounding-set", "-all")  # root without capabilities, as most users are
NICE = ("setpriv", "--bounding-set", "-all,+sys_nice")
ANOTHER_GROUP = (*LESS, "--regid", "1", "--clear-groups")

pytestmark = pytest.mark.skipif(not memory_space(), reason="no memory is shared here")
as_root = pytest.mark.skipif(
    os.geteuid() != 0 or shutil.which("setpriv") is None,
    reason="only root can start processes of less rights",
)


def test_a_python_that_makes_no_memory_files_shares_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delattr(os, "memfd_create")
    assert memory_space() == ""


@pytest.mark.slow
@pytest.mark.parametrize(
    ("maker", "readers"),
    [
        ((), {(): "opened"}),
        pytest.param((), {LESS: "refused"}, marks=as_root),
        pytest.param(NICE, {LESS: "refused"}, marks=as_root),
        pytest.param(LESS, {LESS: "opened", ANOTHER_GROUP: "refused"}, marks=as_root),
    ],
)
def test_who_may_not_open_anothers_memory_is_of_another_space(
    maker: tuple[str, ...], readers: dict[tuple[str, ...], str]
) -> None:
    with subprocess.Popen(
        [*maker, sys.executable, "-c", MAKER], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    ) as process:
        assert process.stdout is not None
        number, file, space = process.stdout.readline().split()
        for reader, outcome in readers.items():
            done = subprocess.run(
                [*reader, sys.executable, "-c", READER, number, file],
                capture_output=True,
                text=True,
                timeout=RUN_LIMIT,
                check=True,
            )
            reported, other_space = done.stdout.split()
            assert reported == outcome
            assert (space == other_space) == (outcome == "opened")
        process.kill()
