"""The list of messages names every request that steers, with its fields."""

from __future__ import annotations

import re

import pytest

from visualhfsm._editor import protocol as p

hooks = pytest.importorskip("docs.hooks", reason="needs the packages of visualhfsm[docs]")


def test_every_request_that_steers_has_its_row_with_its_fields() -> None:
    rows: dict[str, str] = {}
    for line in hooks.requests().split("\n"):
        if line.startswith("| `"):
            names, fields = line.split("|")[1:3]
            rows |= dict.fromkeys(re.findall(r"`(\w+)`", names), fields)
    steering: set[type[p.Request]] = {
        *p.Steering.__subclasses__(),
        *p.SceneRequest.__subclasses__(),
        p.Moment,
        p.Series,
        p.Picture,
        p.Body,
    }
    assert p.Pause in steering
    steering |= {
        p.StopPresent,
        p.EmergencyStop,
        p.ResetEmergencyStop,
        p.StandRobot,
        p.Identities,
        p.RosGraph,
        p.Facts,
    }
    for request in steering:
        name = str(request.__struct_config__.tag)
        assert name in rows
        for field in {*request.__struct_fields__} - {"id", "component"}:
            assert f"`{field}`" in rows[name], f"{name} takes {field}"
