"""`naoserver-sim --robots`, in one process and in several, and `--world`."""

import signal
from contextlib import ExitStack

import pytest

from interfaces.jderobot import CommandRefusedException
from interfaces.nao import GroundTruthPrx, JointsPrx, SafetyPrx
from naoserver.errors import RobotError
from naoserver_sim._command import app
from tests.support.commands import run_here
from tests.support.limits import START_LIMIT
from tests.support.nao_command import nao
from tests.support.processes import ComponentProcess, free_endpoint, module
from zenoh_ice import initialize

pytestmark = pytest.mark.sim


@pytest.mark.parametrize(
    ("apart", "second"),
    [((), "; realm nao2"), (("--apart",), "ready: realm nao2")],
    ids=["together", "apart"],
)
def test_robots_live_in_realms_of_their_own_and_end_together(apart, second):
    endpoint = free_endpoint()
    options = ("--robots", "2", "--world", "soccer", "--no-skin", "--speed", "0.2", *apart)
    with ComponentProcess(module("naoserver_sim", "--listen", endpoint, *options)) as process:
        process.wait_for(f"ready: realm nao, {endpoint}")
        process.wait_for(second)
        for realm in ("nao", "nao2"):
            with initialize(realm=realm, connect=[endpoint], listen=["tcp/127.0.0.1:0"]) as communicator:
                truth = GroundTruthPrx.uncheckedCast(communicator.stringToProxy("GroundTruth"))
                assert "Ball" in truth.getGroundTruth.wait(timeout=START_LIMIT).value.objects
        outcome = nao("stop", "--all", "--connect", endpoint, "--listen", "tcp/127.0.0.1:0")
        stopped = [line.partition(": the robot")[0] for line in outcome.out.splitlines()]
        assert (outcome.code, stopped) == (0, ["nao: stopped", "nao2: stopped"]), outcome.text
        process.process.send_signal(signal.SIGINT)
        assert process.wait() == 130


def test_robots_of_one_world_see_each_other_and_a_stop_of_one_stops_one():
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


def test_a_world_that_lists_its_robots_takes_no_number():
    done = run_here(app, "naoserver-sim", "--world", "match", "--robots", "2")
    assert done.returncode == 2
    assert "lists its robots: leave out --robots" in " ".join(done.stderr.split())


def test_a_wrong_world_is_reported_in_one_line(tmp_path):
    file = tmp_path / "mine.toml"
    file.write_text("[robot]\nheading = 'north'\n")
    done = run_here(app, "naoserver-sim", "--world", file, expected=(RobotError,))
    assert done.returncode == 1
    assert "mine.toml" in done.stderr
    assert "robot.heading" in done.stderr
    assert (done.stdout, done.stderr.count("\n")) == ("", 1)
