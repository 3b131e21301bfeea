"""Try a component without a robot: `python -m visualhfsm.testing.trial COMPONENT [OPTIONS OF THE COMPONENT]`.

This is *Try it* of the editor. A fake robot with its real servants, and stand-ins for all other interfaces,
are served within the process and cannot be reached from outside; the monitor is served in the realm, as
always. A trial has its own time: its speed can be changed, a pause stops it, and each step advances it by a
period.
"""

from __future__ import annotations

import logging
import math
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, closing, contextmanager
from functools import partial
from pathlib import Path
from typing import Any, Final, NoReturn

from hfsm_runtime.command import World, make_app
from hfsm_runtime.component import Component, proxies_of, ros_of
from hfsm_runtime.debugger.reload import components_in
from hfsm_runtime.ending import report_abrupt_ends
from hfsm_runtime.errors import ComponentError, ValueTypeError
from hfsm_runtime.loading import load_module
from hfsm_runtime.robot import connect
from hfsm_runtime.runtime import Runtime
from hfsm_runtime.timeline import Timeline
from hfsm_runtime.virtual.blank import blank
from hfsm_runtime.virtual.stubs import make_stub
from naoserver.fake import FakeRobot
from naoserver.jobs import Job, JobThreads, Periodic
from naoserver.server import serve
from zenoh_ice import Clock, Communicator, ObjectAdapter, ObjectPrx, Publisher, RobotClock, Settings
from zenoh_ice.application.cli import run
from zenoh_ice.in_process import InProcessTransport
from zenoh_ice.interface import Interface

_FASTEST: Final = 100.0
_LOOK: Final = 0.01  # s between two checks of a condition
_PERIOD: Final = 0.1  # s of the trial's time between samples of the stand-ins' streams

_logger = logging.getLogger(__name__)


class Trial(Runtime):
    """A component in a trial: its time can be made faster and slower."""

    timeline: _TrialTimeline

    def __init__(self, *arguments: Any, robot: FakeRobot, **options: Any) -> None:  # noqa: ANN401 - of Runtime
        super().__init__(*arguments, **options)
        self.speed = self.timeline.speed
        names = [joint.name for joint in robot.joints]
        self.joints = lambda: dict(zip(names, robot.read().positions, strict=True))

    def set_speed(self, speed: float) -> None:
        """Set the speed of time, in s per wall second. Raises ValueTypeError for an invalid speed."""
        if not (math.isfinite(speed) and 0.0 < speed <= _FASTEST):
            raise ValueTypeError(f"the speed is more than 0 and at most {_FASTEST:g}, not {speed:g}")
        with self.tree.lock:
            self.speed = speed
            self.timeline.set_speed(speed)

    def _make_timeline(self, clock: Clock) -> Timeline:
        assert isinstance(clock, RobotClock)
        return _TrialTimeline(clock)


class _TrialTimeline(Timeline):
    """Component time that also drives the robot and the stand-ins: in a pause they stand still, too."""

    def __init__(self, clock: RobotClock) -> None:
        super().__init__(clock)
        self._robot_clock = clock
        self.speed = clock.rate

    def set_speed(self, speed: float) -> None:
        """Change the speed of time; in a pause, the change takes effect at its end."""
        self.speed = speed
        if not self.paused:
            self._run(speed)

    def pause(self) -> None:
        """Let time stand still."""
        super().pause()
        self._run(0.0)

    def resume(self) -> None:
        """Let time continue."""
        self._run(self.speed)
        super().resume()

    def step(self, duration: int) -> None:
        """Move time forward by a duration in ns while it stands still."""
        super().step(duration)
        self._run(0.0, duration / 1e9)

    def _run(self, rate: float, ahead: float = 0.0) -> None:
        self._robot_clock.update(self._robot_clock.now() + ahead, rate, simulated=True)


@contextmanager
def trial() -> Iterator[World]:
    """Serve the fake robot, and stand-ins for what it does not serve, within a `with` block."""
    clock = RobotClock(0.0, 1.0, simulated=True, silence=math.inf)
    with ExitStack() as stack:
        network = stack.enter_context(Communicator(Settings(), transport=InProcessTransport, clock=clock))
        adapter = network.createObjectAdapter("trial")
        adapter.activate()
        robot = stack.enter_context(closing(FakeRobot(clock)))
        stack.enter_context(serve(robot, adapter, wall=clock))
        yield World(network, partial(_connect, adapter=adapter, stack=stack), partial(Trial, robot=robot))


