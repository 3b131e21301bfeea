"""Recordings that a window sends."""

from __future__ import annotations

import asyncio

import pytest

from visualhfsm.errors import VisualHfsmError
from visualhfsm.web.uploads import Upload
from visualhfsm.web.work import Workers


def test_a_recording_that_is_too_large_is_given_up() -> None:
    async def go() -> None:
        workers = Workers(1)
        upload = Upload(workers, largest=5)
        try:
            await upload.add("run.mcap", b"12345", begins=True)
            with pytest.raises(VisualHfsmError, match="larger than"):
                await upload.add("run.mcap", b"6", begins=False)
            with pytest.raises(VisualHfsmError, match="no recording was sent"), upload.whole():
                pass
        finally:
            upload.close()
            await workers.close()

    asyncio.run(go())
