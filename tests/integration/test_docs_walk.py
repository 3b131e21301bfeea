"""docs/how-to/walk.md: its program prints the documented output, and its limits are those of the walk."""

import re

import pytest

from naoserver_sim._walk.walker import LIMITS
from naoserver_sim.robot import SimulatedRobot
from tests.support.pages import DOCS
from tests.support.robot_server import served

pytestmark = pytest.mark.sim

PAGE = (DOCS / "how-to/walk.md").read_text()


def block(language):
    (text,) = re.findall(rf"^```{language}\n(.*?)^```", PAGE, flags=re.M | re.S)
    return text


def test_its_program_runs(monkeypatch, capsys):
    with served(SimulatedRobot(skin=False, speed=5.0)) as server:
        monkeypatch.setenv("VISUALHFSM_REALM", server.realm)
        monkeypatch.setenv("VISUALHFSM_CONNECT", server.endpoint)
        exec(compile(block("python"), "walk.md", "exec"), {})
    said = re.fullmatch(r"it is ([\d.]+) m from where it began\n", capsys.readouterr().out)
    assert said
    assert 0.3 < float(said[1]) < 1.5
    assert re.fullmatch(r"it is [\d.]+ m from where it began\n", block("text"))


def test_its_limits_are_those_of_the_walk():
    limits = f"{LIMITS.forward:g} m/s forwards and back, {LIMITS.left:g} m/s sideways, {LIMITS.turn:g} rad/s"
    assert limits in PAGE
