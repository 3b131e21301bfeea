"""Permissions over real TLS links: certificates, passwords, roles, and the errors of refusals."""

from __future__ import annotations

import re
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, closing, nullcontext, suppress
from datetime import UTC, datetime, timedelta
from pathlib import Path
from queue import SimpleQueue

import pytest

from interfaces.nao import HeadLimits, HeadPose, PoseHead, PoseHeadPrx
from nao_tools._doctor.network import check_network
from tests.support.limits import EVENT_LIMIT, FOREVER, START_LIMIT
from tests.support.processes import free_endpoint
from tests.support.security import Keys, routing
from tests.support.stranger import session_of
from tests.support.waiting import listened, until
from zenoh_ice import Communicator, Current, ObjectAdapter, initialize
from zenoh_ice.data.exceptions import (
    AccessDeniedException,
    ConfigurationException,
    ConnectFailedException,
    ConnectionLostException,
    EndpointInUseException,
    ObjectNotExistException,
    SystemException,
    TimeoutException,
)
from zenoh_ice.data.keys import client_token
from zenoh_ice.settings import Settings, load_settings
from zenoh_ice.threads.limits import Limits


def pose(pan: float, tilt: float = 0.0) -> HeadPose:
    return HeadPose(time=0.0, pan=pan, tilt=tilt, panSpeed=0.0, tiltSpeed=0.0)


class HeadI(PoseHead):
    def __init__(self) -> None:
        self.moved: list[tuple[float, float]] = []
        self.stopped: SimpleQueue[str] = SimpleQueue()

    def setPose(self, pan: float, tilt: float, fraction: float, current: Current) -> HeadPose:
        self.moved.append((pan, tilt))
        return pose(pan, tilt)

    def getPose(self, current: Current) -> HeadPose:
        return pose(0.25)

    def setSpeed(self, pan: float, tilt: float, current: Current) -> HeadPose:
        raise NotImplementedError

    def stop(self, current: Current) -> None:
        self.stopped.put(current.client)

    def getLimits(self, current: Current) -> HeadLimits:
        raise NotImplementedError


@pytest.fixture(scope="module")
def keys(tmp_path_factory: pytest.TempPathFactory) -> Keys:
    """The keys of the router that many tests share."""
    return Keys(tmp_path_factory.mktemp("keys"))


@pytest.fixture(scope="module")
def own_keys(tmp_path_factory: pytest.TempPathFactory) -> Keys:
    """The keys of tests that start a router or a server with access control themselves."""
    return Keys(tmp_path_factory.mktemp("own_keys"))


Open = Callable[..., Communicator]


@pytest.fixture
def open_with() -> Iterator[Open]:
    with ExitStack() as opened:
        yield lambda settings, **limits: opened.enter_context(initialize(settings, **limits))


@pytest.fixture(scope="module")
def watcher(keys: Keys) -> Iterator[Communicator]:
    """A session that sees who is linked to the router."""
    with routing(keys.settings("router")), initialize(keys.settings("student")) as communicator:
        yield communicator


@pytest.fixture
def router(watcher: Communicator) -> None:
    """A router to which no servant of another test is linked."""
    until(lambda: not watcher.identities())


@pytest.fixture
def head(keys: Keys, router: None, open_with: Open) -> HeadI:
    """The head of the robot, which it serves through the router."""
    servant = HeadI()
    serve(open_with(keys.settings("robot")), servant, "Head")
    return servant


def plain(**changes: object) -> Settings:
    """Return settings without a file."""
    return Settings(clock="wall", connect=()).override(**changes)


def serve(communicator: Communicator, servant: PoseHead, identity: str) -> ObjectAdapter:
    adapter = communicator.createObjectAdapter("Test")
    adapter.add(servant, identity)
    adapter.activate()
    return adapter


def proxy(communicator: Communicator, identity: str = "Head") -> PoseHeadPrx:
    return PoseHeadPrx.checkedCast(communicator.stringToProxy(identity))


