"""Fixtures of all tests: the same environment everywhere, a check for leaks, and communicators."""

from __future__ import annotations

import faulthandler
import gc
import logging
import os
import signal
import sys
import tempfile
from collections.abc import Callable, Generator, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import lru_cache, partial
from itertools import count
from logging.handlers import RotatingFileHandler
from typing import Any, Final

import numpy as np  # noqa: F401 - once for a process: pytester forgets what its runs have imported
import pytest
import typer.testing
from hypothesis import HealthCheck, settings

from tests.support.carriers import COLLOCATED, LOCAL, LOCAL_SOCKETS, NETWORK
from tests.support.costs import Costs
from tests.support.deeds import Doors, begin_test, undue_deeds
from tests.support.examples import examples, more_asked_for
from tests.support.leaks import Leaks, watched_leaks
from tests.support.limits import CALL_LIMIT
from tests.support.memory import Memory
from tests.support.places import ROOT
from tests.support.processes import free_endpoint
from tests.support.soak import LEFT_TO_SOAK, OTHERS, SOAKS, repeated
from zenoh_ice import Communicator, ObjectAdapter, initialize

# On a busy machine the duration of an example means nothing. By default the examples are always the same, so that
# nobody is stopped by a failure in others' code; a soak, which asks for more, also tries different ones.
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
        "PYTHONUNBUFFERED",  # what containers set hides what is lost in a buffer
    }
)
"""Environment variables that change the tested code."""
TEST_LIMIT = repeated(300.0, 1200.0)
"""A test that takes longer, in s, fails."""
NEW_OBJECTS = 10_000
"""So many new objects between two garbage collections: Python's 700 cost 3 % of the processor time."""
LAST_LIMIT = 30.0
"""How long after its limit a test that does not fail ends its process, in s."""

_memory: Final = Memory()
_WARNINGS: Final = ROOT / "MUJOCO_LOG.TXT"
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
    config.pluginmanager.register(Costs())
    config.pluginmanager.register(Doors())
    config.stash[_stderr] = os.dup(2)
    config.add_cleanup(partial(os.close, config.stash[_stderr]))
    for warnings in ("error", "default::pytest.PytestUnraisableExceptionWarning"):
        config.addinivalue_line("filterwarnings", warnings)


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_auto_num_workers(config: pytest.Config) -> int | None:
    """Return a worker for two processors for `-n auto`, which `make` gives tests beside those that wait."""
    return ((os.cpu_count() or 1) + 1) // 2 if config.option.numprocesses == "auto" else None


def pytest_sessionfinish() -> None:
    """Save what `make coverage` has measured: pytest-xdist kills a worker that takes long to end."""
    coverage = sys.modules.get("coverage")
    measured = coverage.Coverage.current() if coverage else None
    if measured is not None:
        measured.save()


@pytest.hookimpl(wrapper=True)
def pytest_collection() -> Generator[None, object, object]:
    """Collect without garbage collection, which would take 3 of 8 s: all that is imported and collected stays."""
    gc.disable()
    try:
        return (yield)
    finally:
        _memory.keep_the_collected()
        gc.set_threshold(NEW_OBJECTS)
        gc.enable()


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(
    session: pytest.Session, config: pytest.Config, items: list[pytest.Item]
) -> None:
    """Leave the tests of `make soak` to it, before options select among the others."""
    left = [] if SOAKS else [item for item in items if item.get_closest_marker("soak")]
    if left:
        config.hook.pytest_deselected(items=left)
        items[:] = [item for item in items if not item.get_closest_marker("soak")]
    session.stash[LEFT_TO_SOAK] = left
    session.stash[OTHERS] = [*items]


@pytest.hookimpl(wrapper=True)
def pytest_runtestloop(session: pytest.Session) -> Generator[None, object, object]:
    """Remove environment variables that would change the tests, and let calls take longer."""
    if not session.items:  # pytest-xdist runs the tests in other processes
        return (yield)
    with (
        tempfile.TemporaryDirectory(prefix="visualhfsm-states-") as states,
        pytest.MonkeyPatch.context() as patch,
    ):
        for name in list(os.environ):
            if name in DECISIVE or name.startswith("VISUALHFSM_"):
                patch.delenv(name)
        # A pytest that a test starts would load these for half a second.
        patch.setenv("PYTEST_ADDOPTS", "-p no:anyio -p no:hypothesispytest")
        patch.setenv("GIT_CONFIG_GLOBAL", os.devnull)
        patch.setenv("GIT_CONFIG_NOSYSTEM", "1")
        patch.setenv("XDG_STATE_HOME", states)  # of what fixtures of several tests start
        # A shell makes background jobs ignore signals, as nohup does, and child processes inherit that.
        for number, handler in (
            (signal.SIGINT, signal.default_int_handler),
            (signal.SIGTERM, signal.SIG_DFL),
            (signal.SIGHUP, signal.SIG_DFL),
        ):
            if signal.getsignal(number) is signal.SIG_IGN:
                signal.signal(number, handler)
        # A busy machine may delay calls by 2 s.
        patch.setenv("VISUALHFSM_TIMEOUT", str(CALL_LIMIT))
        # For each command that a test runs, typer would otherwise build its app with all subcommands again.
        patch.setattr("typer.testing._get_command", lru_cache(maxsize=16)(typer.main.get_command))
        return (yield)


@pytest.hookimpl(wrapper=True)
def pytest_runtest_protocol(item: pytest.Item) -> Generator[None, object, object]:
    """Limit a test also where its own limit, which is an exception in the main thread, does not end it."""
    end_process_later(item)
    begin_test(item)
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
    _memory.give_back()


@pytest.fixture(autouse=True)
def each_test(
    leaks: Leaks, request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory
) -> Iterator[None]:
    """Fail a test that leaves threads, Zenoh sessions, child processes or MuJoCo's file behind, and tidy up around it.

    This is one fixture, because each of them takes time for each test.
    """
    with leaks.check("the test"), log_handlers(), rendering(request.node), own_state(tmp_path_factory):
        yield
    _memory.give_back()
    if _WARNINGS.exists():
        text = _WARNINGS.read_text("utf-8")
        _WARNINGS.unlink(missing_ok=True)  # the next test has nothing to do with it
        pytest.fail(f"MuJoCo warned in a file, as it does where nobody takes its warnings:\n{text}")
    if undue := undue_deeds(request.node):
        pytest.fail(
            f"`make test` is not for what this test does: {undue}; with the mark, `make test-all` runs it"
        )


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