def _connect(component: Component, adapter: ObjectAdapter, stack: ExitStack) -> None:
    """Connect a component's proxies; where a servant is missing or has another interface, to a stand-in."""
    network = adapter.getCommunicator()
    stand_ins = _StandIns(adapter)
    if ros_of(component):
        _connect_ros(component, network.clock)
    for name, declared in proxies_of(component).items():
        served = adapter.find(declared.identity)
        if served is None or declared.type.ice_interface not in served.ice_interface.lineage:
            stand_ins.serve(declared.identity, declared.type.ice_interface)
            _logger.warning("self.%s is a stand-in, which answers with zeros and empty texts", name)
    if stand_ins.jobs:
        stack.enter_context(JobThreads(stand_ins.jobs))
    connect(component, network)


def _connect_ros(component: Component, clock: Clock) -> None:
    """Give a component a ROS in which nobody publishes, services answer with zeros and goals succeed."""
    from hfsm_runtime.ros import Endpoints  # only components that use ROS need its libraries
    from hfsm_runtime.virtual.ros import FakeRos

    ros = FakeRos(clock.now, _wait, stand_ins=True)
    Endpoints(ros, ros.types).connect(component)
    for name in ros_of(component):
        _logger.warning("self.%s is a stand-in for ROS", name)


def _wait(holds: Callable[[], bool], timeout: float) -> bool:
    """Wait in wall time, because the trial's time may stand still."""
    end = time.monotonic() + timeout
    while not holds():
        if time.monotonic() >= end:
            return False
        time.sleep(_LOOK)
    return True


class _StandIns:
    """Serves servants that accept every call and return blank values."""

    def __init__(self, adapter: ObjectAdapter) -> None:
        self._adapter: Final = adapter
        self._returned: Final[set[Interface]] = set()
        """Interfaces that have a stand-in because an operation returns a proxy of it."""
        self.jobs: Final[list[Job]] = []
        """The jobs of their streams."""

    def serve(self, identity: str, interface: Interface) -> None:
        """Serve a stand-in, in place of any earlier servant with this identity."""
        operations = interface.all_operations
        answers: dict[str, object] = {}
        for name, operation in operations.items():
            values = blank(operation.result.struct, self._proxy)
            answers[name] = values[0] if len(values) == 1 else values or None
        servant, _ = make_stub(identity, interface, answers)
        self._adapter.removeAll([identity])
        self._adapter.add(servant, identity)
        clock = self._adapter.getCommunicator().clock
        for name, operation in operations.items():
            if operation.streamed:
                self.jobs.append(_publishing(servant.ice_publisher(operation), answers[name], clock))

    def _proxy(self, kind: type[ObjectPrx]) -> ObjectPrx:
        """Return a proxy of another stand-in, which is named like its type."""
        interface = kind.ice_interface
        identity = interface.type_id.removeprefix("::").replace("::", ".")
        if interface not in self._returned:
            self._returned.add(interface)  # first: its operations may return proxies of it
            self.serve(identity, interface)
        return kind.uncheckedCast(self._adapter.getCommunicator().stringToProxy(identity))


def _publishing(publisher: Publisher[Any], value: object, clock: Clock) -> Job:
    return Periodic(
        publisher.operation.name,
        clock,
        lambda: _PERIOD,
        lambda: publisher.publish(value, clock.now()),
        thread="stand-ins",
        wanted=lambda: publisher.listening,
    )


def main() -> NoReturn:
    """Run the component of a file with the component's command line."""
    if len(sys.argv) < 2:
        sys.exit("usage: python -m visualhfsm.testing.trial COMPONENT [OPTIONS OF THE COMPONENT]")
    file = Path(sys.argv[1]).resolve()
    sys.argv[:2] = [str(file)]
    sys.path.insert(0, str(file.parent))  # for handwritten code beside it
    report_abrupt_ends(str(file))
    try:
        found = components_in(load_module(file.stem, file))
    except ComponentError as error:
        sys.exit(f"{file.name}: error: {error}")
    if len(found) != 1:
        sys.exit(f"{file.name} defines {len(found)} components, not one")
    run(make_app(found[0], trial), expected=(ComponentError,))


if __name__ == "__main__":
    main()
