"""What callbacks raise: their watchers are notified, and everything else goes on."""

from __future__ import annotations

from collections.abc import Iterator
from concurrent.futures import Future

import pytest

from zenoh_ice.objects.callbacks import CallFuture, failure_watchers


@pytest.fixture
def failures() -> Iterator[list[BaseException]]:
    """Watch for a test what callbacks raise."""
    found: list[BaseException] = []
    failure_watchers.append(found.append)
    yield found
    failure_watchers.remove(found.append)


@pytest.mark.parametrize("is_late", [False, True], ids=["before the outcome", "after it"])
def test_watchers_are_notified_of_what_a_callback_of_a_call_raises(
    is_late: bool, failures: list[BaseException], caplog: pytest.LogCaptureFixture
) -> None:
    heard: list[object] = []
    error = ValueError("no such place")

    def fail(_: Future[object]) -> None:
        raise error

    call = CallFuture()
    if is_late:
        call.set_result(3)
    call.add_done_callback(fail)
    call.add_done_callback(lambda each: heard.append(each.result()))
    if not is_late:
        call.set_result(3)
    assert heard == [3]
    assert failures == [error]
    assert "no such place" in caplog.text
