"""The warning that nothing of ROS answers; with nodes, it is in test_node.py."""

from __future__ import annotations

import logging
import threading
from contextlib import closing

import pytest

from tests.support.waiting import until
from zenoh_ros2._node import AbsenceWarning

HERE = ["tcp/127.0.0.1:7447"]
DELAY = 0.3


@pytest.fixture(autouse=True)
def warnings(caplog: pytest.LogCaptureFixture) -> None:
    caplog.set_level(logging.WARNING)


@pytest.mark.slow
def test_who_is_not_connected_for_a_while_says_so(caplog: pytest.LogCaptureFixture) -> None:
    with closing(AbsenceWarning(lambda: False, HERE, DELAY)):
        assert not caplog.text
        until(lambda: "nothing of ROS answers at tcp/127.0.0.1:7447 so far" in caplog.text)


def test_who_is_connected_in_time_says_nothing(caplog: pytest.LogCaptureFixture) -> None:
    connected = threading.Event()
    looks = threading.Semaphore(0)

    def look() -> bool:
        looks.release()
        return connected.is_set()

    with closing(AbsenceWarning(look, HERE, DELAY)) as warning:
        assert looks.acquire(timeout=5.0)
        connected.set()
        until(lambda: not any(each.name == "first link to ROS" for each in threading.enumerate()))
        warning.close()
    assert not caplog.text


def test_it_does_not_keep_a_node_from_closing(caplog: pytest.LogCaptureFixture) -> None:
    AbsenceWarning(lambda: False, HERE, DELAY).close()
    assert not caplog.text


def test_without_a_thread_it_warns_at_once(
    caplog: pytest.LogCaptureFixture, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(_: threading.Thread) -> None:
        raise RuntimeError("can't start new thread")

    monkeypatch.setattr(threading.Thread, "start", refuse)
    AbsenceWarning(lambda: False, HERE, DELAY).close()
    assert "nothing of ROS answers" in caplog.text
