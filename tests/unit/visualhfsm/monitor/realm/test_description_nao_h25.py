"""The body that the editor draws for a robot without a description is that of the simulator."""

from __future__ import annotations

import json
from importlib import resources

from naoserver.bodies import DEFAULT_BODY, find_body
from naoserver.bodies.looks.description import write_looks
from naoserver.body import write_body


def test_the_geometry_is_current() -> None:
    packaged = json.loads((resources.files("visualhfsm._monitor.realm") / "nao_h25.json").read_text())
    body = find_body(DEFAULT_BODY)
    assert packaged == {"body": json.loads(write_body(body)), "looks": json.loads(write_looks(body))}, (
        "type: python -m naoserver_sim._description visualhfsm/_monitor/realm/nao_h25.json"
    )
