"""The measured peer: generated proxies and servants of zenoh_ice."""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from concurrent.futures import Future
from contextlib import AbstractContextManager, contextmanager
from pathlib import Path
from typing import Any, Final

from zenoh_ice import Current, initialize

from .content import JOINTS, POSE, SMALL_IMAGE, frame
from .interface import IDENTITY, REALM, load_generated
from .peers import Got

_QUEUE: Final = 1000
"""Joint states that are queued for a slow subscriber: those of one second."""


class OurServer:
    """A servant and its publishers."""

    def __init__(self, bench: Any, robot: Any) -> None:  # noqa: ANN401
        self._bench = bench
        self._joints = robot.jointsPublisher
        self._video = robot.videoPublisher

    def send(self, stream: str, stamp: int, number: int, content: Any) -> None:  # noqa: ANN401
        """Publish a value."""
        if stream == "joints":
            self._joints.publish(self._bench.JointState(stamp, number, content))
        else:
            self._video.publish(self._bench.Picture(stamp, number, content.tobytes()))


class OurClient:
    """A proxy of the servant."""

    def __init__(self, bench: Any, robot: Any) -> None:  # noqa: ANN401
        self._robot = robot
        self._angles = bench.Angles(*POSE)
        self.image = robot.image
        self.joints = robot.joints
        self.latest = robot.joints.latest

    def step(self) -> object:
        """Call with four doubles there and back."""
        return self._robot.step(self._angles)

    def stepAsync(self) -> Future[Any]:
        """Call without waiting."""
        future: Future[Any] = self._robot.step.begin(self._angles)
        return future

    def follow(self, stream: str, got: Got) -> AbstractContextManager[object]:
        """Subscribe."""

        def take(sample: Any) -> None:  # noqa: ANN401
            got(sample.value)

        call = getattr(self._robot, stream)
        queue = _QUEUE if stream == "joints" else 1
        subscription: AbstractContextManager[object] = call.subscribe(take, queue=queue)
        return subscription


def make_servant(bench: Any) -> Any:  # noqa: ANN401
    """Return a servant of the benchmark's interface."""

    class RobotI(bench.Robot):  # type: ignore[misc]
        def step(self, angles: Any, current: Current) -> Any:  # noqa: ANN401, ARG002
            return angles

        def image(self, width: int, height: int, current: Current) -> bytes:  # noqa: ARG002
            pixels: bytes = frame(width, height).tobytes()
            return pixels

        def joints(self, current: Current) -> Any:  # noqa: ANN401, ARG002
            return bench.JointState(time.monotonic_ns(), 0, list(JOINTS))

        def video(self, current: Current) -> Any:  # noqa: ANN401, ARG002
            return bench.Picture(time.monotonic_ns(), 0, frame(*SMALL_IMAGE).tobytes())

        def follow(self, receiver: Any, current: Current) -> None:  # noqa: ANN401
            raise NotImplementedError("subscribe to the streams instead")

    return RobotI()


@contextmanager
def serve(endpoint: str, package: Path) -> Iterator[OurServer]:
    """Serve on an endpoint."""
    bench = load_generated(package)
    with initialize(realm=REALM, listen=[endpoint], connect=[], clock="wall") as communicator:
        adapter = communicator.createObjectAdapter("Bench")
        robot = make_servant(bench)
        adapter.add(robot, IDENTITY)
        adapter.activate()
        yield OurServer(bench, robot)


@contextmanager
def connect(endpoints: Sequence[str], package: Path) -> Iterator[OurClient]:
    """Connect to a server."""
    bench = load_generated(package)
    with initialize(realm=REALM, connect=list(endpoints), clock="wall") as communicator:
        yield OurClient(bench, bench.RobotPrx.checkedCast(communicator.stringToProxy(IDENTITY)))
