"""The emergency stop as one message that every release understands; a command and the editor repeat it."""

from __future__ import annotations

import asyncio
import json
import re
from collections.abc import Callable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import ExitStack, contextmanager
from dataclasses import replace
from pathlib import Path

import pytest

from codegen.messages import Message
from interfaces.nao import SafetyPrx
from nao_tools._stopping import StopLimits
from naoserver.fake import FakeRobot
from tests.support.attachments import encode_call_attachment
from tests.support.carriers import NETWORK
from tests.support.coasting import Coasting
from tests.support.limits import CALL_LIMIT, EVENT_LIMIT, FOREVER, RUN_LIMIT
from tests.support.nao_command import Outcome, at, nao
from tests.support.processes import free_endpoint
from tests.support.relay import Relay
from tests.support.robot_server import RobotClient, served, served_to_client
from tests.support.scripted_robot import STOPPED, ScriptedRobot, error, joints, listening, state
from tests.support.security import Keys, routing
from tests.support.stranger import stranger
from tests.support.waiting import until
from visualhfsm._monitor import stopping as editor_stop
from visualhfsm._monitor.messages import PartLimits
from visualhfsm._monitor.stopping import StopReport
from zenoh_ice import Communicator, initialize
from zenoh_ice.application.emergency_stop import SAFETY, begin_stop
from zenoh_ice.carriers.zenoh.session import open_session

RECORDED = json.loads(Path("tests/data/emergency_stop/messages.json").read_text())
MESSAGE = RECORDED["message"]
RELEASES = RECORDED["releases"]
REASON = "a hand in the way"
HASTY = StopLimits(state=0.3, standstill=0.2)
"""For robots that say nothing of their joints, or never come to rest: what others do ends before."""
LOST = StopLimits(state=CALL_LIMIT, standstill=1.0)
"""For robots that are lost for good."""


@pytest.fixture
def endpoint() -> str:
    return free_endpoint()


@pytest.fixture
def scripted(endpoint: str) -> Iterator[ScriptedRobot]:
    with listening(endpoint) as session:
        yield ScriptedRobot(session)


@pytest.fixture
def robot(by_environment: None) -> Iterator[RobotClient]:
    with served_to_client(FakeRobot()) as client:
        yield client


def stop(endpoint: str, *options: str, limits: StopLimits | None = None) -> Outcome:
    return nao("stop", REASON, "--connect", endpoint, "--mode", "client", *options, limits=limits)


def failing(endpoint: str, *options: str, limits: StopLimits) -> Outcome:
    """Return the outcome of a stop that fails once it has heard of the robot's state.

    On a busy machine nothing may be heard in so short a time: then it has longer.
    """
    outcome = stop(endpoint, *options, limits=limits)
    return outcome if outcome.code else stop(endpoint, *options, limits=replace(limits, standstill=10.0))


def giving_up(attempt: Callable[..., Outcome], *words: str, until_it_says: str) -> Outcome:
    """Return the outcome of a stop that gives up soon, the first that has had the time to hear something.

    Each has twice as long as the one before, on a busy machine.
    """
    outcomes = list[Outcome]()

    def said() -> bool:
        outcomes.append(attempt(*words, "--seconds", str(0.2 * 2 ** len(outcomes))))
        return until_it_says in outcomes[-1].text

    until(said, RUN_LIMIT)
    return outcomes[-1]


@contextmanager
def stopping(endpoint: str) -> Iterator[Future[Outcome]]:
    """Run the command in the background."""
    with ThreadPoolExecutor(1) as pool:
        yield pool.submit(stop, endpoint, "--seconds", str(FOREVER))


