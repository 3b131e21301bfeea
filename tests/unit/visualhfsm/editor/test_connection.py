"""A connection whose window asks without end, and reads nothing."""

from __future__ import annotations

import asyncio
from types import SimpleNamespace
from typing import Any

from tests.support.limits import EVENT_LIMIT
from visualhfsm._editor.connection import converse
from visualhfsm._editor.limits import Limits


class Flood:
    """A websocket that has always another request, and takes no answers."""

    def __init__(self, request: str) -> None:
        self.received = 0
        self.others = 0
        self._request = request

    async def accept(self) -> None: ...

    async def receive(self) -> dict[str, Any]:
        self.received += 1
        return {"type": "websocket.receive", "text": self._request}

    async def send_text(self, text: str) -> None:
        await asyncio.Event().wait()


async def _leave(_window: object) -> None: ...


def received(request: str, limits: Limits, *, is_viewer: bool) -> int:
    """Return how many requests of a flood are read while others have 10,000 turns."""
    workspace: Any = SimpleNamespace(limits=limits, leave=_leave)

    async def run() -> int:
        flood: Any = Flood(request)
        conversation = asyncio.create_task(converse(flood, workspace, is_viewer=is_viewer))
        async with asyncio.timeout(EVENT_LIMIT):
            for _ in range(10_000):
                await asyncio.sleep(0)
        conversation.cancel()
        await asyncio.gather(conversation, return_exceptions=True)
        return flood.received  # type: ignore[no-any-return]

    return asyncio.run(run())


def test_no_more_is_read_of_a_window_that_takes_no_answers() -> None:
    """What waits to be sent was taken together, and as many answers may wait again."""
    assert received("{}", Limits(unsent_answers=10), is_viewer=False) in range(11, 24)


def test_no_more_is_read_of_a_viewer_who_asks_too_fast() -> None:
    limits = Limits(viewer_requests=0.001, unsent_answers=1000)
    assert received('{"id": 1, "op": "outputShown"}', limits, is_viewer=True) == 1


def test_others_have_their_turn_between_requests() -> None:
    limits = Limits(unsent_answers=1_000_000)
    assert received('{"id": 1, "op": "outputShown"}', limits, is_viewer=False) in range(2, 10_001)
