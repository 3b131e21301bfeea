"""Record a behavior in virtual time for viewers: its automata, its robot, and the pictures that it takes.

The recording is of the kind that a watcher makes: the editor opens it, and a page can be written of it. It
only looks: a behavior that is recorded does the same, bit by bit.
"""

from __future__ import annotations

import time
from pathlib import Path
from typing import TYPE_CHECKING, Final

import msgspec

from codegen.reasons import reason
from hfsm_runtime.component import proxies_of
from hfsm_runtime.debugger.snapshot import structure_of, take_snapshot
from hfsm_runtime.observer import Observer
from hfsm_runtime.recording_file.messages import (
    Action,
    Description,
    Failing,
    Fault,
    Message,
    Picture,
    RobotPose,
    Shape,
    Snapshot,
    World,
)
from hfsm_runtime.recording_file.writer import RecordingFailedError, RecordingWriter
from hfsm_runtime.tree import Actor, ChangeKind
from interfaces.jderobot import CameraPrx
from naoserver.body import write_body
from visualhfsm._base.errors import VisualHfsmError
from visualhfsm._monitor.realm.pictures import encode_jpeg

if TYPE_CHECKING:
    from naoserver.bodies.capabilities import Pose, WorldShape
    from naoserver.bodies.parts import CameraFacts
    from visualhfsm.simulation import Behavior

_DIGITS: Final = 4
_PICTURE_PERIOD: Final = 0.45
"""s between two pictures of a camera that are kept."""
_CAMERA: Final = ".getImageData"
_COLORS: Final = "RGB8"
_LOOK_PERIOD: Final = 0.01
"""Wall seconds between looks at whether the file has caught up."""


class BehaviorRecording(Observer):
    """A recording of a behavior; call `look` as its time passes, and `close` at the end.

    Raises VisualHfsmError when the file exists, or cannot be written.
    """

    def __init__(self, behavior: Behavior, path: Path) -> None:
        self._behavior = behavior
        self._start = time.time()
        text = behavior.document.read_text(encoding="utf-8") if behavior.document else ""
        try:
            self._writer = RecordingWriter.watching(path, behavior.name, text)
        except RecordingFailedError as error:
            raise VisualHfsmError(reason(error)) from error
        self._calls = 0
        self._pictured: dict[str, float] = {}
        self._looks_through: list[CameraFacts] = []
        """The cameras whose pictures are taken here: those of a behavior are its own, or a camera that fails
        would keep another picture for it."""
        self._failing: tuple[Fault, ...] = ()
        self._changed = False
        self._put("/actions", Action("structure", msgspec.to_builtins(structure_of(behavior))))
        if behavior.has_robot:
            device = behavior.robot.device
            self._put("/description", Description.of(write_body(device.body), device.looks()))
            self._looks_through = [] if _takes_pictures(behavior) else [*device.body.cameras]
            if device.stage is not None:
                self._put("/world", World([_shape(each) for each in device.stage.shapes]))
        behavior.tree.observers.append(self)
        self.write()

    def changed(self, now: int, run: Actor, kind: ChangeKind) -> None:  # noqa: ARG002
        """Note that a change is to be shown."""
        self._changed = True

    def cycle_ended(self, run: Actor, at: int) -> None:  # noqa: ARG002
        """Show a change once its cycle has ended."""
        if self._changed:
            self._changed = False
            self._show()

    def write(self) -> None:
        """Write down how everything is now, and the pictures since the last time."""
        self._show()
        calls = self._behavior.calls()
        for call in calls[self._calls :]:
            camera = call.target.removesuffix(_CAMERA)
            due = call.time - self._pictured.get(camera, -_PICTURE_PERIOD) >= _PICTURE_PERIOD
            if camera != call.target and due and call.error is None:
                shape = call.result.description
                if call.arguments.get("format") == _COLORS:
                    pixels = call.result.pixelData
                    self._picture(camera, call.time, shape.width, shape.height, pixels)
        self._calls = len(calls)
        for facts in self._looks_through:
            if self._behavior.time - self._pictured.get(facts.name, -_PICTURE_PERIOD) >= _PICTURE_PERIOD:
                frame = self._behavior.robot.look(facts.name, *facts.sizes[0])
                self._picture(facts.name, self._behavior.time, frame.width, frame.height, bytes(frame.pixels))
        while self._writer.crowded:  # virtual time waits for the disk
            time.sleep(_LOOK_PERIOD)

    def close(self) -> None:
        """End the file."""
        self._show()
        self._writer.close()

    def _show(self) -> None:
        behavior = self._behavior
        if behavior.has_robot:
            joints = {name: round(angle, _DIGITS) for name, angle in behavior.robot.joints.items()}
            stage = behavior.robot.device.stage
            truth = None if stage is None else stage.truth()
            torso = None if truth is None else _place(truth.torso)
            objects = {} if truth is None else {name: _place(at) for name, at in truth.objects.items()}
            self._put("/robot", RobotPose(joints, torso, objects))
            self._note_failures()
        self._put("/snapshots", Snapshot.of(take_snapshot(behavior, self._start)))

    def _picture(self, camera: str, taken: float, width: int, height: int, pixels: bytes) -> None:
        self._pictured[camera] = taken
        at = self._start + taken
        jpeg = encode_jpeg(width, height, pixels)
        self._writer.show(f"/images/{camera}", Picture.of(camera, round(at * 1e9), jpeg), at)

    def _note_failures(self) -> None:
        faults = self._behavior.robot.device.faults
        failing = {} if faults is None else faults.current()
        found = tuple(Fault(it.part, it.kind, it.amount) for it in failing.values())
        if found != self._failing:
            self._failing = found
            self._put("/faults", Failing(found))

    def _put(self, topic: str, message: Message) -> None:
        self._writer.show(topic, message, self._start + self._behavior.time)


def _takes_pictures(behavior: Behavior) -> bool:
    return any(issubclass(each.type, CameraPrx) for each in proxies_of(behavior.component).values())


def _place(pose: Pose) -> list[float]:
    w, x, y, z = pose.orientation
    return [round(value, _DIGITS) for value in (*pose.position, x, y, z, w)]


def _shape(shape: WorldShape) -> Shape:
    return Shape(
        shape.object, shape.kind.lower(), [*shape.size], _place(shape.pose), [*shape.color], shape.opacity
    )
