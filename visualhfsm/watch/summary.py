"""The figures of a run."""

from __future__ import annotations

import statistics
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Final

from visualhfsm.watch.recording import Ball, Recording

__all__ = ["SETTLING", "Summary", "in_middle_third", "summarize"]

SETTLING: Final = 2.0
"""Seconds at the beginning of each time of following that do not count: the head is on its way."""


@dataclass(frozen=True, slots=True)
class Summary:
    """Figures of a run; None is what was never measured.

    `centered` is a share from 0 to 1 of `centered_of` rows; angles are in rad, lags (robot time
    behind its schedule) in s of wall time.
    """

    component: str
    duration: float
    snapshots: int
    centered: float | None
    centered_of: int
    changes: int
    torso_tilt: float | None
    camera_rate: float | None
    real_time_factor: float | None
    typical_lag: float | None
    largest_lag: float | None
    errors: int
    overruns: int
    cycles: int


def summarize(recording: Recording, width: int, height: int) -> Summary:
    """Compute the figures of a recording; `width` and `height` are those of the robot's image in pixels.

    Of the ball, what counts is the share of rows in which its center is in the middle third of the image
    along both axes, from `SETTLING` seconds after the beginning of each time of following; a ball out of
    sight counts as outside.
    """
    rows = list(recording.rows)
    settled = [row.ball for row in rows if row.ball and row.time - row.ball.following_since >= SETTLING]
    centered = sum(in_middle_third(ball, width, height) for ball in settled)
    lags = _known(row.robot.lag for row in rows)
    rates = _known(row.robot.camera_rate for row in rows)
    newest = recording.newest
    automata = newest.automata if newest else []
    return Summary(
        component=recording.automata.name,
        duration=recording.duration,
        snapshots=len(rows),
        centered=centered / len(settled) if settled else None,
        centered_of=len(settled),
        changes=len(recording.changes),
        torso_tilt=max(_known(row.robot.torso_tilt for row in rows), default=None),
        camera_rate=statistics.median(rates) if rates else None,
        real_time_factor=_mean(_known(row.robot.real_time_factor for row in rows)),
        typical_lag=statistics.median(lags) if lags else None,
        largest_lag=max(lags, default=None),
        errors=len(newest.errors) if newest else 0,
        overruns=sum(automaton.overruns for automaton in automata),
        cycles=sum(automaton.cycles for automaton in automata),
    )


def in_middle_third(ball: Ball, width: int, height: int) -> bool:
    """Whether the ball is seen in the middle third of an image along both axes."""
    return ball.seen and abs(ball.error_u) <= width / 6 and abs(ball.error_v) <= height / 6


def _known(values: Iterable[float | None]) -> list[float]:
    return [value for value in values if value is not None]


def _mean(values: list[float]) -> float | None:
    return sum(values) / len(values) if values else None
