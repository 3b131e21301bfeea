"""Open the recording of a run for the timeline: the same moments as those of a component that is followed."""

from __future__ import annotations

import bisect
import math
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final, get_args

import msgspec

from codegen.hfsm.document import Document
from codegen.messages import NO_MESSAGE, Message
from codegen.reasons import reason
from hfsm_runtime.recording_file import messages as recorded
from hfsm_runtime.recording_file.reader import ImageHash, RawMessage, RecordingError, RecordingFile, decode
from interfaces import hfsm
from interfaces.hfsm import (
    AutomatonSnapshot,
    ComponentSnapshot,
    ComponentStatus,
    ComponentStructure,
    ErrorReport,
    GuardSnapshot,
    TimerSnapshot,
)
from visualhfsm._base.errors import VisualHfsmError
from visualhfsm._document.serialization import parse
from visualhfsm._monitor.realm.description import DescribedRobot, describe, nao
from visualhfsm._monitor.realm.pictures import OLDEST, encode_jpeg, evenly, require_pillow
from visualhfsm._monitor.realm.robot import LONGEST_NAME, LONGEST_TEXT, RobotState
from visualhfsm._monitor.realm.run_log import LiveSnapshot, RunLog, is_sound
from visualhfsm._monitor.realm.world import sound_objects, sound_placement, sound_shapes
from visualhfsm._monitor.run_page import MOST_PICTURES, Run
from zenoh_ice.data import typed
from zenoh_ice.data.text import printable