class TestMessage:
    @pytest.mark.parametrize("release", RELEASES)
    def test_the_command_sends_the_recorded_message_and_understands_the_recorded_answers(
        self, endpoint: str, scripted: ScriptedRobot, release: str
    ) -> None:
        answers = RELEASES[release]
        scripted.stops = [(True, bytes.fromhex(answers["stop"]["payload"]))]
        scripted.joints = [(True, bytes.fromhex(answers["joints"]["payload"]))]
        outcome = stop(endpoint)
        assert outcome.code == 0
        assert outcome.out.startswith("stopped: the robot refuses commands until")
        assert "its joints are still" in outcome.out
        assert set(scripted.sent) == {(MESSAGE["key"], MESSAGE["payload"], MESSAGE["attachment"])}

    def test_a_communicator_sends_the_same_message_and_needs_no_token(
        self, endpoint: str, scripted: ScriptedRobot
    ) -> None:
        with initialize(connect=[endpoint], mode="client", clock="wall") as communicator:
            begin_stop(communicator, REASON, CALL_LIMIT).result()
        assert scripted.sent == [(MESSAGE["key"], MESSAGE["payload"], MESSAGE["attachment"])]

    @pytest.mark.parametrize("release", RELEASES)
    def test_an_error_of_each_release_is_not_taken_for_a_stop(
        self, endpoint: str, scripted: ScriptedRobot, release: str
    ) -> None:
        refused = RELEASES[release]["without a reason"]
        scripted.stops = [(refused["ok"], bytes.fromhex(refused["payload"]))]
        refusal = "the robot was NOT stopped: Safety.emergencyStop: Object missing required"
        outcome = giving_up(stop, endpoint, until_it_says=refusal)
        assert (outcome.code, outcome.out) == (1, "")

    @pytest.mark.parametrize(
        "attachment",
        [
            pytest.param(None, id="none"),
            pytest.param(encode_call_attachment("0123456789abcdef", 1, "c0ffee", 0.0), id="other version"),
            pytest.param(encode_call_attachment("", 1, "c0ffee", 0.001), id="late"),
            pytest.param(b"\xc1", id="unreadable"),
            pytest.param(b"x" * 4096, id="too long"),
        ],
    )
    def test_this_release_stops_whatever_is_said_of_the_message(
        self, robot: RobotClient, attachment: bytes | None
    ) -> None:
        with stranger(robot.endpoint) as sender:
            key = MESSAGE["key"].replace("nao/", f"{robot.realm}/", 1)
            until(lambda: sender.ask(f"{robot.realm}/Safety/getSafetyState", STOPPED, None))
            (reply,) = sender.ask(key, bytes.fromhex(MESSAGE["payload"]), attachment)
        assert reply.ok is not None
        assert reply.ok.payload.to_bytes() == STOPPED
        state = robot.proxy(SafetyPrx, "Safety").getSafetyState()
        assert (state.stopped, state.reason) == (True, REASON)


class TestRepetition:
    def test_a_robot_that_cannot_stop_is_reported_in_its_words(
        self, endpoint: str, scripted: ScriptedRobot
    ) -> None:
        scripted.stops = [error("the left arm does not answer")]
        refusal = "the robot was NOT stopped: the left arm does not answer; use the robot's own switch"
        assert giving_up(stop, endpoint, until_it_says=refusal).code == 1

    def test_joints_that_go_on_moving_are_reported(self, endpoint: str, scripted: ScriptedRobot) -> None:
        scripted.joints = [joints(0.0, -1.5)]
        outcome = failing(endpoint, limits=HASTY)
        assert (outcome.code, outcome.out) == (1, "")
        assert "stopped, but its joints still move, the fastest at 1.5 rad/s" in outcome.err

    def test_it_is_sent_when_the_network_is_back(self, robot: RobotClient) -> None:
        with Relay(robot.endpoint) as relay, at(relay.endpoint, robot.realm):
            relay.cut()
            with stopping(relay.endpoint) as outcome:
                relay.resume()
                assert outcome.result(RUN_LIMIT).code == 0
        assert robot.proxy(SafetyPrx, "Safety").getSafetyState().stopped

    def test_it_waits_for_a_robot_whose_server_starts(self, endpoint: str) -> None:
        with listening(endpoint) as session, stopping(endpoint) as outcome:
            scripted = ScriptedRobot(session)
            assert outcome.result(RUN_LIMIT).code == 0
            assert scripted.sent

    def test_settings_that_allow_no_link_end_it_at_once(self, endpoint: str, tmp_path: Path) -> None:
        outcome = stop(endpoint, "--authority", str(tmp_path / "none.pem"), "--seconds", str(FOREVER))
        assert (outcome.code, "none.pem" in outcome.err) == (1, True)


