"""Open the recording of a run for the timeline: it has the snapshots of a component that is followed."""

from __future__ import annotations

import bisect
import math
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import msgspec
from msgspec.structs import replace

from codegen.hfsm.document import Document
from codegen.messages import NO_MESSAGE, Message
from codegen.reasons import reason
from hfsm_runtime.recording_file import messages as recorded
from hfsm_runtime.recording_file.reader import ImageHash, RawMessage, RecordingError, RecordingFile, decode
from interfaces.hfsm import ComponentSnapshot, ComponentStructure
from visualhfsm._base.errors import VisualHfsmError
from visualhfsm._document.serialization import parse
from visualhfsm._monitor.realm.description import DescribedRobot, describe, nao
from visualhfsm._monitor.realm.faults import sound_faults
from visualhfsm._monitor.realm.pictures import OLDEST, encode_jpeg, evenly, require_pillow
from visualhfsm._monitor.realm.robot import LONGEST_NAME, LONGEST_TEXT, RobotState
from visualhfsm._monitor.realm.run_log import LiveSnapshot, RunLog, is_sound
from visualhfsm._monitor.realm.world import sound_objects, sound_placement, sound_shapes
from visualhfsm._monitor.run_page import MOST_PICTURES, ExportedRun
from zenoh_ice.data import typed
from zenoh_ice.data.text import printable

_MOST_STEPS: Final = 600_000
"""The part of a recording that is read: some two hours of a behavior with four automata, in some 12 s.

A message is one step, and another one for each 8 kB; a moment has one for each automaton.
"""
_LONGEST_TEXT: Final = 120
_MOST_AUTOMATA: Final = 10_000
_MOST_JOINTS: Final = 100
_MOST_IMAGES: Final = 500_000
_JPEG: Final = b"\xff\xd8"
_decode_snapshot: Final = typed.json_decoder(ComponentSnapshot)


@dataclass(frozen=True)
class RecordedRun:
    """A run that was recorded; `document` is the text of its document, empty when the recording lacks it.

    `shortened` says until when it was read if it is too long to be read to its end. `world` are the shapes
    that a simulation showed, and `pictures` what the component saw. `described` is the robot, or the Nao if
    none is.
    """

    name: str
    structure: ComponentStructure
    log: RunLog
    document: str
    shortened: Message
    world: Sequence[recorded.Shape]
    pictures: RecordedPictures
    described: DescribedRobot

    def exported(self, document: Document | None, imported: Sequence[Mapping[str, Any]] = ()) -> ExportedRun:
        """Return the run to export, with the document that it shows. Raises VisualHfsmError."""
        pictures = self.pictures.spread(MOST_PICTURES)
        return ExportedRun(
            self.name, self.structure, self.log, document, imported, self.world, pictures, self.shortened,
            body=self.described.page,
        )  # fmt: skip


