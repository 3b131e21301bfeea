"""docs/how-to/gains.md: its program prints the documented output, and its times are those of the server."""

import re

import pytest

from naoserver.bodies import find_body
from naoserver.options import SafetyOptions
from naoserver_sim.robot import SimulatedRobot
from tests.support.pages import DOCS
from tests.support.robot_server import served

pytestmark = pytest.mark.sim

PAGE = (DOCS / "how-to/gains.md").read_text()


def block(language):
    (text,) = re.findall(rf"^```{language}\n(.*?)^```", PAGE, flags=re.M | re.S)
    return text


def test_its_program_runs(monkeypatch, capsys):
    with served(SimulatedRobot(skin=False, body=find_body("T1"))) as server:
        monkeypatch.setenv("VISUALHFSM_REALM", server.realm)
        monkeypatch.setenv("VISUALHFSM_CONNECT", server.endpoint)
        exec(compile(block("python"), "gains.md", "exec"), {})
    assert capsys.readouterr().out == block("text")


def test_its_times_are_those_of_the_server():
    options = SafetyOptions()
    assert f"lasts for {options.gains_timeout:g} s of wall time" in PAGE
    assert f"damped for {options.damping_time:g} s" in PAGE
