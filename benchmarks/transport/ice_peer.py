"""The peer for comparison: Ice 3.7, configured as by its users."""

from __future__ import annotations

import threading
import time
from collections.abc import Iterator
from concurrent.futures import Future
from contextlib import contextmanager
from typing import Any, Final

from .content import JOINTS, POSE, SMALL_IMAGE, frame
from .interface import IDENTITY, load_ice
from .peers import Got

_PROPERTIES: Final = {
    "Ice.MessageSizeMax": "0",  # the default of 1 MB is too small for the images
    "Ice.ThreadPool.Server.Size": "1",  # the fastest for small calls
    "Ice.Warn.Connections": "0",
}


class IceServer:
    """A servant that sends oneway calls to the sinks of its followers."""

    def __init__(self, bench: Any) -> None:  # noqa: ANN401
        self._bench = bench
        self._lock = threading.Lock()
        self._sinks: tuple[Any, ...] = ()

    def add(self, sink: Any) -> None:  # noqa: ANN401
        """Add a sink."""
        with self._lock:
            self._sinks += (sink,)

    def send(self, stream: str, stamp: int, number: int, content: Any) -> None:  # noqa: ANN401
        """Push a value; a lost sink is removed."""
        joints = stream == "joints"
        value = (
            self._bench.JointState(stamp, number, content)
            if joints
            else self._bench.Picture(stamp, number, content.tobytes())
        )
        for sink in self._sinks:
            try:
                (sink.takeJoints if joints else sink.takePicture)(value)
            except Exception:  # noqa: BLE001 - Ice's, which is not imported here
                with self._lock:
                    self._sinks = tuple(other for other in self._sinks if other is not sink)


class IceClient:
    """A proxy of the servant, and a sink."""

    def __init__(self, bench: Any, robot: Any, adapter: Any) -> None:  # noqa: ANN401
        self._bench = bench
        self._robot = robot
        self._adapter = adapter
        self._angles = bench.Angles(*POSE)
        self.image = robot.image
        self.joints = robot.joints

    def step(self) -> object:
        """Call with four doubles there and back."""
        return self._robot.step(self._angles)

    def stepAsync(self) -> Future[Any]:
        """Call without waiting; Ice's future is like Python's."""
        future: Future[Any] = self._robot.stepAsync(self._angles)
        return future

    def latest(self) -> object:
        """Call, since Ice does not keep the newest value."""
        return self._robot.joints()

    @contextmanager
    def follow(self, stream: str, got: Got) -> Iterator[object]:
        """Register a sink at the server."""

        class SinkI(self._bench.Sink):  # type: ignore[misc,name-defined]
            def takeJoints(self, state: Any, current: Any) -> None:  # noqa: ANN401, ARG002
                if stream == "joints":
                    got(state)

            def takePicture(self, image: Any, current: Any) -> None:  # noqa: ANN401, ARG002
                if stream == "video":
                    got(image)

        proxy = self._adapter.addWithUUID(SinkI())
        self._robot.follow(self._bench.SinkPrx.uncheckedCast(proxy))
        try:
            yield None
        finally:
            self._adapter.remove(proxy.ice_getIdentity())


@contextmanager
def serve(endpoint: str) -> Iterator[IceServer]:
    """Serve on an endpoint."""
    bench, ice = load_ice()
    server = IceServer(bench)

    class RobotI(bench.Robot):  # type: ignore[misc,name-defined]
        def step(self, angles: Any, current: Any) -> Any:  # noqa: ANN401, ARG002
            return angles

        def image(self, width: int, height: int, current: Any) -> bytes:  # noqa: ANN401, ARG002
            pixels: bytes = frame(width, height).tobytes()
            return pixels

        def joints(self, current: Any) -> Any:  # noqa: ANN401, ARG002
            return bench.JointState(time.monotonic_ns(), 0, list(JOINTS))

        def video(self, current: Any) -> Any:  # noqa: ANN401, ARG002
            return bench.Picture(time.monotonic_ns(), 0, frame(*SMALL_IMAGE).tobytes())

        def follow(self, receiver: Any, current: Any) -> None:  # noqa: ANN401, ARG002
            server.add(bench.SinkPrx.uncheckedCast(receiver.ice_oneway()))

    with ice.initialize(_properties(ice)) as communicator:
        adapter = communicator.createObjectAdapterWithEndpoints("Bench", _endpoint(endpoint))
        adapter.add(RobotI(), ice.stringToIdentity(IDENTITY))
        adapter.activate()
        yield server


@contextmanager
def connect(endpoint: str) -> Iterator[IceClient]:
    """Connect to a server."""
    bench, ice = load_ice()
    with ice.initialize(_properties(ice)) as communicator:
        robot = bench.RobotPrx.checkedCast(communicator.stringToProxy(f"{IDENTITY}:{_endpoint(endpoint)}"))
        adapter = communicator.createObjectAdapterWithEndpoints("Sinks", "tcp -h 127.0.0.1")
        adapter.activate()
        yield IceClient(bench, robot, adapter)


def _properties(ice: Any) -> Any:  # noqa: ANN401
    data = ice.InitializationData()
    data.properties = ice.createProperties()
    for name, value in _PROPERTIES.items():
        data.properties.setProperty(name, value)
    return data


def _endpoint(endpoint: str) -> str:
    host, port = endpoint.removeprefix("tcp/").split(":")
    return f"tcp -h {host} -p {port}"
