"""Take another robot: the same behavior on all of them, and a robot of one's own from its model alone."""

from __future__ import annotations

import math
import re
from pathlib import Path

import pytest

from tests.doors.conftest import printed
from tests.support.pages import blocks_of
from tests.support.places import ROOT
from tests.support.plugins import OWN_ROBOTS
from tests.support.processes import ComponentProcess, free_endpoint, module
from tests.support.reader import commands_of
from visualhfsm.testing import MakeBehavior


@pytest.mark.parametrize("body", ["H25", "T1", "G1", "Cart"])
@pytest.mark.promise("a Booster T1, a Unitree G1, a cart")
@pytest.mark.promise("run the same behaviors")
def test_it_turns_its_camera_to_the_ball(behavior: MakeBehavior, body: str) -> None:
    b = behavior("behaviors/follow_ball.xml", robot="sim", body=body)
    b.advance(6.0)
    assert b.active == "follow"
    seen = b.variables("follow_ball")
    assert seen["missed"] == 0
    assert math.degrees(math.hypot(seen["left"], seen["down"])) < 2.0
    assert not b.robot.state.fallen


@OWN_ROBOTS
@pytest.mark.gl
@pytest.mark.promise("or your own from its URDF or MJCF")
def test_a_model_alone_is_served_and_taken_for_what_the_page_says(tmp_path: Path) -> None:
    blocks = blocks_of((ROOT / "plugins/own_robots/docs/own-robot.md").read_text("utf-8"))
    for block in blocks:
        if block.name is not None:
            (tmp_path / block.name).write_text(block.text, "utf-8")
    outputs = {
        command.text: command.output
        for block in blocks
        for command in commands_of(block.text, block.language)
        if command.output
    }
    endpoint = free_endpoint()
    command = module("naoserver_sim", "--body", "rover.xml", "--realm", "own", "--listen", endpoint)
    with ComponentProcess(command, {"PYTHONPATH": str(ROOT)}, tmp_path) as process:
        for line in outputs["naoserver-sim --body rover.xml"].splitlines():
            process.wait_for(re.escape(line).replace(re.escape("..."), ".*"))
        said = printed("drive.py", folder=tmp_path, VISUALHFSM_REALM="own", VISUALHFSM_CONNECT=endpoint)
    assert said.rstrip() == outputs["python drive.py"]
