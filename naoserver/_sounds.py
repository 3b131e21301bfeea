"""The sounds that every robot with a loudspeaker plays, as tones: there are no files of audio."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

LOWEST_TONE: Final = 50.0
"""The lowest tone in Hz."""
HIGHEST_TONE: Final = 8000.0
"""The highest tone in Hz: half the lowest rate at which NAOqi plays, 16000 samples a second.

Source: http://doc.aldebaran.com/2-4/naoqi/audio/alaudiodevice.html, *Performances and Limitations*.
"""
LONGEST_TONE: Final = 10.0
"""Seconds of the longest tone."""


@dataclass(frozen=True, slots=True)
class Tone:
    """A tone of a frequency in Hz, or a rest of frequency 0, for some seconds."""

    frequency: float
    seconds: float


@dataclass(frozen=True, slots=True)
class Sound:
    """Tones one after the other."""

    name: str
    tones: tuple[Tone, ...]
    description: str = ""
    """A line for people."""

    @property
    def duration(self) -> float:
        """Its length in s."""
        return sum(tone.seconds for tone in self.tones)


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
