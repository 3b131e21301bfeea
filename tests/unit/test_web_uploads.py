"""Recordings that a window sends."""

from __future__ import annotations

import asyncio

import pytest

from visualhfsm.errors import VisualHfsmError
from visualhfsm.web.connection import Upload
from visualhfsm.web.tab import Threads


def test_a_recording_that_is_too_large_is_given_up() -> None:
    async def go() -> None:
        threads = Threads(1)
        upload = Upload(threads, largest=5)
        try:
            await upload.add("run.mcap", b"12345", begins=True)
            with pytest.raises(VisualHfsmError, match="larger than"):
                await upload.add("run.mcap", b"6", begins=False)
            with pytest.raises(VisualHfsmError, match="beginning was not sent"):
                await upload.add("run.mcap", b"6", begins=False)
        finally:
            upload.close()
            await threads.close()

    asyncio.run(go())
