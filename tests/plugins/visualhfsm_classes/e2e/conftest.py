"""The page is opened as by the tests of the editor."""

from tests.e2e.conftest import (
    browser,
    checks,
    merge_within,
    open_browser,
    path,
    patience,
    root,
    running,
    shown,
)

__all__ = [
    "browser",
    "checks",
    "merge_within",
    "open_browser",
    "path",
    "patience",
    "root",
    "running",
    "shown",
]