def test_a_student_reads_and_does_not_move(keys: Keys, head: HeadI, open_with: Open) -> None:
    student = proxy(open_with(keys.settings("student")))
    assert student.getPose().pan == 0.25
    with pytest.raises(AccessDeniedException, match="setPose"):
        student.setPose(1.0, 0.0, 0.5)
    assert head.moved == []
    operator = proxy(open_with(keys.settings("operator")))
    operator.setPose(0.5, 0.1, 0.5)
    assert head.moved == [(0.5, 0.1)]


def test_an_agent_reads_and_is_watched_and_moves_what_a_person_adds_alone(
    own_keys: Keys, open_with: Open
) -> None:
    file = own_keys.folder / "router.toml"
    given = load_settings(file, environment={}).security.roles["agent"]
    for more in ((), ("Head.setPose",)):
        roles = {
            "robot": {"serve": ["**"]},
            "operator": {"call": ["**"]},
            "agent": {"call": [*given.call, *more], "serve": [*given.serve]},
        }
        users = {name: name for name in roles}
        with routing(own_keys.settings("router", security={"roles": roles, "users": users})):
            servant = HeadI()
            robot, operator, agent = (
                open_with(own_keys.settings(who)) for who in ("robot", "operator", "agent")
            )
            serve(robot, servant, "Head")
            assert proxy(agent).getPose().pan == 0.25
            with nullcontext() if more else pytest.raises(AccessDeniedException, match="setPose"):
                proxy(agent).setPose(0.5, 0.1, 0.5)
            with pytest.raises(AccessDeniedException, match="stop"):
                proxy(agent).stop()
            assert servant.moved == ([(0.5, 0.1)] if more else [])
            serve(agent, HeadI(), "Hfsm.look")
            serve(agent, HeadI(), "Spare")
            assert proxy(operator, "Hfsm.look").getPose().pan == 0.25
            assert "Spare" not in operator.identities()
            for each in (agent, operator, robot):
                each.destroy()


def test_a_user_who_declares_and_ends_tokens_of_another_does_not_end_that_one(
    own_keys: Keys, open_with: Open
) -> None:
    roles = {
        "robot": {"serve": ["**"]},
        "operator": {"call": ["**"]},
        "student": {"call": ["*.get*"]},
        "gateway": {},
        "agent": {},
    }
    with routing(own_keys.settings("router", security={"roles": roles})):
        robot, operator, student = (
            open_with(own_keys.settings(who)) for who in ("robot", "operator", "student")
        )
        serve(robot, HeadI(), "Head")
        lost: SimpleQueue[str] = SimpleQueue()
        with closing(robot.onClientLost(lost.put)):
            proxy(operator).setPose(0.0, 0.0, 0.5)
            proxy(student).getPose()
            forged = client_token("nao", operator.client_id)
            for _ in range(5):
                session_of(student).liveliness().declare_token(forged).undeclare()
            student.destroy()
            assert lost.get(timeout=EVENT_LIMIT) == student.client_id
            proxy(operator).setPose(0.0, 0.0, 0.5)
            operator.destroy()
            assert lost.get(timeout=EVENT_LIMIT) == operator.client_id


def test_a_student_reads_streams(keys: Keys, head: HeadI, open_with: Open) -> None:
    student = proxy(open_with(keys.settings("student")))
    assert student.getPose.latest() is None  # from now on it listens
    assert listened(head.getPosePublisher, EVENT_LIMIT)
    head.getPosePublisher.publish(pose(0.5), time=1.0)
    assert student.getPose.wait(timeout=EVENT_LIMIT).value.pan == 0.5


def test_the_robot_learns_of_an_operator_who_is_gone_and_of_no_tokens_of_a_student(
    keys: Keys, router: None, open_with: Open
) -> None:
    patient = Limits(
        token_checks=int(FOREVER / Limits.check_period)
    )  # a caller without a token counts as lost later
    robot = open_with(keys.settings("robot"), limits=patient)
    student, operator = (open_with(keys.settings(who)) for who in ("student", "operator"))
    serve(robot, HeadI(), "Head")
    lost: list[str] = []  # also of the test before, which may be noticed late
    with closing(robot.onClientLost(lost.append)):
        proxy(operator).setPose(0.0, 0.0, 0.5)
        proxy(student).getPose()
        session_of(student).liveliness().declare_token(client_token("nao", operator.client_id)).undeclare()
        student.destroy()
        operator.destroy()
        until(lambda: operator.client_id in lost)
        assert lost.count(operator.client_id) == 1
        assert student.client_id not in lost


