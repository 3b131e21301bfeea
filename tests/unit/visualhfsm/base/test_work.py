"""Work for documents in any order: each has one child, all of them are known, and none lives after the close."""

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
from visualhfsm._monitor.messages import PartLimits, Source, StartedPush
from visualhfsm._processes import components
from visualhfsm._processes.components import StartedComponents
from visualhfsm._processes.test_results import TestsPush
from visualhfsm._processes.tests import StartedTests
from visualhfsm.trials._messages import Choices, TrialsPush
from visualhfsm.trials._service import RunningTrials

WAITING: Final = "waiting.py"
"""The role of a process that is started ahead, and runs nothing yet."""
SEEDS: Final = range(repeated(300, soak=10_000))


@pytest.fixture
def sources(tmp_path: Path) -> list[Source]:
    """Return two documents of one name."""
    found = []
    for tab, folder in enumerate(("one", "two"), 1):
        path = tmp_path / folder / "walk.xml"
        path.parent.mkdir()
        path.write_text("<VisualHFSM/>")
        (path.parent / "test_walk.py").write_text("def test_walk(): 'walk.xml'")
        found.append(Source(tab, 1, Document(), path, False))
    return found


Service = StartedComponents | StartedTests | RunningTrials


def requests(service: Service, source: Source) -> list[Callable[[], Awaitable[object]]]:
    match service:
        case StartedComponents():
            return [partial(service.start, source, []), partial(service.generate, source)]
        case StartedTests():
            return [partial(service.start, source), partial(service.find, source)]
        case RunningTrials():
            return [partial(service.run, source, Choices()), partial(service.read, source)]


def shown(push: object) -> int:
    """Return how many children of a document the page knows."""
    match push:
        case StartedPush():
            return push.status != "ended"
        case TestsPush() | TrialsPush():
            return push.status != "idle"
    raise AssertionError(push)


def role(command: Sequence[str]) -> str:
    """Return what only one child may do at a time: be a component of a name, or test or try a document."""
    match command:
        case [_, str(component), *_] if component.endswith(".py"):
            return Path(component).name
    return "two" if "/two/" in " ".join(command) else "one"


@pytest.mark.slow
@pytest.mark.parametrize("make", [
    lambda pushes, folder: StartedComponents(pushes, limits=PartLimits(preparation=0.0)),
    lambda pushes, folder: StartedTests(pushes, folder),
    lambda pushes, folder: RunningTrials(pushes),
], ids=["components", "tests", "trials"])  # fmt: skip
def test_whatever_is_asked_in_any_order_no_two_children_do_the_same_and_none_is_left(
    make: Callable[[Callable[[Any], None], Path], Service],
    sources: list[Source],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(components, "generate_component", lambda file, target, *_, **__: target / "walk.py")
    monkeypatch.setattr(components, "read_origins", lambda *_, **__: None)
    ran = 0

    async def go(seed: int) -> None:
        nonlocal ran
        chance = random.Random(seed)
        nursery = Nursery(chance, role)
        monkeypatch.setattr(asyncio.BaseEventLoop, "subprocess_exec", nursery.subprocess_exec)
        monkeypatch.setattr(os, "killpg", nursery.killpg)
        monkeypatch.setattr(asyncio, "to_thread", nursery.to_thread)
        known: Counter[int] = Counter()

        def publish(push: StartedPush | TestsPush | TrialsPush) -> None:
            known[push.tab] = shown(push)

        async def rest() -> None:
            for _ in range(40):
                await asyncio.sleep(0)
            assert running() == known.total(), seed

        def running() -> int:
            return nursery.alive.total() - nursery.alive[WAITING]

        service = make(publish, tmp_path)
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
