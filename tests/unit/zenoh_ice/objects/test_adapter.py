"""Adapters: all of their servants are served, or none."""

from __future__ import annotations

import pytest

from tests.support.gripper import GripperI
from zenoh_ice import AlreadyRegisteredException, Communicator, Settings
from zenoh_ice.routes.in_process import InProcessTransport
from zenoh_ice.threads.pool import Pool


def test_one_that_cannot_serve_all_serves_none_and_can_try_again() -> None:
    with Communicator(Settings(clock="wall"), pool=Pool(0, "test"), transport=InProcessTransport) as here:
        first, second = here.createObjectAdapter("First"), here.createObjectAdapter("Second")
        first.add(GripperI(), "Left")
        first.activate()
        for identity in ("Right", "Left"):
            second.add(GripperI(), identity)
        with pytest.raises(AlreadyRegisteredException, match="'Left'"):
            second.activate()
        assert here.identities() == ["Left"]
        first.removeAll()
        second.activate()
        assert here.identities() == ["Left", "Right"]


def test_one_that_is_active_ends_with_its_communicator() -> None:
    here = Communicator(Settings(clock="wall"), pool=Pool(0, "test"), transport=InProcessTransport)
    adapter = here.createObjectAdapter("Test")
    adapter.add(GripperI(), "Gripper")
    adapter.activate()
    assert here.served
    here.destroy()
    assert not here.served
