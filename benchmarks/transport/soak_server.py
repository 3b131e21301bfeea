"""A server of the soak: it answers, and sends values by which torn ones can be recognized on both streams."""

from __future__ import annotations

import threading
import time
from pathlib import Path
from typing import Any, Final, Self

from zenoh_ice import initialize

from .content import marked_joints, marked_pixels
from .interface import REALM, load_generated
from .our_peer import make_servant

SIZE: Final = (640, 480)

_JOINTS_RATE: Final = 100.0
_VIDEO_RATE: Final = 15.0


class SoakServer:
    """Serves until the process ends."""

    def __init__(self, endpoint: str, package: Path, identity: str) -> None:
        self._identity = identity
        self._bench = load_generated(package)
        self._communicator = initialize(realm=REALM, listen=[endpoint], connect=[], clock="wall")
        self._stop = threading.Event()
        self._threads: list[threading.Thread] = []
        self._robot = make_servant(self._bench)

    def __enter__(self) -> Self:
        adapter = self._communicator.createObjectAdapter("Soak")
        adapter.add(self._robot, self._identity)
        adapter.activate()
        for target in (self._send_joints, self._send_video):
            thread = threading.Thread(target=target)
            thread.start()
            self._threads.append(thread)
        return self

    def __exit__(self, *_: object) -> None:
        self._stop.set()
        for thread in self._threads:
            thread.join(5.0)
        self._communicator.destroy()

    def _send_joints(self) -> None:
        publisher: Any = self._robot.jointsPublisher
        number = 0
        while not self._stop.wait(1 / _JOINTS_RATE):
            number += 1
            publisher.publish(self._bench.JointState(time.monotonic_ns(), number, marked_joints(number)))

    def _send_video(self) -> None:
        publisher: Any = self._robot.videoPublisher
        number = 0
        while not self._stop.wait(1 / _VIDEO_RATE):
            number += 1
            image = marked_pixels(number, *SIZE)
            publisher.publish(self._bench.Picture(time.monotonic_ns(), number, image))
