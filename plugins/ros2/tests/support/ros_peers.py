"""Other implementations of ROS 2, in a separate environment: genuine rclpy, rosidl and zenoh-ros2-sdk.

`make ros-peers` installs them. Tests that need them are skipped where they are not installed; plugins/ros2/tests/data/ros2 has
recordings of them, with which ours are always compared.
"""

from __future__ import annotations

import json
import os
import queue
import subprocess
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from pathlib import Path
from typing import Any, Final

import pytest

from tests.support.limits import END_LIMIT, EVENT_LIMIT, START_LIMIT
from tests.support.places import ROOT

PROGRAMS: Final = ROOT / "plugins" / "ros2" / "tests" / "ros_peers"
"""Programs that the environment's Python runs."""
RECORDED: Final = ROOT / "plugins" / "ros2" / "tests" / "data" / "ros2"


def peers_folder() -> Path:
    """Return the folder of the environment: that of the environment variable ROS_PEERS, or one in the user's cache."""
    cache_folder = os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache"
    return Path(os.environ.get("ROS_PEERS") or Path(cache_folder, "visualhfsm", "ros-peers"))


def peers_python() -> str:
    """Return the environment's Python; skips the test where it is not installed."""
    folder = peers_folder()
    python = folder / "bin" / "python"
    found = {each.name for each in folder.glob("lib/*/site-packages/*_*")}
    if not {"zenoh_ros2_sdk", "sensor_msgs"} <= found:  # which are installed with the others
        pytest.skip(f"genuine ROS 2 and zenoh-ros2-sdk are not all in {folder}: make ros-peers installs them")
    return str(python)


@cache
def recorded_types() -> dict[str, Any]:
    """Return what plugins/ros2/tests/ros_peers/record_types.py printed, which says what it has."""
    found: dict[str, Any] = json.loads((RECORDED / "types.json").read_text("utf-8"))
    return found


class Peer:
    """A node of zenoh-ros2-sdk in another process, which takes orders."""

    def __init__(self, process: subprocess.Popen[str]) -> None:
        self.process = process
        self.said: queue.Queue[dict[str, Any]] = queue.Queue()
        self.other = ""
        self._reader = threading.Thread(target=self._read, name="output of a peer", daemon=True)
        self._reader.start()

    def order(self, **what: object) -> None:
        """Give it an order, as plugins/ros2/tests/ros_peers/zenoh_sdk.py says."""
        assert self.process.stdin is not None
        self.process.stdin.write(json.dumps(what) + "\n")
        self.process.stdin.flush()

    def next(self, limit: float = START_LIMIT) -> dict[str, Any]:
        """Return its next message."""
        try:
            return self.said.get(timeout=limit)
        except queue.Empty:
            raise AssertionError(f"the peer says nothing more; it said {self.other}") from None

    def close(self) -> None:
        """End the node."""
        assert self.process.stdin is not None
        self.process.stdin.close()
        try:
            self.process.wait(END_LIMIT)
        except subprocess.TimeoutExpired:
            self.process.kill()
            self.process.wait(END_LIMIT)
        self._reader.join(EVENT_LIMIT)
        assert not self._reader.is_alive()  # otherwise closing would wait for it, without a limit
        assert self.process.stdout is not None
        self.process.stdout.close()

    def _read(self) -> None:
        assert self.process.stdout is not None
        for line in self.process.stdout:
            if line.startswith("{"):
                self.said.put(json.loads(line))
            else:
                self.other += line


@contextmanager
def running_peer(router: str, **asked: object) -> Iterator[Peer]:
    """Run a node of zenoh-ros2-sdk, connected to a router, with what plugins/ros2/tests/ros_peers/zenoh_sdk.py takes."""
    argument = json.dumps({"port": int(router.rpartition(":")[2]), **asked})
    process = subprocess.Popen(
        [peers_python(), str(PROGRAMS / "zenoh_sdk.py"), argument],
        stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
    )  # fmt: skip
    peer = Peer(process)
    try:
        yield peer
    finally:
        peer.close()
