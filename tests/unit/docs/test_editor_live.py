"""The page about the protocol of running components names every action."""

from __future__ import annotations

import re

from tests.support.places import ROOT
from visualhfsm._monitor.steering import OPERATIONS

PAGE = ROOT / "docs" / "reference/live-protocol.md"


def test_every_action_has_its_row_with_its_arguments() -> None:
    rows: dict[str, str] = {}
    for line in PAGE.read_text(encoding="utf-8").split("\n"):
        if line.startswith("| `"):
            names, arguments = line.split("|")[1:3]
            rows |= dict.fromkeys(re.findall(r"`(\w+)`", names), arguments)
    assert "pause" in OPERATIONS
    for action, operation in OPERATIONS.items():
        assert action in rows
        for field in operation.arguments.fields:
            assert f"`{field}`" in rows[action], f"{action} takes {field}"