def read_patiently(head: PoseHeadPrx) -> None:
    """Wait for a sample until there is a reason why none comes: the servant's answer may take a while."""
    deadline = time.monotonic() + EVENT_LIMIT
    while time.monotonic() < deadline:
        with suppress(TimeoutException):
            head.getPose.wait(timeout=0.2)


def test_a_stream_that_may_not_be_read_says_so(own_keys: Keys, open_with: Open) -> None:
    roles = {"robot": {"serve": ["**"]}, "student": {"call": ["Head.stop"]}}
    users = {"robot": "robot", "student": "student"}
    with routing(own_keys.settings("router", security={"roles": roles, "users": users})):
        serve(open_with(own_keys.settings("robot")), HeadI(), "Head")
        student = proxy(open_with(own_keys.settings("student")))
        with pytest.raises(AccessDeniedException, match="getPose"):
            read_patiently(student)


def test_a_stream_that_is_silent_is_no_refusal(keys: Keys, head: HeadI, open_with: Open) -> None:
    student = proxy(open_with(keys.settings("student")))
    with pytest.raises(TimeoutException):
        student.getPose.wait(timeout=0.2)


def test_everybody_with_a_certificate_can_have_a_role(
    own_keys: Keys, open_with: Open, tmp_path: Path
) -> None:
    users = {"robot": "robot", "*": "student"}
    with routing(own_keys.settings("router", security={"users": users})):
        serve(open_with(own_keys.settings("robot")), HeadI(), "Head")
        somebody = proxy(open_with(own_keys.settings("operator")))
        assert somebody.getPose().pan == 0.25
        with pytest.raises(AccessDeniedException):
            somebody.setPose(1.0, 0.0, 0.5)
        none = {"certificate": "", "key": ""}
        assert "it asks for a certificate" in refusal(own_keys.settings("student", security=none))


def test_nobody_but_the_robot_serves_it(keys: Keys, router: None, open_with: Open) -> None:
    impostor, elsewhere = HeadI(), open_with(keys.settings("student"))
    serve(elsewhere, impostor, "Head")
    serve(elsewhere, impostor, "Spare")
    head = HeadI()
    serve(open_with(keys.settings("robot")), head, "Head")
    operator = open_with(keys.settings("operator"))
    for _ in range(5):
        proxy(operator).setPose(0.0, 0.0, 0.5)
    assert (len(head.moved), impostor.moved) == (5, [])
    assert operator.identities() == ["Head"]


def test_a_sample_that_the_robot_did_not_publish_reaches_nobody(
    keys: Keys, head: HeadI, open_with: Open
) -> None:
    student, forger = proxy(open_with(keys.settings("student"))), open_with(keys.settings("student"))
    student.getPose.latest()
    assert listened(head.getPosePublisher, EVENT_LIMIT)
    session_of(forger).put("nao/Head/getPose", b"forged")
    # What is sent after it on the same way and is answered has overtaken nothing.
    assert proxy(forger).getPose().pan == 0.25
    head.getPosePublisher.publish(pose(0.5), time=1.0)
    sample = student.getPose.wait(timeout=EVENT_LIMIT)
    assert (sample.value.pan, sample.sequence) == (0.5, 1)


def refusal(settings: Settings) -> str:
    """Return why a client is refused."""
    with pytest.raises(ConnectFailedException) as caught, initialize(settings.override(timeout=0.1)):
        pass
    return str(caught.value)


