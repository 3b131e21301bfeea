"""Follow a stream: its rate, age, size and losses, and its values."""

from __future__ import annotations

import itertools
import logging
import math
import queue
import statistics
import sys
import threading
import time
from collections import deque
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from typing import Any, Final

import typer
from rich.console import Group, RenderableType
from rich.filesize import decimal
from rich.highlighter import JSONHighlighter
from rich.live import Live
from rich.table import Table
from rich.text import Text

from nao_tools._call import shown_bytes
from nao_tools._connection import find_operation
from nao_tools._dynamic import DynamicProxy
from nao_tools._output import (
    console,
    count_text,
    duration_text,
    for_people,
    pretty,
    print_json,
    span_text,
    width,
)
from nao_tools._values import Json, to_json
from zenoh_ice import Sample, initialize
from zenoh_ice.application.cli import stop_on_signals
from zenoh_ice.settings import Settings

_REDRAW: Final = 0.1  # s between two pictures of the view
_LINE: Final = 1.0  # s between two lines, where the output is no terminal
_MOST_WAITING: Final = 1024  # samples that were received and not yet handled
_FEW_WAITING: Final = 4  # of samples that may be images
_CHECK_PERIOD: Final = 0.1  # s between two checks for the end
_WINDOW: Final = 5.0  # s over which rates, intervals and ages are taken
_SILENCE: Final = 2.0  # s after which the view reports that nothing arrives


def watch(
    settings: Settings,
    address: str,
    *,
    count: int,
    seconds: float,
    rate: float | None,
    with_values: bool,
    as_json: bool,
) -> None:
    """Follow the stream that an address names until `count` samples, `seconds`, or Ctrl-C; 0 is no limit.

    At most `rate` samples a second are taken, if that is given. Raises NaoError when there is no such
    stream, and the exceptions of a call when its servant is offline at the beginning.
    """
    with initialize(settings) as communicator:
        proxy, name = find_operation(communicator, address, streamed=True)
        with stop_on_signals() as stop:
            limit = time.monotonic() + (seconds or math.inf)
            watched = _Watched(proxy, name, rate, count or math.inf, limit, stop)
            if as_json:
                _print_samples(watched, with_values=with_values)
            elif for_people():
                _show(watched, with_values=with_values)
            else:
                _print_lines(watched)


class StreamStatistics:
    """Count the samples of a stream; rates and ages are those of the last five seconds."""

    def __init__(self) -> None:
        self.received = 0
        self.lost = 0
        """Samples that were sent and did not arrive, including those dropped for a rate."""
        self.restarts = 0
        """Number of restarts of the server, seen by restarting sequence numbers."""
        self._last = time.monotonic()
        self._sequence: int | None = None
        self._arrivals: Final[deque[tuple[float, float]]] = deque()

    def add(self, sample: Sample[Any], arrived: float, age: float) -> None:
        """Count a sample that arrived at a time of the monotonic clock with an age in s."""
        self.received += 1
        self.lost += sample.lost
        self.restarts += self._sequence is not None and sample.sequence <= self._sequence
        self._sequence, self._last = sample.sequence, arrived
        self._arrivals.append((arrived, age))
        self._forget(arrived)

    def intervals(self) -> list[float]:
        """Return the times in s between samples."""
        self._forget(time.monotonic())
        return [after[0] - before[0] for before, after in itertools.pairwise(self._arrivals)]

    def rate(self) -> float | None:
        """Return the samples per second; None before the second sample."""
        intervals = self.intervals()
        return len(intervals) / sum(intervals) if sum(intervals) > 0 else None

    def ages(self) -> list[float]:
        """Return the ages of samples in s on arrival; below 0 when the clocks of the machines differ."""
        self._forget(time.monotonic())
        return [age for _, age in self._arrivals]

    def silence(self) -> float:
        """Return the seconds since the newest sample arrived, or since the beginning."""
        return time.monotonic() - self._last

    def _forget(self, now: float) -> None:
        while self._arrivals and now - self._arrivals[0][0] > _WINDOW:
            self._arrivals.popleft()


