"""The commands of several robots."""

import sys
import threading

import pytest

from naoserver.errors import RobotError
from naoserver_sim._command import run_team, team_commands
from tests.support.limits import FOREVER
from zenoh_ice.settings import Settings

SETTINGS = Settings(realm="nao", listen=("tcp/127.0.0.1:7447",), connect=())


def own(command):
    """The options of a robot behind `python -m naoserver_sim`."""
    assert command[:4] == [sys.executable, "-P", "-m", "naoserver_sim"]
    return command[4:]


def test_each_robot_has_a_realm_and_a_port_of_its_own_and_finds_the_first():
    first, second, third = team_commands([], 3, SETTINGS)
    assert own(first) == ["--realm", "nao", "--listen", "tcp/127.0.0.1:7447"]
    connect = ["--connect", "tcp/127.0.0.1:7447"]
    assert own(second) == ["--realm", "nao2", "--listen", "tcp/127.0.0.1:7448", *connect]
    assert own(third) == ["--realm", "nao3", "--listen", "tcp/127.0.0.1:7449", *connect]


def test_what_is_given_for_all_goes_to_each():
    options = ["--speed", "5", "--robots", "2", "--realm=a", "--camera", "Camera=640x480@15", "--no-skin"]
    for command in team_commands(options, 2, SETTINGS):
        assert own(command)[:5] == ["--speed", "5", "--camera", "Camera=640x480@15", "--no-skin"]
        assert "--robots" not in command


def test_robots_draw_different_numbers_and_have_what_they_cannot_share_apart():
    commands = team_commands(
        ["--seed", "7", "--an-address=tcp://127.0.0.1:9559"],
        2,
        SETTINGS,
        seed=7,
        apart={"an_address": lambda number: f"tcp://127.0.0.1:{9559 + number}"},
    )
    assert own(commands[1])[-4:] == ["--seed", "8", "--an-address", "tcp://127.0.0.1:9560"]
    assert commands[1].count("--seed") == 1


def test_port_that_the_system_picks_stays_so():
    second = team_commands([], 2, Settings(listen=("tcp/127.0.0.1:0",), connect=()))[1]
    assert own(second) == ["--realm", "nao2", "--listen", "tcp/127.0.0.1:0"]


@pytest.mark.slow
def test_all_end_when_one_does(tmp_path):
    up, ended = tmp_path / "up", tmp_path / "ended"
    stays = f"""
import pathlib, signal, sys, time
def end(*_):
    pathlib.Path({str(ended)!r}).touch()
    sys.exit()
signal.signal(signal.SIGTERM, end)
pathlib.Path({str(up)!r}).touch()
time.sleep({FOREVER})
"""
    ends = f"""
import pathlib, sys, time
while not pathlib.Path({str(up)!r}).exists():
    time.sleep(0.01)
sys.exit(3)
"""
    with pytest.raises(RobotError, match="robot 2 ended with exit code 3"):
        run_team([[sys.executable, "-c", stays], [sys.executable, "-c", ends]], threading.Event())
    assert ended.exists()
