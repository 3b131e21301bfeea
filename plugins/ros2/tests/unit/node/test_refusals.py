"""What is refused of a topic is logged, but not more than a reader can follow."""

from __future__ import annotations

import time

import pytest

from zenoh_ros2._refusals import Refusals


def test_the_first_are_logged_and_then_one_in_ten_seconds_that_counts_the_others(
    caplog: pytest.LogCaptureFixture, monkeypatch: pytest.MonkeyPatch
) -> None:
    now = 100.0
    monkeypatch.setattr(time, "monotonic", lambda: now)
    refusals = Refusals("/joint_angles", "refused a message")
    for number in range(20):
        refusals.add(f"reason\n{number}")
    now += 10.0
    refusals.add("late")
    assert caplog.messages == [
        "/joint_angles: refused a message: reason 0",
        "/joint_angles: refused a message: reason 1",
        "/joint_angles: refused a message: reason 2",
        "/joint_angles: refused a message: late (17 more since the last report)",
    ]
    assert refusals.count == 21
