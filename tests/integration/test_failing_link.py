"""A served robot whose server hangs or restarts, or the link to which fails: over Zenoh, in wall time."""

from __future__ import annotations

import socket
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from interfaces.jderobot import MotorsPrx
from interfaces.nao import FaultsPrx, PoseHeadPrx, SafetyPrx
from naoserver.fake import FakeRobot
from naoserver.serving.server import problem_of
from tests.support.limits import EVENT_LIMIT, START_LIMIT
from tests.support.nao_command import at, nao
from tests.support.processes import ComponentProcess, free_endpoint, module
from tests.support.robot_server import RobotClient, served_to_client
from tests.support.waiting import until
from zenoh_ice import SystemException, TimeoutException, initialize

LIMIT = 1.0
"""s of the calls of these clients."""
SLACK = 1.0
"""s that a busy machine may add."""


@pytest.fixture(scope="module", params=["sockets", "zenoh"])
def client_(request) -> Iterator[RobotClient]:
    """A client of this machine through local sockets, or one as if of another machine."""
    near = request.param == "sockets"
    with served_to_client(FakeRobot(), timeout=LIMIT, local_sockets=near) as client:
        yield client


@pytest.fixture
def client(client_: RobotClient) -> Iterator[RobotClient]:
    yield client_
    faults_of(client_).heal()  # by the robot's own door
    until(lambda: answers(client_), EVENT_LIMIT)


def faults_of(client: RobotClient):
    faults = client.robot.faults
    assert faults is not None
    return faults


def answers(client: RobotClient) -> bool:
    try:
        client.proxy(PoseHeadPrx, "Head").getPose()
    except SystemException:
        return False
    return True


def timed(call: Callable[[], object]) -> float:
    began = time.monotonic()
    call()
    return time.monotonic() - began


def given_up(call: Callable[[], object]) -> float:
    """Return after how many s a call gave up."""

    def give_up() -> None:
        with pytest.raises(TimeoutException):
            call()

    return timed(give_up)


def test_over_a_late_link_a_call_takes_longer_and_a_sample_says_how_old_it_is(client: RobotClient) -> None:
    head = client.proxy(PoseHeadPrx, "Head")
    head.getPose.latest()
    client.proxy(FaultsPrx, "Faults").inject("Link", "late", 0.2, None)
    assert 0.4 <= timed(head.getPose) < LIMIT
    until(
        lambda: (sample := head.getPose.latest()) is not None and 0.2 <= sample.age < 0.2 + SLACK, EVENT_LIMIT
    )


@pytest.mark.parametrize("kind", ["deaf", "mute", "lossy"])
def test_over_a_link_that_is_cut_a_call_ends_at_its_limit_and_works_once_it_is_healed(
    client: RobotClient, kind: str
) -> None:
    head, faults = client.proxy(PoseHeadPrx, "Head"), client.proxy(FaultsPrx, "Faults")
    faults.inject("Link", kind, 1.0 if kind == "lossy" else None, None)
    assert LIMIT - 0.1 <= given_up(head.getPose) < LIMIT + SLACK
    assert [fault.kind for fault in faults.getFaults().faults] == [kind]
    faults.heal("Link")
    until(lambda: answers(client), EVENT_LIMIT)


def test_from_a_mute_robot_no_samples_come_until_it_is_healed(client: RobotClient) -> None:
    head, faults = client.proxy(PoseHeadPrx, "Head"), client.proxy(FaultsPrx, "Faults")
    head.getPose.wait(timeout=EVENT_LIMIT)
    faults.inject("Link", "mute", None, None)
    until(lambda: (sample := head.getPose.latest()) is not None and sample.age > 0.5, EVENT_LIMIT)
    faults.heal("Link")
    until(lambda: (sample := head.getPose.latest()) is not None and sample.age < 0.2, EVENT_LIMIT)


def test_a_lossy_link_leaves_gaps_in_streams(client: RobotClient) -> None:
    client.proxy(FaultsPrx, "Faults").inject("Link", "lossy", 0.5, None)
    lost: list[int] = []
    with client.proxy(PoseHeadPrx, "Head").getPose.subscribe(lambda sample: lost.append(sample.lost)):
        until(lambda: sum(lost) > 5, EVENT_LIMIT)


@pytest.mark.parametrize(("part", "kind"), [("Link", "deaf"), ("Server", "hung")])
def test_a_walking_robot_stands_once_its_client_cannot_renew_that(
    client: RobotClient, part: str, kind: str
) -> None:
    walk = client.proxy(MotorsPrx, "Motors")
    walk.setV(0.1)
    walker = client.robot.walker
    assert walker is not None
    assert walker.walking
    client.proxy(FaultsPrx, "Faults").inject(part, kind, None, 2.0)
    given_up(lambda: walk.setV(0.1))
    until(lambda: not walker.walking, EVENT_LIMIT)
    until(lambda: answers(client), EVENT_LIMIT)
    walk.setV(0.1)
    assert walker.walking
    walk.setV(0.0)


