"""Make assertions about an element once it exists."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterator
from typing import Any, Final, Literal

import pytest
from playwright.sync_api import Error, Locator, expect

__all__ = ["awaited_elements"]

_WITHOUT_ELEMENT: Final = ("not_", "to_be_hidden", "to_have_count")
"""Prefixes of the assertions that may hold without the element."""


class _Awaiting:
    """The assertions of Playwright about an element, which is awaited first."""

    def __init__(self, locator: Locator, assertions: object) -> None:
        self._locator = locator
        self._assertions = assertions

    def __getattr__(self, name: str) -> Callable[..., None]:
        assertion: Callable[..., None] = getattr(self._assertions, name)
        if name.startswith(_WITHOUT_ELEMENT):
            return assertion

        def assert_of_element(*expected: object, timeout: float | None = None, **options: object) -> None:
            if not (expected and isinstance(expected[0], list)):  # a list is about any number of elements
                state: Literal["attached", "visible"] = "visible" if name == "to_be_visible" else "attached"
                try:
                    self._locator.wait_for(state=state, timeout=timeout)
                except Error:
                    timeout = 1.0  # the assertion fails, and says why
                else:
                    if state == "visible":
                        return
            assertion(*expected, timeout=timeout, **options)

        return assert_of_element


@contextlib.contextmanager
def awaited_elements() -> Iterator[None]:
    """Let `expect` wait for an element before it checks it, within the block.

    Whenever the element is missing, Playwright would describe the whole page in words, for an error that nobody
    sees: this takes Chromium as long as drawing the page several times.
    """
    genuine = type(expect).__call__

    def expect_of(self: Any, actual: Any, message: str | None = None) -> Any:
        assertions = genuine(self, actual, message)
        return _Awaiting(actual, assertions) if isinstance(actual, Locator) else assertions

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(type(expect), "__call__", expect_of)
        yield
