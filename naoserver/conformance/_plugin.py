"""The suite in pytest: which robot it tests, what that may do, and which sentences of the contract hold."""

from __future__ import annotations

import importlib
import math
import sys
import traceback
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, ExitStack, contextmanager, nullcontext
from pathlib import Path
from typing import Any, Final

import pytest

from interfaces.nao import SafetyPrx
from naoserver.conformance._robot import LIMIT, ROOM, STEP, RobotClient, served
from naoserver.errors import RobotError
from naoserver.protocol.robot import Robot

MakeRobot = Callable[[], AbstractContextManager[Robot]]
_MAKE: Final = pytest.StashKey[MakeRobot]()
_SENTENCE: Final = "sentence"
"""The property of a test's report with the topic and the sentence of the contract that it tests."""
_LAST: Final = "test_life"
"""The topic that closes the robot for good."""
_WORDS: Final = {"passed": "holds", "failed": "BROKEN", "error": "BROKEN", "skipped": "skipped"}


def pytest_addoption(parser: pytest.Parser) -> None:
    """Add the options."""
    add = parser.getgroup("naoserver.conformance", "conformance of a robot").addoption
    robot = "what makes the robot: called without arguments, it returns a Robot that is not started"
    add("--robot", metavar="MODULE:FUNCTION", help=robot)
    add("--room", action="store_true", help="the robot has 2 m of free floor around it: let it walk")
    limit = f"how long to wait for what the contract promises; by default {LIMIT:g} s"
    add("--robot-limit", type=float, default=LIMIT, metavar="SECONDS", help=limit)


def pytest_configure(config: pytest.Config) -> None:
    """Describe the mark."""
    config.addinivalue_line("markers", "needs(part, ...): skipped by name for a robot without the part")


def pytest_sessionstart(session: pytest.Session) -> None:
    """Find what makes the robot before anything runs."""
    option = session.config.option
    if getattr(option, "numprocesses", None):  # of pytest-xdist
        raise pytest.UsageError("one robot is tested by one process: leave out -n")
    if not 0.0 < option.robot_limit < math.inf:
        raise pytest.UsageError(f"--robot-limit {option.robot_limit:g}: it must be more than 0 s")
    if option.robot:
        session.config.stash[_MAKE] = made_by(option.robot)
    elif not option.collectonly:
        raise pytest.UsageError(
            "which robot? Say --robot MODULE:FUNCTION, which returns a Robot, not started"
        )


