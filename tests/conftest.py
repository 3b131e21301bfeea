"""Fixtures of all tests: the same environment everywhere, a check for leaks, and communicators."""

from __future__ import annotations

import faulthandler
import fcntl
import gc
import logging
import os
import signal
import sys
import tempfile
from collections import Counter
from collections.abc import Callable, Generator, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from functools import lru_cache, partial
from importlib.util import find_spec
from itertools import count
from logging.handlers import RotatingFileHandler
from pathlib import Path
from typing import Any, Final

import pytest
import typer.testing
from hypothesis import HealthCheck, settings

pytest.register_assert_rewrite("tests.support")  # a failed assertion shows its values there, too

from tests.support.carriers import COLLOCATED, LOCAL, LOCAL_SOCKETS, NETWORK
from tests.support.examples import examples, more_asked_for
from tests.support.leaks import Leaks, watched_leaks
from tests.support.limits import CALL_LIMIT, EVENT_LIMIT, START_LIMIT
from tests.support.processes import free_endpoint
from zenoh_ice import Communicator, ObjectAdapter, initialize

# On a busy machine the duration of an example means nothing. By default the examples are always the same, so that
# nobody is stopped by a failure in others' code; TEST_EXAMPLES, which asks for more, also tries different ones.
settings.register_profile(
    "busy",
    settings(),
    deadline=None,
    suppress_health_check=[HealthCheck.too_slow],
    max_examples=examples(50),
    derandomize=not more_asked_for(),
    database=None,
)
settings.load_profile("busy")

DECISIVE = frozenset(
    {
        *("CI", "BUILD_NUMBER", "GITHUB_ACTIONS", "PYTEST_ADDOPTS"),  # pytest, rich and typer print more
        *("FORCE_COLOR", "NO_COLOR", "PY_COLORS", "COLUMNS", "LINES", "TERMINAL_WIDTH", "PYTHONWARNINGS"),
        *("GIT_DIR", "GIT_WORK_TREE", "GIT_INDEX_FILE"),  # of a hook that runs the tests
    }
)
"""Environment variables that change the tested code."""
ONE_BY_ONE = "tests/e2e/"
"""The folder of the longest tests; they are also collected first."""
APART = "@checkout]"
"""The end of the names of long tests that another worker may take than that of their file's other tests."""
UNIT = "tests/unit/"
"""The folder of the tests that are distributed last."""
TEST_LIMIT = 300.0
"""A test that takes longer, in s, fails."""
LAST_LIMIT = 30.0
"""How long after its limit a test that does not fail ends its process, in s."""

_stderr: Final = pytest.StashKey[int]()
"""The standard error of the process, while that of tests is captured."""


@pytest.hookimpl(tryfirst=True)
def pytest_configure(config: pytest.Config) -> None:
    """Be strict with these tests alone: pyproject.toml also holds for what people write below a checkout."""
    config.option.importmode = "importlib"  # files in different folders have the same name
    if config.getoption("timeout", None) is None:
        config.option.timeout = TEST_LIMIT
    if config.getoption("maxworkerrestart", None) is None:
        config.option.maxworkerrestart = "0"  # another worker would run the same test again
    config.stash[_stderr] = os.dup(2)
    config.add_cleanup(partial(os.close, config.stash[_stderr]))
    for warnings in ("error", "default::pytest.PytestUnraisableExceptionWarning"):
        config.addinivalue_line("filterwarnings", warnings)


def pytest_sessionfinish() -> None:
    """Save what `make coverage` has measured: pytest-xdist kills a worker that takes long to end."""
    coverage = sys.modules.get("coverage")
    measured = coverage.Coverage.current() if coverage else None
    if measured is not None:
        measured.save()


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_make_scheduler(config: pytest.Config, log: Any) -> object:
    """Give workers whole files, so that the fixtures of a file are made once, but long tests one by one."""
    from xdist.scheduler import LoadGroupScheduling

    class Scheduling(LoadGroupScheduling):  # type: ignore[misc]
        def _split_scope(self, nodeid: str) -> str:
            if nodeid.startswith(ONE_BY_ONE):
                return nodeid
            file = nodeid.partition("::")[0]
            return f"{file}::{APART}" if nodeid.endswith(APART) else file

        def _assign_work_unit(self, node: Any) -> None:
            # Pages and unit tests keep processors busy, while others wait for robots that move in real time: one of
            # three workers takes pages, and then files from the end, the unit tests; all others take the first files
            # that are left. So one worker never waits, and neither does the end of the run: it is unit tests.
            scopes = list(self.workqueue)
            if self.nodes.index(node) % 3 == 0:
                chosen = scopes[0] if scopes[0].startswith(ONE_BY_ONE) else scopes[-1]
            else:
                chosen = next((scope for scope in scopes if not scope.startswith(ONE_BY_ONE)), scopes[0])
            self.workqueue.move_to_end(chosen, last=False)
            super()._assign_work_unit(node)

    # By default it begins with the files that have most tests, and so ends with the longest tests.
    config.option.loadscopereorder = False
    return Scheduling(config, log)


