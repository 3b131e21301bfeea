"""The setup of a reader of the tutorial: a simulated robot, and the editor in a browser."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from playwright.sync_api import Browser

from tests.support.browser import EditorPage, editor_page
from tests.support.editor import editor
from tests.support.limits import CALL_LIMIT
from tests.support.processes import ComponentProcess, free_endpoint, module
from visualhfsm.web.workspace import make_services
from zenoh_ice import Settings

__all__ = ["page_with_a_simulated_robot"]


@contextmanager
def page_with_a_simulated_robot(browser: Browser, folder: Path) -> Iterator[EditorPage]:
    """Start a simulated robot, and open the page of an editor of a folder."""
    endpoint = free_endpoint()
    with ComponentProcess(module("naoserver_sim", "--listen", endpoint)) as robot:
        robot.wait_for("ready")
        settings = Settings(connect=(endpoint,), timeout=CALL_LIMIT)
        with (
            editor(folder, make_services=make_services(settings)) as running,
            editor_page(browser, running, height=720) as shown,
        ):
            yield shown
