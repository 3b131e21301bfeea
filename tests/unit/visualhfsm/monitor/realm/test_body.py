"""The other robots of a world, whose names any process may report."""

from __future__ import annotations

import pytest

from visualhfsm._monitor.realm.body import Others
from zenoh_ice import initialize


@pytest.mark.slow
def test_names_that_are_no_realms_are_ignored_and_new_ones_without_end_are_not_followed() -> None:
    with initialize(connect=[], listen=[], clock="wall") as communicator:
        others = Others(communicator)
        others.update(["", "a/b", "**", "@", "x" * 200, "Cafè"])
        watched = communicator.presence._realms.copy()
        for number in range(30):
            others.update(f"robot{number}-{each}" for each in range(100))
        assert others.bodies() == {}
        assert watched == {communicator.realm}
        assert len(communicator.presence._realms) == 65