@pytest.hookimpl(wrapper=True)
def pytest_collection() -> Generator[None, object, object]:
    """Collect the tests without garbage collection: they all stay, and it takes a third of the time."""
    gc.disable()
    try:
        with pytest.MonkeyPatch.context() as patch:
            patch.setenv("MUJOCO_GL", "disable")  # otherwise MuJoCo searches for GLFW while it is imported
            return (yield)
    finally:
        gc.freeze()  # later collections need not search what was imported
        gc.set_threshold(2_000, 20, 100)  # and search less often what tests make: little of it is garbage
        gc.enable()


@pytest.hookimpl(wrapper=True)
def pytest_make_collect_report(collector: pytest.Collector) -> Generator[None, object, object]:
    """Import a file in one worker at a time: in a fresh clone, the first compiles it for the others."""
    if isinstance(collector, pytest.File | pytest.Directory):
        with alone(collector.path):
            return (yield)
    return (yield)


@pytest.hookimpl(wrapper=True)
def pytest_collection_modifyitems(items: list[pytest.Item]) -> Generator[None, None, None]:
    """Let workers pass one at a time: Hypothesis searches all modules for constants, and saves them for the others."""
    with alone(Path(__file__)):
        yield
    if "PYTEST_XDIST_WORKER" in os.environ:
        put_long_files_last(items)


def put_long_files_last(items: list[pytest.Item]) -> None:
    """Order the files of unit tests by how many slow tests they have: workers that begin at the end take them first."""
    slow = Counter(item.path for item in items if any(map(item.get_closest_marker, ("slow", "sim"))))
    unit = [item for item in items if item.nodeid.startswith(UNIT)]
    others = [item for item in items if not item.nodeid.startswith(UNIT)]
    items[:] = others + sorted(unit, key=lambda item: slow[item.path])


@contextmanager
def alone(path: Path) -> Iterator[None]:
    """Wait until no other worker is in such a block for `path`, unless no files are saved for the others."""
    if sys.dont_write_bytecode:
        yield
        return
    descriptor = os.open(path, os.O_RDONLY)
    try:
        with suppress(OSError):  # some network file systems do not lock what is only read
            fcntl.flock(descriptor, fcntl.LOCK_EX)
        yield
    finally:
        os.close(descriptor)


@pytest.hookimpl(wrapper=True)
def pytest_runtestloop(session: pytest.Session) -> Generator[None, object, object]:
    """Remove environment variables that would change the tests, and let calls and images take longer."""
    if not session.items:  # pytest-xdist runs the tests in other processes
        return (yield)
    with pytest.MonkeyPatch.context() as patch:
        for name in list(os.environ):
            if name in DECISIVE or name.startswith("VISUALHFSM_"):
                patch.delenv(name)
        # A pytest that a test starts would load these for half a second.
        patch.setenv("PYTEST_ADDOPTS", "-p no:anyio -p no:hypothesispytest")
        patch.setenv("GIT_CONFIG_GLOBAL", os.devnull)
        patch.setenv("GIT_CONFIG_NOSYSTEM", "1")
        patch.setenv("XDG_STATE_HOME", tempfile.gettempdir())  # of what fixtures of several tests start
        # A shell makes background jobs ignore signals, as nohup does, and child processes inherit that.
        for number, handler in (
            (signal.SIGINT, signal.default_int_handler),
            (signal.SIGTERM, signal.SIG_DFL),
            (signal.SIGHUP, signal.SIG_DFL),
        ):
            if signal.getsignal(number) is signal.SIG_IGN:
                signal.signal(number, handler)
        # A busy machine may delay calls by 2 s, and images of a simulation beyond their time limit.
        patch.setenv("VISUALHFSM_TIMEOUT", str(CALL_LIMIT))
        # For each command that a test runs, typer would otherwise build its app with all subcommands again.
        patch.setattr("typer.testing._get_command", lru_cache(maxsize=16)(typer.main.get_command))
        if find_spec("mujoco") and any(each.get_closest_marker("gl") for each in session.items):
            from naoserver_sim import cameras

            patch.setattr(cameras, "_FRAME_TIMEOUT", EVENT_LIMIT)
            patch.setattr(cameras, "_SETUP_TIMEOUT", START_LIMIT)
        return (yield)


@pytest.hookimpl(wrapper=True)
def pytest_runtest_protocol(item: pytest.Item) -> Generator[None, object, object]:
    """Limit a test also where its own limit, which is an exception in the main thread, does not end it."""
    end_process_later(item)
    try:
        return (yield)
    finally:
        faulthandler.cancel_dump_traceback_later()