@pytest.mark.usefixtures("watcher")
class TestRefusal:
    def test_a_certificate_of_another_authority(self, keys: Keys, tmp_path: Path) -> None:
        stranger = Keys(tmp_path / "other").settings("student").security
        own = {"certificate": stranger.certificate, "key": stranger.key}
        assert "does not trust the authority of our certificate" in refusal(
            keys.settings("student", security=own)
        )

    def test_a_router_of_another_authority(self, keys: Keys, tmp_path: Path) -> None:
        other = Keys(tmp_path / "other").settings("student", connect=[keys.endpoint])
        assert "its certificate is not accepted" in refusal(other)

    def test_no_certificate(self, keys: Keys) -> None:
        none = {"certificate": "", "key": ""}
        assert "it asks for a certificate" in refusal(keys.settings("student", security=none))

    def test_a_certificate_that_has_expired(self, keys: Keys) -> None:
        late = keys.issue("late", valid=timedelta(minutes=-5))
        assert "our certificate has expired" in refusal(late)

    @pytest.mark.parametrize(
        ("days", "remedy"), [(-30, "set the clock or renew the certificate"), (30, "set the clock")]
    )
    def test_a_clock_outside_of_the_time_of_a_certificate(
        self, tmp_path: Path, open_with: Open, monkeypatch: pytest.MonkeyPatch, days: int, remedy: str
    ) -> None:
        """As on a machine whose clock is wrong by that many days."""
        keys = Keys(tmp_path)
        begin = datetime.now(UTC) + timedelta(days=days)
        monkeypatch.setattr("nao_tools._security.folder._CLOCKS_APART", -timedelta(days=days))
        keys.security.renew("router", valid=timedelta(days=days + 1))
        open_with(keys.settings("router"))
        said = refusal(keys.settings("student"))
        assert re.search(
            rf"your clock says {datetime.now(UTC):%Y-%m-%d} \S+ UTC, its certificate is", said
        ), said
        assert f"is valid from {begin:%Y-%m-%d}" in said
        assert f" to {begin + timedelta(days=1):%Y-%m-%d}" in said
        assert said.endswith(f": {remedy}")
        assert "security.authority" not in said
        failed = [
            each for each in check_network(keys.settings("student", timeout=0.1)) if each.level == "FAIL"
        ]
        assert [(each.text, each.fix[:27]) for each in failed] == [
            (f"no link: {said}", "sudo timedatectl set-ntp tr")
        ]

    def test_another_name_of_the_router(self, keys: Keys) -> None:
        elsewhere = keys.other_endpoint
        assert "its certificate is not accepted: IP address mismatch" in refusal(
            keys.settings("student", connect=[elsewhere])
        )

    def test_nobody_listens(self, keys: Keys) -> None:
        absent = free_endpoint().replace("tcp", "tls")
        assert f"nothing answers at {absent}" in refusal(keys.settings("student", connect=[absent]))

    def test_no_tls(self, keys: Keys) -> None:
        plain = keys.endpoint.replace("tls", "tcp")
        assert "it listens, but makes no link" in refusal(keys.settings("student", connect=[plain]))


def login(connect: dict[str, object], **security: str) -> Settings:
    return plain(**connect).override(security=security)


