"""The setup of a reader of the tutorial: a simulated robot, and the editor in a browser."""

from __future__ import annotations

import re
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from playwright.sync_api import Browser, expect

from tests.support.browser import EditorPage, editor_page
from tests.support.editor import editor
from tests.support.limits import CALL_LIMIT
from tests.support.processes import free_endpoint
from visualhfsm.web.workspace import make_services
from zenoh_ice import Settings

__all__ = ["page_with_a_simulated_robot"]


@contextmanager
def page_with_a_simulated_robot(browser: Browser, folder: Path) -> Iterator[EditorPage]:
    """Open the page of an editor of a folder, and start a simulated robot there."""
    settings = Settings(connect=(free_endpoint(),), timeout=CALL_LIMIT)
    with (
        editor(folder, make_services=make_services(settings)) as running,
        editor_page(browser, running, height=720) as shown,
    ):
        shown.button("No robot: start a simulation").click()
        expect(shown.page.get_by_role("button", name=re.compile("^Simulated Nao"))).to_be_visible()
        yield shown
