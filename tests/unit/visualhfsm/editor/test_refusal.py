"""What those read who are refused, people a page, programs a line; what the terminal shows of refusals."""

from __future__ import annotations

import pytest
from starlette.datastructures import Headers

from codegen.messages import Message
from visualhfsm._editor.refusal import RefusalLog, refused

REASON = Message("`{name}` is not defined", name="<b>")


def answer(path: str = "/", **headers: str) -> tuple[str, str]:
    """Return the type and the text of the answer to a request that is refused."""
    response = refused(
        Headers({name.replace("_", "-"): value for name, value in headers.items()}), path, REASON
    )
    assert response.status_code == 403
    return str(response.media_type), bytes(response.body).decode()


def test_a_program_gets_a_line_in_english() -> None:
    assert answer(accept_language="es") == ("text/plain", "`<b>` is not defined\n")


def test_people_get_a_page_in_their_language_whose_texts_are_no_html() -> None:
    kind, page = answer(accept="text/html", accept_language="es")
    assert kind == "text/html"
    assert "<p>`&lt;b&gt;` no está definido</p>" in page
    assert "?token=" in page


def test_a_viewer_is_not_sent_to_a_terminal() -> None:
    assert "?token=" not in answer("/view/", accept="text/html")[1]


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
