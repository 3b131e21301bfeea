"""Processes that are forked from one with a communicator: they may not use it, and hold nothing of it."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from pathlib import Path

import pytest

from tests.support.calculator import CalculatorPrx
from tests.support.calculator_servant import CalculatorI
from tests.support.carriers import local_connections
from tests.support.limits import EVENT_LIMIT, FOREVER, LONGEST_CALL, RUN_LIMIT
from tests.support.serving import serve
from tests.support.soak import cases
from tests.support.waiting import until
from zenoh_ice import Communicator, ConnectionLostException

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

PARENT = """
import multiprocessing, os, signal, sys, time
from tests.support.calculator import CalculatorPrx
from tests.support.calculator_servant import CalculatorI
from zenoh_ice import initialize

def live():
    signal.alarm(240)
    print("child", os.getpid(), flush=True)
    time.sleep(240)

if __name__ == "__main__":
    way, other, *options = sys.argv[1:]
    with initialize(clock="wall", timeout=60.0, lease=60.0, connect=options) as communicator:
        adapter = communicator.createObjectAdapter("Parent")
        calculator = CalculatorI()
        adapter.add(calculator, "Calculator")
        adapter.activate()
        other = CalculatorPrx.checkedCast(communicator.stringToProxy(other))
        other.count()
        other.count.begin().result()
        print("ready", flush=True)
        calculator.entered.wait(60)
        sys.stdin.readline()
        if way == "os":
            if os.fork() == 0:
                live()
        else:
            multiprocessing.get_context(way).Process(target=live).start()
        time.sleep(240)
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


@contextmanager
def parent(
    endpoint: str, script: Path, way: str
) -> Iterator[tuple[subprocess.Popen[str], Callable[[], None]]]:
    """Run a process that called a servant and serves one; the function lets it have a child, which lives on."""
    script.write_text(PARENT)
    command = [sys.executable, str(script), way, "Other", endpoint]
    environment = {**os.environ, "PYTHONPATH": str(Path.cwd()), "VISUALHFSM_LISTEN": "tcp/127.0.0.1:0"}
    children: list[int] = []
    with subprocess.Popen(
        command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, env=environment
    ) as process:
        assert process.stdin is not None
        assert process.stdout is not None

        def fork() -> None:
            assert process.stdin is not None
            assert process.stdout is not None
            process.stdin.write("\n")
            process.stdin.flush()
            children.append(int(process.stdout.readline().split()[1]))

        try:
            assert process.stdout.readline() == "ready\n"
            yield process, fork
        finally:
            process.kill()
            for child in children:
                os.kill(child, signal.SIGKILL)


@pytest.mark.parametrize("way", cases(["fork"], ["os", "spawn"]))
def test_the_end_of_a_parent_is_noticed_while_its_child_lives(
    endpoint: str, make_communicator: Callable[..., Communicator], tmp_path: Path, way: str
) -> None:
    server = make_communicator(listen=[endpoint], lease=LONGEST_CALL)
    client = make_communicator(connect=[endpoint], lease=LONGEST_CALL, timeout=LONGEST_CALL)
    serve(server, CalculatorI(), "Other")
    before = local_connections()
    with parent(endpoint, tmp_path / "parent.py", way) as (process, fork):
        until(lambda: local_connections() > before)
        calculator = CalculatorPrx.checkedCast(client.stringToProxy("Calculator"))
        with ThreadPoolExecutor(1) as thread:
            waiting = thread.submit(calculator.sleep, FOREVER)
            fork()  # once the servant was called
            process.kill()
            assert isinstance(waiting.exception(EVENT_LIMIT), ConnectionLostException)
        until(lambda: local_connections() == before)
