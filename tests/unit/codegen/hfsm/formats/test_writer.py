"""What is written reads back the same, and what XML cannot hold is refused."""

from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import given, settings

from codegen.diagnostics import Diagnostics
from codegen.hfsm import DocumentNotWritableError, parse_document, write_document
from codegen.hfsm.document import Document, Text
from tests.support.examples import examples
from tests.support.plugins import OLD_DOCUMENTS
from tests.support.random_documents import documents


@pytest.mark.parametrize("text", ["\x00", "a\x0b", "\ud800", "\ufffe"])
def test_what_xml_cannot_hold_is_refused_on_writing(text: str) -> None:
    with pytest.raises(DocumentNotWritableError):
        write_document(Document(description=Text(text)))


SURVIVING = """\
<?xml version="1.0" encoding="UTF-8"?>
<VisualHFSM>
  <!-- On a dark day. -->
  <survives part="Camera" kind="black"/>
  <survives part="LKneePitch" kind="weak" amount="0.5" after="1" must="succeed" mine="1"/>
  <libraries/>
  <config/>
</VisualHFSM>
"""


def test_what_it_must_survive_is_written_as_it_was_read() -> None:
    read = parse_document(SURVIVING, Path("test.xml"), Diagnostics())
    assert read is not None
    assert [each.failure for each in read.survives] == ["Camera black", "LKneePitch weak 0.5"]
    assert write_document(read) == SURVIVING


@OLD_DOCUMENTS
@settings(max_examples=examples(10), deadline=None)
@given(documents)
def test_what_is_written_reads_back_the_same(document: Document) -> None:
    text = write_document(document)
    again = parse_document(text, Path("test.xml"), Diagnostics())
    assert again == document
    assert write_document(again) == text