@dataclass(slots=True)
class _Watched:
    """A stream that is followed until `left` samples have arrived, `limit` has passed, or `stop` is set."""

    proxy: DynamicProxy
    name: str
    rate: float | None
    left: float
    limit: float
    stop: threading.Event
    statistics: StreamStatistics = field(default_factory=StreamStatistics)
    newest: Sample[Any] | None = None

    @property
    def realm(self) -> str:
        """The realm of the stream."""
        return self.proxy.proxy.ice_getRealm()

    @property
    def title(self) -> str:
        """The stream as users type it."""
        return f"{self.proxy.identity}.{self.name}"

    def follow(
        self,
        period: float,
        report: Callable[[], object] = lambda: None,
        take: Callable[[Sample[Any]], object] = lambda _: None,
    ) -> None:
        """Count samples and give each to `take`; call `report` once a period, and at the end."""
        arrived: queue.Queue[tuple[Sample[Any], float, float]] = queue.Queue(1)
        ended = threading.Event()

        def on_sample(sample: Sample[Any]) -> None:
            # Ages are measured here: later they would include the wait for the view.
            entry = sample, time.monotonic(), time.time() - sample.wall_time
            while not ended.is_set():
                with suppress(queue.Full):
                    arrived.put(entry, timeout=_CHECK_PERIOD)
                    return

        most_waiting = 1  # with a rate, the newest in its turn
        if not self.rate:  # images are large, and viewers want the newest
            bulk = self.proxy.operation(self.name).result.holds_bytes
            most_waiting = _FEW_WAITING if bulk else _MOST_WAITING
        due = time.monotonic() + period
        with self.proxy.stream(self.name).subscribe(on_sample, rate=self.rate, queue=most_waiting):
            try:
                while not self.stop.is_set() and self.left > 0 and (now := time.monotonic()) < self.limit:
                    if now >= due:
                        report()
                        due = max(due + period, now)
                    wait = min(due, self.limit) - time.monotonic()
                    with suppress(queue.Empty):
                        self.newest, at, age = arrived.get(timeout=max(0.0, min(wait, _CHECK_PERIOD)))
                        self.statistics.add(self.newest, at, age)
                        self.left -= 1
                        take(self.newest)
                report()
            finally:
                ended.set()

    def value(self, sample: Sample[Any]) -> object:
        """Return the content of the sample: a value, or several by name."""
        results = self.proxy.results(self.name, sample.value)
        return next(iter(results.values())) if len(results) == 1 else results

    def figures(self) -> list[tuple[str, str, str]]:
        """Return name, figure and detail of each fact about the stream."""
        figures = self.statistics
        intervals = figures.intervals()
        rate = figures.rate()
        ages = figures.ages()
        rows = [("rate", "-", ""), ("age", "-", "")]
        if intervals and rate is not None:
            every = f"every {duration_text(min(intervals))} to {duration_text(max(intervals))}"
            rows[0] = "rate", f"{rate:.1f} /s", every
        if ages:
            rows[1] = "age", duration_text(statistics.mean(ages)), f"at most {duration_text(max(ages))}"
        if self.newest is not None:
            size = len(self.proxy.operation(self.name).result.gather_result(self.newest.value, self.title))
            flow = f"{decimal(int(size * rate))} a second" if rate is not None else ""
            rows.append(("size", decimal(size), flow))
        name = "skipped" if self.rate else "lost"
        return [*rows, (name, str(figures.lost), f"of {figures.received + figures.lost}")]


def _print_samples(watched: _Watched, *, with_values: bool) -> None:
    """Print every sample as a line of JSON."""

    def print_sample(sample: Sample[Any]) -> None:
        line: dict[str, Json] = {
            "sequence": sample.sequence,
            "time": to_json(sample.time),
            "wallTime": to_json(sample.wall_time),
            "lost": watched.statistics.lost,
        }
        print_json({**line, "value": to_json(watched.value(sample))} if with_values else line)

    watched.follow(_LINE, take=print_sample)


def _print_lines(watched: _Watched) -> None:
    """Print the figures once a second."""
    typer.echo(f"{watched.title} of {watched.proxy.type_id} in realm {watched.realm}")
    watched.follow(
        _LINE, lambda: typer.echo("  ".join(f"{name} {text}" for name, text, _ in watched.figures()))
    )


def _show(watched: _Watched, *, with_values: bool) -> None:
    """Show figures and the newest value in place."""
    with Live(console=console(), auto_refresh=False, vertical_overflow="crop") as live, _logs_above():
        watched.follow(
            _REDRAW,
            lambda: live.update(_view(watched, live.console.height, with_values=with_values), refresh=True),
        )


@contextmanager
def _logs_above() -> Iterator[None]:
    """Send logs to the stream that the view has put in the place of stderr: they appear above the view."""
    handlers = [each for each in logging.getLogger().handlers if type(each) is logging.StreamHandler]
    before = [handler.setStream(sys.stderr) for handler in handlers]
    try:
        yield
    finally:
        for handler, stream in zip(handlers, before, strict=True):
            if stream is not None:
                handler.setStream(stream)


def _view(watched: _Watched, rows: int, *, with_values: bool) -> RenderableType:
    figures = watched.statistics
    realm = f"  {watched.proxy.type_id.removeprefix('::')} in realm {watched.realm}"
    head = Text.assemble((watched.title, "bold"), (realm, "dim"), no_wrap=True, overflow="ellipsis")
    grid = Table.grid(padding=(0, 2))
    for column in ({"style": "dim"}, {"justify": "right", "min_width": 8}, {"style": "dim"}):
        grid.add_column(**column)
    for name, figure, detail in watched.figures():
        grid.add_row(name, Text(figure, "bold red" if name == "lost" and figures.lost else "bold"), detail)
    parts: list[RenderableType] = [head, grid]
    if figures.restarts:
        parts.append(Text(f"the server was restarted ({count_text(figures.restarts, 'time')})", "yellow"))
    if not watched.proxy.is_there():
        parts.append(Text("the server is offline; waiting until it is back", "bold red"))
    elif figures.silence() > _SILENCE:
        parts.append(Text(f"no sample for {span_text(figures.silence())}", "yellow"))
    if with_values and watched.newest is not None:
        room = rows - len(parts) - 6
        lines = pretty(to_json(watched.value(watched.newest), shown_bytes), width()).splitlines()
        if len(lines) > room:
            lines = [*lines[: max(0, room - 1)], f"... {len(lines) - room + 1} more lines"]
        text = JSONHighlighter()("\n".join(lines))
        text.no_wrap, text.overflow = True, "ellipsis"
        parts += [Text(""), text]
    return Group(*parts)
