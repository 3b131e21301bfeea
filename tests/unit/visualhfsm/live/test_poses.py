"""The body that the editor draws in 3D is that of the simulator."""

from __future__ import annotations

import json
from importlib import resources

import pytest


@pytest.mark.sim
def test_the_geometry_is_current() -> None:
    from naoserver_sim.geometry import describe_body

    packaged = (resources.files("visualhfsm._live") / "nao_h25.json").read_text()
    assert json.loads(packaged) == describe_body(), (
        "type: python -m naoserver_sim.geometry visualhfsm/_live/nao_h25.json"
    )
