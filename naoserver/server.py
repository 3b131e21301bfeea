"""Serve a robot: its servants on an adapter, and the threads that stream and watch."""

from __future__ import annotations

from contextlib import ExitStack
from types import TracebackType
from typing import Final, Self

from naoserver.assembly import Assembly
from naoserver.jobs import JobThreads
from naoserver.options import ServerOptions
from naoserver.robot import Robot
from zenoh_ice import ObjectAdapter, WallClock


def serve(robot: Robot, adapter: ObjectAdapter, options: ServerOptions | None = None) -> RobotServer:
    """Serve a started robot on an adapter; the caller activates the adapter, and closes the robot afterwards.

    Raises RobotError when the options ask for what the robot cannot do.
    """
    return RobotServer(robot, adapter, options or ServerOptions())


class RobotServer:
    """The servants and threads that serve a robot; leaving the `with` block stops motion and ends them."""

    def __init__(self, robot: Robot, adapter: ObjectAdapter, options: ServerOptions) -> None:
        self._adapter = adapter
        self._served: list[str] = []
        self.assembly: Final = Assembly(robot, options, WallClock())
        """What stands between the robot and its clients: another way in goes through its guards too."""
        self.events: Final = self.assembly.events
        """What an operator should know, as the health report has it."""
        self._threads = JobThreads(self.assembly.jobs)
        self.assembly.on_wake = self._threads.wake
        self._start()

    def close(self) -> None:
        """Stop all motion, take the servants away and end the threads; does nothing the second time."""
        with ExitStack() as steps:  # run from the last to the first, each whatever the others raise
            steps.callback(self._threads.close)
            steps.callback(self._clients.close)
            steps.callback(self._withdraw)
            for watched in self.assembly.watched:
                steps.callback(watched.close)
            steps.callback(self._threads.stop)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def _start(self) -> None:
        self._clients = self._adapter.getCommunicator().onClientLost(self.assembly.drop_client)
        try:
            for identity, servant in self.assembly.servants.items():
                self._adapter.add(servant, identity)
                self._served.append(identity)
            self._threads.start()
        except BaseException:
            self.close()
            raise

    def _withdraw(self) -> None:
        served, self._served = self._served, []
        self._adapter.removeAll(served)
