"""The page about what robots serve describes the servers."""

from __future__ import annotations

import pytest

from tools.generators.robots_page import PAGE, robots_page


@pytest.mark.sim
def test_the_table_of_robots_is_current() -> None:
    pytest.importorskip("mujoco", reason="the simulated robot needs MuJoCo: pip install 'visualhfsm[sim]'")
    pytest.importorskip("qi", reason="the real robot needs libqi: pip install 'visualhfsm[naoqi]'")
    assert PAGE.read_text() == robots_page(), "write it again: python -m tools.generators.robots_page"
