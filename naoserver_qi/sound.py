"""ALAudioPlayer, ALAudioDevice and ALAudioRecorder: sound that nobody hears, in the time that it takes.

Paths are those of the robot's disk, for which a folder stands: what a client names is neither read nor
written elsewhere.
"""

from __future__ import annotations

import logging
import math
import struct
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from itertools import count
from pathlib import Path, PurePosixPath
from typing import Final

from tinytag import TinyTag, TinyTagException

from naoserver.errors import InvalidCommand
from naoserver_qi.arguments import chosen, listed, number, number_within, text
from naoserver_qi.calls import Call
from zenoh_ice import Clock

_logger = logging.getLogger(__name__)

MOST: Final = 100
"""Sounds that may be loaded, and files that may be recorded."""
LONGEST_RECORDING: Final = 3600.0
"""Robot seconds."""
UNKNOWN_LENGTH: Final = 1.0
"""Seconds that a sound lasts whose file is not on the robot's disk."""
_LOOK: Final = 0.05
"""Robot seconds between two looks whether a sound is over."""
_RATES: Final = (16000, 48000)
_CHANNELS: Final = 4
_SAMPLE: Final = 2
"""Bytes of a sample."""
_HEADER: Final = struct.Struct("<4sI4s4sIHHIIHH4sI")
"""Header of a WAV file: RIFF, then the layout of the samples, then the size of what follows."""


