"""docs/reference/shelf.md has the ready states as their documents describe them."""

from __future__ import annotations

from tests.support.shelf_page import PAGE, shelf_page


def test_the_list_of_ready_states_is_current() -> None:
    assert PAGE.read_text("utf-8") == shelf_page(), "write it again: python -m tests.support.shelf_page"