class TestJson:
    def test_a_program_learns_which_robots_have_stopped_and_are_still(
        self, endpoint: str, scripted: ScriptedRobot
    ) -> None:
        scripted.joints = [joints(0.0, 0.0)]
        outcome = stop(endpoint, "--json")
        nao_ = {"realm": "nao", "stopped": True, "still": True, "fastestJoint": 0.0, "trouble": ""}
        nao_ |= {"lost": "", "lostFor": 0.0}
        assert (outcome.code, json.loads(outcome.out)) == (0, {"robots": [nao_], "unreached": []})

    def test_a_robot_that_is_lost_is_not_still(self, endpoint: str, scripted: ScriptedRobot) -> None:
        scripted.states = [state("the cable is out", 12.5)]
        outcome = failing(endpoint, "--json", limits=LOST)
        (robot,) = json.loads(outcome.out)["robots"]
        assert (outcome.code, robot["stopped"], robot["still"]) == (1, True, False)
        assert (robot["lost"], robot["lostFor"]) == ("the cable is out", 12.5)

    def test_a_robot_that_cannot_stop_is_in_it_too(self, endpoint: str, scripted: ScriptedRobot) -> None:
        scripted.stops = [error("no motors")]
        outcome = giving_up(stop, endpoint, "--json", until_it_says="no motors")
        (robot,) = json.loads(outcome.out)["robots"]
        assert (outcome.code, robot["stopped"], robot["still"]) == (1, False, False)
        assert "no motors" in robot["trouble"]
        assert "NOT stopped" in outcome.err

    def test_joints_that_move_and_endpoints_that_are_not_reached_are_in_it(
        self, endpoint: str, scripted: ScriptedRobot
    ) -> None:
        scripted.joints = [joints(-1.5)]
        absent = free_endpoint()
        words = ("stop", "--all", "--json", "--connect", endpoint, "--connect", absent)
        found = giving_up(nao, *words, until_it_says='"fastestJoint": 1.5')
        result = json.loads(found.out)
        assert [(each["stopped"], each["still"], each["fastestJoint"]) for each in result["robots"]] == [
            (True, False, 1.5)
        ]
        assert [each["endpoint"] for each in result["unreached"]] == [absent]
        assert found.code == 1

    def test_a_reset_is_reported_and_a_person_at_a_terminal_gets_none(self, robot: RobotClient) -> None:
        with at(robot.endpoint, robot.realm):
            nao("stop", "--json")
            reset = nao("stop", "--reset", "--json")
        assert json.loads(reset.out) == {"robots": [{"realm": robot.realm, "stopped": False}]}
        assert "prints no JSON" in nao("stop", "--ready", "--json").err


class TestARobotThatItsServerHasLost:
    def test_it_is_stopped_but_nobody_knows_whether_it_moves(
        self, endpoint: str, scripted: ScriptedRobot
    ) -> None:
        scripted.states = [state("the cable is out", 12.5)]
        outcome = failing(endpoint, limits=LOST)
        assert outcome.code == 1
        assert re.search(
            r"stopped, but the robot is lost since \d\d:\d\d:\d\d \(12 s\): the cable is out: look at it",
            outcome.err,
        )
        assert "still" not in outcome.text
        outcome = failing(endpoint, "--all", limits=LOST)
        assert outcome.code == 1
        assert "nao: stopped, but the robot is lost since" in outcome.out

    def test_what_does_not_say_whether_it_is_lost_is_not_called_still(
        self, endpoint: str, scripted: ScriptedRobot
    ) -> None:
        scripted.states = []
        outcome = stop(endpoint, limits=HASTY)
        assert (outcome.code, outcome.out[:7], "still" in outcome.out) == (0, "stopped", False)

    @pytest.mark.parametrize("seconds", [float("nan"), float("inf"), -1.0, 1e300])
    def test_times_that_cannot_be_are_not_shown(
        self, endpoint: str, scripted: ScriptedRobot, seconds: float
    ) -> None:
        scripted.states = [state("the\x1b[31m cable", seconds)]
        outcome = failing(endpoint, limits=LOST)
        assert outcome.code == 1
        assert "the robot is lost: the [31m cable: look at it" in outcome.err

    @pytest.mark.parametrize(
        "words", [("stop",), ("status",), ("doctor",), ("list",)], ids=lambda words: words[0]
    )
    def test_every_command_says_it_until_it_is_found(
        self, robot: RobotClient, words: tuple[str, ...]
    ) -> None:
        gate = robot.assembly.gate
        with at(robot.endpoint, robot.realm):
            gate.lose("the cable is out")
            gate.lose("the cable is out, still")
            lost = nao(*words, limits=LOST) if words == ("stop",) else nao(*words)
            gate.find()
            found = nao(*words)
        assert re.search(r"lost since \d\d:\d\d:\d\d \(\d+ s\): the cable is out, still", lost.text)
        assert lost.code == (words[0] in ("stop", "doctor"))
        assert "lost" not in found.text
        assert found.code == 0 or words == ("doctor",)


