"""What those read who are refused, and what the terminal shows of refusals."""

from __future__ import annotations

import pytest
from starlette.datastructures import Headers

from codegen.messages import Message
from visualhfsm._editor.refusal import RefusalLog, refused


def test_who_is_refused_reads_why_in_the_language_of_the_browser() -> None:
    reason = Message("`{name}` is not defined", name="<b>")
    for language, text in (("", "is not defined"), ("es", "no está definido")):
        response = refused(Headers({"accept-language": language}), reason)
        assert (response.status_code, response.media_type) == (403, "text/plain")
        assert bytes(response.body).decode() == f"`<b>` {text}\n"


def test_a_reason_is_logged_again_only_after_a_while_with_their_number(
    caplog: pytest.LogCaptureFixture,
) -> None:
    now = 0.0
    log = RefusalLog(lambda: now)
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
