"""Show the progress of a ball: as a bar on a terminal, elsewhere in the log."""

from __future__ import annotations

import logging
import time
from types import TracebackType
from typing import Final, Self

from rich.console import Console
from rich.live import Live
from rich.progress_bar import ProgressBar
from rich.table import Table
from rich.text import Text

from ._axes import Point
from ._route import Route, Stop
from ._waypoints import Color

_BAR_WIDTH: Final = 12
_REFRESH_PERIOD: Final = 0.1  # s of wall time

_logger = logging.getLogger(__name__)


class Progress:
    """Draw the ball's goals as a bar if stdout is a terminal, or log them at level debug.

    The loss of its server is a warning in the log, or shown above the bar. As a context manager, it removes
    the bar at the end and restores the terminal.
    """

    def __init__(
        self, color: Color, route: Route, console: Console | None = None, errors: Console | None = None
    ) -> None:
        self._color = color
        self._count = len(route.stops)
        self._console = console or Console(highlight=False, soft_wrap=True)
        self._errors = errors or Console(stderr=True, highlight=False, soft_wrap=True)
        self._live = Live(console=self._console, auto_refresh=False, transient=True)
        self._heading = ""
        self._drawn_at = 0.0

    def __enter__(self) -> Self:
        if self._console.is_terminal:
            self._live.start()
        else:
            self._console.print(f"{self._color}: {self._count} waypoints")
            self._console.file.flush()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        self._live.stop()

    def departed(self, index: int, stop: Stop, lap: int) -> None:
        """Report that the ball starts towards a stop."""
        lap_text = f"lap {lap}, " if lap > 1 else ""
        self._heading = (
            f"{self._color}: {lap_text}waypoint {index + 1} of {self._count} "
            f"{stop.waypoint.point} at {stop.speed:.3g} m/s"
        )
        if not self._live.is_started:
            _logger.debug("%s", self._heading)

    def moved(self, target: Point, fraction: float) -> None:
        """Redraw the bar, at most ten times a second."""
        now = time.monotonic()
        if not self._live.is_started or now - self._drawn_at < _REFRESH_PERIOD:
            return
        self._drawn_at = now
        heading, place = Text(self._heading), Text(str(target))
        heading.truncate(max(0, self._console.width - _BAR_WIDTH - len(place) - 3), overflow="ellipsis")
        line = Table.grid(padding=(0, 1))
        line.add_row(heading, ProgressBar(total=1.0, completed=fraction, width=_BAR_WIDTH), place)
        self._live.update(line, refresh=True)

    def arrived(self, stop: Stop, error: float) -> None:
        """Report that the ball is at a stop."""
        if not self._live.is_started:
            dwell = f", staying {stop.waypoint.dwell:g} s" if stop.waypoint.dwell else ""
            _logger.debug("%s: arrived, %.1f cm off%s", self._color, error * 100, dwell)

    def lost(self, reason: str) -> None:
        """Report that the server does not answer."""
        self._warn(f"{self._color}: lost the ball; waiting for its server: {reason}")

    def returned(self) -> None:
        """Report that the server is back."""
        self._warn(f"{self._color}: the ball is back; continuing")

    def _warn(self, text: str) -> None:
        if self._live.is_started and self._errors.is_terminal:
            # On a terminal with the bar, only the bar's own console can write above it.
            self._console.print(Text(text))
        else:
            _logger.warning("%s", text)