class TestAllRobots:
    def test_every_realm_at_every_endpoint_is_stopped_and_listed(self, endpoint: str) -> None:
        with ExitStack() as opened:
            session = opened.enter_context(listening(endpoint))
            first, second = (
                ScriptedRobot(session, realm, RELEASES["0.1.0"]["token"].replace("/nao/", f"/{realm}/", 1))
                for realm in ("nao7", "red")
            )
            other = opened.enter_context(served(FakeRobot()))
            outcome = nao("stop", "--all", "--connect", endpoint, "--connect", other.endpoint)
            client = opened.enter_context(other.client())
            assert client.proxy(SafetyPrx, "Safety").getSafetyState().stopped
        assert outcome.code == 0, outcome.text
        lines = [line.partition(": the robot")[0] for line in outcome.out.splitlines()]
        assert lines == sorted(["nao7: stopped", "red: stopped", f"{other.realm}: stopped"])
        assert first.sent
        assert second.sent

    def test_behind_a_router_every_realm_of_the_role_is_stopped_and_no_other_is_seen(
        self, tmp_path: Path
    ) -> None:
        keys, roles = (
            Keys(tmp_path / "keys"),
            {
                "robot": {"serve": ["**"], "realms": ["nao*", "secret"]},
                "student": {"call": ["Safety.emergencyStop"], "realms": ["nao*"], "liveliness": False},
            },
        )
        users = {"robot": "robot", "student": "student"}
        with ExitStack() as opened:
            opened.enter_context(routing(keys.settings("router", security={"roles": roles, "users": users})))
            session = opened.enter_context(open_session(keys.settings("robot")))
            robots = {
                realm: ScriptedRobot(
                    session, realm, RELEASES["0.1.0"]["token"].replace("/nao/", f"/{realm}/", 1)
                )
                for realm in ("nao", "nao7", "secret")
            }
            outcome = nao(
                *("stop", "--all", "--config", str(keys.folder / "student.toml"), "--connect", keys.endpoint),
                limits=HASTY,  # the role of a student does not read joints
            )
        assert outcome.code == 0, outcome.text
        assert [line.partition(": the robot")[0] for line in outcome.out.splitlines()] == [
            "nao: stopped",
            "nao7: stopped",
        ]
        assert [realm for realm, robot in robots.items() if robot.sent] == ["nao", "nao7"]

    def test_one_that_does_not_stop_is_named(self, endpoint: str, scripted: ScriptedRobot) -> None:
        with stranger(endpoint) as also:
            token = RELEASES["0.1.0"]["token"].replace("/nao/", "/red/", 1)
            failing = ScriptedRobot(also.session, "red", token)
            failing.stops = [error("no motors")]
            words = ("stop", "--all", "--connect", endpoint)
            outcome = giving_up(nao, *words, until_it_says="red: NOT stopped: no motors")
        assert outcome.code == 1
        assert "nao: stopped" in outcome.out

    def test_an_endpoint_that_is_not_reached_is_named(self, robot: RobotClient) -> None:
        absent = free_endpoint()
        words = ("stop", "--all", "--connect", robot.endpoint, "--connect", absent)
        outcome = giving_up(nao, *words, until_it_says=f"{robot.realm}: stopped")
        assert outcome.code == 1
        assert f"{absent}: NOT reached" in outcome.out

    def test_without_any_robot_it_says_so(self, endpoint: str) -> None:
        with listening(endpoint):
            outcome = nao("stop", "--all", "--connect", endpoint, limits=StopLimits(realms=0.05))
        assert (outcome.code, "no robot was found" in outcome.err) == (1, True)


