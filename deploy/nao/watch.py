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
from deploy.nao.statistics import StreamStatistics, Summary
from deploy.nao.values import Json, to_json
from zenoh_ice import Sample, initialize
from zenoh_ice.settings import Settings

if TYPE_CHECKING:
    from rich.console import RenderableType

__all__ = ["watch"]

_REDRAW: Final = 0.1  # s between two pictures of the view
_LINE: Final = 1.0  # s between two lines, where the output is no terminal
_MOST_WAITING: Final = 1024  # samples that were received and not yet looked at
_LOOK: Final = 0.1  # s after which it is looked whether the end has come
_FEW_WAITING: Final = 4  # of those that may be images
_SILENCE: Final = 2.0  # s after which it is told that nothing comes


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
        watched = _Watched(proxy, name, rate)
        with watched.follow():
            limit = time.monotonic() + seconds if seconds else math.inf
            if as_json:
                _print_samples(watched, count, limit, with_values=with_values)
            elif for_people():
                _show(watched, count, limit, with_values=with_values)
            else:
                _print_lines(watched, count, limit)


class _Watched:
    """A stream that is followed: its samples, counted as they are taken."""

    def __init__(self, proxy: DynamicProxy, name: str, rate: float | None) -> None:
        self.title: Final = f"{proxy.proxy.ice_getIdentity()}.{name}"
        self.type_id: Final = proxy.type_id
        self.realm: Final = proxy.proxy.ice_getRealm()
        self.statistics: Final = StreamStatistics()
        self.newest: Sample[Any] | None = None
        self._proxy: Final = proxy
        self._name: Final = name
        self.rate: Final = rate
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

    def next(self, timeout: float) -> Sample[Any] | None:
        """Return the next sample, or None when none comes within some seconds."""
        try:
            sample, arrived, age = self._arrived.get(timeout=max(0.0, timeout))
        except queue.Empty:
            return None
        self.statistics.add(sample, arrived, age)
        self.newest = sample
        return sample

    def value(self, sample: Sample[Any]) -> object:
        """Return what the sample brought: a value, or several by name."""
        results = self._proxy.results(self._name, sample.value)
        return next(iter(results.values())) if len(results) == 1 else results

    def size(self) -> int | None:
        """Return how many bytes the newest sample has on the wire."""
        if self.newest is None:
            return None
        return len(self._proxy.operation(self._name).result.pack_result(self.newest.value, self.title))

    def is_there(self) -> bool:
        """Return whether the servant is there."""
        return self._proxy.is_there()


def _print_samples(watched: _Watched, count: int, limit: float, *, with_values: bool) -> None:
    """Print every sample as a line of JSON."""
    left = count or math.inf
    while left > 0 and (now := time.monotonic()) < limit:
        sample = watched.next(min(_LINE, limit - now))
        if sample is None:
            continue
        left -= 1
        line: dict[str, Json] = {
            "sequence": sample.sequence,
            "time": to_json(sample.time),
            "wallTime": to_json(sample.wall_time),
            "lost": watched.statistics.lost,
        }
        print_json({**line, "value": to_json(watched.value(sample))} if with_values else line)


def _print_lines(watched: _Watched, count: int, limit: float) -> None:
    """Print a line a second of what there is to tell."""
    print_line(f"{watched.title} of {watched.type_id} in realm {watched.realm}")

    def tell() -> None:
        summary = watched.statistics.summary()
        print_line("  ".join(f"{name} {text}" for name, text, _ in _figures(summary, watched)))

    _follow(watched, count, limit, _LINE, tell)


def _show(watched: _Watched, count: int, limit: float, *, with_values: bool) -> None:
    """Show figures and the newest value in place."""
    from rich.live import Live

    with (
        Live(console=console(), auto_refresh=False, vertical_overflow="crop") as live,
        _logs_above(),
    ):
        _follow(
            watched,
            count,
            limit,
            _REDRAW,
            lambda: live.update(_view(watched, live.console.height, with_values=with_values), refresh=True),
        )


@contextmanager
def _logs_above() -> Iterator[None]:
    """Let logs go where the view has put itself: it takes them, and moves down."""
    moved = [
        (handler, handler.setStream(sys.stderr))
        for handler in logging.getLogger().handlers
        if isinstance(handler, logging.StreamHandler)
    ]
    try:
        yield
    finally:
        for handler, stream in moved:
            if stream is not None:
                handler.setStream(stream)


def _follow(watched: _Watched, count: int, limit: float, period: float, tell: Callable[[], None]) -> None:
    """Take samples until the end, and tell of them once a period."""
    left = count or math.inf
    due = time.monotonic() + period
    try:
        while left > 0 and (now := time.monotonic()) < limit:
            if now >= due:
                tell()
                due = max(due + period, now)
            if watched.next(min(due, limit) - time.monotonic()) is not None:
                left -= 1
    finally:
        tell()


def _figures(summary: Summary, watched: _Watched) -> list[tuple[str, str, str]]:
    """Return name, figure and detail of what there is to tell of a stream."""
    size = watched.size()
    rows = []
    if summary.rate is not None and summary.interval is not None:
        shortest, longest = summary.interval
        every = f"every {duration_text(shortest)} to {duration_text(longest)}"
        rows.append(("rate", rate_text(summary.rate), every))
    else:
        rows.append(("rate", "-", ""))
    if summary.age is not None and summary.oldest is not None:
        rows.append(("age", duration_text(summary.age), f"at most {duration_text(summary.oldest)}"))
    else:
        rows.append(("age", "-", ""))
    if size is not None:
        flow = f"{bytes_text(size * summary.rate)} a second" if summary.rate is not None else ""
        rows.append(("size", bytes_text(size), flow))
    name = "skipped" if watched.rate else "lost"
    rows.append((name, str(summary.lost), f"of {summary.received + summary.lost}"))
    return rows


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
    for name, figure, detail in _figures(summary, watched):
        style = "bold red" if name == "lost" and summary.lost else "bold"
        grid.add_row(name, Text(figure, style=style), detail)
    parts: list[RenderableType] = [head, grid]
    if summary.restarts:
        parts.append(Text(f"the server was restarted ({count_text(summary.restarts, 'time')})", "yellow"))
    if not watched.is_there():
        parts.append(Text("the server is gone; this goes on as soon as it is back", "bold red"))
    elif summary.silence > _SILENCE:
        parts.append(Text(f"nothing came for {span_text(summary.silence)}", "yellow"))
    sample = watched.newest
    if with_values and sample is not None:
        room = rows - len(parts) - 6
        lines = pretty(to_json(watched.value(sample), shown_bytes), width()).splitlines()
        if len(lines) > room:
            lines = [*lines[: max(0, room - 1)], f"... {len(lines) - room + 1} more lines"]
        text = Text("\n".join(lines), no_wrap=True, overflow="ellipsis")
        JSONHighlighter().highlight(text)
        parts += [Text(""), text]
    return Group(*parts)