_INTERVAL: Final = 100_000_000
"""Nanoseconds between two moments, as of a monitor, unless a state changes."""
_MOST_STEPS: Final = 600_000
"""The part of a recording that is read: some two hours of a behavior with four automata, in some 12 s.

A message is one step, and another one for each 8 kB; a moment has one for each automaton.
"""
_LONGEST_TEXT: Final = 120
_MOST_ERRORS: Final = 20
_MOST_AUTOMATA: Final = 10_000
_MOST_MARKS: Final = 128
_MOST_JOINTS: Final = 100
_MOST_IMAGES: Final = 500_000
_MARK_SHOWN: Final = 500_000_000
"""Nanoseconds for which a mark is shown, as by a running component."""
_JPEG: Final = b"\xff\xd8"
_decode_snapshot: Final = typed.json_decoder(ComponentSnapshot)
_OfAutomaton = (
    recorded.Cycle
    | recorded.Failure
    | recorded.Firing
    | recorded.Guard
    | recorded.Timers
    | recorded.Variables
)


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

    def exported(self, document: Document | None, imported: Sequence[Mapping[str, Any]] = ()) -> Run:
        """Return the run to export, with the document that it shows. Raises VisualHfsmError."""
        pictures = self.pictures.spread(MOST_PICTURES)
        return Run(
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


def recorded_run(path: Path) -> Run:
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
    run.finish()
    if run.log.newest is None:
        raise VisualHfsmError.because(
            "the recording {file} holds no state of {component}", file=path.name, component=recording.name
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


class _Automaton:
    """The state of one automaton at the moment that is being read."""

    def __init__(self, id: int) -> None:
        self.snapshot = AutomatonSnapshot(
            id=id, state=0, ghost=True, finished=False, lastTransition=0, enteredAt=0.0, timers=[], guards=[],
            variables={}, cycles=0, overruns=0, lastCycle=0.0, longestCycle=0.0,
        )  # fmt: skip
        self.timers: dict[int, float] = {}
        """Seconds left, by transition, at the component time `timed_at` in ns."""
        self.timed_at = 0
        self.guards: dict[int, bool] = {}
        self.began = 0


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
            recorded.Change: self._change,
            recorded.Description: self._describe,
            recorded.Mark: self._mark,
            recorded.RobotPose: self._pose,
            recorded.Snapshot: self._show,
            recorded.World: self._build,
            **dict.fromkeys(get_args(_OfAutomaton), self._note),
        }
        self._automata: dict[int, _Automaton] = {}
        self._next = 0
        self._now = 0
        self.steps = 0
        """The steps that were read so far, as `_MOST_STEPS` counts them."""
        self._status = ComponentStatus.Running
        self._errors: list[ErrorReport] = []
        self._marks: dict[tuple[str, str], tuple[int, hfsm.Mark]] = {}

    @property
    def seconds(self) -> float:
        """The component time until which messages were applied."""
        return self._now / 1e9

    def apply(self, message: RawMessage) -> None:
        """Process the next message; a malformed one is skipped."""
        self.steps += 1 + (len(message.data) >> 13)
        is_picture = message.kind in (recorded.Image, recorded.Picture)
        take = self._takers.get(message.kind)
        if take is None and not is_picture:
            return
        with suppress(RecordingError):
            if take is None:
                self.pictures.add(message)
                return
            decoded = decode(message, message.kind)
            now = max(self._now, message.time - self._start)
            if now > self._now and now >= self._next and self._automata:
                self._add_moment()
            self._now, self._wall_time = now, message.time / 1e9
            take(decoded)

    def finish(self) -> None:
        """Note that there are no more messages."""
        if self._automata:
            self._add_moment()

    def _change(self, change: recorded.Change) -> None:
        if len(self._automata) >= _MOST_AUTOMATA and change.automaton not in self._automata:
            return
        found = self._automata.setdefault(change.automaton, _Automaton(change.automaton))
        snapshot = found.snapshot
        snapshot.ghost = change.kind == "ghost"
        snapshot.finished = change.kind == "finished"
        if change.kind == "entered":
            snapshot.enteredAt = change.at / 1e9
            found.guards = {}
        if snapshot.state != change.state or change.kind == "entered":
            found.timers = {}
        else:
            found.timers = self._remaining(found)
        found.timed_at = change.at
        snapshot.state = change.state
        self._next = 0  # add a separate moment once everything that happened at this time is known

    def _act(self, action: recorded.Action) -> None:
        if action.kind == "pause":
            self._status = ComponentStatus.Paused
        elif action.kind == "resume":
            self._status = ComponentStatus.Running
        elif action.kind == "structure":
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
        """Add a moment of a recording for viewing, which contains the snapshots themselves."""
        with suppress(msgspec.MsgspecError):
            component = _decode_snapshot(snapshot.component)
            if is_sound(component):
                self.log.add(LiveSnapshot(self._wall_time, component, self._robot))

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
        )

    def _mark(self, mark: recorded.Mark) -> None:
        self._marks = {key: made for key, made in self._marks.items() if self._now - made[0] <= _MARK_SHOWN}
        if len(self._marks) < _MOST_MARKS:
            made = hfsm.Mark(mark.camera, mark.u, mark.v, mark.label)
            self._marks[mark.camera, mark.label] = self._now, made

    def _note(self, message: _OfAutomaton) -> None:
        automaton = self._automata.get(message.automaton)
        if automaton is None:
            return
        snapshot = automaton.snapshot
        match message:
            case recorded.Cycle(begins=True, at=at):
                automaton.began = at
            case recorded.Cycle(at=at):
                snapshot.cycles += 1
                snapshot.lastCycle = max(0, at - automaton.began) / 1e9
                snapshot.longestCycle = max(snapshot.longestCycle, snapshot.lastCycle)
            case recorded.Guard(transition=transition, value=value):
                automaton.guards[transition] = value
            case recorded.Firing(transition=transition):
                snapshot.lastTransition = transition
            case recorded.Variables(values=values, gone=gone):
                kept = {name: text for name, text in snapshot.variables.items() if name not in gone}
                snapshot.variables = kept | {name: _shown(value) for name, value in values.items()}
            case recorded.Timers(remaining=remaining):  # they follow a change, and are of its time
                automaton.timers = self._timers(snapshot, remaining)
            case recorded.Failure(message=text, location=location):
                report = ErrorReport(self._now / 1e9, snapshot.id, snapshot.state, location, text)
                self._errors = [*self._errors, report][-_MOST_ERRORS:]

    def _timers(self, snapshot: AutomatonSnapshot, remaining: dict[str, float]) -> dict[int, float]:
        """Return the seconds that are left by transition; a recording has them by its name."""
        automata = (each for each in self.structure.automata if each.id == snapshot.id)
        return {
            transition.id: remaining[name]
            for automaton in automata
            for transition in automaton.transitions
            if transition.origin == snapshot.state
            and (name := transition.name or str(transition.id)) in remaining
        }

    def _remaining(self, automaton: _Automaton) -> dict[int, float]:
        passed = 0.0 if automaton.snapshot.ghost else max(0, self._now - automaton.timed_at) / 1e9
        return {number: max(0.0, left - passed) for number, left in automaton.timers.items()}

    def _add_moment(self) -> None:
        self._next = self._now + _INTERVAL
        self.steps += len(self._automata)
        automata = []
        for automaton in self._automata.values():
            snapshot = msgspec.structs.replace(automaton.snapshot)
            snapshot.timers = [TimerSnapshot(*timer) for timer in self._remaining(automaton).items()]
            snapshot.guards = [GuardSnapshot(*guard) for guard in automaton.guards.items()]
            automata.append(snapshot)
        component = ComponentSnapshot(
            startedAt=self._start / 1e9, time=self._now / 1e9, status=self._status, generation=0,
            automata=automata, parameters={}, stoppedAt=[], errors=self._errors,
            marks=[mark for made, mark in self._marks.values() if self._now - made <= _MARK_SHOWN],
        )  # fmt: skip
        if is_sound(component):
            self.log.add(LiveSnapshot((self._start + self._now) / 1e9, component, self._robot))


def _shown(value: object) -> str:
    """Return a value of JSON as Python shows it."""
    return repr(value)[:_LONGEST_TEXT]
