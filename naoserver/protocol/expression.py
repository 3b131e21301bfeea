"""Lights, voice and sounds over time, for robots without lamps, loudspeaker or ears.

Colors fade, texts last, sounds are tones, or samples of programs. What people say is typed.
"""

from __future__ import annotations

import math
import threading
from collections import deque
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Final

from naoserver.bodies.capabilities import SAMPLE_RATE, Color, Playback, Sound, Tone, Utterance
from naoserver.bodies.parts import Lamp
from naoserver.errors import InvalidCommand


def works() -> bool:
    """Return that a device does not fail."""
    return False


@dataclass(frozen=True, slots=True)
class Ramp:
    """A change that begins at `start`, from one value to another within some seconds."""

    before: float
    after: float
    start: float = 0.0
    seconds: float = 0.0

    def at(self, time: float) -> float:
        """Return the value at a time in s."""
        left = self.start + self.seconds - time
        if left <= 0.0:
            return self.after
        return self.after + (self.before - self.after) * min(1.0, left / self.seconds)


class FadingLights:
    """The lights of a body on a clock, `now` in s of robot time. Implements Lights; thread-safe.

    While `dark` holds, none of them shines.
    """

    def __init__(
        self, now: Callable[[], float], lamps: Mapping[str, Lamp], dark: Callable[[], object] = works
    ) -> None:
        self._now = now
        self._dark = dark
        self._lamps = lamps
        self._lock = threading.Lock()
        self._fades = self._start_fades()

    @property
    def names(self) -> tuple[str, ...]:
        return tuple(self._lamps)

    def set(self, name: str, color: Color, seconds: float) -> None:
        """Fade a group to a color within some seconds of robot time. Raises KeyError for an unknown group."""
        lamp = self._lamps[name]
        if lamp.single_colored:
            only, brightness = lamp.start, max(color)
            color = (only[0] * brightness, only[1] * brightness, only[2] * brightness)
        with self._lock:
            now = self._now()
            change = zip(self._fades[name], color, strict=True)
            self._fades[name] = [Ramp(ramp.at(now), part, now, seconds) for ramp, part in change]

    def reset(self) -> None:
        with self._lock:
            self._fades = self._start_fades()

    def colors(self) -> Mapping[str, Color]:
        if self._dark():
            return dict.fromkeys(self._lamps, (0.0, 0.0, 0.0))
        with self._lock:
            now = self._now()
            return {name: (r.at(now), g.at(now), b.at(now)) for name, (r, g, b) in self._fades.items()}

    def _start_fades(self) -> dict[str, list[Ramp]]:
        return {name: [Ramp(part, part) for part in lamp.start] for name, lamp in self._lamps.items()}


_RATE: Final = 14.0
"""Characters per second: 150 words a minute, of 4.6 letters and a blank each."""
_SPEECH_PAUSE: Final = 0.4
"""Seconds of pause around a text."""
LONGEST_TEXT: Final = 2000
"""Characters of the longest text."""
MOST_WAITING: Final = 100
"""Texts that may wait to be said."""


def speaking_time(text: str) -> float:
    """Return the seconds that a voice takes for a text."""
    return _SPEECH_PAUSE + len(text) / _RATE


class TimedVoice:
    """Say texts one after the other on a clock, `now` in s. Implements Voice; thread-safe.

    While `silent` holds, nobody hears which.
    """

    def __init__(self, now: Callable[[], float], silent: Callable[[], object] = works) -> None:
        self._now = now
        self._silent = silent
        self._lock = threading.Lock()
        self._agenda: deque[tuple[str, float]] = deque()  # what is spoken when, and until when
        self._newest = ""
        self._begun = 0

    def say(self, text: str) -> None:
        with self._lock:
            now = self._now()
            self._go_on(now)
            if len(self._agenda) > MOST_WAITING:
                raise InvalidCommand("text", f"{MOST_WAITING} texts are already waiting to be said")
            start = self._agenda[-1][1] if self._agenda else now
            self._agenda.append((text, start + speaking_time(text)))

    def stop(self) -> None:
        with self._lock:
            self._go_on(self._now())
            if self._agenda:
                self._begin(self._agenda[0][0])
            self._agenda.clear()

    def utterance(self) -> Utterance:
        with self._lock:
            self._go_on(self._now())
            if not self._agenda:
                return Utterance(self._newest, speaking=False, count=self._begun)
            text = "" if self._silent() else self._agenda[0][0]
            return Utterance(text, speaking=True, count=self._begun + 1)

    def _go_on(self, now: float) -> None:
        """Drop the texts that have ended."""
        while self._agenda and self._agenda[0][1] <= now:
            self._begin(self._agenda.popleft()[0])

    def _begin(self, text: str) -> None:
        self._newest = "" if self._silent() else text
        self._begun += 1


LOWEST_TONE: Final = 50.0
"""The lowest tone in Hz."""
HIGHEST_TONE: Final = 8000.0
"""The highest tone in Hz: half the lowest rate at which NAOqi plays, 16000 samples a second.

Source: http://doc.aldebaran.com/2-4/naoqi/audio/alaudiodevice.html, *Performances and Limitations*.
"""
LONGEST_TONE: Final = 10.0
"""Seconds of the longest tone."""


def single_tone(frequency: float, seconds: float) -> Sound:
    """Return a tone as a sound, whose name is `tone`."""
    return Sound("tone", (Tone(frequency, seconds),))


