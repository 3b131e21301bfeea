"""What a command reports to systemd's watchdog."""

from __future__ import annotations

import os
import socket
import threading
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path

import pytest

from tests.support.limits import EVENT_LIMIT
from zenoh_ice.application.watchdog import Watchdog

WORKS = b"WATCHDOG=1"


@pytest.fixture
def systemd(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[socket.socket]:
    with closing(socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)) as systemd:
        systemd.bind(f"{tmp_path}/notify")
        systemd.settimeout(EVENT_LIMIT)
        monkeypatch.setenv("NOTIFY_SOCKET", f"{tmp_path}/notify")
        yield systemd


def reports(systemd: socket.socket) -> list[bytes]:
    """Return what has been reported so far."""
    systemd.setblocking(False)
    found = []
    try:
        while True:
            found.append(systemd.recv(64))
    except BlockingIOError:
        return found


@pytest.mark.slow
def test_a_command_that_works_reports_it_again_and_again(
    systemd: socket.socket, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("WATCHDOG_USEC", "10000")
    watchdog, stop = Watchdog(), threading.Event()
    waiting = threading.Thread(target=watchdog.wait, args=(stop, str, 0.001))
    waiting.start()
    assert [systemd.recv(64) for _ in range(3)] == [WORKS] * 3
    stop.set()
    waiting.join(EVENT_LIMIT)
    assert not waiting.is_alive()
    assert {"NOTIFY_SOCKET", "WATCHDOG_USEC"}.isdisjoint(os.environ), "its processes report nothing"


@pytest.mark.slow
def test_a_command_that_does_not_work_reports_nothing_and_says_why(
    systemd: socket.socket, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.setenv("WATCHDOG_USEC", "1")
    watchdog = Watchdog()
    watchdog.report(lambda: "its clock hangs")
    assert reports(systemd) == []
    assert caplog.messages == ["not reporting to systemd that this command works: its clock hangs"]
    watchdog.report(str)
    assert reports(systemd) == [WORKS]


@pytest.mark.slow
@pytest.mark.parametrize("wanted", [None, "", "soon"])
def test_without_a_watchdog_nothing_is_tried(
    wanted: str | None, systemd: socket.socket, monkeypatch: pytest.MonkeyPatch
) -> None:
    if wanted is not None:
        monkeypatch.setenv("WATCHDOG_USEC", wanted)
    tried: list[str] = []
    Watchdog().report(lambda: tried.append("tried") or "")  # type: ignore[func-returns-value]
    assert (tried, reports(systemd)) == ([], [])
