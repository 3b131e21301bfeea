"""Lines of the log about refusals: what is refused again and again does not fill the terminal."""

from __future__ import annotations

import pytest

from codegen.messages import Message
from visualhfsm._web.refusal_log import RefusalLog


def test_a_reason_is_logged_again_only_after_a_while_with_their_number(
    caplog: pytest.LogCaptureFixture, monkeypatch: pytest.MonkeyPatch
) -> None:
    now = 0.0
    monkeypatch.setattr("visualhfsm._web.refusal_log.time.monotonic", lambda: now)
    log = RefusalLog()
    for _ in range(3):
        log.add("no cookie")
    log.add("another host")
    now = 59.0
    log.add("no cookie")
    now = 61.0
    log.add("no cookie")
    assert caplog.messages == [
        "refused a request: no cookie",
        "refused a request: another host",
        "refused a request: no cookie (3 more since the last report)",
    ]


def test_a_refusal_is_logged_in_english(caplog: pytest.LogCaptureFixture) -> None:
    RefusalLog().add(Message("`{name}` is not defined", name="<b>"))
    assert caplog.messages == ["refused a request: `<b>` is not defined"]
