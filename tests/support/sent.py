"""What the server of the editor sends to a window."""

from __future__ import annotations

import asyncio
import contextlib
import json
from typing import Any

from tests.support.limits import RUN_LIMIT
from visualhfsm._editor.protocol import Answer
from visualhfsm._editor.window import Window

__all__ = ["sent"]


async def sent(window: Window) -> list[dict[str, Any]]:
    """Return the messages that wait for a window."""
    found: list[dict[str, Any]] = []
    everything = asyncio.Event()

    async def send(text: str) -> None:
        message = json.loads(text)
        if "re" in message:
            everything.set()
        else:
            found.append(message)

    window.answer(Answer(re=1))  # comes after all that was pushed
    writing = asyncio.create_task(window.write(send))
    await asyncio.wait_for(everything.wait(), RUN_LIMIT)
    writing.cancel()
    with contextlib.suppress(asyncio.CancelledError):
        await writing
    return found
