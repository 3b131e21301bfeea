"""What is counted of tokens that come and end while they are asked for; Zenoh's part is played by the test."""

from __future__ import annotations

import logging
from collections import deque
from collections.abc import Callable
from types import SimpleNamespace
from typing import Any, cast

import pytest
import zenoh

from zenoh_ros2._graph import Discovery, Entities

MOST = 3


class Asked:
    """Entities, with the session that they ask."""

    def __init__(self) -> None:
        self._jobs: deque[Callable[[], object]] = deque()
        self.entities = Entities(
            Discovery(cast("zenoh.Session", self), 0, self._jobs.append), "**", "what", MOST
        )

    def liveliness(self) -> Asked:
        return self

    def declare_subscriber(self, _tokens: str, handler: Callable[[object], object]) -> Asked:
        self._change = handler
        return self

    def undeclare(self) -> None:
        """Nothing remains of the subscriber."""

    def get(self, _tokens: str, *, handler: Any, timeout: float) -> None:
        assert timeout > 0
        self._report = handler

    def change(self, number: int, *, exists: bool) -> None:
        kind = zenoh.SampleKind.PUT if exists else zenoh.SampleKind.DELETE
        self._change(SimpleNamespace(key_expr=token(number), kind=kind))

    def report(self, number: int) -> None:
        self._report(SimpleNamespace(ok=SimpleNamespace(key_expr=token(number))))

    def all_are_reported(self) -> None:
        self._report.drop()

    def count(self) -> int:
        while self._jobs:
            self._jobs.popleft()()
        return len(self.entities)


@pytest.fixture
def asked() -> Asked:
    return Asked()


def token(number: int) -> str:
    of_text = f"std_msgs::msg::dds_::String_/RIHS01_{'0' * 64}/::,10:,:,:,,"
    return f"@ros2_lv/0/f{number:x}/0/1/MS/%/%/n/%a/{of_text}"


def test_reports_and_changes_are_counted_once(asked: Asked) -> None:
    asked.report(1)
    asked.change(1, exists=True)
    asked.change(2, exists=True)
    asked.report(2)
    assert asked.count() == 2
    asked.change(1, exists=False)
    assert asked.count() == 1


@pytest.mark.parametrize("handled", [False, True])
def test_an_end_outdates_a_report_that_comes_after_it(asked: Asked, handled: bool) -> None:
    asked.change(1, exists=False)
    if handled:
        assert asked.count() == 0
    asked.report(1)
    assert asked.count() == 0


def test_what_comes_back_counts_again(asked: Asked) -> None:
    asked.change(1, exists=False)
    asked.report(1)
    asked.change(1, exists=True)
    assert asked.count() == 1


def test_ends_are_kept_until_all_are_reported_and_not_beyond_the_most(
    asked: Asked, caplog: pytest.LogCaptureFixture
) -> None:
    with caplog.at_level(logging.WARNING):
        for number in range(MOST):
            asked.change(number, exists=False)
        assert (asked.count(), caplog.text) == (0, "")
        asked.change(MOST, exists=False)
        assert asked.count() == 0
    assert f"what: more than {MOST} exist" in caplog.text


def test_later_ends_are_not_kept(asked: Asked, caplog: pytest.LogCaptureFixture) -> None:
    asked.all_are_reported()
    with caplog.at_level(logging.WARNING):
        for number in range(2 * MOST):
            asked.change(number, exists=True)
            asked.change(number, exists=False)
            assert asked.count() == 0
    assert caplog.text == ""
