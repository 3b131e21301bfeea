"""Stop robots from a new process: what is reached, what counts as stopped, and when the trying ends."""

from __future__ import annotations

import threading
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager

import pytest
import zenoh

from nao_tools._stopping import OWN_SWITCH, Realm, StopLimits, Stopping
from tests.support.limits import CALL_LIMIT, END_LIMIT, FOREVER
from tests.support.processes import free_endpoint
from tests.support.scripted_robot import ScriptedRobot, error, joints, listening, state
from tests.support.waiting import at_once, until
from zenoh_ice import Settings
from zenoh_ice.data.exceptions import EndpointInUseException

pytestmark = pytest.mark.slow

LIMITS = StopLimits(answer=CALL_LIMIT, state=CALL_LIMIT, standstill=FOREVER)


@pytest.fixture
def endpoint() -> str:
    return free_endpoint()


@pytest.fixture
def session(endpoint: str) -> Iterator[zenoh.Session]:
    with listening(endpoint) as session:
        yield session


@pytest.fixture
def robot(session: zenoh.Session) -> ScriptedRobot:
    return ScriptedRobot(session)


@pytest.fixture
def impatient(monkeypatch: pytest.MonkeyPatch) -> None:
    """Say soon what is missing, and do not try for long to reach nobody."""
    monkeypatch.setattr("nao_tools._stopping._REPORT_PERIOD", 0.05)
    monkeypatch.setattr("nao_tools._stopping._LINK_LIMIT", 0.5)


class Enough(Exception):
    """A test has seen what it waited for."""


def client(*endpoints: str) -> Settings:
    return Settings(mode="client", connect=endpoints, listen=(), timeout=CALL_LIMIT)


def stopped(
    *endpoints: str, limit: float = END_LIMIT, limits: StopLimits = LIMITS, every_realm: bool = False
) -> tuple[Stopping, list[str]]:
    """Stop what is behind some endpoints; return how that went, and what was said meanwhile."""
    stopping = Stopping(client(*endpoints), "a hand", limit=limit, every_realm=every_realm, limits=limits)
    said: list[str] = []
    stopping.run(said.append)
    return stopping, said


@contextmanager
def running(*endpoints: str, every_realm: bool = False) -> Iterator[Stopping]:
    """Stop what is behind some endpoints; the end of the block waits until that is done."""
    stopping = Stopping(client(*endpoints), "a hand", limit=END_LIMIT, every_realm=every_realm, limits=LIMITS)
    thread = threading.Thread(target=stopping.run, args=(lambda _: None,))
    thread.start()
    try:
        yield stopping
    finally:
        thread.join()


@at_once
def test_a_robot_that_confirms_and_is_still_is_stopped_at_once(endpoint: str, robot: ScriptedRobot) -> None:
    stopping, said = stopped(endpoint, limit=FOREVER)
    assert (stopping.succeeded, [each.name for each in stopping.concerned], said) == (True, ["nao"], [])
    assert (stopping.unreached, stopping.realms["nao"].speed) == ([], 0.0)


@at_once
@pytest.mark.usefixtures("impatient")
def test_one_endpoint_of_two_is_enough_for_one_robot(endpoint: str, robot: ScriptedRobot) -> None:
    stopping, _ = stopped(free_endpoint(), endpoint, limit=FOREVER)
    assert stopping.succeeded
    assert [route.name for route in stopping.routes if route.reached] == [endpoint]


def test_the_message_is_repeated_until_the_robot_confirms_it(endpoint: str, robot: ScriptedRobot) -> None:
    robot.stops = [error("the cable is out"), error("the cable is out"), *robot.stops]
    stopping, _ = stopped(endpoint)
    assert stopping.succeeded
    assert len(robot.sent) >= 3


def test_it_goes_on_until_the_joints_are_still(endpoint: str, robot: ScriptedRobot) -> None:
    robot.joints = [joints(1.0), joints(0.5), joints(0.0)]
    stopping, _ = stopped(endpoint)
    assert (stopping.succeeded, robot.joints) == (True, [joints(0.0)])


def test_a_robot_that_says_nothing_of_its_joints_is_believed_in_the_end(
    endpoint: str, robot: ScriptedRobot
) -> None:
    robot.joints = []
    stopping, _ = stopped(endpoint, limits=StopLimits(state=0.3, standstill=0.2))
    assert (stopping.succeeded, stopping.realms["nao"].speed) == (True, None)


def test_a_robot_that_no_command_reaches_has_not_stopped(endpoint: str, robot: ScriptedRobot) -> None:
    robot.states = [state("unplugged", 7.0)]
    with running(endpoint) as stopping:
        realm = stopping.realms["nao"]
        until(lambda: realm.lost == "unplugged")
        assert (realm.confirmed, realm.lost_for, stopping.succeeded) == (True, 7.0, False)
        robot.states = [state()]
    assert stopping.succeeded


