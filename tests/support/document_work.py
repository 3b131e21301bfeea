"""Work for documents in any order, by what runs something for each of them."""

from __future__ import annotations

import asyncio
import os
import random
from collections import Counter
from collections.abc import Awaitable, Callable, Sequence
from functools import partial
from pathlib import Path
from typing import Any, Final

import pytest

from codegen.hfsm.document import Document
from tests.support.interleaving import Nursery, interleave
from tests.support.soak import repeated
from visualhfsm._base.errors import VisualHfsmError
from visualhfsm._base.work import PerDocument
from visualhfsm._monitor.messages import Source

WAITING: Final = "waiting.py"
"""The role of a process that is started ahead, and runs nothing yet."""
SEEDS: Final = range(repeated(300, soak=10_000))


def two_sources(folder: Path) -> list[Source]:
    """Return two documents of one name."""
    found = []
    for tab, name in enumerate(("one", "two"), 1):
        path = folder / name / "walk.xml"
        path.parent.mkdir()
        path.write_text("<VisualHFSM/>")
        (path.parent / "test_walk.py").write_text("def test_walk(): 'walk.xml'")
        found.append(Source(tab, 1, Document(), path, False))
    return found


def role(command: Sequence[str]) -> str:
    """Return what only one child may do at a time: be a component of a name, or test or try a document."""
    match command:
        case [_, str(component), *_] if component.endswith(".py"):
            return Path(component).name
    return "two" if "/two/" in " ".join(command) else "one"


def check_interleaved(
    make: Callable[[Callable[[Any], None]], PerDocument[Any]],
    requests: Callable[[Any, Source], list[Callable[[], Awaitable[object]]]],
    shown: Callable[[Any], int],
    sources: Sequence[Source],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Assert that whatever is asked in any order, no two children do the same, and none is left.

    `requests` are made of what `make` returns, and `shown` is how many children of a document a push names.
    """
    ran = 0

    async def go(seed: int) -> None:
        nonlocal ran
        chance = random.Random(seed)
        nursery = Nursery(chance, role)
        monkeypatch.setattr(asyncio.BaseEventLoop, "subprocess_exec", nursery.subprocess_exec)
        monkeypatch.setattr(os, "killpg", nursery.killpg)
        monkeypatch.setattr(asyncio, "to_thread", nursery.to_thread)
        known: Counter[int] = Counter()

        def publish(push: Any) -> None:
            known[push.tab] = shown(push)

        async def rest() -> None:
            for _ in range(40):
                await asyncio.sleep(0)
            assert running() == known.total(), seed

        def running() -> int:
            return nursery.alive.total() - nursery.alive[WAITING]

        service = make(publish)
        asked = [each for source in sources for each in requests(service, source)] * 2
        asked += [partial(service.stop, source.tab) for source in sources]
        if seed % 2:
            asked.append(partial(service.forget, 1))
        if seed % 3 == 0:
            asked.append(service.close)
        await interleave(chance, asked, delays=(0.0,))
        await rest()
        assert max(nursery.most.values(), default=0) <= 1, seed
        ran += nursery.most.total()
        for tab in (1, 2):
            await service.stop(tab)
        await rest()
        assert not running(), seed
        await interleave(chance, [asked[0], asked[1], service.close], delays=(0.0,))
        await rest()
        assert not nursery.alive.total(), seed
        with pytest.raises(VisualHfsmError, match="the document was closed"):
            await requests(service, sources[1])[1]()

    async def all_of_them() -> None:
        for seed in SEEDS:
            await go(seed)

    asyncio.run(all_of_them())
    assert ran > len(SEEDS) / 2