def _sound(name: str, description: str, *tones: tuple[float, float]) -> Sound:
    return Sound(name, tuple(Tone(*tone) for tone in tones), description)


_TABLE: Final = (
    _sound("beep", "a short signal", (880, 0.2)),
    _sound("yes", "two tones upwards", (659, 0.12), (988, 0.25)),
    _sound("no", "two tones downwards", (392, 0.2), (294, 0.4)),
    _sound("question", "up, and up again", (523, 0.15), (494, 0.1), (784, 0.3)),
    _sound(
        "fanfare",
        "for a success",
        *((523, 0.12), (0, 0.03), (523, 0.12), (0, 0.03), (523, 0.12)),
        *((659, 0.2), (523, 0.15), (659, 0.15), (784, 0.6)),
    ),
    _sound("whistle", "a referee's: short, then long", (2800, 0.15), (0, 0.1), (2800, 0.7)),
    _sound("alarm", "high and low in turn", *((960, 0.25), (770, 0.25)) * 3),
)

SOUNDS: Final[Mapping[str, Sound]] = {sound.name: sound for sound in _TABLE}
"""The sounds by name."""


_BLOCK: Final = 2 * SAMPLE_RATE // 4
"""Bytes of samples that are due together: of a quarter of a second."""
_DELAY: Final = 0.35
"""Seconds from the first samples until they are due: a program that sends what it hears has sent a block."""
_LAG: Final = 0.4
"""Seconds from when samples are due until they are over for all listeners, who hear them a little later."""
MOST_BYTES: Final = 8_000_000
"""Of samples that wait to be due: those of 250 s."""


class _Samples:
    """Samples that wait; the first of them are due at `begin` in s."""

    def __init__(self, begin: float) -> None:
        self._begin = begin
        self._waiting = bytearray()
        self._over = 0  # bytes that came before

    def due(self, now: float) -> tuple[bytes, int]:
        """Return the block that is due, and its place, and forget those before it."""
        if now < self._begin:
            return b"", -1
        first = max(self._over, self._newest(now) * _BLOCK)
        del self._waiting[: first - self._over]
        self._over = first
        return bytes(self._waiting[:_BLOCK]), first // 2

    def append(self, samples: bytes, now: float) -> float:
        """Append samples; return when all end. Raises InvalidCommand."""
        self.due(now)
        if len(samples) % 2 or len(self._waiting) + len(samples) > MOST_BYTES:
            raise InvalidCommand("samples", f"samples have 2 bytes each, and at most {MOST_BYTES} bytes wait")
        late = (self._newest(now) + 1) * _BLOCK - self._over - len(self._waiting)
        self._waiting += bytes(max(0, late)) + samples
        return self._begin + (self._over + len(self._waiting)) / 2 / SAMPLE_RATE + _LAG

    def _newest(self, now: float) -> int:
        """Return the number of the newest block that is due, below 0 before the first."""
        return math.floor((now - self._begin) * 2 * SAMPLE_RATE / _BLOCK)


class TimedSounds:
    """Play sounds on a clock, `now` in s. Implements Loudspeaker; thread-safe.

    While `silent` holds, nobody hears them.
    """

    def __init__(self, now: Callable[[], float], silent: Callable[[], object] = works) -> None:
        self._now = now
        self._silent = silent
        self._lock = threading.Lock()
        self._newest = Playback()
        self._samples: _Samples | None = None
        self._end = -math.inf

    def play(self, sound: Sound, loudness: float) -> None:
        with self._lock:
            self._end, self._samples = self._now() + sound.duration, None
            count = self._newest.count + 1
            self._newest = Playback(sound.name, sound.tones, loudness, playing=True, count=count)

    def play_samples(self, name: str, samples: bytes) -> int:
        with self._lock:
            now, count = self._now(), self._newest.count
            goes_on = now < self._end and name == self._newest.name
            own = self._samples if goes_on and self._samples else _Samples(now + _DELAY)
            self._end = own.append(samples, now)
            if own is not self._samples:
                self._newest = Playback(name, loudness=1.0, playing=True, count=count + 1)
            self._samples = own
            return self._newest.count

    def stop(self) -> None:
        with self._lock:
            self._end, self._samples = -math.inf, None

    def playback(self) -> Playback:
        with self._lock:
            now = self._now()
            playing = now < self._end
            samples, place = self._samples.due(now) if playing and self._samples else (b"", -1)
            heard = replace(self._newest, playing=playing, samples=samples, place=place)
            if self._silent():
                heard = replace(heard, loudness=0.0, samples=bytes(len(samples)))
            return heard


LONGEST_SENTENCE: Final = 500
"""Characters of the longest sentence."""


class Hearing:
    """Pass sentences on to all listeners. Thread-safe once they are known."""

    def __init__(self) -> None:
        self._listeners: list[Callable[[str], str]] = []

    def listen(self, understand: Callable[[str], str]) -> None:
        """Call `understand` with each sentence; it returns what it recognized, an empty text if nothing."""
        self._listeners.append(understand)

    def hear(self, sentence: str) -> str:
        """Return what was recognized in a sentence, empty if nothing. Raises InvalidCommand if it is none."""
        if not sentence.strip():
            raise InvalidCommand("text", "text is empty: there is nothing to hear")
        if len(sentence) > LONGEST_SENTENCE:
            message = f"text has {len(sentence)} characters: at most {LONGEST_SENTENCE} are heard at a time"
            raise InvalidCommand("text", message)
        return ", ".join(filter(None, [understand(sentence) for understand in self._listeners]))
