"""Logs on /rosout."""

from __future__ import annotations

import logging

import pytest

from plugins.ros2.tests.support.ros_nodes import Inbox, matched, two_nodes
from zenoh_ros2 import RosoutHandler


@pytest.mark.slow
def test_records_are_published() -> None:
    with two_nodes(clock=lambda: 5_000_000_007) as (robot, tool):
        inbox = Inbox()
        tool.create_subscription("rcl_interfaces/msg/Log", "/rosout", inbox)
        logger, handler = logging.getLogger("a.behavior"), RosoutHandler(robot)
        logger.addHandler(handler)
        try:
            matched(robot, tool, "/rosout")
            logger.debug("not at this level")
            logger.warning("%d balls\0", 2)
            (log,) = inbox.wait()
        finally:
            logger.removeHandler(handler)
            handler.close()
        assert (log.level, log.name, log.msg) == (30, "a.behavior", "2 balls")
        assert (log.stamp.sec, log.stamp.nanosec) == (5, 7)
        assert log.file.endswith("test_rosout.py")


@pytest.mark.slow
def test_a_record_that_cannot_be_formatted_fails_no_code(monkeypatch: pytest.MonkeyPatch) -> None:
    with two_nodes() as (robot, _):
        handler = RosoutHandler(robot)
        failed: list[logging.LogRecord] = []
        monkeypatch.setattr(handler, "handleError", failed.append)
        record = logging.LogRecord("a", logging.ERROR, "a.py", 1, "%d balls", ("no",), None)
        handler.handle(record)
        assert failed == [record]
