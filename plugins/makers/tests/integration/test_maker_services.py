"""What the services on DDS promise to programs of either maker: how what they command ends."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import pytest

from naoserver.bodies import find_body
from naoserver.errors import InvalidCommand
from naoserver.fake import FakeRobot
from naoserver.options import ServerOptions
from naoserver.protocol.jobs import JobThreads
from naoserver.serving.assembly import Assembly
from naoserver.serving.entrances import Entrance
from plugins.makers.tests.support.dds import free_domain
from tests.support.present import present
from tests.support.processes import ComponentProcess, module
from tests.support.resets import check_that_a_reset_starts_nothing
from tests.support.soak import repeated
from tests.support.waiting import until
from visualhfsm_makers import BOOSTER, UNITREE
from zenoh_ice import WallClock

pytest.importorskip("cyclonedds", reason="the extras unitree and booster are not installed")

from plugins.makers.tests.support import booster, unitree
from visualhfsm_makers._booster import _types as booster_types
from visualhfsm_makers._unitree import _types as unitree_types

DOMAIN = free_domain()
LEASE = "600"
"""Seconds in which DDS alone would notice that a program was killed: longer than a test waits."""


@dataclass(frozen=True)
class Maker:
    """A maker's robot, and what its programs do."""

    entrance: Entrance
    body: str
    support: Any
    """The module with its programs."""
    elbow: int
    stopped: int
    """The code of a robot that is stopped."""
    walk: Callable[[Any], int]
    """Let a program walk; it returns the code of the answer."""

    def process(self, what: str) -> ComponentProcess:
        """A program that walks, or commands by all doors without a pause, until it is killed."""
        return ComponentProcess(module(self.support.__name__, str(DOMAIN), what, LEASE))

    def program(self) -> Any:
        """A program in this process."""
        return self.support.Program(DOMAIN)


T1 = Maker(BOOSTER, "T1", booster, booster.ELBOW, 409, lambda program: int(program.call(*booster.MOVE)))
G1 = Maker(
    UNITREE,
    "G1",
    unitree,
    unitree.ELBOW,
    7301,
    lambda program: int(program.call(7105, unitree.CONTINUOUS).header.status.code),
)
both = pytest.mark.parametrize("maker", [T1, G1], ids=lambda maker: maker.body)


@contextmanager
def served(maker: Maker, domain: int = DOMAIN) -> Iterator[tuple[Any, Assembly]]:
    """Serve a maker's robot without physics; give it and its assembly."""
    clock = WallClock()
    robot = FakeRobot(clock, body=find_body(maker.body))
    assembly = Assembly(robot, ServerOptions(), clock)
    watchdog, *_ = assembly.jobs
    serve = present(maker.entrance.serve)
    try:
        with JobThreads([watchdog]), serve(robot, assembly, {"dds_domain": domain}):
            yield robot, assembly
    finally:
        assembly.close()
        robot.close()


def walks(robot: Any) -> bool:
    return bool(robot.walker.commanded().forward > 0.0)


def follows(assembly: Assembly, joint: str) -> bool:
    """Return whether a joint follows commands with gains."""
    try:
        assembly.body.claims.check([joint])
    except InvalidCommand:
        return True
    return False


@both
def test_the_end_of_the_service_stops_what_programs_drove(maker):
    with served(maker) as (robot, _assembly):
        maker.walk(maker.program())
        assert walks(robot)
    assert not walks(robot)


@both
def test_a_killed_program_walks_no_further(maker):
    with served(maker) as (robot, _assembly):
        for _ in range(repeated(1, soak=100)):
            with maker.process("walk") as program:
                program.wait_for("answered 0")
                assert walks(robot)
                program.process.kill()
                until(lambda: not walks(robot))


@both
def test_a_stop_ends_what_a_program_commands_by_both_doors(maker):
    with served(maker) as (robot, assembly), maker.process("flood") as program:
        program.wait_for("answered 0")
        before = robot.read().positions[maker.elbow]
        until(lambda: robot.read().positions[maker.elbow] != before)
        assembly.gate.stop("a test")
        assert not walks(robot)
        held, other = robot.read().commands[maker.elbow], maker.program()
        assert [maker.walk(other), maker.walk(other)] == [maker.stopped] * 2
        assert robot.read().commands[maker.elbow] == held
        until(lambda: robot.read().positions[maker.elbow] == pytest.approx(held, abs=0.01))
        program.process.kill()


@both
def test_a_reset_starts_no_walk_of_a_program_that_calls_on(maker):
    with served(maker) as (robot, assembly):
        program = maker.program()
        check_that_a_reset_starts_nothing(
            assembly, lambda: maker.walk(program) and None, lambda: walks(robot)
        )


@pytest.mark.parametrize(
    ("maker", "topic", "kind", "command"),
    [
        (T1, "rt/joint_ctrl", booster_types.LowCmd, booster.low_command(booster.ELBOW, 0.5)),
        (G1, "rt/lowcmd", unitree_types.LowCmd, unitree.low_command(unitree.ELBOW, 0.5)),
        (G1, "rt/arm_sdk", unitree_types.LowCmd, unitree.arm_command(unitree.ELBOW, 1.0)),
    ],
    ids=["T1", "G1", "arms of a G1"],
)
def test_a_reset_starts_no_joint_of_a_program_that_commands_on(maker, topic, kind, command):
    with served(maker) as (robot, assembly):
        program, joint = maker.program(), robot.joints[maker.elbow].name
        if maker is T1:
            program.call(*booster.CUSTOM)
        door = program.writer(topic, kind)
        check_that_a_reset_starts_nothing(
            assembly, lambda: door.write(command), lambda: follows(assembly, joint)
        )
