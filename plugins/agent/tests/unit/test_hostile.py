"""Documents and commands that nobody means well: refused or judged, and nothing moves or is written elsewhere."""

from __future__ import annotations

import gc
from collections.abc import Iterator
from contextlib import closing, suppress
from pathlib import Path

import psutil
import pytest

from codegen.messages import MessageError
from naoserver.fake import FakeRobot
from plugins.agent.tests.support.hostile_documents import KINDS, hostile_commands, hostile_documents
from tests.support.limits import CALL_LIMIT, START_LIMIT
from tests.support.robot_server import ServedRobot, served
from tests.support.soak import cases, repeated
from visualhfsm import EditError, Project
from visualhfsm_agent._desk import Desk
from zenoh_ice import Settings, ZenohIceError

pytestmark = pytest.mark.slow

_ALL = 200
_FEW = 2 * KINDS
_QUICK = (1, 2, 4, 5, 6, 7, 8, 10, 12, 15, 17, 19)
"""Kinds of documents that are judged without seconds of waiting for runs and analyses that never end."""
_REST = sorted({*range(KINDS)} - {*_QUICK})
_PATIENCE = 1.0
"""Seconds of a run in virtual time, which some never end."""
_GROWTH = 300 << 20
_CHILD = 600 << 20
"""Most memory by which the process of the tests may grow, and of each of its processes after a task."""


@pytest.fixture(scope="module")
def robot() -> Iterator[ServedRobot]:
    with served(FakeRobot()) as server:
        yield server


@pytest.fixture(scope="module")
def root(tmp_path_factory: pytest.TempPathFactory, robot: ServedRobot) -> Path:
    root = tmp_path_factory.mktemp("all") / "project"
    root.mkdir()
    (root.parent / "outside.xml").write_text("<VisualHFSM/>")
    (root / "agent.toml").write_text(
        f'realm = "{robot.realm}"\ninterfaces = ["Head"]\nask = false\nlongest_run = {START_LIMIT}\n'
    )
    return root


@pytest.fixture
def desk(root: Path, robot: ServedRobot) -> Iterator[Desk]:
    settings = Settings(realm=robot.realm, connect=(robot.endpoint,), clock="wall", timeout=CALL_LIMIT)
    with closing(Desk(root, settings, patience=_PATIENCE)) as made:
        yield made


def outside(root: Path) -> dict[str, bytes]:
    """Return what stands beside the project."""
    return {
        str(each): each.read_bytes()
        for each in root.parent.rglob("*")
        if each.is_file() and root not in each.parents
    }


def ask(tool: object, *arguments: object) -> dict[str, object]:
    """Return the answer of a tool; empty if it is refused for a reason."""
    assert callable(tool)
    answer: dict[str, object] = {}
    with suppress(MessageError, ZenohIceError, OSError, TimeoutError):  # the server says why
        answer = tool(*arguments)
    return answer


@pytest.mark.parametrize("kind", cases(_QUICK, _REST))
def test_documents_are_refused_or_judged(desk: Desk, root: Path, robot: ServedRobot, kind: int) -> None:
    angles, beside = tuple(robot.robot.read().positions), outside(root)
    memory = psutil.Process().memory_info().rss
    for number, content in enumerate(hostile_documents(repeated(_FEW, _ALL))):
        if number % KINDS != kind:
            continue
        file = root / "hostile.xml"
        file.write_bytes(content)
        for tool in (desk.document, desk.picture):
            ask(tool, file.name)
        verdict = ask(desk.verdict, file.name, 0.2)
        run = ask(desk.run, file.name)
        assert verdict.get("ready") or not run
        if run:
            desk.stop()
        ask(desk.edit, file.name, [{"command": "addState", "automaton": 1, "x": 1, "y": 1}])
        assert tuple(robot.robot.read().positions) == angles
        assert outside(root) == beside
    gc.collect()
    assert psutil.Process().memory_info().rss - memory < _GROWTH
    for child in psutil.Process().children(recursive=True):
        assert child.memory_info().rss < _CHILD


def test_the_verdict_of_the_command_says_the_same_of_documents_that_cannot_be_run(
    root: Path, tmp_path: Path
) -> None:
    with Project(root, journals=tmp_path) as project:
        for number, content in enumerate(hostile_documents(_FEW)):
            kind = number % KINDS
            if kind in {9, 10, 11, 14, 16}:  # their code is run, as a verdict is no wall
                continue
            if kind not in repeated(_QUICK, range(KINDS)):
                continue
            file = root / f"hostile{number}.xml"
            file.write_bytes(content)
            with suppress(EditError):
                opened = project.open(file)
                verdict = opened.verdict(seconds=0.2, patience=_PATIENCE)
                assert verdict.ready or verdict.reasons[0].text
                opened.close()
            file.unlink()


def test_commands_are_refused_or_applied_whole(desk: Desk, root: Path) -> None:
    file = root / "edited.xml"
    desk.edit(file.name, [{"command": "addState", "automaton": 1, "x": 1, "y": 1, "name": "first"}])
    beside = outside(root)
    for commands in hostile_commands(_ALL):
        before = file.read_bytes()
        if not ask(desk.edit, file.name, commands):
            assert file.read_bytes() == before
        assert outside(root) == beside