class Disk:
    """A folder that stands for the robot's disk: `/home/nao/a.wav` is `home/nao/a.wav` in it."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder.resolve()

    def path(self, name: object) -> Path:
        """Return where a file of the robot is. Raises InvalidCommand for one outside the disk."""
        path = PurePosixPath("/", text(name, "file name"))
        with suppress(OSError, RuntimeError, ValueError):  # too long, links in a circle, a null in it
            place = self._folder.joinpath(*path.parts[1:]).resolve()
            if place.is_relative_to(self._folder) and place != self._folder:
                return place
        raise InvalidCommand("file name", f"{str(path)[:200]!r} is no file on the robot's disk")


class _Sound:
    """A loaded file."""

    def __init__(self, name: str, length: float) -> None:
        self.name: Final = name
        self.length: Final = length
        """In s."""
        self.volume = 1.0
        self.position = 0.0
        """In s, while it plays and after that."""
        self.paused = False
        self.call: Call | None = None
        """What plays it."""


class ALAudioPlayer:
    """Play sounds: a call lasts as long as the file. Volumes are remembered."""

    def __init__(self, disk: Disk, clock: Clock) -> None:
        self._disk = disk
        self._clock = clock
        self._lock = threading.Lock()
        self._numbers = count(1)
        self._sounds: dict[int, _Sound] = {}
        self._volume = 1.0

    def loadFile(self, fileName: object) -> int:
        """Load a sound; returns its number."""
        sound = _Sound(text(fileName, "file name"), self._length(fileName))
        with self._lock:
            if len(self._sounds) >= MOST:
                raise InvalidCommand("file name", f"{MOST} sounds are loaded already: unload some")
            number = next(self._numbers)
            self._sounds[number] = sound
        return number

    def unloadFile(self, id_: object) -> None:
        """Forget a sound, which falls silent."""
        self.stop(id_)
        with self._lock:
            self._sounds.pop(self._number(id_), None)

    def unloadAllFiles(self) -> None:
        """Forget all sounds, which fall silent."""
        for loaded in self.getLoadedFilesIds():
            self.unloadFile(loaded)

    def getLoadedFilesIds(self) -> list[int]:
        """Return the numbers of the loaded sounds."""
        with self._lock:
            return list(self._sounds)

    def getLoadedFilesNames(self) -> list[str]:
        """Return the file names of the loaded sounds."""
        with self._lock:
            return [sound.name for sound in self._sounds.values()]

    def play(self, call: Call, id_: object, volume: object = 1.0, pan: object = 0.0) -> None:
        """Play a loaded sound; returns at its end."""
        self._play(call, self._sound(id_), volume, pan)

    def playInLoop(self, call: Call, id_: object, volume: object = 1.0, pan: object = 0.0) -> None:
        """Play a loaded sound again and again; returns when something stops it."""
        self._play(call, self._sound(id_), volume, pan, loop=True)

    def playFile(self, call: Call, fileName: object, volume: object = 1.0, pan: object = 0.0) -> None:
        """Play a file; returns at its end."""
        with self._loaded(fileName) as sound:
            self._play(call, sound, volume, pan)

    def playFileInLoop(self, call: Call, fileName: object, volume: object = 1.0, pan: object = 0.0) -> None:
        """Play a file again and again; returns when something stops it."""
        with self._loaded(fileName) as sound:
            self._play(call, sound, volume, pan, loop=True)

    def playFileFromPosition(
        self, call: Call, fileName: object, position: object, volume: object = 1.0, pan: object = 0.0
    ) -> None:
        """Play a file from a position in s; returns at its end."""
        with self._loaded(fileName) as sound:
            sound.position = number_within(position, "position", 0.0, sound.length)
            self._play(call, sound, volume, pan)

    def playSine(self, call: Call, frequency: object, gain: object, pan: object, duration: object) -> None:
        """Play a tone for some seconds; returns at its end."""
        number_within(frequency, "frequency", 1.0, 24000.0)
        number_within(gain, "gain", 0.0, 100.0)
        number(pan, "pan")
        call.wait(number_within(duration, "duration", 0.0, 3600.0))

    def pause(self, id_: object) -> None:
        """Hold a sound that plays, or let it continue."""
        sound = self._sound(id_)
        sound.paused = not sound.paused

    def stop(self, id_: object) -> None:
        """Stop a sound; the call that plays it returns."""
        if (call := self._sound(id_).call) is not None:
            call.stopped.set()

    def stopAll(self) -> None:
        """Stop every sound."""
        for loaded in self.getLoadedFilesIds():
            self.stop(loaded)

    def goTo(self, id_: object, position: object) -> None:
        """Continue a sound at a position in s."""
        sound = self._sound(id_)
        sound.position = number_within(position, "position", 0.0, sound.length)

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

    def setMasterVolume(self, volume: object) -> None:
        """Remember the volume of all sounds, from 0 to 1."""
        self._volume = number_within(volume, "volume", 0.0, 1.0)

    def getMasterVolume(self) -> float:
        """Return the volume of all sounds, from 0 to 1."""
        return self._volume

    def _length(self, name: object) -> float:
        """Return how long a file plays in s."""
        try:
            length = TinyTag.get(self._disk.path(name), tags=False).duration
        except (OSError, TinyTagException) as error:
            _logger.warning("ALAudioPlayer: %s plays for %g s: %s", name, UNKNOWN_LENGTH, error)
            return UNKNOWN_LENGTH
        return length if length is not None and math.isfinite(length) else UNKNOWN_LENGTH

    @contextmanager
    def _loaded(self, name: object) -> Iterator[_Sound]:
        loaded = self.loadFile(name)
        try:
            yield self._sounds[loaded]
        finally:
            with self._lock:
                self._sounds.pop(loaded, None)

    def _play(self, call: Call, sound: _Sound, volume: object, pan: object, *, loop: bool = False) -> None:
        sound.volume = number_within(volume, "volume", 0.0, 1.0)
        number_within(pan, "pan", -1.0, 1.0)
        with self._lock:
            if sound.call is not None:
                raise InvalidCommand("sound", f"{sound.name[:200]!r} is playing already")
            sound.call = call
        sound.paused = False
        now = self._clock.now()
        try:
            while sound.position < sound.length and not call.wait(_LOOK):
                before, now = now, self._clock.now()
                if not sound.paused:
                    sound.position += now - before
                if loop and sound.length > 0.0:
                    sound.position %= sound.length
        finally:
            sound.call, sound.position = None, 0.0

    def _number(self, id_: object) -> int:
        return int(number(id_, "number of the sound"))

    def _sound(self, id_: object) -> _Sound:
        with self._lock:
            sound = self._sounds.get(self._number(id_))
        if sound is None:
            raise InvalidCommand("sound", f"no sound {str(id_)[:60]} is loaded")
        return sound


class ALAudioRecorder:
    """Record from the microphones, which hear nothing: the files are silent."""

    def __init__(self, disk: Disk, clock: Clock) -> None:
        self._disk = disk
        self._clock = clock
        self._lock = threading.Lock()
        self._made = 0
        self._recording: tuple[Path, float, int, int] | None = None
        """File, beginning in robot time, samples a second, and channels."""

    def startMicrophonesRecording(
        self,
        fileName: object,
        type_: object = "wav",
        samplerate: object = 16000,
        channels: object = (0, 0, 1, 0),
    ) -> None:
        """Begin to record into a file; `channels` says of left, right, front and rear whether it is used."""
        path = self._disk.path(fileName)
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
            if self._made >= MOST:
                raise InvalidCommand("file name", f"{MOST} files were recorded already")
            self._made += 1
            self._recording = path, self._clock.now(), rate, used
            self._write(0.0)

    def stopMicrophonesRecording(self) -> None:
        """End the recording."""
        with self._lock:
            if self._recording is not None:
                self._write(min(LONGEST_RECORDING, self._clock.now() - self._recording[1]))
            self._recording = None

    def _write(self, seconds: float) -> None:
        """Write the recording as a file of silence, which takes no room on the disk."""
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


class ALAudioDevice:
    """The loudspeakers' volume, and microphones that hear nothing."""

    def __init__(self, recorder: ALAudioRecorder) -> None:
        self._recorder = recorder
        self._volume = 70
        self._muted = False

    def setOutputVolume(self, volume: object) -> None:
        """Remember the volume in percent."""
        self._volume = round(number_within(volume, "volume", 0.0, 100.0))

    def getOutputVolume(self) -> int:
        """Return the volume in percent."""
        return self._volume

    def muteAudioOut(self, mute: object) -> None:
        """Remember whether the loudspeakers are off."""
        self._muted = bool(mute)

    def isAudioOutMuted(self) -> bool:
        """Return whether the loudspeakers are off."""
        return self._muted

    def startMicrophonesRecording(self, fileName: object) -> None:
        """Begin to record all four microphones into a file."""
        self._recorder.startMicrophonesRecording(fileName, "wav", 48000, [1, 1, 1, 1])

    def stopMicrophonesRecording(self) -> None:
        """End the recording."""
        self._recorder.stopMicrophonesRecording()

    def setClientPreferences(
        self, name: object, sampleRate: object, channels: object, deinterleaved: object
    ) -> None:
        """Do nothing, since no sound comes."""

    def subscribe(self, module: object) -> None:
        """Do nothing but log it: the microphones hear nothing, so no sound comes."""
        _logger.warning("ALAudioDevice: %s gets no sound: the microphones hear nothing", text(module, "name"))

    def unsubscribe(self, module: object) -> None:
        """Do nothing."""

    def enableEnergyComputation(self) -> None:
        """Do nothing: the energies are 0."""

    def disableEnergyComputation(self) -> None:
        """Do nothing."""

    def getFrontMicEnergy(self) -> float:
        """Return how loud it is at this microphone: it is silent."""
        return 0.0

    getLeftMicEnergy = getRightMicEnergy = getRearMicEnergy = getFrontMicEnergy
