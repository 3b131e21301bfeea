"""The switch that stops a real robot when its server dies or hangs."""

from __future__ import annotations

import os
import threading
from collections.abc import Iterator
from contextlib import contextmanager

import pytest

from naoserver.hardware.connection import CallFailed
from plugins.naoqi.tests.support.scripted import ScriptedNaoqi
from tests.support.limits import EVENT_LIMIT
from tests.support.robot_server import eventually
from visualhfsm_naoqi.robot._switch import stops_of
from visualhfsm_naoqi.robot.dead_man import SwitchLimits, guard

WALK, POSTURE, HOLD = "ALMotion.stopMove", "ALRobotPosture.stopMove", "ALMotion.changeAngles"
JOINTS = ["HeadYaw", "HeadPitch"]
HASTY = SwitchLimits(silence=0.3, repetition=0.05)


class Server:
    """The server's end of the pipe."""

    def __init__(self, pipe: int, guarding: threading.Thread) -> None:
        self._pipe: int | None = pipe
        self.guarding = guarding

    def say(self, text: bytes) -> None:
        assert self._pipe is not None
        os.write(self._pipe, text)

    def die(self) -> None:
        if self._pipe is not None:
            os.close(self._pipe)
            self._pipe = None


@pytest.fixture
def naoqi() -> ScriptedNaoqi:
    naoqi = ScriptedNaoqi()
    naoqi.answers["ALMotion.getBodyNames"] = JOINTS
    return naoqi


@contextmanager
def guarded(naoqi: ScriptedNaoqi) -> Iterator[Server]:
    reading, writing = os.pipe()
    guarding = threading.Thread(
        target=guard, args=(reading, naoqi.connect, stops_of, HASTY), name="dead man's switch"
    )
    guarding.start()
    server = Server(writing, guarding)
    try:
        yield server
    finally:
        server.die()
        guarding.join(EVENT_LIMIT)
        os.close(reading)
        assert not guarding.is_alive()


def is_stopped(naoqi: ScriptedNaoqi) -> bool:
    return naoqi.called(WALK) == naoqi.called(POSTURE) == [()] and naoqi.called(HOLD) == [
        (JOINTS, [0.0, 0.0], 0.1)
    ]


def test_the_death_of_the_server_stops_walk_posture_and_joints(naoqi: ScriptedNaoqi) -> None:
    with guarded(naoqi) as server:
        server.say(b".")
        naoqi.wait_for_call("ALMotion.getBodyNames")
        assert naoqi.called(WALK) == []
    assert is_stopped(naoqi)


@pytest.mark.slow
def test_a_server_that_hangs_is_enough_and_is_guarded_again_when_it_goes_on(naoqi: ScriptedNaoqi) -> None:
    with guarded(naoqi) as server:
        server.say(b".")
        eventually(lambda: is_stopped(naoqi))
        server.say(b".")
        naoqi.wait_for_call(WALK, 2)


def test_a_server_that_has_stopped_the_robot_itself_ends_the_switch(naoqi: ScriptedNaoqi) -> None:
    with guarded(naoqi) as server:
        server.say(b".")
        server.say(b".q")
        server.guarding.join(EVENT_LIMIT)
        assert not server.guarding.is_alive()
    assert naoqi.called(WALK) == []


def test_a_server_that_never_reached_the_robot_leaves_it_alone(naoqi: ScriptedNaoqi) -> None:
    with guarded(naoqi):
        pass
    assert naoqi.calls == []


@pytest.mark.slow
def test_what_the_robot_refuses_is_repeated(naoqi: ScriptedNaoqi) -> None:
    def refuse_first() -> None:
        if len(naoqi.called(WALK)) == 1:
            raise CallFailed(f"{WALK}: busy")

    naoqi.answers[WALK] = refuse_first
    with guarded(naoqi) as server:
        server.say(b".")
    assert len(naoqi.called(WALK)) == 2
    assert len(naoqi.called(HOLD)) == 1


def test_a_robot_that_does_not_name_its_joints_at_first_is_stopped_wholly(naoqi: ScriptedNaoqi) -> None:
    def refuse_first(_chain: str) -> list[str]:
        if len(naoqi.called("ALMotion.getBodyNames")) == 1:
            raise CallFailed("ALMotion.getBodyNames: busy")
        return JOINTS

    naoqi.answers["ALMotion.getBodyNames"] = refuse_first
    with guarded(naoqi) as server:
        server.say(b".")
        naoqi.wait_for_call("ALMotion.getBodyNames")
    assert is_stopped(naoqi)


@pytest.mark.slow
def test_a_robot_that_cannot_be_reached_at_first_is_stopped_when_it_can(naoqi: ScriptedNaoqi) -> None:
    naoqi.reachable = False
    with guarded(naoqi) as server:
        server.say(b".")
        eventually(lambda: naoqi.refused > 0)
        server.die()
        naoqi.reachable = True
    assert is_stopped(naoqi)
