"""The setup of a reader of the tutorial: the editor in a browser, and a simulated robot."""

from __future__ import annotations

import re
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from playwright.sync_api import Browser, expect

from tests.support.browser import EditorPage, editor_page
from tests.support.editor import editor
from tests.support.limits import CALL_LIMIT
from tests.support.monitor import patient_parts
from tests.support.processes import free_endpoint
from zenoh_ice import Settings

__all__ = ["page_of_a_reader", "start_simulation"]


@contextmanager
def page_of_a_reader(browser: Browser, folder: Path) -> Iterator[EditorPage]:
    """Open the page of an editor of a folder, which can start a robot."""
    settings = Settings(connect=(free_endpoint(),), timeout=CALL_LIMIT)
    with (
        editor(folder, make_parts=patient_parts(settings)) as running,
        editor_page(browser, running, height=720) as shown,
    ):
        yield shown


def start_simulation(shown: EditorPage) -> None:
    """Start a simulated robot."""
    shown.button("No robot: start a simulation").click()
    expect(shown.page.get_by_role("button", name=re.compile("^Simulated Nao"))).to_be_visible()
