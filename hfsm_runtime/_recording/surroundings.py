"""Record the robot, its poses, those of the things around it, and what was made to fail, for viewers.

They are not inputs of the component, and a replay skips them: the component's own calls are recorded apart.
"""

from __future__ import annotations

import contextlib
import math
import threading
from collections.abc import Iterator
from functools import partial
from itertools import chain
from typing import Final

from hfsm_runtime.recording_file.messages import (
    Description,
    Failing,
    Fault,
    RobotPose,
    Shape,
    World,
    values_of,
)
from interfaces.nao import DescriptionPrx, FaultsPrx, FaultState, GroundTruthPrx, JointsPrx, Pose, ScenePrx
from zenoh_ice import Communicator, Sample, ZenohIceError

from ..component import Component, proxies_of
from .recorder import Recorder

_POSE_PERIOD: Final = 0.1
"""Wall seconds between two poses."""
_OLDEST_SAMPLE: Final = 1.0
"""Wall seconds after which a sample is out of date."""
_RETRY_PERIOD: Final = 20
"""Poses after which a call that failed is repeated."""
_CALL_LIMIT: Final = 1000
"""Wall milliseconds for the answer to a call."""
_JOIN_LIMIT: Final = 5.0
_MOST_SHAPES: Final = 1000
_QUEUE: Final = 100
"""Changes of what fails that wait to be recorded."""
_DIGITS: Final = 4


@contextlib.contextmanager
def recorded_failures(
    communicator: Communicator, recorder: Recorder, component: type[Component]
) -> Iterator[None]:
    """Record what is made to fail of the robots that a component uses, in a `with` block."""
    home, failures = communicator.realm, _Failures(recorder)
    uses = (communicator.stringToProxy(each.identity) for each in proxies_of(component).values())
    with contextlib.ExitStack() as stack:
        for realm in {home, *(proxy.ice_getRealm() for proxy in uses)}:
            behind = "" if realm == home else f"@{realm}"
            faults = FaultsPrx.uncheckedCast(communicator.stringToProxy(f"Faults@{realm}"))
            stack.enter_context(faults.getFaults.subscribe(partial(failures.record, behind), queue=_QUEUE))
        yield


class _Failures:
    def __init__(self, recorder: Recorder) -> None:
        self._recorder = recorder
        self._lock = threading.Lock()  # each robot has a thread
        self._present: dict[str, tuple[Fault, ...]] = {}

    def record(self, behind: str, sample: Sample[FaultState]) -> None:
        """Record what fails of a robot, with this behind the names of its parts, if that has changed."""
        found = tuple(Fault(f"{it.part}{behind}", it.kind, it.amount) for it in sample.value.faults)
        with self._lock:
            if found != self._present.get(behind, ()):
                self._present[behind] = found
                self._recorder.put("/faults", Failing(tuple(chain.from_iterable(self._present.values()))))


@contextlib.contextmanager
def recorded_surroundings(communicator: Communicator, recorder: Recorder) -> Iterator[None]:
    """Record poses ten times a second, as far as the robot reports them, in a `with` block."""
    stopping = threading.Event()
    surroundings = _Surroundings(communicator, recorder)

    def watch() -> None:
        while not stopping.wait(_POSE_PERIOD):
            with contextlib.suppress(ZenohIceError):  # the robot comes or goes, or has another interface
                surroundings.record()

    thread = threading.Thread(target=watch, name="recording of the robot", daemon=True)
    thread.start()
    try:
        yield
    finally:
        stopping.set()
        thread.join(_JOIN_LIMIT)


class _Surroundings:
    def __init__(self, communicator: Communicator, recorder: Recorder) -> None:
        proxy = communicator.stringToProxy
        self._communicator = communicator
        self._recorder = recorder
        self._body = JointsPrx.uncheckedCast(proxy("Body")).ice_invocationTimeout(_CALL_LIMIT)
        self._truth = GroundTruthPrx.uncheckedCast(proxy("GroundTruth"))
        self._scene = ScenePrx.uncheckedCast(proxy("Scene")).ice_invocationTimeout(_CALL_LIMIT)
        self._described = DescriptionPrx.uncheckedCast(proxy("Description")).ice_invocationTimeout(
            _CALL_LIMIT
        )
        self._names: list[str] | None = None
        self._has_world = self._has_robot = False
        self._rounds = 0
        self._before: RobotPose | None = None

    def record(self) -> None:
        """Record the current pose if it has changed. Raises ZenohIceError."""
        present = self._communicator.identities()
        self._rounds += 1
        if self._rounds % _RETRY_PERIOD == 1:
            if "Body" in present and self._names is None:
                self._names = self._body.getJointNames()
            if "Description" in present and not self._has_robot:
                description = Description.of(self._described.getBody(), self._described.getLooks())
                self._has_robot = True
                self._recorder.put(
                    "/description", description, len(description.body) + len(description.looks)
                )
            if "Scene" in present and not self._has_world:
                found = [*map(Shape.of, self._scene.getShapes()[:_MOST_SHAPES])]
                self._has_world = True
                self._recorder.put("/world", World(found), 200 * len(found))
        state = self._body.getJointState.latest() if "Body" in present else None
        truth = self._truth.getGroundTruth.latest() if "GroundTruth" in present else None
        joints: dict[str, float] = {}
        if state is not None and state.age <= _OLDEST_SAMPLE and self._names is not None:
            pairs = zip(self._names, state.value.positions, strict=False)
            joints = {name: round(angle, _DIGITS) for name, angle in pairs if math.isfinite(angle)}
        pose = RobotPose(joints)
        if truth is not None and truth.age <= _OLDEST_SAMPLE:
            objects = {name: _values(at) for name, at in truth.value.objects.items()}
            pose = RobotPose(joints, _values(truth.value.torso), objects)
        if pose != (self._before or RobotPose({})):
            self._before = pose
            self._recorder.put("/robot", pose, 2000)


def _values(pose: Pose) -> list[float]:
    return [round(value, _DIGITS) for value in values_of(pose)]
