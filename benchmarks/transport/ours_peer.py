"""The measured peer: generated proxies and servants of zenoh_ice."""

from __future__ import annotations

import importlib
import time
from collections.abc import Callable, Iterator
from concurrent.futures import Future
from contextlib import AbstractContextManager, contextmanager
from typing import Any, Final

from zenoh_ice import Current, initialize

from .peers import IDENTITY, PACKAGE, POSE, SMALL_IMAGE, pixels

_REALM: Final = "bench"

bench: Final = importlib.import_module(f"{PACKAGE}.Bench")


class RobotI(bench.Robot):  # type: ignore[name-defined,misc]
    """The servant."""

    def step(self, angles: Any, current: Current) -> Any:  # noqa: ANN401, ARG002
        """Return the same angles."""
        return angles

    def image(self, width: int, height: int, current: Current) -> bytes:  # noqa: ARG002
        """Return the pixels of an image."""
        return pixels(width, height)

    def video(self, current: Current) -> Any:  # noqa: ANN401, ARG002
        """Return an image."""
        return bench.Picture(time.monotonic_ns(), pixels(*SMALL_IMAGE))

    def follow(self, receiver: Any, current: Current) -> None:  # noqa: ANN401
        """Refuse: here one subscribes."""
        raise NotImplementedError("subscribe to the stream instead")

    def send_image(self, stamp: int, content: bytes) -> None:
        """Send an image to all that follow."""
        self.videoPublisher.publish(bench.Picture(stamp, content))


class OurClient:
    """A proxy of the servant."""

    def __init__(self, robot: Any) -> None:  # noqa: ANN401
        self._robot = robot
        self._angles = bench.Angles(*POSE)
        self.image = robot.image

    def step(self) -> object:
        """Call with four doubles there and back."""
        return self._robot.step(self._angles)

    def begin_step(self) -> Future[Any]:
        """Call without waiting."""
        future: Future[Any] = self._robot.step.begin(self._angles)
        return future

    def follow(self, take: Callable[[Any], object]) -> AbstractContextManager[object]:
        """Subscribe."""
        subscription: AbstractContextManager[object] = self._robot.video.subscribe(
            lambda sample: take(sample.value)
        )
        return subscription


@contextmanager
def serve(endpoint: str) -> Iterator[RobotI]:
    """Serve on an endpoint."""
    with initialize(realm=_REALM, listen=[endpoint], connect=[], clock="wall") as communicator:
        adapter = communicator.createObjectAdapter("Bench")
        robot = RobotI()
        adapter.add(robot, IDENTITY)
        adapter.activate()
        yield robot


@contextmanager
def connect(endpoint: str) -> Iterator[OurClient]:
    """Connect to a server."""
    with initialize(realm=_REALM, connect=[endpoint], clock="wall") as communicator:
        yield OurClient(bench.RobotPrx.checkedCast(communicator.stringToProxy(IDENTITY)))
