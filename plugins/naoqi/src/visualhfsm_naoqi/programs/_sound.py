"""ALAudioPlayer, ALAudioDevice and ALAudioRecorder: inaudible sound that takes as long as on a robot.

Paths are those of the robot's disk, which is represented by a folder: clients can neither read nor write
files elsewhere.
"""

from __future__ import annotations

import logging
import math
import struct
from contextlib import suppress
from dataclasses import dataclass
from itertools import count
from pathlib import Path, PurePosixPath
from typing import Final

from tinytag import TinyTag, TinyTagException

from naoserver.errors import InvalidCommand
from naoserver.protocol.expression import HIGHEST_TONE, LONGEST_TONE, LOWEST_TONE, single_tone
from visualhfsm_naoqi.programs._access import Access, Service, delegated, needed
from visualhfsm_naoqi.programs._arguments import (
    chosen,
    constant,
    keepable,
    kept,
    listed,
    number,
    number_within,
    switch,
    text,
    within,
)
from visualhfsm_naoqi.programs._clients import (
    CHECK_PERIOD,
    SERVER,
    Activity,
    Belongings,
    Call,
    Client,
    begins,
    begins_any,
)

_logger = logging.getLogger(__name__)

MOST_SOUNDS: Final = 100
"""Maximum number of a client's loaded sounds, and of recorded files."""
_MOST_FOLDERS: Final = 16
"""Maximum folders above a file."""
LONGEST_RECORDING: Final = 3600.0
"""Robot seconds."""
UNKNOWN_LENGTH: Final = 1.0
"""Duration in s of a sound whose file is not on the robot's disk."""
_RATES: Final = (16000, 48000)
_CHANNELS: Final = 4
_SAMPLE: Final = 2
"""Bytes of a sample."""
_SHARE: Final = within(0.0, 1.0)
_HEADER: Final = struct.Struct("<4sI4s4sIHHIIHH4sI")
"""Header of a WAV file: RIFF, then the layout of the samples, then the size of what follows."""


def path_on(disk: Path, name: object) -> Path:
    """Return the place of a robot's file: `/home/nao/a.wav` is `home/nao/a.wav` in the folder `disk`.

    Raises InvalidCommand for one outside of it.
    """
    path = PurePosixPath("/", text(name, "file name"))
    with suppress(OSError, RuntimeError, ValueError):  # too long, a cycle of links, a null character
        place = disk.joinpath(*path.parts[1:]).resolve()
        if place.is_relative_to(disk) and place != disk:
            if len(place.relative_to(disk).parts) > _MOST_FOLDERS + 1:
                raise InvalidCommand("file name", f"a file is in at most {_MOST_FOLDERS} folders")
            return place
    raise InvalidCommand("file name", f"{str(path)[:200]!r} is no file on the robot's disk")


def _percent(value: object, what: str) -> int:
    return round(number_within(value, what, 0.0, 100.0))


@dataclass(slots=True)
class _Sound:
    """A loaded file, its length and its position in s, and the call that plays it."""

    name: str
    length: float
    volume: float = 1.0
    position: float = 0.0
    paused: bool = False
    call: Call | None = None


