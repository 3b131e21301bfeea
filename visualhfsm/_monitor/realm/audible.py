"""What the robot says and plays, as far as its servers stream it, within bounds."""

from __future__ import annotations

import asyncio
import math
import struct
import time
from collections.abc import AsyncGenerator, Callable, Iterable
from contextlib import suppress
from itertools import islice
from typing import Final

import msgspec

from interfaces.nao import SoundSamples, SoundsPrx, SoundState, SpeechPrx, SpeechState, Tone
from visualhfsm._monitor.realm.realm import Newest
from zenoh_ice import Communicator, Sample
from zenoh_ice.data.text import printable

_SPEECH: Final = "Speech"
_SOUNDS: Final = "Sounds"
LONGEST_TEXT: Final = 2000
LONGEST_NAME: Final = 100
_MOST_TONES: Final = 64
_LOWEST, _HIGHEST = 50.0, 8000.0  # Hz
_LONGEST_TONE: Final = 10.0
"""Seconds."""
_MOST_BYTES: Final = 32_000
"""Bytes of the largest block: those of a second."""
_MOST_BLOCKS: Final = 16
"""Blocks that wait for a slow page; further ones are lost."""
_HEADER: Final = struct.Struct("<2d")
"""Count and place, as a page reads numbers, before the samples of a block."""
_WATCHED: Final = 1.0
"""Seconds between two looks within which what has begun began just now."""


class Audible(msgspec.Struct, frozen=True):
    """What is heard of the robot at one moment; empty while it is silent."""

    says: str = ""
    """The text that is being said."""
    sound: str = ""
    """The name of the sound that is being played."""
    tones: tuple[tuple[float, float], ...] = ()
    """The tones of that sound: each in Hz, 0 for a rest, and in s."""
    loudness: float = 0.0
    """Of that sound, from 0 to 1."""
    counts: tuple[int, int] = (0, 0)
    """The numbers of texts and of sounds that were begun."""


def audible(speech: SpeechState | None, sound: SoundState | None) -> Audible:
    """Return what is heard; what a server sends beyond the bounds is cut or left out."""
    playing = sound if sound is not None and sound.playing else None
    return Audible(
        says=printable(speech.text, LONGEST_TEXT) if speech is not None and speech.speaking else "",
        sound=printable(playing.name, LONGEST_NAME) if playing else "",
        tones=_sane(playing.tones) if playing else (),
        loudness=min(max(playing.loudness, 0.0), 1.0) if playing and math.isfinite(playing.loudness) else 0.0,
        counts=(speech.count if speech else 0, sound.count if sound else 0),
    )


def _sane(tones: Iterable[Tone]) -> tuple[tuple[float, float], ...]:
    """Return the tones and rests that a robot can play; comparisons with NaN are false."""
    return tuple(
        (tone.frequency, tone.seconds)
        for tone in islice(tones, _MOST_TONES)
        if (tone.frequency == 0.0 or _LOWEST <= tone.frequency <= _HIGHEST)
        and 0.0 < tone.seconds <= _LONGEST_TONE
    )


async def played_samples(communicator: Communicator) -> AsyncGenerator[bytes, None]:
    """Yield the samples that the robot plays, block after block, each after its `_HEADER`."""
    blocks: asyncio.Queue[bytes] = asyncio.Queue()
    loop = asyncio.get_running_loop()

    def receive(sample: Sample[SoundSamples]) -> None:
        now = sample.value
        fits = 0 < len(now.samples) <= _MOST_BYTES and len(now.samples) % 2 == 0
        if fits and blocks.qsize() < _MOST_BLOCKS:
            block = _HEADER.pack(now.count, now.place) + now.samples
            with suppress(RuntimeError):  # the loop was closed, and nobody waits any more
                loop.call_soon_threadsafe(blocks.put_nowait, block)

    sounds = SoundsPrx.uncheckedCast(communicator.stringToProxy(_SOUNDS))
    with sounds.getSamples.subscribe(receive, queue=_MOST_BLOCKS):
        while True:
            yield await blocks.get()


class Begin:
    """When the newest text or sound began, if that was watched; `clock` is in s."""

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        self._clock = clock
        self._count: int | None = None
        self._observed = -math.inf
        self._time: float | None = None

    def observe(self, count: int | None) -> None:
        """Note how many were begun so far, None while that is unknown."""
        now = self._clock()
        if count != self._count:
            watched = self._count is not None and now - self._observed < _WATCHED
            self._time = now if watched else None
        self._count, self._observed = count, now

    @property
    def age(self) -> float | None:
        """Seconds since then; None if it began before anybody watched."""
        return None if self._time is None else self._clock() - self._time


class AudibleMonitor:
    """Listen to the robot of a realm, from the first `read` on."""

    def __init__(self, communicator: Communicator) -> None:
        self._begins = Begin(), Begin()
        self._communicator = communicator
        proxy = communicator.stringToProxy
        self._speech = Newest(SpeechPrx.uncheckedCast(proxy(_SPEECH)).getSpeech.latest)
        self._sound = Newest(SoundsPrx.uncheckedCast(proxy(_SOUNDS)).getSound.latest)

    def read(self) -> Audible:
        """Return what is heard, without waiting; nothing of a server that is gone."""
        present = self._communicator.identities()
        speech = self._speech() if _SPEECH in present else None
        sound = self._sound() if _SOUNDS in present else None
        for begin, newest in zip(self._begins, (speech, sound), strict=True):
            begin.observe(newest.value.count if newest else None)
        return audible(speech.value if speech else None, sound.value if sound else None)

    def ages(self) -> tuple[float | None, float | None]:
        """Return how many seconds ago text and sound of the last `read` began, None where nobody saw it."""
        text, sound = self._begins
        return text.age, sound.age
