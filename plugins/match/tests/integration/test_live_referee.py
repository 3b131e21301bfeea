"""A referee in the live simulator: it begins when it is read for all, and a stop of a person holds."""

from __future__ import annotations

from contextlib import ExitStack
from pathlib import Path

import pytest

from interfaces.nao import MatchPhase, RefereePrx, SafetyPrx
from naoserver.errors import RobotError
from naoserver_sim import _command
from tests.support.commands import run_here
from tests.support.limits import EVENT_LIMIT, START_LIMIT
from tests.support.processes import ComponentProcess, free_endpoint, module
from tests.support.waiting import until
from visualhfsm_match._rules import RULES
from zenoh_ice import initialize

pytestmark = pytest.mark.sim

WORLD = """
[field]
[[balls]]
name = "Ball"
position = [0.0, 0.0]
[[robots]]
name = "east"
team = "blue"
position = [2.0, 0.0]
heading = 3.14159265
[[robots]]
name = "west"
team = "red"
position = [-2.0, 0.0]
"""


def test_a_match_begins_when_it_is_read_for_each_robot_and_a_stopped_robot_stays_stopped(
    tmp_path: Path,
) -> None:
    world, rules, endpoint = tmp_path / "world.toml", tmp_path / "rules.toml", free_endpoint()
    world.write_text(WORLD)
    rules.write_text(RULES.read_text().replace("\nready = 2.0", "\nready = 0.3"))
    options = ("--world", str(world), "--body", "Cart", "--speed", "5", "--listen", endpoint)
    judged = ("--referee", "0.2", "--rules", str(rules))
    with ComponentProcess(module("naoserver_sim", *options, *judged)) as process, ExitStack() as realms:
        process.wait_for("Referee: red : blue begins once")
        process.wait_for("ready: ")
        referees, safety = {}, {}
        for realm in ("west", "east"):
            opened = initialize(realm=realm, connect=[endpoint], listen=["tcp/127.0.0.1:0"])
            communicator = realms.enter_context(opened)
            referees[realm] = RefereePrx.uncheckedCast(communicator.stringToProxy("Referee"))
            safety[realm] = SafetyPrx.uncheckedCast(communicator.stringToProxy("Safety"))
        safety["west"].getSafetyState.wait(timeout=START_LIMIT)
        safety["west"].emergencyStop("test")
        west = referees["west"].getMatch()
        assert (west.phase, west.team, west.opponents, west.timeLeft) == (MatchPhase.Ready, "red", "blue", 12)
        assert "kick-off" not in process.output
        referees["east"].getMatch.wait(timeout=START_LIMIT)
        process.wait_for("0:00.0  kick-off for red")
        process.wait_for("the whistle")
        process.wait_for("the end: red 0, blue 0")
        until(lambda: referees["east"].getMatch().phase is MatchPhase.Finished, EVENT_LIMIT)
        found = referees["east"].getMatch()
        assert (found.place.x < -0.5, found.score, found.opponentScore) == (True, 0, 0)
        stopped = {realm: each.getSafetyState().stopped for realm, each in safety.items()}
        assert stopped == {"west": True, "east": False}


@pytest.mark.parametrize(
    ("world", "why"), [("soccer", "robots of two teams"), ("empty", "needs a ball of the name Ball")]
)
def test_a_world_without_two_teams_has_no_referee(world: str, why: str) -> None:
    options = ("--world", world, "--body", "Cart", "--referee", "1", "--listen", free_endpoint())
    done = run_here(_command.app, "naoserver-sim", *options, expected=(RobotError,))
    assert done.returncode == 1
    assert why in done.stderr