@pytest.hookimpl(trylast=True)
def pytest_exception_interact(node: pytest.Item | pytest.Collector) -> None:
    """Limit the end of a test that failed, too: its limits are canceled for the sake of debuggers."""
    if isinstance(node, pytest.Item):
        end_process_later(node)


def end_process_later(test: pytest.Item) -> None:
    """End the process if a test takes far too long, and print the stacks of all threads.

    This needs neither the main thread, which may wait in a library, nor the interpreter, which may be locked.
    """
    marker = test.get_closest_marker("timeout")
    limit = float(marker.args[0] if marker else test.config.getoption("timeout"))
    if limit > 0:
        stderr = test.config.stash[_stderr]
        faulthandler.dump_traceback_later(limit + LAST_LIMIT, exit=True, file=stderr)


@pytest.fixture(scope="session", autouse=True)
def leaks() -> Iterator[Leaks]:
    """Track what the tests start, and fail if the fixtures of the whole run leave something behind."""
    with watched_leaks() as leaks, leaks.check("the tests of this process"):
        yield leaks


@pytest.fixture(scope="module", autouse=True)
def module_leak_check(leaks: Leaks, request: pytest.FixtureRequest) -> Iterator[None]:
    """Fail if the shared fixtures of a test file leave something behind."""
    with leaks.check(request.path.name):
        yield


@pytest.fixture(autouse=True)
def each_test(
    leaks: Leaks, request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory
) -> Iterator[None]:
    """Fail a test that leaves threads, Zenoh sessions or child processes behind, and tidy up around it.

    This is one fixture, because each of them takes time for each test.
    """
    with leaks.check("the test"), log_handlers(), rendering(request.node), own_state(tmp_path_factory):
        yield


@contextmanager
def log_handlers() -> Iterator[None]:
    """Remove the log handlers of commands that ran in this process: their streams are closed by now."""
    root = logging.getLogger()
    handlers, level = root.handlers.copy(), root.level
    yield
    if left := [each for each in root.handlers if type(each) in (logging.StreamHandler, RotatingFileHandler)]:
        root.handlers[:] = handlers
        root.setLevel(level)
        for handler in left:
            handler.close()


@contextmanager
def rendering(test: pytest.Item) -> Iterator[None]:
    """Switch the cameras of simulations off, unless the test is marked `gl`: setting GL up takes most of their start."""
    with pytest.MonkeyPatch.context() as patch:
        if test.get_closest_marker("gl") is None:
            patch.setenv("MUJOCO_GL", "disable")
        yield


_tests: Final = count()


@contextmanager
def own_state(folders: pytest.TempPathFactory) -> Iterator[None]:
    """Let servers keep their emergency stop where no other test finds it: a killed one leaves the robot stopped."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("XDG_STATE_HOME", str(folders.getbasetemp() / "state" / str(next(_tests))))
        yield


@dataclass(frozen=True)
class Pair:
    """A server and a client with separate sessions, as in two processes."""

    endpoint: str
    server: Communicator
    client: Communicator
    adapter: ObjectAdapter
    """The active adapter of the server."""


@pytest.fixture
def endpoint() -> str:
    """An unused endpoint on loopback."""
    return free_endpoint()


@pytest.fixture
def carrier() -> str:
    """How calls travel; the marks in tests/support/carriers.py run tests over several carriers."""
    return LOCAL


@pytest.fixture
def by_environment(carrier: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Let commands, and communicators that others make, call over the carrier."""
    monkeypatch.setenv(LOCAL_SOCKETS, "false" if carrier == NETWORK else "true")


@pytest.fixture
def make_communicator(carrier: str) -> Iterator[Callable[..., Communicator]]:
    """Create communicators with the wall clock, and destroy them after the test.

    A busy machine must not cost them their links: often the threads of several share one interpreter.
    """
    made: list[Communicator] = []
    common = {"clock": "wall", "connect": [], "lease": CALL_LIMIT, "local_sockets": carrier != NETWORK}

    def make(**settings: Any) -> Communicator:
        communicator = initialize(**{**common, **settings})
        made.append(communicator)
        return communicator

    yield make
    for communicator in reversed(made):
        communicator.destroy()


@pytest.fixture
def pair(endpoint: str, make_communicator: Callable[..., Communicator]) -> Pair:
    """A server that listens on a free port and a client connected to it."""
    server = make_communicator(listen=[endpoint])
    client = make_communicator(connect=[endpoint])
    adapter = server.createObjectAdapter("Test")
    adapter.activate()
    return Pair(endpoint, server, client, adapter)


@pytest.fixture
def caller(carrier: str, pair: Pair) -> Communicator:
    """The one of the pair that calls the server's servants over the carrier."""
    return pair.server if carrier == COLLOCATED else pair.client
