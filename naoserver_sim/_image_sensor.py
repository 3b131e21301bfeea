"""The effects of a camera's lens and sensor on rendered pictures: blur, exposure, casts, noise and latency.

Pictures are assumed to be encoded with a gamma of 2.2, so that a gain on their values is a gain on the light.
Rolling shutter, lens distortion, vignetting and automatic white balance are not modelled.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import Final

import numpy as np
from numpy.typing import NDArray

from naoserver.bodies.parts import CameraFacts

Picture = NDArray[np.uint8]

_TICKS: Final = 100
"""Control ticks in a second."""
_EVERY: Final = 25
"""Ticks from one measurement of the brightness to the next."""
_MEASUREMENTS: Final = 8
"""Past measurements on which the exposure depends."""
_SPARE: Final = 8
"""Older states that are kept for pictures that are drawn late."""
_POOL: Final = 1 << 22
"""Number of precomputed noise values, of which each picture takes a consecutive part."""
_PERIODS: Final = np.array((11.0, 14.3))
"""Seconds of a slow change of red and of blue; assumed."""
_SHIFTS: Final = ((1, 0), (0, 1), (-1, -1))
"""Three of six neighbors; the others are opposite. A pixel gets an eighth of the light of each."""
_ROUNDED: Final = np.float32(0.5)
"""Average loss by rounding down the product with the gain."""
_HIGHEST_NOISE: Final = 25
"""Limit of the noise of a value."""
_LEVELS: Final = 4
"""Halvings of the path of motion blur: it has up to 16 steps."""


@dataclass(frozen=True, slots=True)
class PictureNoise:
    """Imperfections of pictures; standard deviations unless said otherwise."""

    white: float = 3.2
    """Noise of a value from 0 to 255 at a gain of 1. The data sheet of the MT9M114 (onsemi, rev. 13) gives a
    ratio of signal to noise of at most 37 dB, with full pixels: shot noise of 255 / 70.8 / 2.2 = 1.6, which
    the gamma makes the same at each brightness. It is twice that in pixels filled to a quarter (assumed)."""
    exposure: float = 0.01
    """Exposure time in s, during which the picture of a turning camera is blurred; assumed."""
    brightness: float = 118.0
    """Mean value that the exposure aims at; assumed."""
    least_gain: float = 0.6
    most_gain: float = 4.0
    """Limits of the gain that leads there; assumed. In dim light the noise is amplified, too."""
    adaptation: float = 0.5
    """Time constant in s with which it adapts; assumed."""
    cast: float = 0.02
    """Constant relative errors of red and blue; assumed."""
    drift: float = 0.02
    """Amplitude of their slow changes; assumed."""
    least_latency: float = 0.06
    most_latency: float = 0.1
    """Seconds from the exposure until the picture arrives, drawn once for each camera from this range.
    B-Human measures that the cameras of a NAO 6 take 37 and 45 ms for a picture (`imageRecordingTime` in
    `coordinateSystemProvider.cfg`, code release 2025). Then it waits for the next of 30 cycles a second, for
    17 ms on average, and is converted, for 10 to 30 ms (assumed)."""


class ImageSensor:
    """Make pictures of some cameras imperfect.

    The result depends on the seed, the camera and the course of the simulation until then, not on earlier
    pictures. `look` is called on the thread of the physics, `develop` on that of the
    cameras.
    """

    def __init__(
        self,
        noise: PictureNoise,
        cameras: tuple[CameraFacts, ...],
        seed: int | None,
        qpos: NDArray[np.float64],
    ) -> None:
        """Start at the positions `qpos` of the joints."""
        self._noise = noise
        self._cameras = {camera.name: (index, camera) for index, camera in enumerate(cameras)}
        self._seed = int(np.random.SeedSequence(seed).generate_state(1)[0])
        random = np.random.default_rng(self._seed)
        self._casts = random.normal(1.0, noise.cast, (len(cameras), 2))
        self._phases = random.uniform(0.0, math.tau, (len(cameras), 2))
        self._latencies = random.uniform(noise.least_latency, noise.most_latency, len(cameras))
        # Replaced, never changed: the other thread reads it.
        self._past: tuple[tuple[int, NDArray[np.float64]], ...] = ((0, qpos.copy()),)
        # For each camera: the newest measurement, all measurements that count, and the resulting gain.
        self._measured: dict[str, tuple[int, dict[int, float], float]] = dict.fromkeys(
            self._cameras, (-1, {}, 1.0)
        )

    def sees(self, camera: str) -> bool:
        """Return whether it is one of its cameras."""
        return camera in self._cameras

    def latency(self, camera: str) -> float:
        """Return how old the pictures of a camera are in s."""
        index, _ = self._cameras[camera]
        return float(self._latencies[index])

    def expose(self, time: float, qpos: NDArray[np.float64]) -> None:
        """Keep the positions of the joints at the end of a control tick, if the exposure needs them."""
        tick = round(time * _TICKS)
        if tick % _EVERY == 0:
            self._past = (*self._past[1 - _MEASUREMENTS - _SPARE :], (tick, qpos.copy()))

    def develop(
        self,
        picture: Picture,
        camera: str,
        time: float,
        turning: NDArray[np.float64],
        measure: Callable[[NDArray[np.float64]], float],
    ) -> Picture:
        """Return a picture, taken at `time` in s, with the imperfections of the camera.

        `turning` is the camera's turning rate in rad/s about its axes right, up and backwards; `measure`
        returns the mean value that it sees at some positions of the joints.
        """
        index, facts = self._cameras[camera]
        tick = round(time * _TICKS)
        gain = self._gain(camera, tick, measure)
        height, width, _ = picture.shape
        focal = width / 2 / math.tan(facts.horizontal_fov / 2)
        blurred = _smeared(picture, focal * self._noise.exposure * turning[1::-1])
        for shift in _SHIFTS:
            blurred = _mixed(blurred, *shift)
        angles = math.tau * time / _PERIODS + self._phases[index]
        red, blue = self._casts[index] + self._noise.drift * np.sin(angles)
        colors = gain * np.array((red, 1.0, blue))
        # As integers, which are faster: the product of value and gain fills 16 bits.
        bits = 8 - max(0, math.frexp(colors.max() * (255 + _HIGHEST_NOISE) / 255)[1])
        factors = np.tile(np.rint(colors * 2**bits).astype(np.uint16), width)
        begin = np.random.default_rng((self._seed, index, tick)).integers(_POOL - picture.size)
        noise = self._pool[begin : begin + picture.size].reshape(height, 3 * width)
        values = np.add(blurred.reshape(noise.shape), noise, dtype=np.int16)
        product = values.clip(0, 255 + _HIGHEST_NOISE, out=values).view(np.uint16)
        product *= factors
        product >>= bits
        return values.clip(0, 255, out=values).astype(np.uint8).reshape(picture.shape)

    @cached_property
    def _pool(self) -> NDArray[np.int8]:
        return _noise_values(self._seed, len(self._cameras), self._noise.white)

    def _gain(self, camera: str, tick: int, measure: Callable[[NDArray[np.float64]], float]) -> float:
        """Return the gain of the exposure, which follows the brightness of the last two seconds."""
        kept = self._past
        past = dict([(at, qpos) for at, qpos in kept if at <= tick][-_MEASUREMENTS:] or kept[:1])
        newest, before, gain = self._measured[camera]
        if newest == max(past):
            return gain
        measured = {at: before[at] if at in before else measure(qpos) for at, qpos in past.items()}
        weights = np.exp(np.arange(1 - len(past), 1) * _EVERY / _TICKS / self._noise.adaptation)
        mean = max(1.0, float(np.average([*measured.values()], weights=weights)))
        gain = min(max(self._noise.brightness / mean, self._noise.least_gain), self._noise.most_gain)
        self._measured[camera] = max(past), measured, gain
        return gain


@lru_cache(maxsize=1)
def _noise_values(seed: int, cameras: int, white: float) -> NDArray[np.int8]:
    """Return enough noise for several pictures, computed once for robots of the same seed."""
    values = np.random.default_rng((seed, cameras)).standard_normal(_POOL, np.float32)
    values *= np.float32(white)
    values += _ROUNDED
    return np.rint(values, out=values).clip(-_HIGHEST_NOISE, _HIGHEST_NOISE, out=values).astype(np.int8)


def _smeared(picture: Picture, path: NDArray[np.float64]) -> Picture:
    """Return the mean of a picture along the path in pixels, to the right and down, on which it moved."""
    for level in range(1, _LEVELS + 1):
        dx, dy = np.rint(path / 2**level).astype(int).tolist()
        if dx or dy:
            picture = _mixed(picture, dx, dy)
    return picture


def _mixed(picture: Picture, dx: int, dy: int) -> Picture:
    """Return the mean of each pixel and the pixel `dx` to its right and `dy` below it, if there is one."""
    height, width, _ = picture.shape
    if abs(dx) >= width or abs(dy) >= height:
        return picture
    flat, step = picture.reshape(-1), 3 * (dy * width + dx)
    begin, end = max(0, -step), len(flat) - max(0, step)
    here, there = flat[begin:end], flat[begin + step : end + step]
    mixed = np.empty_like(flat)
    mixed[:begin], mixed[end:] = flat[:begin], flat[end:]
    # The mean of two bytes without a carry: the common bits plus half of the differing ones.
    mean = np.bitwise_and(here, there, out=mixed[begin:end])
    half = here ^ there
    half >>= 1
    mean += half
    result = mixed.reshape(picture.shape)
    if dx:  # there, the pixel to the right of a row's last one would be the first one of the next row
        beyond = slice(-dx, None) if dx > 0 else slice(None, -dx)
        result[:, beyond] = picture[:, beyond]
    return result
