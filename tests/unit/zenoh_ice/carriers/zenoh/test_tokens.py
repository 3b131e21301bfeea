"""Which tokens count that come and end while they are reported; Zenoh's part is played by the test."""

from __future__ import annotations

import logging
from collections import deque
from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor
from types import SimpleNamespace
from typing import Any, cast

import pytest
import zenoh

from zenoh_ice.carriers.zenoh.tokens import FEW, MOST_QUESTIONS, MOST_UNSURE, PAUSE_STEP, Tokens

PATTERN = "**"
PUT, DELETE = zenoh.SampleKind.PUT, zenoh.SampleKind.DELETE


class Zenoh:
    """A session, and what is counted of its tokens."""

    def __init__(
        self,
        *reported: str,
        existing: Iterable[str] = (),
        overtaken: int = 0,
        most_unsure: int = MOST_UNSURE,
        pause_step: float = PAUSE_STEP,
    ) -> None:
        """Report some tokens to who subscribes, of which those exist that are named.

        Before so many questions are answered, another thread ends the answers.
        """
        self._reported = reported
        self.existing = set(existing)
        self._overtaken = overtaken
        self._jobs: deque[Callable[[], object]] = deque()
        self.while_answering: Callable[[], object] = lambda: None
        self.questions = 0
        self.present: set[str] = set()
        session = cast("zenoh.Session", self)
        self.tokens = Tokens(
            session, PATTERN, self._note, self._jobs.append, most_unsure, pause_step=pause_step
        )
        self.run_jobs()

    def liveliness(self) -> Zenoh:
        return self

    def declare_subscriber(self, _: str, handler: Callable[[Any], object], *, history: bool = False) -> Zenoh:
        if history:
            self._history = handler
            for token in self._reported:
                self.report(token)
        else:
            self._news = handler
        return self

    def get(self, key: str, *, handler: Any) -> None:
        self.questions += 1
        if self.questions <= self._overtaken:
            with ThreadPoolExecutor(1) as thread:
                thread.submit(handler.drop).result()
            return
        for token in self.existing if key == PATTERN else self.existing & {key}:
            handler(SimpleNamespace(ok=SimpleNamespace(key_expr=token)))
        self.while_answering()
        handler.drop()

    def undeclare(self) -> None:
        """Nothing remains of a subscriber."""

    def report(self, token: str) -> None:
        self._history(SimpleNamespace(key_expr=token, kind=PUT))

    def come(self, token: str) -> None:
        self.existing.add(token)
        self._news(SimpleNamespace(key_expr=token, kind=PUT))
        self.report(token)

    def end(self, token: str) -> None:
        self.existing.discard(token)
        for subscriber in (self._news, self._history):
            subscriber(SimpleNamespace(key_expr=token, kind=DELETE))

    def run_jobs(self) -> None:
        while self._jobs:
            self._jobs.popleft()()

    def _note(self, token: str, came: bool) -> None:
        (self.present.add if came else self.present.discard)(token)


def test_what_is_reported_counts_if_it_exists_when_asked_for() -> None:
    session = Zenoh("a", "b", existing="ac")
    assert session.present == {"a"}
    session.report("b")
    session.report("c")
    session.run_jobs()
    assert session.present == {"a", "c"}


def test_many_are_asked_for_at_once() -> None:
    many = [f"m{number}" for number in range(FEW + 1)]
    session = Zenoh(*many, "a", existing=many)
    assert session.present == set(many)
    assert session.questions == 2  # one for the token that was not among the answers


def test_nothing_is_asked_about_what_comes() -> None:
    session = Zenoh()
    for token in "abc":
        session.come(token)
    session.run_jobs()
    assert (session.present, session.questions) == (set("abc"), 0)


def test_nothing_is_asked_about_what_comes_after_it_was_reported() -> None:
    session = Zenoh()
    session.report("a")
    session.come("a")
    session.run_jobs()
    assert (session.present, session.questions) == ({"a"}, 0)


def test_a_report_after_the_end_does_not_count() -> None:
    session = Zenoh()
    session.come("a")
    session.end("a")
    session.report("a")
    session.run_jobs()
    assert session.present == set()
    session.come("a")
    assert session.present == {"a"}


def test_what_ends_while_it_is_asked_for_does_not_count() -> None:
    session = Zenoh(existing="ab")
    session.while_answering = lambda: session.end("a")
    session.report("a")
    session.report("b")
    session.run_jobs()
    assert session.present == {"b"}


def test_what_is_reported_again_after_that_is_asked_for_again() -> None:
    def end_and_report() -> None:
        session.end("a")
        session.report("a")
        session.while_answering = lambda: None

    session = Zenoh(existing="a")
    session.while_answering = end_and_report
    session.report("a")
    session.run_jobs()
    assert (session.present, session.questions) == (set(), 2)


def test_tokens_are_asked_for_again_when_answers_were_dropped() -> None:
    assert Zenoh("a", "b", existing="a", overtaken=3).present == {"a"}


def test_tokens_count_when_answers_are_always_dropped(caplog: pytest.LogCaptureFixture) -> None:
    with caplog.at_level(logging.WARNING):
        zenoh = Zenoh("a", "b", overtaken=2 * MOST_QUESTIONS, pause_step=0.0)
        assert zenoh.present == {"a", "b"}
    assert "**: 2 tokens may have ended: Zenoh drops answers" in caplog.text


def test_how_many_wait_to_be_confirmed_is_limited() -> None:
    assert Zenoh("a", "b", "c", most_unsure=2).present == {"c"}


def test_what_is_reported_twice_waits_once_to_be_confirmed() -> None:
    assert Zenoh("a", "b", "b", "a", most_unsure=2).present == set()


def test_nothing_is_reported_or_asked_after_the_end() -> None:
    session = Zenoh(existing="a")
    session.report("a")
    session.tokens.close()
    session.run_jobs()
    session.come("b")
    assert (session.present, session.questions) == (set(), 0)
