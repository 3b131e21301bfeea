"""What waits to be sent to one window.

Nothing grows here while a window is slow: of each thing only the newest value waits, and it is made when
there is room to send it. Answers wait in order; there are never more of them than requests under way.
Output of components is kept line by line, the oldest lines going first.
"""

from __future__ import annotations

import asyncio
from collections import deque
from collections.abc import Callable, Hashable

from .protocol import Output, OutputLine, encode

__all__ = ["Outbox"]

MakePush = Callable[[], bytes | None]


class Outbox:
    """Used on the event loop only."""

    def __init__(self, output_lines: int) -> None:
        self._answers: list[bytes] = []
        self._pushes: dict[Hashable, MakePush] = {}
        self._output: dict[int, deque[OutputLine]] = {}
        self._dropped: dict[int, int] = {}
        self._whole: set[int] = set()
        self._output_lines = output_lines
        self._filled = asyncio.Event()

    def answer(self, message: bytes) -> None:
        """Send an answer; everything that was pushed before goes first."""
        self._answers.append(message)
        self._filled.set()

    def push(self, key: Hashable, make: MakePush) -> None:
        """Send what `make` gives once there is room, nothing for None; replaces a former one of the key."""
        self._pushes[key] = make
        self._filled.set()

    def output(self, push: Output) -> None:
        """Send lines of output; those that are the whole take the place of those that wait."""
        if push.whole:
            self._whole.add(push.tab)
            self._output.pop(push.tab, None)
            self._dropped.pop(push.tab, None)
        lines = self._output.setdefault(push.tab, deque())
        lines.extend(push.lines)
        excess = max(0, len(lines) - self._output_lines)
        for _ in range(excess):
            lines.popleft()
        self._dropped[push.tab] = self._dropped.get(push.tab, 0) + excess + push.dropped
        self._filled.set()

    def forget(self, keys: Callable[[Hashable], bool]) -> None:
        """Leave out the pushes whose key is one of those."""
        for key in [key for key in self._pushes if keys(key)]:
            del self._pushes[key]

    async def next(self) -> list[bytes]:
        """Wait until there is something to send and return it: first what was pushed, then the
        answers.
        """
        await self._filled.wait()
        self._filled.clear()
        answers, self._answers = self._answers, []
        pushes, self._pushes = self._pushes, {}
        output, self._output = self._output, {}
        dropped, self._dropped = self._dropped, {}
        whole, self._whole = self._whole, set()
        # Output first: what a component wrote comes before the news that it ended.
        messages = [
            encode(Output(tab=tab, lines=list(lines), dropped=dropped[tab], whole=tab in whole))
            for tab, lines in output.items()
        ]
        messages.extend(message for make in pushes.values() if (message := make()) is not None)
        return messages + answers
