"""`naoserver-sim --robots`, in one process and in several, and `--world`."""

import signal

import pytest

from interfaces.nao import GroundTruthPrx
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
