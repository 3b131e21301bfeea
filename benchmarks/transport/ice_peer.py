"""The peer for comparison: Ice 3.7, configured as by its users."""

from __future__ import annotations

import importlib
import time
from collections.abc import Callable, Iterator
from concurrent.futures import Future
from contextlib import contextmanager
from typing import Any, Final

from .peers import IDENTITY, POSE, SLICE, SMALL_IMAGE, pixels

_PROPERTIES: Final = {
    "Ice.MessageSizeMax": "0",  # the default of 1 MB is too small for the images
    "Ice.ThreadPool.Server.Size": "1",  # the fastest for small calls
    "Ice.Warn.Connections": "0",
}

Ice: Final = importlib.import_module("Ice")
Ice.loadSlice(f"--all -I{SLICE.parent} {SLICE}")
bench: Final = importlib.import_module("Bench")


class RobotI(bench.Robot):  # type: ignore[name-defined,misc]
    """A servant that sends oneway calls to the sinks of its followers."""

    def __init__(self) -> None:
        self._sinks: list[Any] = []

    def step(self, angles: Any, current: Any) -> Any:  # noqa: ANN401, ARG002
        """Return the same angles."""
        return angles

    def image(self, width: int, height: int, current: Any) -> bytes:  # noqa: ANN401, ARG002
        """Return the pixels of an image."""
        return pixels(width, height)

    def video(self, current: Any) -> Any:  # noqa: ANN401, ARG002
        """Return an image."""
        return bench.Picture(time.monotonic_ns(), pixels(*SMALL_IMAGE))

    def follow(self, receiver: Any, current: Any) -> None:  # noqa: ANN401, ARG002
        """Push images to a sink from now on."""
        self._sinks.append(bench.SinkPrx.uncheckedCast(receiver.ice_oneway()))

    def send_image(self, stamp: int, content: bytes) -> None:
        """Push an image to all that follow."""
        for sink in self._sinks:
            sink.take(bench.Picture(stamp, content))


class IceClient:
    """A proxy of the servant, and a sink."""

    def __init__(self, robot: Any, adapter: Any) -> None:  # noqa: ANN401
        self._robot = robot
        self._adapter = adapter
        self._angles = bench.Angles(*POSE)
        self.image = robot.image

    def step(self) -> object:
        """Call with four doubles there and back."""
        return self._robot.step(self._angles)

    def begin_step(self) -> Future[Any]:
        """Call without waiting; Ice's future is like Python's."""
        future: Future[Any] = self._robot.stepAsync(self._angles)
        return future

    @contextmanager
    def follow(self, take: Callable[[Any], object]) -> Iterator[None]:
        """Register a sink at the server."""

        class SinkI(bench.Sink):  # type: ignore[name-defined,misc]
            def take(self, image: Any, current: Any) -> None:  # noqa: ANN401, ARG002
                take(image)

        proxy = self._adapter.addWithUUID(SinkI())
        self._robot.follow(bench.SinkPrx.uncheckedCast(proxy))
        yield


@contextmanager
def serve(endpoint: str) -> Iterator[RobotI]:
    """Serve on an endpoint."""
    with Ice.initialize(_properties()) as communicator:
        adapter = communicator.createObjectAdapterWithEndpoints("Bench", _endpoint(endpoint))
        robot = RobotI()
        adapter.add(robot, Ice.stringToIdentity(IDENTITY))
        adapter.activate()
        yield robot


@contextmanager
def connect(endpoint: str) -> Iterator[IceClient]:
    """Connect to a server."""
    with Ice.initialize(_properties()) as communicator:
        robot = bench.RobotPrx.checkedCast(communicator.stringToProxy(f"{IDENTITY}:{_endpoint(endpoint)}"))
        adapter = communicator.createObjectAdapterWithEndpoints("Sinks", "tcp -h 127.0.0.1")
        adapter.activate()
        yield IceClient(robot, adapter)


def _properties() -> Any:  # noqa: ANN401
    data = Ice.InitializationData()
    data.properties = Ice.createProperties()
    for name, value in _PROPERTIES.items():
        data.properties.setProperty(name, value)
    return data


def _endpoint(endpoint: str) -> str:
    host, port = endpoint.removeprefix("tcp/").split(":")
    return f"tcp -h {host} -p {port}"
