"""What the tests of the editor's page share."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from playwright.sync_api import Browser

from tests.support.browser import BROWSERS


@pytest.fixture(scope="module")
def browser(request: pytest.FixtureRequest) -> Iterator[Browser]:
    """One browser for the tests of a file: Chromium, unless they are marked with `IN_EACH_BROWSER`."""
    with BROWSERS[getattr(request, "param", "chromium")]() as browser:
        yield browser
