"""Serve a robot in the test's process, and call it over a separate session, like another process."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, closing, contextmanager
from dataclasses import dataclass
from typing import Any, Final, TypeVar
from uuid import uuid4

from naoserver.assembly import Assembly
from naoserver.options import ServerOptions
from naoserver.robot import Robot
from naoserver.server import serve
from tests.support.limits import CALL_LIMIT, MOVE_LIMIT
from tests.support.processes import free_endpoint
from tests.support.waiting import until
from zenoh_ice import Communicator, ObjectPrx, RobotClock, initialize
from zenoh_ice.proxy import StreamedCall

HASTE: Final = CALL_LIMIT / 8.0
"""Limit in s of the calls of a client that asks for what is not served: it waits for a tenth of it."""

P = TypeVar("P", bound=ObjectPrx)
V = TypeVar("V")


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

    @contextmanager
    def client(self, **settings: Any) -> Iterator[RobotClient]:
        """Open a client's session, with further settings; it knows all that is served by now."""
        with initialize(
            realm=self.realm,
            listen=["tcp/127.0.0.1:0"],
            connect=[self.endpoint],
            clock="wall",
            lease=CALL_LIMIT,
            **settings,
        ) as communicator:
            known = communicator.presence.interfaces
            eventually(  # on a busy machine word of them takes longer
                lambda: all(
                    servant.fingerprints.keys() <= known(target).keys()
                    for target, servant in self.served_by.served.copy().items()
                )
            )
            yield RobotClient(
                self.robot,
                self.assembly,
                self.serving,
                self.served_by,
                self.realm,
                self.endpoint,
                communicator,
            )


@dataclass(frozen=True)
class RobotClient(ServedRobot):
    """A served robot, and a session that calls it."""

    communicator: Communicator

    def proxy(self, interface: type[P], identity: str) -> P:
        """Return a checked proxy over the wire."""
        return interface.checkedCast(self.communicator.stringToProxy(identity))


@contextmanager
def served(
    robot: Robot, options: ServerOptions | None = None, *, realm: str = "", endpoint: str = ""
) -> Iterator[ServedRobot]:
    """Start and serve a robot on loopback, by default in a separate realm; close both at the end."""
    realm, endpoint = realm or f"test-{uuid4().hex[:8]}", endpoint or free_endpoint()
    with (
        closing(robot),
        # Its threads share one interpreter with its clients: a busy machine must not cost them the link.
        initialize(
            realm=realm, listen=[endpoint], connect=[], clock="wall", lease=CALL_LIMIT
        ) as communicator,
    ):
        robot.start()
        adapter = communicator.createObjectAdapter("Robot")
        with ExitStack() as serving:
            assembly = serving.enter_context(serve(robot, adapter, options))
            adapter.activate()
            yield ServedRobot(robot, assembly, serving, communicator, realm, endpoint)


@contextmanager
def served_to_client(
    robot: Robot, options: ServerOptions | None = None, **settings: Any
) -> Iterator[RobotClient]:
    """Serve a robot, and open a session that calls it, with further settings."""
    with served(robot, options) as server, server.client(**settings) as client:
        yield client


def clock_at(speed: float) -> RobotClock:
    """Return a clock that runs faster than the wall's."""
    return RobotClock(0.0, speed, simulated=False, silence=math.inf)


def eventually(condition: Callable[[], object], limit: float = MOVE_LIMIT) -> None:
    """Wait until a condition holds, as long as a robot may move; raise AssertionError after `limit` s."""
    until(condition, limit)


def wait_for(stream: StreamedCall[..., V], condition: Callable[[V], bool]) -> V:
    """Return the first value of a stream that meets a condition; raise AssertionError after the limit."""
    deadline = time.monotonic() + MOVE_LIMIT
    value: V | None = None
    for sample in stream.samples(timeout=MOVE_LIMIT):
        value = sample.value
        if condition(value):
            return value
        if time.monotonic() > deadline:
            break
    raise AssertionError(f"not met in time; the last is {value}")
