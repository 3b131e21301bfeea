"""Serve a robot on loopback, call it over a separate session, as another process does, and wait for it."""

from __future__ import annotations

import socket
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, closing, contextmanager
from dataclasses import dataclass
from typing import Any, Final, TypeVar
from uuid import uuid4

from naoserver.assembly import Assembly
from naoserver.options import ServerOptions
from naoserver.robot import JointReading, Robot
from naoserver.server import serve
from zenoh_ice import Communicator, ObjectPrx, initialize

LIMIT: Final = 20.0
"""Seconds within which what the contract promises must come true, unless a caller gives another limit."""
_LEASE: Final = 20.0
"""In s: server and client share one interpreter, and a busy machine must not cost them their link."""
_LOOK: Final = 0.002
"""Seconds between two looks at a robot that moves."""

P = TypeVar("P", bound=ObjectPrx)


@dataclass(frozen=True)
class ServedRobot:
    """A served robot and its endpoint."""

    robot: Robot
    assembly: Assembly
    serving: ExitStack
    """Closing it ends the server before the robot and its session."""
    served_by: Communicator
    realm: str
    endpoint: str
    limit: float
    """Seconds within which what is waited for must come true."""

    @contextmanager
    def client(self, **settings: Any) -> Iterator[RobotClient]:  # noqa: ANN401
        """Open a client's session, with further settings; it knows all that is served by now."""
        common = {"listen": ["tcp/127.0.0.1:0"], "connect": [self.endpoint], "clock": "wall", "lease": _LEASE}
        with initialize(realm=self.realm, **{**common, **settings}) as communicator:
            client = RobotClient(**{**vars(self), "communicator": communicator})
            known, served = communicator.presence.interfaces, self.served_by.served.copy()
            client.until(
                lambda: all(each.fingerprints.keys() <= known(at).keys() for at, each in served.items()),
                "a client knows what is served",
            )
            yield client

    def until(self, condition: Callable[[], object], promise: str) -> None:
        """Wait until a condition holds. Raises AssertionError with the promise that is broken otherwise."""
        deadline = time.monotonic() + self.limit
        while not condition():
            assert time.monotonic() < deadline, f"not within {self.limit:g} s: {promise}"
            time.sleep(_LOOK)

    def readings(self, done: Callable[[JointReading], object], promise: str) -> list[JointReading]:
        """Return the robot's readings from now to the first that is `done`, each once.

        Raises AssertionError with the promise that is broken if there is none within the limit.
        """
        seen = [self.robot.read()]

        def look() -> object:
            if (reading := self.robot.read()) is not seen[-1]:
                seen.append(reading)
            return done(seen[-1])

        self.until(look, promise)
        return seen

    def watched(self, seconds: float) -> list[JointReading]:
        """Return the robot's readings of some seconds of its time."""
        end = self.robot.read().time + seconds
        return self.readings(lambda reading: reading.time >= end, "the time of readings goes on")


@dataclass(frozen=True)
class RobotClient(ServedRobot):
    """A served robot, and a session that calls it."""

    communicator: Communicator

    def proxy(self, interface: type[P], identity: str) -> P:
        """Return a checked proxy over the wire."""
        return interface.checkedCast(self.communicator.stringToProxy(identity))


@contextmanager
def served(
    robot: Robot,
    options: ServerOptions | None = None,
    *,
    realm: str = "",
    endpoint: str = "",
    limit: float = LIMIT,
) -> Iterator[ServedRobot]:
    """Start and serve a robot on loopback, by default in a separate realm; close both at the end."""
    realm, endpoint = realm or f"test-{uuid4().hex[:8]}", endpoint or f"tcp/127.0.0.1:{_free_port()}"
    with (
        closing(robot),
        initialize(realm=realm, listen=[endpoint], connect=[], clock="wall", lease=_LEASE) as communicator,
    ):
        robot.start()
        adapter = communicator.createObjectAdapter("Robot")
        with ExitStack() as serving:
            assembly = serving.enter_context(serve(robot, adapter, options))
            adapter.activate()
            yield ServedRobot(robot, assembly, serving, communicator, realm, endpoint, limit)


def _free_port() -> int:
    with socket.create_server(("127.0.0.1", 0)) as free:
        port: int = free.getsockname()[1]
    return port
