"""The check that tests leave nothing running: it finds leaks, and ignores what is older."""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
from contextlib import ExitStack
from pathlib import Path

import pytest

from tests.support import processes
from tests.support.limits import FOREVER, RUN_LIMIT
from tests.support.processes import REPOSITORY, ComponentProcess

CONFTEST = f"""
import os
from tests.support.suite import each_test, leaks, module_leak_check
from tests.support.leaks import Leaks

check = Leaks.check

def check_briefly(self, scope):
    '''Wait for the end of what is left only where nothing is.'''
    file = os.environ["PYTEST_CURRENT_TEST"].partition("::")[0]
    return check(self, scope, limit={FOREVER} if file in ("test_clean.py", "test_locked.py") else 0.1)

Leaks.check = check_briefly
"""
STARTERS = """
import subprocess, sys, threading
from concurrent.futures import ThreadPoolExecutor
import pytest
from zenoh_ice import initialize

kept = []

def start_thread():
    threading.Thread(target=threading.Event().wait, name="idler", daemon=True).start()

def start_process():
    process = subprocess.Popen([sys.executable, "-c", "input()"], stdin=subprocess.PIPE)
    kept.append(process.stdin.close)
    return process

def start_communicator():
    communicator = initialize(connect=[], clock="wall")
    kept.append(communicator.destroy)
    return communicator

def end_all():
    while kept:
        kept.pop()()

def run_on(communicator, job):
    done = threading.Event()
    communicator.pool.submit(lambda: (job(), done.set()))
    assert done.wait(20)

@pytest.fixture(scope="module")
def shared():
    with initialize(connect=[], clock="wall") as shared:
        yield shared
"""
LEAKING = {
    "everything": """
def test_thread():
    start_thread()

def test_thread_of_a_thread():
    starter = threading.Thread(target=start_thread)
    starter.start()
    starter.join()

def test_process():
    start_process()

def test_communicator():
    start_communicator()
""",
    "older": """
def test_thread(shared):
    run_on(shared, start_thread)

def test_process(shared):
    run_on(shared, start_process)

def test_communicator(shared):
    run_on(shared, start_communicator)

def test_last():
    pass
""",
    "beside": """
def test_process(shared):
    start_process()

def test_communicator(shared):
    start_communicator()

def test_thread(shared):
    start_thread()

def test_last():
    pass
""",
    "fixtures": """
@pytest.fixture(scope="module")
def forgetful():
    start_thread()

def test_it(forgetful):
    pass
""",
}
"""Tests that leave something behind, by the name of their file."""
CLEAN = """
def test_clean():
    with initialize(connect=[], clock="wall") as own, ThreadPoolExecutor(1) as pool, start_process() as process:
        run_on(own, lambda: pool.submit(str))
        process.stdin.close()

def test_pool_grows(shared):
    before = threading.enumerate()
    together = threading.Barrier(3)
    for _ in range(2):
        shared.pool.submit(lambda: together.wait(20))
    together.wait(20)
    assert [thread.name for thread in threading.enumerate() if thread not in before][0] == "zenoh_ice nao-2"

def test_first_use(shared):
    before = threading.active_count()
    shared.pool.kind()
    assert threading.active_count() > before

@pytest.fixture(scope="module")
def starting(shared):
    ending = threading.Event()
    yield lambda: threading.Thread(target=ending.wait).start()
    ending.set()
    end_all()

def test_shared_starts(shared, starting):
    run_on(shared, lambda: (starting(), start_process(), start_communicator()))
"""
LOCKED = """
from zenoh.handlers import Callback

@pytest.fixture(scope="module")
def locked(shared):
    entered, leave = threading.Event(), threading.Event()

    def hold(_reply):
        entered.set()
        leave.wait(20)

    liveliness = shared.transport.network.session.liveliness()
    with liveliness.declare_token("token"), ThreadPoolExecutor(1) as pool:
        pool.submit(liveliness.get, "token", handler=Callback(hold, indirect=False))
        assert entered.wait(20)
        yield
        leave.set()

def test_locked(locked):
    pass
"""
"""A test during which Zenoh keeps a session locked, since it calls a function that does not return."""


