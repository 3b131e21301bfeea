"""The pages about robots describe the servers: the table is current, the example is run."""

from __future__ import annotations

import os
import subprocess
import sys

import pytest

from naoserver.fake import FakeRobot
from tests.support.limits import RUN_LIMIT
from tests.support.pages import DOCS, blocks_of
from tests.support.robot_server import served
from tools.generators.robots_page import PAGE, robots_page


@pytest.mark.sim
def test_the_table_of_robots_is_current() -> None:
    pytest.importorskip("mujoco", reason="the simulated robot needs MuJoCo: pip install 'visualhfsm[sim]'")
    pytest.importorskip("qi", reason="the real robot needs libqi: pip install 'visualhfsm[naoqi]'")
    assert PAGE.read_text() == robots_page(), "write it again: python -m tools.generators.robots_page"


@pytest.mark.parametrize("page", ["explanation/robot-safety.md", "how-to/senses.md"])
def test_the_example_of_a_page_does_what_the_page_says(page: str) -> None:
    code, output = blocks_of((DOCS / page).read_text(encoding="utf-8"))
    with served(FakeRobot()) as robot:
        done = subprocess.run(
            [sys.executable, "-c", code.text],
            env={**os.environ, "VISUALHFSM_REALM": robot.realm, "VISUALHFSM_CONNECT": robot.endpoint},
            capture_output=True,
            text=True,
            timeout=RUN_LIMIT,
            check=False,
        )
    assert (done.stdout, done.returncode) == (output.text, 0), done.stderr
