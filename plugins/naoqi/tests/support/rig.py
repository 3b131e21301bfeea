"""The NAOqi services of a robot in the test's process, in virtual time and without libqi's network."""

from __future__ import annotations

import threading
from collections.abc import Callable
from pathlib import Path
from typing import Any, Final

from naoserver.fake import FakeRobot
from naoserver.options import ServerOptions
from naoserver.serving.assembly import Assembly
from tests.support.limits import EVENT_LIMIT
from tests.support.stepped_clock import SteppedClock
from visualhfsm_naoqi.programs._access import Access
from visualhfsm_naoqi.programs._behaviors import ALRobotPosture
from visualhfsm_naoqi.programs._clients import SERVER, Activity, Call, Client, running
from visualhfsm_naoqi.programs._motion import ALMotion
from zenoh_ice import VirtualClock

__all__ = ["LongCall", "Rig"]

_STEP: Final = 0.02


class LongCall:
    """An operation that runs in a thread."""

    def __init__(self, call: Call, operation: Callable[..., Any], *arguments: object) -> None:
        self.call = call
        self.result: Any = None
        self.error: Exception | None = None
        self._thread = threading.Thread(target=self._run, args=(operation, arguments), name="long call")
        self._thread.start()

    @property
    def ended(self) -> bool:
        """Whether the operation has returned or raised."""
        return not self._thread.is_alive()

    def join(self) -> None:
        """Wait for its end in wall time."""
        self._thread.join(EVENT_LIMIT)
        assert self.ended, "the call goes on"

    def _run(self, operation: Callable[..., Any], arguments: tuple[object, ...]) -> None:
        try:
            with running(self.call):
                self.result = operation(self.call, *arguments)
        except Exception as error:  # noqa: BLE001 - the test looks at it
            self.error = error


class Rig:
    """A robot in virtual time, a fake one by default, behind its guards, and ALMotion over them."""

    def __init__(
        self,
        make_robot: Callable[[SteppedClock], Any] = FakeRobot,
        clock: SteppedClock | None = None,
        options: ServerOptions | None = None,
    ) -> None:
        self.clock = clock or SteppedClock(limit=EVENT_LIMIT)
        self.robot = make_robot(self.clock)
        self.assembly = Assembly(self.robot, options or ServerOptions(), VirtualClock())
        self.access = Access(self.robot, self.assembly, Path("no disk"))
        self.postures = self.access.service(ALRobotPosture)
        self.walking = self.access.walking
        self.motion = self.access.service(ALMotion)

    def close(self) -> None:
        """End the threads."""
        self.walking.stop()
        self.robot.close()

    def advance(self, seconds: float) -> None:
        """Advance the robot time, and run the guards."""
        for _ in range(round(seconds / _STEP)):
            self.clock.advance(_STEP)
            if self.robot.control_loop is None:
                self.assembly.player.tick()
                self.assembly.paths.tick()
                if self.assembly.walk_to is not None:
                    self.assembly.walk_to.tick()
            for watched in self.assembly.watched:
                watched.watch()

    def arrive(self, operation: Callable[..., Any], *arguments: object, client: Client = SERVER) -> Call:
        """Return a call of an operation that has arrived, but that no thread has taken."""
        activities: frozenset[Activity] = getattr(operation, "begins", frozenset())
        call = Call(self.clock, client, activities, arguments)
        self.access.calls.add(call)
        return call

    def begin(self, operation: Callable[..., Any], *arguments: object, client: Client = SERVER) -> LongCall:
        """Run a long operation until it first waits for time to pass, or ends."""
        waiting = self.clock.waiting
        call = LongCall(self.arrive(operation, *arguments, client=client), operation, *arguments)
        while not call.ended and self.clock.waiting == waiting:
            threading.Event().wait(0.001)
        return call

    def complete(self, operation: Callable[..., Any], *arguments: object, limit: float = 60.0) -> float:
        """Run an operation to its end; return the robot seconds that it took.

        Raises what it raises, and AssertionError when it takes longer than `limit` robot seconds.
        """
        start = self.clock.now()
        call = self.begin(operation, *arguments)
        while not call.ended:
            assert self.clock.now() - start < limit, "the call goes on"
            self.advance(_STEP)
        call.join()
        if call.error is not None:
            raise call.error
        return self.clock.now() - start

    def positions(self, *joints: str) -> list[float]:
        """Return the angles of joints in rad."""
        reading = self.robot.read()
        return [reading.positions[self.access.body.index(joint)] for joint in joints]
