"""What waits for a slow window."""

from __future__ import annotations

import asyncio
import json
from collections.abc import Callable
from functools import partial

import pytest

from tests.support.limits import LIMIT
from visualhfsm.web.outbox import Outbox
from visualhfsm.web.protocol import Output, OutputLine


def waiting(fill: Callable[[Outbox], None], lines: int = 5) -> list[bytes]:
    async def take() -> list[bytes]:
        outbox = Outbox(lines)
        fill(outbox)
        return await asyncio.wait_for(outbox.next(), LIMIT)

    return asyncio.run(take())


def lines(*texts: str, tab: int = 1) -> Output:
    return Output(tab=tab, lines=[OutputLine(text=text) for text in texts])


def test_of_each_thing_only_the_newest_is_made() -> None:
    made: list[str] = []

    def make(text: str) -> bytes:
        made.append(text)
        return text.encode()

    def fill(outbox: Outbox) -> None:
        outbox.push("document", partial(make, "old"))
        outbox.push("document", partial(make, "new"))
        outbox.push("problems", lambda: b"problems")
        outbox.push("nothing", lambda: None)

    assert waiting(fill) == [b"new", b"problems"]
    assert made == ["new"]


def test_what_was_pushed_comes_before_the_answers_in_their_order() -> None:
    def fill(outbox: Outbox) -> None:
        outbox.answer(b"first")
        outbox.push("document", lambda: b"document")
        outbox.answer(b"second")

    assert waiting(fill) == [b"document", b"first", b"second"]


def test_output_comes_first_and_loses_its_oldest_lines() -> None:
    def fill(outbox: Outbox) -> None:
        outbox.push("run", lambda: b"ended")
        outbox.output(lines("a", "b", "c"))
        outbox.output(lines("d", "e", "f", "g"))
        outbox.output(lines("x", tab=2))

    output, other, ended = waiting(fill)
    told = json.loads(output)
    assert ([line["text"] for line in told["lines"]], told["dropped"]) == (["c", "d", "e", "f", "g"], 2)
    assert json.loads(other)["tab"] == 2
    assert ended == b"ended"


def test_the_whole_output_takes_the_place_of_what_waits() -> None:
    def fill(outbox: Outbox) -> None:
        outbox.output(lines("a", "b", "c", "d", "e", "f"))
        outbox.output(Output(tab=1, lines=lines("a", "b").lines, whole=True))
        outbox.output(lines("c"))

    (told,) = map(json.loads, waiting(fill))
    assert [line["text"] for line in told["lines"]] == ["a", "b", "c"]
    assert (told["dropped"], told["whole"]) == (0, True)


def test_what_is_forgotten_is_not_sent() -> None:
    def fill(outbox: Outbox) -> None:
        outbox.push(("document", 1), lambda: b"one")
        outbox.push(("document", 2), lambda: b"two")
        outbox.forget(lambda key: key == ("document", 1))

    assert waiting(fill) == [b"two"]


def test_nothing_is_sent_twice() -> None:
    async def take() -> None:
        outbox = Outbox(5)
        outbox.answer(b"once")
        assert await outbox.next() == [b"once"]
        with pytest.raises(TimeoutError):
            await asyncio.wait_for(outbox.next(), 0.01)

    asyncio.run(take())