class ALAudioPlayer(Service):
    """Play sounds: a call lasts as long as the file. Volumes are remembered."""

    def __init__(self, access: Access) -> None:
        super().__init__(access)
        self._numbers = count(1)
        self._sounds: Belongings[float, _Sound] = self._bounded(
            "loaded sounds", MOST_SOUNDS
        )  # by their numbers

    setMasterVolume, getMasterVolume = kept("the volume of all sounds, from 0 to 1", 1.0, volume=_SHARE)

    def loadFile(self, fileName: object) -> int:
        """Load a sound; returns its number."""
        sound = _Sound(text(fileName, "file name"), self._length(fileName))
        with self._lock:
            loaded = next(self._numbers)
            self._sounds[loaded] = sound
        return loaded

    def unloadFile(self, id_: object) -> None:
        """Unload a sound, which stops."""
        self.stop(id_)
        with self._lock:
            self._sounds.pop(number(id_, "number of the sound"), None)

    def unloadAllFiles(self) -> None:
        """Unload all sounds, which stop."""
        self.stopAll()
        with self._lock:
            self._sounds.clear()

    def getLoadedFilesIds(self) -> list[float]:
        """Return the numbers of the loaded sounds."""
        with self._lock:
            return list(self._sounds)

    @begins(Activity.SOUND)
    def play(self, call: Call, id_: object, volume: object = 1.0, pan: object = 0.0) -> None:
        """Play a loaded sound; returns at its end."""
        self._play(call, self._sound(id_), volume, pan)

    @begins(Activity.SOUND)
    def playInLoop(self, call: Call, id_: object, volume: object = 1.0, pan: object = 0.0) -> None:
        """Play a loaded sound in a loop; returns when something stops it."""
        self._play(call, self._sound(id_), volume, pan, loop=True)

    @begins(Activity.SOUND)
    def playFile(self, call: Call, fileName: object, volume: object = 1.0, pan: object = 0.0) -> None:
        """Play a file; returns at its end."""
        self._play_file(call, fileName, volume, pan)

    @begins(Activity.SOUND)
    def playFileInLoop(self, call: Call, fileName: object, volume: object = 1.0, pan: object = 0.0) -> None:
        """Play a file in a loop; returns when something stops it."""
        self._play_file(call, fileName, volume, pan, loop=True)

    @begins(Activity.SOUND)
    def playFileFromPosition(
        self, call: Call, fileName: object, position: object, volume: object = 1.0, pan: object = 0.0
    ) -> None:
        """Play a file from a position in s; returns at its end."""
        self._play_file(call, fileName, volume, pan, position)

    @begins(Activity.SOUND)
    def playSine(self, call: Call, frequence: object, gain: object, pan: object, duration: object) -> None:
        """Play a tone of a frequency in Hz, at a gain from 0 to 100, for some seconds; returns at its end."""
        tone = single_tone(
            number_within(frequence, "frequency", LOWEST_TONE, HIGHEST_TONE),
            number_within(duration, "duration", 0.0, LONGEST_TONE),
        )
        loudness = number_within(gain, "gain", 0.0, 100.0) / 100
        number_within(pan, "pan", -1.0, 1.0)
        loudspeaker = needed(self._robot.loudspeaker, "has no loudspeaker")
        with self._access.calls.beginning(call) as may:
            if not may:
                return
            loudspeaker.play(tone, loudness)
            own = loudspeaker.playback().count
        while (now := loudspeaker.playback()).playing and now.count == own:
            if call.wait(CHECK_PERIOD):
                loudspeaker.stop()
                return

    def pause(self, id_: object) -> None:
        """Pause a playing sound, or resume it."""
        sound = self._sound(id_)
        sound.paused = not sound.paused

    def stop(self, id_: object) -> None:
        """Stop a sound; the calls that play it, or are to play it, return."""
        sound, chosen = self._sound(id_), begins_any(Activity.SOUND)
        with self._access.calls.stopping(
            lambda call: call is sound.call or (chosen(call) and call.arguments[:1] == (id_,))
        ):
            pass

    def stopAll(self) -> None:
        """Stop every sound, and drop those that have not begun yet."""
        with self._access.calls.stopping(begins_any(Activity.SOUND)):
            pass

    def getCurrentPosition(self, id_: object) -> float:
        """Return the position of a sound in s."""
        return self._sound(id_).position

    def getFileLength(self, id_: object) -> float:
        """Return the length of a sound in s."""
        return self._sound(id_).length

    def setVolume(self, id_: object, volume: object) -> None:
        """Remember the volume of a sound, from 0 to 1."""
        self._sound(id_).volume = number_within(volume, "volume", 0.0, 1.0)

    def getVolume(self, id_: object) -> float:
        """Return the volume of a sound, from 0 to 1."""
        return self._sound(id_).volume

    def _length(self, name: object) -> float:
        """Return the duration of a file in s."""
        try:
            length = TinyTag.get(path_on(self._access.disk, name), tags=False).duration
        except (OSError, TinyTagException) as error:
            _logger.warning("ALAudioPlayer: %s plays for %g s: %s", name, UNKNOWN_LENGTH, error)
            return UNKNOWN_LENGTH
        return length if length is not None and math.isfinite(length) else UNKNOWN_LENGTH

    def _play_file(
        self, call: Call, name: object, volume: object, pan: object, at: object = 0.0, *, loop: bool = False
    ) -> None:
        loaded = self.loadFile(name)
        try:
            self._play(call, self._sound(loaded), volume, pan, at, loop=loop)
        finally:
            with self._lock:
                self._sounds.pop(loaded, None)

    def _play(
        self, call: Call, sound: _Sound, volume: object, pan: object, at: object = 0.0, *, loop: bool = False
    ) -> None:
        position = number_within(at, "position", 0.0, sound.length)
        sound.volume = number_within(volume, "volume", 0.0, 1.0)
        number_within(pan, "pan", -1.0, 1.0)
        with self._lock:
            if sound.call is not None:
                raise InvalidCommand("sound", f"{sound.name[:200]!r} is playing already")
            sound.call = call
        sound.position, sound.paused = position, False
        clock = self._robot.clock
        now = clock.now()
        try:
            while sound.position < sound.length and not call.wait(CHECK_PERIOD):
                before, now = now, clock.now()
                if not sound.paused:
                    sound.position += now - before
                if loop and sound.length > 0.0:
                    sound.position %= sound.length
        finally:
            sound.call, sound.position = None, 0.0

    def _sound(self, id_: object) -> _Sound:
        with self._lock:
            sound = self._sounds.get(number(id_, "number of the sound"))
        if sound is None:
            raise InvalidCommand("sound", f"no sound {str(id_)[:60]} is loaded")
        return sound