def run(folder: Path, files: dict[str, str]) -> dict[str, dict[str, str]]:
    """Run files of tests, none of which fails; return by file the errors of those that fail in their teardown."""
    (folder / "conftest.py").write_text(CONFTEST)
    for name, tests in files.items():
        (folder / f"test_{name}.py").write_text(STARTERS + tests)
    done = subprocess.run(
        [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider"],
        cwd=folder,
        env=os.environ | {"PYTHONPATH": str(REPOSITORY), "COLUMNS": "1000"},
        capture_output=True,
        text=True,
        timeout=RUN_LIMIT,
        check=False,
    )
    expected = sum(tests.count("def test_") for tests in files.values())
    assert re.search(rf"^{expected} passed", done.stdout, re.MULTILINE), done.stdout
    found = re.findall(r"^ERROR test_(\w+).py::(\S+) - AssertionError: (.*)$", done.stdout, re.MULTILINE)
    assert len(found) == done.stdout.count("\nERROR "), done.stdout
    errors: dict[str, dict[str, str]] = {name: {} for name in files}
    for name, test, error in found:
        errors[name][test] = error
    return errors


@pytest.fixture(scope="module")
def errors(tmp_path_factory: pytest.TempPathFactory) -> dict[str, dict[str, str]]:
    """What is reported of the tests that leave something behind, and of others that do not."""
    return run(tmp_path_factory.mktemp("leaking"), {**LEAKING, "clean": CLEAN, "locked": LOCKED})


REPORTED: dict[str, dict[str, list[str]]] = {
    "everything": {
        "test_thread": ["^the test left behind the thread 'idler'.* of {file}::test_thread$"],
        "test_thread_of_a_thread": [
            "^the test left behind the thread 'idler'.* of {file}::test_thread_of_a_thread$"
        ],
        "test_process": ["^the test left behind the process '.* of {file}::test_process$"],
        "test_communicator": [
            "^the test left behind the Zenoh session .* of {file}::test_communicator$",
            "the thread 'zenoh_ice nao-1' of",
        ],
    },
    # What older things start is reported when they have ended.
    "older": {
        "test_last": [
            "the thread 'idler' of {file}::test_thread",
            "the process '.*' of {file}::test_process",
            "the Zenoh session .* of {file}::test_communicator",
        ]
    },
    "beside": {
        "test_process": [""],
        "test_communicator": [""],
        "test_last": ["test_beside.py left behind the thread 'idler' of {file}::test_thread"],
    },
    "fixtures": {"test_it": ["^{file} left behind the thread 'idler' of {file}::test_it$"]},
    "clean": {},  # it ends with its test, or with what is older
    "locked": {},  # the check does not wait for a session that Zenoh keeps locked
}
"""What the errors of which tests say, by the name of their file."""


@pytest.mark.parametrize("name", REPORTED)
def test_what_tests_leave_behind_is_reported(errors: dict[str, dict[str, str]], name: str) -> None:
    assert list(errors[name]) == list(REPORTED[name])
    for test, parts in REPORTED[name].items():
        for part in parts:
            assert re.search(part.format(file=f"test_{name}.py"), errors[name][test])


def test_a_process_that_keeps_the_output_of_a_component_is_reported(monkeypatch: pytest.MonkeyPatch) -> None:
    code = f"import subprocess; print(subprocess.Popen(['sleep', '{FOREVER}']).pid)"
    with ExitStack() as stack:
        component = stack.enter_context(ComponentProcess([sys.executable, "-c", code]))
        left = int(component.wait_for(r"^\d+$")[0])
        component.process.wait(RUN_LIMIT)
        monkeypatch.setattr(processes, "END_LIMIT", 0.1)
        with pytest.raises(AssertionError, match="left a process with its output"):
            stack.close()
    os.kill(left, signal.SIGKILL)
    component.wait()
    assert component.process.stdout is not None
    component.process.stdout.close()
