"""Robot servers and routers report to systemd's watchdog that they work, and only while they do."""

from __future__ import annotations

import socket
import threading
from collections.abc import Iterator
from contextlib import closing, contextmanager
from pathlib import Path

import pytest

from interfaces.jderobot import CameraPrx
from naoserver.fake import FakeRobot
from naoserver.options import ServerLimits, ServerOptions
from naoserver.robot import Frame
from naoserver.serving.server import problem_of
from tests.support.limits import FOREVER, START_LIMIT
from tests.support.processes import ComponentProcess, module
from tests.support.robot_server import eventually, served_to_client
from tests.support.soak import cases
from zenoh_ice.threads._starting import UserCodeThread

MOST_THREADS = 32  # more than a pool has here


@contextmanager
def systemd(folder: Path, watchdog: float) -> Iterator[socket.socket]:
    """Stand in for systemd, with a watchdog of so many seconds."""
    with closing(socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)) as service_manager:
        service_manager.bind(f"{folder}/notify")
        service_manager.settimeout(START_LIMIT)
        with pytest.MonkeyPatch.context() as patch:
            patch.setenv("NOTIFY_SOCKET", f"{folder}/notify")
            patch.setenv("WATCHDOG_USEC", f"{1e6 * watchdog:.0f}")
            yield service_manager


@pytest.mark.parametrize(
    "command",
    cases(
        [pytest.param(module("naoserver.fake"), id="server")],
        [pytest.param(module("nao_tools", "router"), id="router")],
    ),
)
def test_a_process_that_serves_reports_that_it_works(
    command: list[str], endpoint: str, tmp_path: Path
) -> None:
    with systemd(tmp_path, 0.1) as notified, ComponentProcess([*command, "--listen", endpoint]):
        assert [notified.recv(64) for _ in range(3)] == [b"READY=1", b"WATCHDOG=1", b"WATCHDOG=1"]


class StuckCamera(FakeRobot):
    """Takes no picture until it is let go."""

    def __init__(self) -> None:
        super().__init__()
        self.let_go = threading.Event()

    def capture(self, camera: str, width: int, height: int) -> Frame:
        self.let_go.wait(FOREVER)
        return super().capture(camera, width, height)


def test_a_server_one_of_whose_jobs_hangs_does_not_work() -> None:
    robot = StuckCamera()
    with served_to_client(robot, ServerOptions(limits=ServerLimits(progress=0.3))) as nao:
        try:
            eventually(lambda: problem_of(nao.served_by, nao.assembly) == "")
            CameraPrx.checkedCast(nao.communicator.stringToProxy("Camera")).getImageData.subscribe(print)
            eventually(lambda: problem_of(nao.served_by, nao.assembly).endswith("hangs"))
        finally:
            robot.let_go.set()
        eventually(lambda: problem_of(nao.served_by, nao.assembly) == "")


def test_a_server_that_answers_no_calls_does_not_work(monkeypatch: pytest.MonkeyPatch) -> None:
    def fail(thread: threading.Thread) -> None:
        raise RuntimeError("can't start new thread")

    leave = threading.Event()
    with served_to_client(FakeRobot(), ServerOptions(limits=ServerLimits(answer=0.1))) as nao:
        eventually(lambda: problem_of(nao.served_by, nao.assembly) == "")
        monkeypatch.setattr(UserCodeThread, "start", fail)
        for _ in range(MOST_THREADS):
            nao.served_by.pool.submit(lambda: leave.wait(FOREVER))
        try:
            assert "was not answered within 0.1 s" in problem_of(nao.served_by, nao.assembly)
        finally:
            leave.set()
            monkeypatch.undo()
        eventually(lambda: problem_of(nao.served_by, nao.assembly) == "")
