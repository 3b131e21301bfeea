"""Record which parts of the page's modules run in Chromium, for `make coverage`."""

from __future__ import annotations

import contextlib
import json
import os
import re
import uuid
from collections.abc import Iterator
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

from playwright.sync_api import Page

from tests.support.places import ROOT

__all__ = ["PAGE_COVERAGE", "recorded"]

PAGE_COVERAGE = os.environ.get("PAGE_COVERAGE")
"""The folder for the coverage, if it is recorded."""
STATIC = ROOT / "visualhfsm" / "_editor" / "static"


@contextlib.contextmanager
def recorded(page: Page) -> Iterator[None]:
    """Write the coverage of a page like Node.js with NODE_V8_COVERAGE, if PAGE_COVERAGE is set."""
    if not PAGE_COVERAGE:
        yield
        return
    profiler = page.context.new_cdp_session(page)
    profiler.send("Profiler.enable")
    profiler.send("Profiler.startPreciseCoverage", {"callCount": True, "detailed": True})
    yield
    scripts = profiler.send("Profiler.takePreciseCoverage")["result"]
    profiler.detach()
    folder = Path(PAGE_COVERAGE)
    folder.mkdir(parents=True, exist_ok=True)
    (folder / f"coverage-{uuid.uuid4()}.json").write_text(json.dumps({"result": list(_of_files(scripts))}))


def _of_files(scripts: list[dict[str, Any]]) -> Iterator[dict[str, Any]]:
    """Replace the addresses of our scripts by those of their files, as in the unit tests."""
    for script in scripts:
        address = re.fullmatch(r"/static/\w+/(.+\.js)", urlsplit(script["url"]).path)
        if address is not None:
            yield {**script, "url": (STATIC / address[1]).as_uri()}