class TestEditor:
    PATIENT = PartLimits(stop_answer=CALL_LIMIT, standstill=EVENT_LIMIT)
    """A busy machine may answer late."""

    @pytest.fixture
    def announced(self, endpoint: str) -> Iterator[ScriptedRobot]:
        """A robot that others know."""
        with listening(endpoint) as session:
            yield ScriptedRobot(session, token=RELEASES["0.1.0"]["token"])

    @contextmanager
    def pressed(
        self,
        endpoint: str,
        realm: str,
        *present: str,
        before: Callable[[], object] = lambda: None,
        limits: PartLimits = PATIENT,
    ) -> Iterator[Future[StopReport]]:
        """Stop a robot in the background, once some servants are known and something has happened `before`."""

        async def press(communicator: Communicator) -> StopReport:
            return await editor_stop.stop_robot(communicator, asyncio.get_running_loop().time(), limits)

        with (
            initialize(
                realm=realm, connect=[endpoint], clock="wall", timeout=CALL_LIMIT, lease=CALL_LIMIT
            ) as communicator,
            ThreadPoolExecutor(1) as pool,
        ):
            until(lambda: {*present} <= {*communicator.identities()})
            until(lambda: communicator.presence.linked)
            before()
            yield pool.submit(lambda: asyncio.run(press(communicator)))

    def test_a_stop_that_fails_is_repeated_until_it_succeeds(
        self, endpoint: str, announced: ScriptedRobot
    ) -> None:
        announced.stops = [error("the left arm does not answer"), error("again"), (True, STOPPED)]
        with self.pressed(endpoint, "nao", SAFETY) as report:
            assert report.result(RUN_LIMIT) == StopReport([SAFETY], {})
        assert len(announced.sent) == 3

    def test_a_stop_that_goes_on_failing_is_reported(self, endpoint: str, announced: ScriptedRobot) -> None:
        limits = replace(self.PATIENT, stop_repetition=0.3)
        announced.stops = [error("the left arm does not answer")]
        with self.pressed(endpoint, "nao", SAFETY, limits=limits) as report:
            failed = Message("the left arm does not answer (STOP was repeated for 0.3 s)")
            assert report.result(RUN_LIMIT) == StopReport([], {SAFETY: failed})
        assert len(announced.sent) > 1

    def test_a_robot_that_is_not_known_yet_is_reported_when_it_has_stopped(
        self, endpoint: str, scripted: ScriptedRobot
    ) -> None:
        with self.pressed(endpoint, "nao") as report:
            assert report.result(RUN_LIMIT) == StopReport([SAFETY], {})
        assert len(scripted.sent) == 1

    def test_it_ends_when_the_joints_are_still(self) -> None:
        robot = Coasting()
        with served(robot) as server, server.client() as client:
            safety = client.proxy(SafetyPrx, SAFETY)
            with self.pressed(server.endpoint, server.realm, SAFETY, "Body") as report:
                until(lambda: safety.getSafetyState().stopped)
                since = robot.reads
                until(lambda: robot.reads > since + 10)
                assert not report.done()
                robot.coasts = False
                assert report.result(RUN_LIMIT).failed == {}

    def test_joints_that_go_on_moving_are_reported(self) -> None:
        limits = replace(self.PATIENT, standstill=0.2)
        with (
            served(Coasting()) as server,
            self.pressed(server.endpoint, server.realm, SAFETY, "Body", limits=limits) as report,
        ):
            found = report.result(RUN_LIMIT)
        assert found.failed == {"Body": "its joints still move, the fastest at 1.5 rad/s: look at the robot"}
        assert "Body" not in found.stopped

    @pytest.mark.parametrize("carrier", [NETWORK])
    def test_it_is_repeated_while_the_network_is_silent(
        self, robot: RobotClient, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        sent: list[str] = []

        def send(communicator: Communicator, reason: str, timeout: float) -> Future[None]:
            sent.append(reason)
            return begin_stop(communicator, reason, timeout)

        limits = replace(self.PATIENT, stop_answer=0.2, stop_repetition=FOREVER)
        monkeypatch.setattr(editor_stop, "begin_stop", send)
        with Relay(robot.endpoint) as relay, ExitStack() as steps:
            steps.callback(relay.resume)
            pressed = self.pressed(relay.endpoint, robot.realm, SAFETY, before=relay.hold, limits=limits)
            report = steps.enter_context(pressed)
            until(lambda: len(sent) > 1)
            assert not robot.proxy(SafetyPrx, SAFETY).getSafetyState().stopped
            relay.resume()
            assert report.result(RUN_LIMIT).failed == {}
        assert robot.proxy(SafetyPrx, SAFETY).getSafetyState().stopped