@at_once
@pytest.mark.parametrize(
    "answer",
    [
        pytest.param((True, b"\xc1"), id="not MessagePack"),
        pytest.param((True, b"\x91" * 100_000), id="nested too deeply"),
        pytest.param((True, b"\x80"), id="of another form"),
        pytest.param((True, b"\x90"), id="nothing"),
        pytest.param(error("no such joint"), id="an error"),
        pytest.param((False, joints(1.5)[1]), id="joints as an error"),
    ],
)
def test_a_robot_whose_answer_says_nothing_of_its_joints_counts_as_still(
    endpoint: str, robot: ScriptedRobot, answer: tuple[bool, bytes]
) -> None:
    robot.joints = [answer]
    stopping, _ = stopped(endpoint, limit=FOREVER)
    assert (stopping.succeeded, stopping.realms["nao"].speed) == (True, None)


@pytest.mark.usefixtures("impatient")
def test_why_a_robot_does_not_stop_is_said_and_whoever_fails_to_hear_it_leaves_no_thread(
    endpoint: str, robot: ScriptedRobot
) -> None:
    robot.stops = [error("the cable is out")]
    stopping = Stopping(client(endpoint), "a hand", limit=END_LIMIT, limits=LIMITS)

    def say(text: str) -> None:
        if text == f"not stopped yet: nao: the cable is out; trying again; {OWN_SWITCH}":
            raise Enough

    with pytest.raises(Enough):
        stopping.run(say)
    assert (stopping.succeeded, stopping.realms["nao"].confirmed) == (False, False)
    until(lambda: not [each for each in threading.enumerate() if each.name.startswith("stop by")])


@pytest.mark.usefixtures("impatient")
@pytest.mark.parametrize("somebody", [True, False])
def test_without_a_robot_it_ends_at_the_limit(
    endpoint: str, request: pytest.FixtureRequest, somebody: bool
) -> None:
    if somebody:
        request.getfixturevalue("session")
    began = time.monotonic()
    stopping, _ = stopped(endpoint, limit=0.3)
    assert time.monotonic() - began >= 0.3
    assert (stopping.succeeded, stopping.concerned[0].confirmed) == (False, False)
    if not somebody:
        assert [route.name for route in stopping.unreached] == [endpoint]


class TestEveryRealm:
    def test_all_that_announce_themselves_are_stopped(self, endpoint: str, session: zenoh.Session) -> None:
        first, second = (
            ScriptedRobot(session, realm, token=f"@servant/{realm}/Safety/x") for realm in ("lab", "hall")
        )
        stopping, _ = stopped(endpoint, every_realm=True)
        assert ([each.name for each in stopping.concerned], stopping.succeeded) == (["hall", "lab"], True)
        assert first.sent
        assert second.sent

    def test_one_that_does_not_stop_is_a_failure(self, endpoint: str, session: zenoh.Session) -> None:
        robots = [
            ScriptedRobot(session, realm, token=f"@servant/{realm}/Safety/x") for realm in ("lab", "hall")
        ]
        robots[0].stops = [error("the cable is out")]
        with running(endpoint, every_realm=True) as stopping:
            known = {"hall": True, "lab": False}
            until(lambda: {each.name: each.confirmed for each in stopping.concerned} == known)
            assert not stopping.succeeded
            robots[0].stops = robots[1].stops
        assert stopping.succeeded

    @pytest.mark.usefixtures("impatient")
    def test_an_endpoint_is_a_failure_until_it_is_reached(
        self, endpoint: str, session: zenoh.Session
    ) -> None:
        robot, nobody = ScriptedRobot(session, token="@servant/nao/Safety/x"), free_endpoint()
        with ExitStack() as late, running(endpoint, nobody, every_realm=True) as stopping:
            until(lambda: robot.sent and stopping.realms["nao"].still)
            unreached = [route.name for route in stopping.unreached]
            assert (unreached, stopping.succeeded) == ([nobody], False)
            late.enter_context(listening(nobody))
        assert stopping.succeeded


@at_once
def test_settings_that_allow_no_link_end_it_at_once(endpoint: str, session: zenoh.Session) -> None:
    stopping = Stopping(Settings(listen=(endpoint,), connect=()), "a hand", limit=FOREVER)
    with pytest.raises(EndpointInUseException, match=endpoint):
        stopping.run(print)


def test_no_thread_is_left(endpoint: str, robot: ScriptedRobot) -> None:
    stopped(endpoint)
    assert not [each for each in threading.enumerate() if each.name.startswith("stop by")]


def test_where_the_system_has_one_more_thread_that_is_enough(
    endpoint: str, robot: ScriptedRobot, monkeypatch: pytest.MonkeyPatch
) -> None:
    started: list[threading.Thread] = []
    start = threading.Thread.start

    def scarce(thread: threading.Thread) -> None:
        if thread.name.startswith("stop by"):
            started.append(thread)
            if len(started) > 1:
                raise RuntimeError("can't start new thread")
        start(thread)

    monkeypatch.setattr(threading.Thread, "start", scarce)
    stopping, _ = stopped(endpoint)
    assert (stopping.succeeded, len(started)) == (True, 6)


def test_what_is_no_answer_leaves_a_realm_as_it_is() -> None:
    realm = Realm("nao")
    realm.note([])
    assert (realm.confirmed, realm.trouble) == (False, "")
    realm.note([(True, b"\x80"), error("half of it moves")])
    assert (realm.confirmed, "half of it moves" in realm.trouble) == (False, True)
    realm.note([(True, b"\x80")])
    assert realm.confirmed