class RecordedPictures:
    """The images of a recording, by camera and wall time; they stay in the file."""

    def __init__(self, file: RecordingFile) -> None:
        self._file = file
        self._places: dict[str, list[tuple[float, str, int, bool]]] = {}
        try:
            identities = typed.from_json(file.metadata.get("proxies", "{}"), dict[str, str])
        except msgspec.MsgspecError:
            identities = {}
        self._identities = identities

    @property
    def cameras(self) -> list[str]:
        """The identities of the cameras."""
        return sorted(self._places)

    def spread(self, most: int) -> dict[str, list[tuple[float, bytes]]]:
        """Return at most `most` pictures as JPEG by camera, each with its wall time, evenly over time."""
        found = {}
        for camera, places in self._places.items():
            times = [place[0] for place in evenly(places, most // len(self._places))]
            found[camera] = [(time, jpeg) for time in times if (jpeg := self.at(camera, time)) is not None]
        return found

    def add(self, message: RawMessage) -> None:
        """Remember the place of an image in the file. Raises RecordingError when it has no hash."""
        attribute = message.topic.rpartition("/")[2]
        camera = self._identities.get(attribute, attribute)[:_LONGEST_TEXT]
        places = self._places.setdefault(camera, [])
        if len(places) < _MOST_IMAGES:
            found = message.time / 1e9, decode(message, ImageHash).hash, message.place
            places.append((*found, message.kind is recorded.Picture))

    def at(self, camera: str, at: float) -> bytes | None:
        """Return the last image of a camera up to a wall time as JPEG; None if there is none from about then.

        Raises VisualHfsmError when it is malformed, and MissingPackageError without Pillow.
        """
        places = self._places.get(camera, [])
        found = bisect.bisect_right(places, at, key=lambda place: place[0]) - 1
        if found < 0 or at - places[found][0] > OLDEST:
            return None
        _, wanted, place, is_compressed = places[found]
        try:
            if is_compressed:
                picture = self._file.image_at(place, wanted, recorded.Picture)
                return picture.data if picture is not None and picture.data.startswith(_JPEG) else None
            require_pillow()
            image = self._file.image_at(place, wanted, recorded.Image)
        except (OSError, msgspec.MsgspecError, RecordingError, ValueError) as error:
            raise VisualHfsmError.because(
                "an image of the recording cannot be read: {reason}", reason=reason(error)
            ) from error
        if image is None or image.encoding != "rgb8":
            return None
        return encode_jpeg(image.width, image.height, image.data)


def recorded_run(path: Path) -> ExportedRun:
    """Return the run of a recording to export, with its document. Raises VisualHfsmError."""
    recorded = open_recording(path)
    what = Message("{recording}: the document cannot be read", recording=str(path))
    return recorded.exported(parse(recorded.document, what) if recorded.document else None)


def open_recording(path: Path, most_steps: int = _MOST_STEPS) -> RecordedRun:
    """Read a recording, or its beginning; raises VisualHfsmError when the file is not a recording."""
    with VisualHfsmError.in_place_of(RecordingError):
        recording = RecordingFile(path)
        file, content = recording.files.get("document", ("", b""))
        text = content.decode("utf-8", "replace")
        structure = ComponentStructure(
            name=recording.name, document=file, generation=0, parameters=[], automata=[]
        )
        run = _Reader(structure, recording.start, RecordedPictures(recording))
        shortened = NO_MESSAGE
        for message in recording.messages():
            if run.steps >= most_steps:
                shortened = _shortened(run.seconds, recording)
                break
            run.apply(message)
    if run.log.newest is None:
        raise VisualHfsmError.because(
            "the recording {file} has no snapshots of {component}: an older version made it, or it was cut "
            "off at its beginning; record the run again",
            file=path.name,
            component=recording.name,
        )
    return RecordedRun(
        recording.name, run.structure, run.log, text, shortened, run.world, run.pictures, run.described
    )


def _shortened(seconds: float, recording: RecordingFile) -> Message:
    """Return the text that a recording was read until a component time in s."""
    read, end = _duration(seconds), recording.end
    if end is None:
        return Message("The recording is long: only its first {read} were read.", read=read)
    whole = _duration((end - recording.start) / 1e9)
    return Message(
        "The recording is long: only its first {read} of {whole} were read.", read=read, whole=whole
    )


def _duration(seconds: float) -> str:
    minutes, rest = divmod(round(seconds), 60)
    return f"{minutes} min {rest} s" if minutes else f"{rest} s"


class _Reader:
    def __init__(self, structure: ComponentStructure, start: int, pictures: RecordedPictures) -> None:
        self.structure = structure
        self.log = RunLog()
        self.world: Sequence[recorded.Shape] = ()
        self.pictures = pictures
        self.described = nao()
        self._robot = RobotState()
        self._start = start
        self._wall_time = 0.0
        self._takers: Final[Mapping[type, Callable[[Any], None]]] = {
            recorded.Action: self._act,
            recorded.Description: self._describe,
            recorded.Failing: self._fail,
            recorded.RobotPose: self._pose,
            recorded.Snapshot: self._show,
            recorded.World: self._build,
        }
        self._now = 0
        self.steps = 0
        """The steps that were read so far, as `_MOST_STEPS` counts them."""

    @property
    def seconds(self) -> float:
        """The component time until which messages were applied."""
        return self._now / 1e9

    def apply(self, message: RawMessage) -> None:
        """Process the next message; those that only a replay needs are skipped, as are malformed ones."""
        self.steps += 1 + (len(message.data) >> 13)
        take = self._takers.get(message.kind)
        with suppress(RecordingError):
            if message.kind in (recorded.Image, recorded.Picture):
                self.pictures.add(message)
            elif take is not None:
                decoded = decode(message, message.kind)
                self._now = max(self._now, message.time - self._start)
                self._wall_time = message.time / 1e9
                take(decoded)

    def _act(self, action: recorded.Action) -> None:
        if action.kind == "structure":
            with suppress(msgspec.ValidationError):  # what happened in it is shown anyway
                found = typed.convert(action.arguments, ComponentStructure)
                if len(found.automata) <= _MOST_AUTOMATA:
                    self.structure = found

    def _describe(self, description: recorded.Description) -> None:
        with suppress(VisualHfsmError):  # a body that cannot be drawn
            self.described = describe(description.body, description.looks)

    def _build(self, world: recorded.World) -> None:
        self.world = sound_shapes(world.shapes)

    def _show(self, snapshot: recorded.Snapshot) -> None:
        with suppress(msgspec.MsgspecError):
            component = _decode_snapshot(snapshot.component)
            self.steps += len(component.automata)
            if is_sound(component):
                self.log.add(LiveSnapshot(self._wall_time, component, self._robot))

    def _fail(self, failing: recorded.Failing) -> None:
        self._robot = replace(self._robot, failing=sound_faults(failing.faults))

    def _pose(self, pose: recorded.RobotPose) -> None:
        joints = {
            name: angle for name, angle in list(pose.joints.items())[:_MOST_JOINTS] if math.isfinite(angle)
        }
        torso = None if pose.torso is None else sound_placement(pose.torso)
        pan, tilt = self.described.head(joints)
        objects = sound_objects(pose.objects)
        self._robot = RobotState(
            joints,
            pan,
            tilt,
            None,
            torso,
            objects,
            sliding=self.described.sliding,
            says=printable(pose.says, LONGEST_TEXT),
            sound=printable(pose.sound, LONGEST_NAME),
            failing=self._robot.failing,
        )
