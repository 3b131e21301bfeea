"""Follow a stream: its rate, age, size and losses, and what it brings."""

from __future__ import annotations

import logging
import math
import queue
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from typing import TYPE_CHECKING, Any, Final

from deploy.nao.call import shown_bytes
from deploy.nao.connection import find_operation
from deploy.nao.dynamic import DynamicProxy
from deploy.nao.output import console, for_people, pretty, print_json, print_line, width
from deploy.nao.quantities import bytes_text, count_text, duration_text, rate_text, span_text
from deploy.nao.statistics import StreamStatistics
from deploy.nao.values import Json, to_json
from zenoh_ice import Sample, initialize
from zenoh_ice.settings import Settings

if TYPE_CHECKING:
    from rich.console import RenderableType

__all__ = ["watch"]

_REDRAW: Final = 0.1  # s between two pictures of the view
_LINE: Final = 1.0  # s between two lines, where the output is no terminal
_MOST_WAITING: Final = 1024  # samples that were received and not yet looked at
_FEW_WAITING: Final = 4  # of those that may be images
_LOOK: Final = 0.1  # s after which it is looked whether the end has come
_SILENCE: Final = 2.0  # s after which the view says that nothing comes


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

    At most `rate` samples a second are taken, if that is given. Raises UsageError when there is no such
    stream, and whatever a call raises when its servant is not there at the beginning.
    """
    with initialize(settings) as communicator:
        proxy, name = find_operation(communicator, address, streamed=True)
        watched = _Watched(proxy, name, rate, count or math.inf, seconds or math.inf)
        with watched.follow():
            if as_json:
                _print_samples(watched, with_values=with_values)
            elif for_people():
                _show(watched, with_values=with_values)
            else:
                _print_lines(watched)


class _Watched:
    """A stream that is followed: its samples, counted as they are taken."""

    def __init__(
        self, proxy: DynamicProxy, name: str, rate: float | None, count: float, seconds: float
    ) -> None:
        self.title: Final = f"{proxy.proxy.ice_getIdentity()}.{name}"
        self.type_id: Final = proxy.type_id
        self.realm: Final = proxy.proxy.ice_getRealm()
        self.statistics: Final = StreamStatistics()
        self.newest: Sample[Any] | None = None
        self.rate: Final = rate
        self.is_there: Final = proxy.is_there
        self._proxy: Final = proxy
        self._name: Final = name
        self._left = count
        self._limit: Final = time.monotonic() + seconds
        self._arrived: Final[queue.Queue[tuple[Sample[Any], float, float]]] = queue.Queue(1)
        self._ended: Final = threading.Event()

    @contextmanager
    def follow(self) -> Iterator[None]:
        """Take samples while the context lasts."""
        if self.rate:
            most_waiting = 1  # the newest in its turn
        else:  # images are large, and those who look at them want the newest
            bulk = self._proxy.operation(self._name).result.holds_bytes
            most_waiting = _FEW_WAITING if bulk else _MOST_WAITING
        stream = self._proxy.stream(self._name)
        with stream.subscribe(self._take, rate=self.rate, queue=most_waiting):
            try:
                yield
            finally:
                self._ended.set()

    def _take(self, sample: Sample[Any]) -> None:
        # Ages are taken here: afterwards they would have waited for the view.
        arrived = sample, time.monotonic(), time.time() - sample.wall_time
        while not self._ended.is_set():
            with suppress(queue.Full):
                self._arrived.put(arrived, timeout=_LOOK)
                return

    def samples(self, period: float, report: Callable[[], None] | None = None) -> Iterator[Sample[Any]]:
        """Yield samples until the end; call a function once a period, and at the end."""
        due = time.monotonic() + period
        try:
            while self._left > 0 and (now := time.monotonic()) < self._limit:
                if now >= due:
                    if report is not None:
                        report()
                    due = max(due + period, now)
                try:
                    wait = max(0.0, min(due, self._limit) - time.monotonic())
                    sample, arrived, age = self._arrived.get(timeout=wait)
                except queue.Empty:
                    continue
                self.statistics.add(sample, arrived, age)
                self.newest = sample
                self._left -= 1
                yield sample
        finally:
            if report is not None:
                report()

    def value(self, sample: Sample[Any]) -> object:
        """Return what the sample brought: a value, or several by name."""
        results = self._proxy.results(self._name, sample.value)
        return next(iter(results.values())) if len(results) == 1 else results

    def figures(self) -> list[tuple[str, str, str]]:
        """Return name, figure and detail of what is known of the stream."""
        summary = self.statistics.summary()
        rows = [("rate", "-", ""), ("age", "-", "")]
        if summary.rate is not None and summary.interval is not None:
            shortest, longest = map(duration_text, summary.interval)
            rows[0] = "rate", rate_text(summary.rate), f"every {shortest} to {longest}"
        if summary.age is not None and summary.oldest is not None:
            rows[1] = "age", duration_text(summary.age), f"at most {duration_text(summary.oldest)}"
        if self.newest is not None:
            size = len(self._proxy.operation(self._name).result.pack_result(self.newest.value, self.title))
            flow = f"{bytes_text(size * summary.rate)} a second" if summary.rate is not None else ""
            rows.append(("size", bytes_text(size), flow))
        name = "skipped" if self.rate else "lost"
        return [*rows, (name, str(summary.lost), f"of {summary.received + summary.lost}")]


def _print_samples(watched: _Watched, *, with_values: bool) -> None:
    """Print every sample as a line of JSON."""
    for sample in watched.samples(_LINE):
        line: dict[str, Json] = {
            "sequence": sample.sequence,
            "time": to_json(sample.time),
            "wallTime": to_json(sample.wall_time),
            "lost": watched.statistics.lost,
        }
        print_json({**line, "value": to_json(watched.value(sample))} if with_values else line)


def _print_lines(watched: _Watched) -> None:
    """Print the figures once a second."""
    print_line(f"{watched.title} of {watched.type_id} in realm {watched.realm}")

    def report() -> None:
        print_line("  ".join(f"{name} {text}" for name, text, _ in watched.figures()))

    for _ in watched.samples(_LINE, report):
        pass


def _show(watched: _Watched, *, with_values: bool) -> None:
    """Show figures and the newest value in place."""
    from rich.live import Live

    with Live(console=console(), auto_refresh=False, vertical_overflow="crop") as live, _logs_above():

        def draw() -> None:
            live.update(_view(watched, live.console.height, with_values=with_values), refresh=True)

        for _ in watched.samples(_REDRAW, draw):
            pass


@contextmanager
def _logs_above() -> Iterator[None]:
    """Let logs go to what the view has put in place of stderr: it takes them, and moves down."""
    handlers = [each for each in logging.getLogger().handlers if isinstance(each, logging.StreamHandler)]
    before = [handler.setStream(sys.stderr) for handler in handlers]
    try:
        yield
    finally:
        for handler, stream in zip(handlers, before, strict=True):
            if stream is not None:
                handler.setStream(stream)


def _view(watched: _Watched, rows: int, *, with_values: bool) -> RenderableType:
    from rich.console import Group
    from rich.highlighter import JSONHighlighter
    from rich.table import Table
    from rich.text import Text

    summary = watched.statistics.summary()
    head = Text.assemble(
        (watched.title, "bold"),
        (f"  {watched.type_id.removeprefix('::')} in realm {watched.realm}", "dim"),
        no_wrap=True,
        overflow="ellipsis",
    )
    grid = Table.grid(padding=(0, 2))
    grid.add_column(style="dim")
    grid.add_column(justify="right", min_width=8)
    grid.add_column(style="dim")
    for name, figure, detail in watched.figures():
        style = "bold red" if name == "lost" and summary.lost else "bold"
        grid.add_row(name, Text(figure, style=style), detail)
    parts: list[RenderableType] = [head, grid]
    if summary.restarts:
        parts.append(Text(f"the server was restarted ({count_text(summary.restarts, 'time')})", "yellow"))
    if not watched.is_there():
        parts.append(Text("the server is gone; this goes on as soon as it is back", "bold red"))
    elif summary.silence > _SILENCE:
        parts.append(Text(f"nothing came for {span_text(summary.silence)}", "yellow"))
    if with_values and watched.newest is not None:
        room = rows - len(parts) - 6
        lines = pretty(to_json(watched.value(watched.newest), shown_bytes), width()).splitlines()
        if len(lines) > room:
            lines = [*lines[: max(0, room - 1)], f"... {len(lines) - room + 1} more lines"]
        text = Text("\n".join(lines), no_wrap=True, overflow="ellipsis")
        JSONHighlighter().highlight(text)
        parts += [Text(""), text]
    return Group(*parts)