class TestPasswords:
    """A server that checks the passwords of users, and grants what their roles allow."""

    @pytest.fixture(params=["tcp", "tls"])
    def connect(
        self, request: pytest.FixtureRequest, keys: Keys, tmp_path: Path, open_with: Open
    ) -> dict[str, object]:
        passwords = tmp_path / "passwords.txt"
        passwords.touch(0o600)
        passwords.write_text("ann:secret\nbob:other\n")
        endpoint = free_endpoint().replace("tcp", request.param)
        security = {
            "mutual": False,
            "passwords": passwords,
            "roles": {"reader": {"call": ["Head.get*"]}, "mover": {"call": ["Head.*"]}},
            "users": {"ann": "reader", "bob": "mover"},
        }
        known = keys.settings("router").security
        authority = {"authority": known.authority}
        pair = {"certificate": known.certificate, "key": known.key}
        own = authority | pair if request.param == "tls" else {}
        server = open_with(plain(listen=[endpoint], security={**own, **security}))
        serve(server, HeadI(), "Head")
        return {"mode": "client", "connect": [endpoint], "security": authority}

    def test_roles_are_those_of_the_users(self, connect: dict[str, object], open_with: Open) -> None:
        ann = open_with(login(connect, user="ann", password="secret"))
        with pytest.raises(AccessDeniedException):
            proxy(ann).setPose(1.0, 0.0, 0.5)
        assert proxy(ann).getPose().pan == 0.25
        bob = open_with(login(connect, user="bob", password="other"))
        assert proxy(bob).setPose(1.0, 0.0, 0.5).pan == 1.0

    @pytest.mark.parametrize(
        ("given", "why"),
        [
            ({"user": "ann", "password": "other"}, "does not accept 'ann'"),
            ({"user": "eve", "password": "secret"}, "does not accept 'eve'"),
            ({}, "it listens, but makes no link with us"),
        ],
    )
    def test_refusal(self, connect: dict[str, object], given: dict[str, str], why: str) -> None:
        assert why in refusal(login(connect, **given))


def test_a_server_without_a_router_grants_access_itself(own_keys: Keys, open_with: Open) -> None:
    router = own_keys.settings("router")
    servant = HeadI()
    serve(open_with(router.override(mode="peer")), servant, "Head")
    student = proxy(open_with(own_keys.settings("student")))
    assert student.getPose().pan == 0.25
    with pytest.raises(AccessDeniedException):
        student.setPose(1.0, 0.0, 0.5)
    assert proxy(open_with(own_keys.settings("operator"))).setPose(1.0, 0.0, 0.5).pan == 1.0


def test_a_server_behind_the_router_that_ended_is_lost_and_a_servant_that_was_removed_is_absent(
    keys: Keys, router: None, open_with: Open
) -> None:
    robot = open_with(keys.settings("robot"))
    serve(robot, HeadI(), "Head")
    adapter = serve(robot, HeadI(), "Spare")
    operator = open_with(keys.settings("operator"))
    head, spare = proxy(operator), proxy(operator, "Spare")
    adapter.removeAll(["Spare"])
    with pytest.raises(ObjectNotExistException):
        spare.getPose()
    robot.destroy()
    with pytest.raises(ConnectionLostException, match="the server of Head@nao is offline"):
        head.getPose()


def test_calls_go_on_after_the_router_was_started_again(own_keys: Keys, open_with: Open) -> None:
    with routing(own_keys.settings("router")):
        serve(open_with(own_keys.settings("robot")), HeadI(), "Head")
        student = proxy(open_with(own_keys.settings("student")))
        assert student.getPose().pan == 0.25
    with pytest.raises((ConnectionLostException, TimeoutException)):
        student.ice_invocationTimeout(300).getPose()
    with routing(own_keys.settings("router")):
        deadline = time.monotonic() + START_LIMIT
        while True:
            try:
                assert student.ice_invocationTimeout(300).getPose().pan == 0.25
                break
            except SystemException:
                assert time.monotonic() < deadline


def test_a_unix_socket(tmp_path: Path, open_with: Open) -> None:
    endpoint = f"unixsock-stream/{tmp_path / 'robot.sock'}"
    settings = plain(connect=[endpoint])
    serve(open_with(settings.override(listen=[endpoint])), HeadI(), "Head")
    for mode in ("peer", "client"):
        assert proxy(open_with(settings.override(mode=mode))).getPose().pan == 0.25
    with pytest.raises(EndpointInUseException, match=r"robot\.sock, as a server does .* only you may write"):
        initialize(settings.override(listen=[endpoint]))


def test_somebodys_lock_beside_a_unix_socket_is_said_to_be_in_the_way(tmp_path: Path) -> None:
    taken = tmp_path / "robot.sock"
    taken.with_name("robot.sock.lock").mkdir()
    with pytest.raises(ConfigurationException, match=r"robot\.sock .* remove the file \.lock beside it"):
        initialize(plain(listen=[f"unixsock-stream/{taken}"]))
