"""Wait for elements, and make assertions about them once they exist, with looks every 50 or 100 ms."""

from __future__ import annotations

import contextlib
import time
from collections.abc import Callable, Iterator
from typing import Any, Final, Literal

import pytest
from playwright.sync_api import Error, Locator, Page, expect
from playwright.sync_api import TimeoutError as LateError

from tests.support.limits import PAGE_LIMIT

__all__ = ["awaited_elements"]

_WITHOUT_ELEMENT: Final = ("not_", "to_be_hidden", "to_have_count")
"""Prefixes of the assertions that may hold without the element."""
_SLICE: Final = 2400.0
"""A wait within this many ms looks every 100 ms, and a longer one soon only every 500 ms.

Playwright leaves out intervals that are longer than a fifth of the wait.
"""
_SHORT_SLICE: Final = 250.0
"""The same for every 50 ms, where the error of a wait that is over costs little: it describes nothing."""


def _in_slices(look: Callable[[float], None], timeout: float | None, slice_: float = _SLICE) -> None:
    """Call `look` with the ms that it may wait, until it raises no error or the time is over.

    It may wait at least half as long as all has taken: on a busy machine even one look may need seconds.
    """
    left = whole = PAGE_LIMIT * 1000 if timeout is None else timeout
    end = time.monotonic() + left / 1000
    while left > (part := max(slice_, (whole - left) / 2)):
        begin = time.monotonic()
        try:
            look(part)
        except (AssertionError, LateError):
            if time.monotonic() - begin < part / 2000:
                raise  # not because of the time, and so not about to change
        else:
            return
        left = (end - time.monotonic()) * 1000
    look(max(left, 1.0))  # 0 would be forever


class _Awaiting:
    """The assertions of Playwright about an element, which is awaited first, or about a page."""

    def __init__(self, actual: Locator | Page, assertions: object) -> None:
        self._actual = actual
        self._assertions = assertions

    def __getattr__(self, name: str) -> Callable[..., None]:
        assertion: Callable[..., None] = getattr(self._assertions, name)
        actual = None if name.startswith(_WITHOUT_ELEMENT) else self._actual

        def assert_of_element(*expected: object, timeout: float | None = None, **options: object) -> None:
            any_number = expected and isinstance(expected[0], list)
            if isinstance(actual, Locator) and not any_number:
                state: Literal["attached", "visible"] = "visible" if name == "to_be_visible" else "attached"
                try:
                    actual.wait_for(state=state, timeout=timeout)
                except Error:
                    timeout = 1.0  # the assertion fails, and says why
                else:
                    if state == "visible":
                        return
            _in_slices(lambda limit: assertion(*expected, timeout=limit, **options), timeout)

        return assert_of_element


@contextlib.contextmanager
def awaited_elements() -> Iterator[None]:
    """Within the block, wait for elements in steps of 50 ms, and let `expect` wait for one before it checks it.

    Playwright's longest steps are 500 ms, so what takes 0.3 s would take almost 0.8 s. Whenever the element is missing,
    `expect` would describe the whole page in words, for an error that nobody sees: this takes Chromium as long as
    drawing the page several times.
    """
    genuine = type(expect).__call__
    wait_for = Locator.wait_for

    def expect_of(self: Any, actual: Any, message: str | None = None) -> Any:
        assertions = genuine(self, actual, message)
        return _Awaiting(actual, assertions) if isinstance(actual, Locator | Page) else assertions

    def wait_in_slices(self: Locator, *, timeout: float | None = None, **options: Any) -> None:
        _in_slices(lambda limit: wait_for(self, timeout=limit, **options), timeout, _SHORT_SLICE)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(type(expect), "__call__", expect_of)
        patch.setattr(Locator, "wait_for", wait_in_slices)
        yield
