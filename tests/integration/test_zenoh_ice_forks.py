"""Processes that are forked from one with a communicator: every use is refused at once."""

from __future__ import annotations

import subprocess
import sys

import pytest

from tests.support.limits import RUN_LIMIT

FORKED = """
import multiprocessing, sys
from zenoh_ice import CommunicatorDestroyedException, initialize
from interfaces.nao import PoseHeadPrx

def attempt(what):
    try:
        what()
    except CommunicatorDestroyedException as error:
        print(error, flush=True)

def child(head):
    attempt(head.getPose)
    attempt(lambda: initialize(connect=[]))

if __name__ == "__main__":
    with initialize(connect=[], clock="wall") as communicator:
        head = PoseHeadPrx.uncheckedCast(communicator.stringToProxy("Head"))
        if sys.argv[1] == "destroyed":
            communicator.destroy()
        process = multiprocessing.get_context("fork").Process(target=child, args=(head,))
        process.start()
        process.join()
        print(process.exitcode)
"""

SPAWNED = """
import multiprocessing
from zenoh_ice import initialize

def child():
    with initialize(connect=[], clock="wall") as communicator:
        print(communicator.realm, flush=True)

if __name__ == "__main__":
    with initialize(connect=[], clock="wall"):
        process = multiprocessing.get_context("spawn").Process(target=child)
        process.start()
        process.join()
        print(process.exitcode)
"""


@pytest.mark.parametrize("communicator", ["open", "destroyed"])
def test_a_forked_child_is_refused_a_communicator_and_pointed_to_spawn(communicator: str) -> None:
    """A communicator that was destroyed before has left threads of Zenoh's that a fork does not have."""
    command = [sys.executable, "-c", FORKED, communicator]
    ended = subprocess.run(command, capture_output=True, text=True, timeout=RUN_LIMIT, check=False)
    call, opened, code = ended.stdout.splitlines()
    assert "was destroyed" in call
    assert 'multiprocessing.get_context("spawn")' in opened
    assert (code, ended.stderr) == ("0", "")


def test_a_spawned_child_has_a_communicator_of_its_own(tmp_path) -> None:
    script = tmp_path / "spawned.py"
    script.write_text(SPAWNED)
    ended = subprocess.run(
        [sys.executable, str(script)], capture_output=True, text=True, timeout=RUN_LIMIT, check=False
    )
    assert (ended.stdout, ended.stderr) == ("nao\n0\n", "")