def test_a_server_that_hung_executes_no_command_that_was_given_up(client: RobotClient) -> None:
    head, faults = client.proxy(PoseHeadPrx, "Head"), client.proxy(FaultsPrx, "Faults")
    faults.inject("Server", "hung", None, 4 * LIMIT)
    assert LIMIT - 0.1 <= given_up(lambda: head.setPose(0.5, 0.0, 1.0)) < LIMIT + SLACK
    with pytest.raises(TimeoutException):
        faults.heal(None)
    until(lambda: answers(client), EVENT_LIMIT)
    assert abs(head.getPose().pan) < 0.01


def test_a_server_that_hangs_does_not_work_and_one_with_a_failing_link_does(client: RobotClient) -> None:
    faults, (server, assembly) = faults_of(client), (client.served_by, client.assembly)
    faults.inject("Link", "deaf")
    assert not problem_of(server, assembly)
    faults.heal()
    faults.inject("Server", "hung", seconds=assembly.options.limits.answer + 2.0)
    assert "was not answered within" in problem_of(server, assembly)


def test_the_emergency_stop_over_a_cut_link_is_lost_too(client: RobotClient) -> None:
    safety = client.proxy(SafetyPrx, "Safety")
    faults_of(client).inject("Link", "deaf")
    assert LIMIT - 0.1 <= given_up(lambda: safety.emergencyStop("in the way")) < LIMIT + SLACK
    assert not client.assembly.gate.is_stopped


def test_a_server_in_the_process_of_a_test_cannot_be_restarted(client: RobotClient) -> None:
    with at(client.endpoint, client.realm):
        refused = nao("faults", "Server", "restarted")
    assert refused.code == 1
    assert "its process is not its own" in " ".join(refused.err.replace("│", " ").split())


# -- processes ------------------------------------------------------------------------------------------------------


@contextmanager
def running(*command: str, **environment: str) -> Iterator[tuple[ComponentProcess, str]]:
    """Run a server until the end; yield its process and its endpoint."""
    endpoint = free_endpoint()
    with ComponentProcess(module(*command, "--listen", endpoint), environment) as process:
        process.wait_for("^ready")
        yield process, endpoint


@pytest.fixture(
    scope="module",
    params=[
        ("naoserver.fake", "--body", "Cart"),
        pytest.param(("naoserver_sim", "--body", "Cart", "--no-skin"), marks=pytest.mark.sim),
    ],
    ids=["fake", "sim"],
)
def server(request) -> Iterator[tuple[ComponentProcess, str]]:
    with running(*request.param) as server:
        yield server


def test_a_restarted_server_is_the_same_command_and_its_client_goes_on(
    server: tuple[ComponentProcess, str],
) -> None:
    process, endpoint = server
    with initialize(connect=[endpoint], listen=["tcp/127.0.0.1:0"], timeout=LIMIT) as communicator:
        wheels = MotorsPrx.checkedCast(communicator.stringToProxy("Motors"))
        wheels.setV(0.2)
        with at(endpoint, "nao"):
            assert nao("faults", "Server", "restarted").out == "Server fails: restarted\n"
        until(lambda: process.output.count("ready: ") == 2, START_LIMIT)
        until(lambda: goes_on(wheels), START_LIMIT)
    assert process.process.poll() is None


def test_a_client_of_a_server_that_hung_goes_on(server: tuple[ComponentProcess, str]) -> None:
    _, endpoint = server
    with at(endpoint, "nao"):
        assert nao("faults", "Server", "hung", "--seconds", "6").out.startswith("Server fails: hung, for 6.")
    with initialize(connect=[endpoint], listen=["tcp/127.0.0.1:0"], timeout=LIMIT) as communicator:
        wheels = MotorsPrx.uncheckedCast(communicator.stringToProxy("Motors"))
        assert LIMIT - 0.1 <= given_up(lambda: wheels.setV(0.2)) < LIMIT + SLACK
        until(lambda: goes_on(wheels), START_LIMIT)


def goes_on(wheels: MotorsPrx) -> bool:
    try:
        wheels.setV(0.0)
    except SystemException:
        return False
    return True


def test_a_restarted_server_is_still_one_of_systemd(tmp_path: Path) -> None:
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as systemd:
        systemd.bind(str(tmp_path / "notify"))
        systemd.settimeout(START_LIMIT)
        with (
            running("naoserver.fake", NOTIFY_SOCKET=systemd.getsockname()) as (_, endpoint),
            at(endpoint, "nao"),
        ):
            assert systemd.recv(64) == b"READY=1"
            nao("faults", "Server", "restarted")
            assert systemd.recv(64) == b"READY=1"