class ALAudioRecorder(Service):
    """Record from the microphones, which hear nothing: the files are silent."""

    _recording: tuple[Path, float, int, int] | None = None
    """File, beginning in robot time, samples a second, and channels."""
    _recorder = SERVER
    """The client that records."""

    def __init__(self, access: Access) -> None:
        super().__init__(access)
        self._made: set[Path] = set()

    def startMicrophonesRecording(
        self,
        fileName: object,
        type_: object = "wav",
        samplerate: object = 16000,
        channels: object = (0, 0, 1, 0),
    ) -> None:
        """Start recording into a file; `channels` says of left, right, front and rear whether it is used."""
        path = path_on(self._access.disk, fileName)
        chosen(type_, "type of file", ("wav",))
        rate = int(number(samplerate, "sample rate"))
        if rate not in _RATES:
            raise InvalidCommand("sample rate", f"the sample rate is {rate}: it must be 16000 or 48000")
        used = sum(bool(one) for one in listed(channels, "channels", _CHANNELS))
        if not used:
            raise InvalidCommand("channels", "no microphone is chosen: give one of the four a 1")
        with self._lock:
            if self._recording is not None:
                raise InvalidCommand("file name", "it is recording already: stop that first")
            if path not in self._made and len(self._made) >= MOST_SOUNDS:
                raise InvalidCommand("file name", f"{MOST_SOUNDS} files were recorded already: reuse a name")
            self._made.add(path)
            self._recorder = self._access.calls.current.client
            self._recording = path, self._robot.clock.now(), rate, used
            self._write(0.0)

    def stopMicrophonesRecording(self) -> None:
        """Stop the recording."""
        with self._lock:
            if self._recording is not None:
                self._write(min(LONGEST_RECORDING, self._robot.clock.now() - self._recording[1]))
            self._recording = None

    def _forget(self, client: Client) -> None:
        """Stop the recording of a lost client."""
        super()._forget(client)
        if self._recorder is client:
            self.stopMicrophonesRecording()

    def _write(self, seconds: float) -> None:
        """Write the recording as a file of silence, which is sparse: it takes no room on the disk."""
        assert self._recording is not None
        path, _, rate, channels = self._recording
        frame = channels * _SAMPLE
        size = round(seconds * rate) * frame
        riff = b"RIFF", _HEADER.size - 8 + size, b"WAVE"
        layout = b"fmt ", 16, 1, channels, rate, rate * frame, frame, 8 * _SAMPLE
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            with path.open("wb") as file:
                file.write(_HEADER.pack(*riff, *layout, b"data", size))
                file.truncate(_HEADER.size + size)
        except OSError as error:
            self._recording = None
            raise InvalidCommand("file name", f"{path.name}: {error.strerror}") from None


class ALAudioDevice(Service):
    """The loudspeakers, and microphones that hear nothing."""

    setOutputVolume, getOutputVolume = kept("the volume in percent", 70, volume=_percent)
    muteAudioOut, isAudioOutMuted = kept("whether the loudspeakers are off", False, mute=switch)
    setClientPreferences = constant(
        "Do nothing, since no sound comes.",
        name=text,
        sampleRate=keepable,
        channels=keepable,
        deinterleaved=keepable,
    )
    unsubscribe = constant("Do nothing.", module=text)
    enableEnergyComputation = constant("Do nothing: the energies are 0.")
    disableEnergyComputation = enableEnergyComputation
    getFrontMicEnergy = constant("Return how loud it is at this microphone: it is silent.", 0.0)
    getLeftMicEnergy = getRightMicEnergy = getRearMicEnergy = getFrontMicEnergy
    playSine = delegated(ALAudioPlayer, ALAudioPlayer.playSine)
    stopMicrophonesRecording = delegated(ALAudioRecorder, ALAudioRecorder.stopMicrophonesRecording)

    def startMicrophonesRecording(self, fileName: object) -> None:
        """Start recording all four microphones into a file."""
        recorder = self._access.service(ALAudioRecorder)
        recorder.startMicrophonesRecording(fileName, "wav", 48000, [1, 1, 1, 1])

    def subscribe(self, module: object) -> None:
        """Do nothing but log it: the microphones hear nothing, so no sound comes."""
        _logger.warning("ALAudioDevice: %s gets no sound: the microphones hear nothing", text(module, "name"))