def pytest_report_header(config: pytest.Config) -> str:
    """Say what will move."""
    far = "and it walks" if config.option.room else "and it does not walk (--room lets it)"
    return f"robot: {config.option.robot} MOVES: one joint at a time by {STEP:g} rad, slowly; {far}"


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Put the topic that closes the robot last, and give each test its sentence of the contract."""
    items.sort(key=lambda item: item.path.stem == _LAST)
    for item in items:
        if isinstance(item, pytest.Function):
            topic, sentence = (" ".join(each.__doc__.split()) for each in (item.module, item.function))
            item.user_properties.append((_SENTENCE, (topic, sentence)))


def pytest_terminal_summary(terminalreporter: Any, config: pytest.Config) -> None:  # noqa: ANN401
    """Write what became of each sentence of the contract, by topic."""
    topics: dict[str, list[str]] = {}
    reports = [
        (word, each) for outcome, word in _WORDS.items() for each in terminalreporter.getreports(outcome)
    ]
    for word, report in sorted(reports, key=lambda each: each[1].location[:2]):
        topic, sentence = dict(report.user_properties).get(_SENTENCE, ("", ""))
        topics.setdefault(topic, []).append(f"  {word:<8}{sentence}{_why(report)}")
    for topic, lines in topics.items():
        terminalreporter.section(f"{topic.rstrip('.')}: {config.option.robot}")
        terminalreporter.write_line("\n".join(lines))


def _why(report: pytest.TestReport) -> str:
    """Return why a test was skipped or failed, as the end of its line."""
    if isinstance(report.longrepr, tuple):
        return f" ({report.longrepr[2].removeprefix('Skipped: ')})"
    crash = getattr(report.longrepr, "reprcrash", None)
    return f"\n{'':<10}{crash.message.splitlines()[0].removeprefix('AssertionError: ')}" if crash else ""


def made_by(named: str) -> MakeRobot:
    """Return what makes a robot, by the name `module:function`. Raises pytest.UsageError for what is none."""
    name, _, function = named.partition(":")
    if (folder := str(Path.cwd())) not in sys.path:
        sys.path.insert(0, folder)
    try:
        module = importlib.import_module(name)
    except ImportError as error:
        raise pytest.UsageError(f"--robot {named}, looked for in {folder}, too: {error}") from error
    except (Exception, SystemExit) as error:  # of its own code, or a name that cannot be one of a module
        raise pytest.UsageError(f"--robot {named}: {name or 'no module'}: {error!r}") from error
    if not callable(made_here := getattr(module, function or "make", None)):
        raise pytest.UsageError(f"--robot {named}: {name} has no function {function or 'make'!r}")

    @contextmanager
    def make() -> Iterator[Robot]:
        made = made_here()
        with made if isinstance(made, AbstractContextManager) else nullcontext(made) as robot:
            if lacking := [each for each in dir(Robot) if each[0] != "_" and not hasattr(robot, each)]:
                raise RobotError(f"a {type(robot).__name__} lacks {', '.join(lacking)}: it is no Robot")
            yield robot

    return make


@pytest.fixture(scope="session")
def make(request: pytest.FixtureRequest) -> MakeRobot:
    """What makes a robot, not started; its end gives up what it stands on."""
    return request.config.stash[_MAKE]


@pytest.fixture(scope="session")
def nao(make: MakeRobot, request: pytest.FixtureRequest) -> Iterator[RobotClient]:
    """The robot, served until the suite closes it, and a client's session."""
    option = request.config.option
    with ExitStack() as stack:
        try:
            robot = stack.enter_context(make())
            server = stack.enter_context(served(robot, limit=option.robot_limit))
        except (Exception, SystemExit) as error:  # noqa: BLE001 - whatever the robot's own code raises
            known = isinstance(error, RobotError)
            why = str(error) if known else "".join(traceback.format_exception(error, limit=-2)).rstrip()
            pytest.exit(f"{option.robot}: the robot cannot be started: {why}", 1)
        held = zip(robot.joints, robot.read().stiffnesses, strict=True)
        before = {joint.name: stiffness for joint, stiffness in held if joint.max_torque > 0.0}
        server.serving.callback(robot.command_stiffnesses, before, 0.0)
        yield stack.enter_context(server.client())


@pytest.fixture(autouse=True)
def able(request: pytest.FixtureRequest) -> None:
    """Skip a test, by name, for a robot that lacks what it needs."""
    for part in (part for mark in request.node.iter_markers("needs") for part in mark.args):
        has_it = (
            request.config.option.room if part is ROOM else part.has(request.getfixturevalue("nao").robot)
        )
        if not has_it:
            pytest.skip(part.lacking)


@pytest.fixture
def rest(nao: RobotClient) -> Iterator[RobotClient]:
    """The robot, stiff and at rest before a test, and stopped after it."""
    robot, stop = nao.robot, nao.assembly.body.hold
    driven = {place: joint.name for place, joint in enumerate(robot.joints) if joint.max_torque > 0.0}
    robot.command_stiffnesses(dict.fromkeys(driven.values(), 1.0), 0.5)
    stop()
    nao.until(
        lambda: all(robot.read().stiffnesses[place] > 0.99 for place in driven),
        "motors become stiff within 0.5 s",
    )
    nao.until(
        lambda: max(map(abs, robot.read().velocities), default=0.0) < 0.1, "a stop brings joints to rest"
    )
    yield nao
    stop()
    nao.proxy(SafetyPrx, "Safety").resetEmergencyStop(True)


@pytest.fixture(scope="session")
def closed(nao: RobotClient) -> Robot:
    """The robot, closed for good, twice, after its server has ended."""
    nao.serving.close()
    nao.robot.close()
    nao.robot.close()
    return nao.robot
