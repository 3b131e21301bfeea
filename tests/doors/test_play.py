"""Play against each other: several robots in one world, roles in a team, and a referee."""

from __future__ import annotations

import signal
from contextlib import ExitStack, closing
from pathlib import Path

import pytest

from interfaces.jderobot import CommandRefusedException
from interfaces.nao import GroundTruthPrx, JointsPrx, SafetyPrx
from tests.support.documents import document, state, sub
from tests.support.limits import MOVE_LIMIT, START_LIMIT
from tests.support.nao_command import nao
from tests.support.plugins import needs
from tests.support.processes import ComponentProcess, free_endpoint, module
from tests.support.served_teams import team, until_holder
from tests.support.waiting import until
from zenoh_ice import initialize


@pytest.mark.promise("several robots in one world")
def test_robots_of_one_world_see_each_other_and_a_stop_of_one_stops_one() -> None:
    endpoint = free_endpoint()
    options = ("--world", "match", "--no-skin", "--speed", "0.5")
    with ComponentProcess(module("naoserver_sim", "--listen", endpoint, *options)) as process:
        process.wait_for(f"ready: realm red1, {endpoint}")
        with ExitStack() as realms:
            reached = {}
            for realm in ("red1", "red2", "blue1", "blue2"):
                opened = initialize(realm=realm, connect=[endpoint], listen=["tcp/127.0.0.1:0"])
                reached[realm] = realms.enter_context(opened)
            for realm, communicator in reached.items():
                truth = GroundTruthPrx.uncheckedCast(communicator.stringToProxy("GroundTruth"))
                objects = truth.getGroundTruth.wait(timeout=START_LIMIT).value.objects
                assert set(objects) == {"Ball", *reached} - {realm}
            safety = {
                realm: SafetyPrx.uncheckedCast(communicator.stringToProxy("Safety"))
                for realm, communicator in reached.items()
            }
            safety["red2"].emergencyStop("test")
            stopped = {realm: each.getSafetyState().stopped for realm, each in safety.items()}
            assert stopped == {"red1": False, "red2": True, "blue1": False, "blue2": False}
            joints = {
                realm: JointsPrx.uncheckedCast(reached[realm].stringToProxy("Body"))
                for realm in ("red1", "red2")
            }
            joints["red1"].setJointPositions({"HeadYaw": 0.2}, 1.0)
            with pytest.raises(CommandRefusedException):
                joints["red2"].setJointPositions({"HeadYaw": 0.2}, 1.0)
            outcome = nao("stop", "--all", "--connect", endpoint, "--listen", "tcp/127.0.0.1:0")
            names = sorted(line.partition(":")[0] for line in outcome.out.splitlines())
            assert (outcome.code, names) == (0, sorted(reached)), outcome.text
            assert all(each.getSafetyState().stopped for each in safety.values())


@pytest.mark.promise("teams that agree on who strikes")
def test_a_role_goes_over_when_its_robot_is_stopped_and_when_its_server_is_killed() -> None:
    with team("nao", "nao2") as robots:
        first, second = robots
        first.team.reportBall(1.0, 2.0)
        until(lambda: [m.ballX for m in second.team.getTeamState().mates] == [1.0], START_LIMIT)
        until_holder(robots, [1.0, 2.0], "nao")
        until(lambda: second.team.getRobotOf("striker") == "nao", MOVE_LIMIT)
        SafetyPrx.checkedCast(first.communicator.stringToProxy("Safety")).emergencyStop("a test")
        until_holder(robots, [1.0, 2.0], "nao2")
        SafetyPrx.checkedCast(first.communicator.stringToProxy("Safety")).resetEmergencyStop()
        until_holder(robots, [1.0, 2.0], "nao")
        first.process.process.send_signal(signal.SIGKILL)
        until_holder([second], [2.0], "nao2")


@needs("visualhfsm_match")
@needs("visualhfsm_classes")
@pytest.mark.promise("matches with a referee")
def test_two_teams_that_stand_draw(tmp_path: Path) -> None:
    from naoserver_sim.world import load_world
    from visualhfsm_match._match import Plan
    from visualhfsm_match._rules import load_rules
    from visualhfsm_match._series import Match, Matches, pack

    stands = [tmp_path / f"{name}.xml" for name in ("stands", "other")]
    for path in stands:
        path.write_text(document(sub(1, 0, state(1, "only", "pass", initial=True))))
    archive, (ours, theirs) = pack(stands)
    plan = Plan(
        documents=(ours, theirs),
        teams=("ours", "theirs"),
        players=2,
        seconds=10.0,
        seed=3,
        rules=load_rules(),
        world=load_world("soccer"),
        body="H25",
    )
    with closing(Matches()) as matches:
        played = matches.run(Match(plan, 1, archive, page=True)).require()
    found = played.result
    assert [event.kind for event in found.events] == ["kick-off", "whistle", "end"]
    assert (found.score, found.winner, found.lying, found.seconds) == ((0, 0), "", (), 10.0)
    assert "match-page" in played.page
