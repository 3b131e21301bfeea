"""The table of docs/how-to/plain-python.md names what there is; tests/doors/test_call.py runs its programs."""

from __future__ import annotations

import re

from tests.support.pages import DOCS
from visualhfsm import OpenDocument, Project

PAGE = (DOCS / "how-to" / "plain-python.md").read_text("utf-8")


def test_the_table_names_what_a_document_can_do() -> None:
    table = PAGE.partition("| | |")[2].partition("\n\n")[0]
    named = {
        name
        for row in table.splitlines()
        for name in re.findall(r"`(\w+)`", row.partition("|")[2].partition("|")[0])
    }
    methods = {
        name
        for name in dir(OpenDocument)
        if not name.startswith("_") and callable(getattr(OpenDocument, name))
    }
    assert named == methods - {"text", "abandon", "has", "imports"}
    assert callable(Project.recoverable)
